"""The first tables."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "archive_films",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("path", sa.Text(), nullable=False),
        sa.Column("relative", sa.Text(), nullable=False),
        sa.Column("path_sha256", sa.String(64), nullable=False),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("modified_at", sa.DateTime(), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("project", sa.String(200)),
        sa.Column("asset", sa.String(200)),
        sa.Column("rule", sa.String(100)),
        sa.Column("rig", sa.JSON()),
        sa.Column("rig_name", sa.String(200)),
        sa.Column("header", sa.JSON(), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("state", sa.String(10), nullable=False),
        sa.Column("error_code", sa.String(50)),
        sa.Column("error_detail", sa.Text()),
        sa.Column("wanted_at", sa.DateTime()),
        sa.Column("wanted_by", sa.String(100)),
        sa.Column("added_at", sa.DateTime(), nullable=False),
        sa.Column("added_by", sa.String(100), nullable=False),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("path_sha256"),
    )
    op.create_index("ix_archive_films_queue", "archive_films", ["state", "priority", "wanted_at"])
    op.create_table(
        "archive_rules",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("content", sa.JSON(), nullable=False),
        sa.Column("changed_at", sa.DateTime(), nullable=False),
        sa.Column("changed_by", sa.String(100), nullable=False),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_table(
        "assets",
        sa.Column("asset_id", sa.String(200), nullable=False),
        sa.Column("normalised_id", sa.String(200), nullable=False),
        sa.Column("project", sa.String(200)),
        sa.Column("header", sa.JSON(), nullable=False),
        sa.Column("line", sa.JSON(), nullable=False),
        sa.Column("folded", sa.Text(), nullable=False),
        sa.Column("changed_at", sa.DateTime(), nullable=False),
        sa.Column("changed_by", sa.String(100), nullable=False),
        sa.PrimaryKeyConstraint("asset_id"),
    )
    op.create_index("ix_assets_project", "assets", ["project"])
    op.create_index("ix_assets_normalised_id", "assets", ["normalised_id"])
    op.create_table(
        "code_packs",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("table", sa.Text(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("created_by", sa.String(100), nullable=False),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("name"),
    )
    op.create_table(
        "events",
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("observation_id", sa.String(36)),
        sa.Column("action", sa.String(20), nullable=False),
        sa.Column("who", sa.String(100), nullable=False),
        sa.Column("at", sa.DateTime(), nullable=False),
        sa.Column("before", sa.JSON()),
        sa.Column("after", sa.JSON()),
        sa.Column("remark", sa.Text()),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_index("ix_events_newest", "events", ["inspection_id", "id"])
    op.create_index("ix_events_subject", "events", ["inspection_id", "observation_id"])
    op.create_table(
        "heartbeat",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("at", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_table(
        "inspections",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("status", sa.String(10), nullable=False),
        sa.Column("rig", sa.JSON(), nullable=False),
        sa.Column("header", sa.JSON(), nullable=False),
        sa.Column("source_kind", sa.String(10), nullable=False),
        sa.Column("source_filename", sa.String(255), nullable=False),
        sa.Column(
            "source_size", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False
        ),
        sa.Column("source_sha256", sa.String(64), nullable=False),
        sa.Column("video_file", sa.String(20), nullable=False),
        sa.Column("video", sa.JSON(), nullable=False),
        sa.Column("frames_done", sa.Integer(), nullable=False),
        sa.Column("fps", sa.Float()),
        sa.Column("tracked_with", sa.String(64)),
        sa.Column("distance_mm", sa.Float()),
        sa.Column("sigma_distance_mm", sa.Float()),
        sa.Column("error_code", sa.String(50)),
        sa.Column("error_detail", sa.Text()),
        sa.Column("warning", sa.Text()),
        sa.Column("corrections", sa.JSON(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("corrected_mm", sa.Float()),
        sa.Column("sigma_corrected_mm", sa.Float()),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("queued_at", sa.DateTime(), nullable=False),
        sa.Column("finished_at", sa.DateTime()),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("review_state", sa.String(10), nullable=False),
        sa.Column("reviewed_at", sa.DateTime()),
        sa.Column("reviewed_by", sa.String(100)),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_index("ix_inspections_queue", "inspections", ["status", "priority", "queued_at"])
    op.create_index("ix_inspections_review_state", "inspections", ["review_state"])
    op.create_index("ix_inspections_status", "inspections", ["status"])
    op.create_table(
        "preferences",
        sa.Column("who", sa.String(100), nullable=False),
        sa.Column("chosen", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("who"),
    )
    op.create_table(
        "report_templates",
        sa.Column("project", sa.String(200), nullable=False),
        sa.Column("content", sa.JSON(), nullable=False),
        sa.Column("changed_at", sa.DateTime(), nullable=False),
        sa.Column("changed_by", sa.String(100), nullable=False),
        sa.PrimaryKeyConstraint("project"),
    )
    op.create_table(
        "rigs",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("rig", sa.JSON(), nullable=False),
        sa.Column("changed_at", sa.DateTime(), nullable=False),
        sa.Column("changed_by", sa.String(100), nullable=False),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("name"),
    )
    op.create_table(
        "sessions",
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("token_digest", sa.String(64), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("seen_at", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("digest"),
    )
    op.create_table(
        "token_uses",
        sa.Column("token_digest", sa.String(64), nullable=False),
        sa.Column("seen_at", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("token_digest"),
    )
    op.create_table(
        "alerts",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("observation_id", sa.String(36), nullable=False),
        sa.Column("state", sa.String(10), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("next_at", sa.DateTime(), nullable=False),
        sa.Column("told_at", sa.DateTime()),
        sa.Column("error", sa.Text()),
        sa.ForeignKeyConstraint(["inspection_id"], ["inspections.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_index("ix_alerts_inspection_id", "alerts", ["inspection_id"])
    op.create_index("ix_alerts_state", "alerts", ["state"])
    op.create_table(
        "attachments",
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("observation_id", sa.String(36), nullable=False),
        sa.Column("kind", sa.String(10), nullable=False),
        sa.Column("rank", sa.Integer(), nullable=False),
        sa.Column("frame", sa.Integer(), nullable=False),
        sa.Column("drawing", sa.JSON()),
        sa.Column("media_type", sa.String(20)),
        sa.Column("duration_s", sa.Float()),
        sa.Column("size", sa.Integer()),
        sa.Column("sha256", sa.String(64)),
        sa.Column("photo_error", sa.Text()),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("created_by", sa.String(100), nullable=False),
        sa.Column("deleted_at", sa.DateTime()),
        sa.ForeignKeyConstraint(["inspection_id"], ["inspections.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("inspection_id", "id"),
    )
    op.create_index(
        "ix_attachments_observation", "attachments", ["inspection_id", "observation_id"]
    )
    op.create_table(
        "indexed_inspections",
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("index_version", sa.Integer(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("finished_at", sa.DateTime()),
        sa.Column("newest_event", sa.Integer()),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("project", sa.Text()),
        sa.Column("asset", sa.Text()),
        sa.Column("asset_normalised_id", sa.Text()),
        sa.Column("surveyed_on", sa.Date(), nullable=False),
        sa.Column("folded", sa.Text(), nullable=False),
        sa.Column("start_lat", sa.Float()),
        sa.Column("start_lon", sa.Float()),
        sa.Column("end_lat", sa.Float()),
        sa.Column("end_lon", sa.Float()),
        sa.Column("distance_m", sa.Float()),
        sa.Column("distance_u95_m", sa.Float()),
        sa.Column("defects", sa.Integer(), nullable=False),
        sa.Column("worst_severity", sa.Integer()),
        sa.Column("frames", sa.Integer()),
        sa.Column("weak_share", sa.Float()),
        sa.Column("lost_share", sa.Float()),
        sa.Column("too_fast_share", sa.Float()),
        sa.Column("dark_share", sa.Float()),
        sa.Column("overexposed_share", sa.Float()),
        sa.Column("blurred_share", sa.Float()),
        sa.Column("dirty_lens_share", sa.Float()),
        sa.ForeignKeyConstraint(["inspection_id"], ["inspections.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("inspection_id"),
    )
    op.create_index("ix_indexed_inspections_asset", "indexed_inspections", ["asset"])
    op.create_index(
        "ix_indexed_inspections_asset_normalised_id", "indexed_inspections", ["asset_normalised_id"]
    )
    op.create_index("ix_indexed_inspections_project", "indexed_inspections", ["project"])
    op.create_table(
        "inspection_labels",
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("label", sa.String(50), nullable=False),
        sa.ForeignKeyConstraint(["inspection_id"], ["inspections.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("inspection_id", "label"),
    )
    op.create_index("ix_inspection_labels_label", "inspection_labels", ["label"])
    op.create_table(
        "observations",
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("seq", sa.Integer(), nullable=False),
        sa.Column("frame", sa.Integer(), nullable=False),
        sa.Column("fields", sa.JSON(), nullable=False),
        sa.Column("photo_frame", sa.Integer()),
        sa.Column("photo_sha256", sa.String(64)),
        sa.Column("photo_error", sa.Text()),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("created_by", sa.String(100), nullable=False),
        sa.Column("edited_at", sa.DateTime()),
        sa.Column("edited_by", sa.String(100)),
        sa.Column("deleted_at", sa.DateTime()),
        sa.ForeignKeyConstraint(["inspection_id"], ["inspections.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("inspection_id", "id"),
    )
    op.create_table(
        "remarks",
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("observation_id", sa.String(36), nullable=False),
        sa.Column("kind", sa.String(10), nullable=False),
        sa.Column("text", sa.Text(), nullable=False),
        sa.Column("version", sa.String(16), nullable=False),
        sa.Column("made_at", sa.DateTime(), nullable=False),
        sa.Column("made_by", sa.String(100), nullable=False),
        sa.Column("settled_at", sa.DateTime()),
        sa.Column("settled_by", sa.String(100)),
        sa.ForeignKeyConstraint(["inspection_id"], ["inspections.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("inspection_id", "id"),
    )
    op.create_table(
        "indexed_defects",
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("observation_id", sa.String(36), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("inspection", sa.String(200), nullable=False),
        sa.Column("project", sa.Text()),
        sa.Column("asset", sa.Text()),
        sa.Column("surveyed_on", sa.Date(), nullable=False),
        sa.Column("seq", sa.Integer(), nullable=False),
        sa.Column("frame", sa.Integer(), nullable=False),
        sa.Column("code", sa.String(8)),
        sa.Column("char1", sa.String(2)),
        sa.Column("char2", sa.String(2)),
        sa.Column("label", sa.Text()),
        sa.Column("label_ms", sa.Text()),
        sa.Column("quant1", sa.Float()),
        sa.Column("unit1", sa.String(8)),
        sa.Column("quant2", sa.Float()),
        sa.Column("unit2", sa.String(8)),
        sa.Column("severity", sa.Integer()),
        sa.Column("continuous", sa.String(4)),
        sa.Column("distance_m", sa.Float()),
        sa.Column("distance_u95_m", sa.Float()),
        sa.Column("clock", sa.Integer()),
        sa.Column("clock_to", sa.Integer()),
        sa.Column("clock_hours", sa.Integer(), nullable=False),
        sa.Column("remark", sa.Text()),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("folded", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["inspection_id"], ["indexed_inspections.inspection_id"], ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("inspection_id", "observation_id"),
    )
    op.create_index("ix_indexed_defects_asset", "indexed_defects", ["asset"])
    op.create_index(
        "ix_indexed_defects_filters",
        "indexed_defects",
        [
            "severity",
            "code",
            "distance_m",
            "clock_hours",
            "surveyed_on",
            "created_at",
            "inspection_id",
            "observation_id",
        ],
    )
    op.create_index(
        "ix_indexed_defects_newest",
        "indexed_defects",
        ["created_at", "inspection_id", "observation_id"],
    )
