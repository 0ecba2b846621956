"""The index of the search: derived rows of every inspection and its defects."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the tables, which the server fills, and an index of each inspection's newest event."""
    op.create_index("ix_events_newest", "events", ["inspection_id", "id"])
    op.create_table(
        "indexed_inspections",
        sa.Column(
            "inspection_id",
            sa.String(32),
            sa.ForeignKey("inspections.id", ondelete="CASCADE"),
            primary_key=True,
        ),
        sa.Column("index_version", sa.Integer, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("finished_at", sa.DateTime),
        sa.Column("newest_event", sa.Integer),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("project", sa.Text),
        sa.Column("asset", sa.Text),
        sa.Column("surveyed_on", sa.Date, nullable=False),
        sa.Column("folded", sa.Text, nullable=False),
        sa.Column("distance_m", sa.Float),
        sa.Column("distance_u95_m", sa.Float),
        sa.Column("defects", sa.Integer, nullable=False),
        sa.Column("worst_severity", sa.Integer),
        sa.Column("frames", sa.Integer),
        sa.Column("weak_share", sa.Float),
        sa.Column("lost_share", sa.Float),
        sa.Column("too_fast_share", sa.Float),
        sa.Column("dark_share", sa.Float),
        sa.Column("overexposed_share", sa.Float),
        sa.Column("blurred_share", sa.Float),
        sa.Column("dirty_lens_share", sa.Float),
    )
    op.create_index("ix_indexed_inspections_asset", "indexed_inspections", ["asset"])
    op.create_table(
        "indexed_defects",
        sa.Column(
            "inspection_id",
            sa.String(32),
            sa.ForeignKey("indexed_inspections.inspection_id", ondelete="CASCADE"),
            primary_key=True,
        ),
        sa.Column("observation_id", sa.String(36), primary_key=True),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("inspection", sa.String(200), nullable=False),
        sa.Column("project", sa.Text),
        sa.Column("asset", sa.Text),
        sa.Column("surveyed_on", sa.Date, nullable=False),
        sa.Column("seq", sa.Integer, nullable=False),
        sa.Column("frame", sa.Integer, nullable=False),
        sa.Column("code", sa.String(8)),
        sa.Column("char1", sa.String(2)),
        sa.Column("char2", sa.String(2)),
        sa.Column("label", sa.Text),
        sa.Column("label_ms", sa.Text),
        sa.Column("quant1", sa.Float),
        sa.Column("unit1", sa.String(8)),
        sa.Column("quant2", sa.Float),
        sa.Column("unit2", sa.String(8)),
        sa.Column("severity", sa.Integer),
        sa.Column("continuous", sa.String(4)),
        sa.Column("distance_m", sa.Float),
        sa.Column("distance_u95_m", sa.Float),
        sa.Column("clock", sa.Integer),
        sa.Column("clock_to", sa.Integer),
        sa.Column("clock_hours", sa.Integer, nullable=False),
        sa.Column("remark", sa.Text),
        sa.Column("created_at", sa.DateTime, nullable=False),
        sa.Column("folded", sa.Text, nullable=False),
    )
    key = ["inspection_id", "observation_id"]
    filters = ["severity", "code", "distance_m", "clock_hours", "surveyed_on", "created_at", *key]
    for name, columns in (
        ("asset", ["asset"]),
        ("newest", ["created_at", *key]),
        ("filters", filters),
    ):
        op.create_index(f"ix_indexed_defects_{name}", "indexed_defects", columns)
