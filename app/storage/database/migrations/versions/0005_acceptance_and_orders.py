"""Links by which clients accept, work orders, and what the webhook tells of both."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make their tables."""
    op.create_table(
        "notices",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("event", sa.String(40), nullable=False),
        sa.Column("path", sa.Text(), nullable=False),
        sa.Column("body", sa.JSON(), nullable=False),
        sa.Column("state", sa.String(10), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("next_at", sa.DateTime(), nullable=False),
        sa.Column("told_at", sa.DateTime()),
        sa.Column("error", sa.Text()),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_index("ix_notices_state", "notices", ["state"])
    op.create_table(
        "acceptance_links",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("note", sa.String(200), nullable=False),
        sa.Column("made_at", sa.DateTime(), nullable=False),
        sa.Column("made_by", sa.String(100), nullable=False),
        sa.Column("expires_at", sa.DateTime(), nullable=False),
        sa.Column("revoked_at", sa.DateTime()),
        sa.Column("revoked_by", sa.String(100)),
        sa.Column("opened", sa.Integer(), nullable=False),
        sa.Column("opened_at", sa.DateTime()),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("digest"),
    )
    op.create_index("ix_acceptance_links_made_at", "acceptance_links", ["made_at"])
    op.create_table(
        "acceptance_sections",
        sa.Column("link_id", sa.String(32), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("version", sa.String(40), nullable=False),
        sa.ForeignKeyConstraint(["link_id"], ["acceptance_links.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("link_id", "place"),
    )
    op.create_index(
        "ix_acceptance_sections_inspection_id", "acceptance_sections", ["inspection_id"]
    )
    op.create_table(
        "acceptance_answers",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("link_id", sa.String(32), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("kind", sa.String(10), nullable=False),
        sa.Column("person", sa.String(100), nullable=False),
        sa.Column("text", sa.Text(), nullable=False),
        sa.Column("version", sa.String(40), nullable=False),
        sa.Column("at", sa.DateTime(), nullable=False),
        sa.Column("reply", sa.Text()),
        sa.Column("replied_at", sa.DateTime()),
        sa.Column("replied_by", sa.String(100)),
        sa.ForeignKeyConstraint(["link_id"], ["acceptance_links.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_index("ix_acceptance_answers_link_id", "acceptance_answers", ["link_id"])
    op.create_index("ix_acceptance_answers_inspection_id", "acceptance_answers", ["inspection_id"])
    op.create_table(
        "work_orders",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("number", sa.String(100), nullable=False),
        sa.Column("asset_id", sa.String(200), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("due_on", sa.Date()),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("ordered_at", sa.DateTime(), nullable=False),
        sa.Column("ordered_by", sa.String(100), nullable=False),
        sa.Column("state", sa.String(12), nullable=False),
        sa.Column("inspection_id", sa.String(32)),
        sa.Column("changed", sa.Integer(), nullable=False),
        sa.Column("changed_at", sa.DateTime(), nullable=False),
        sa.Column("ended_by", sa.String(100)),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("number", "asset_id"),
    )
    for column in ("asset_id", "state", "changed"):
        op.create_index(f"ix_work_orders_{column}", "work_orders", [column])
    op.create_table(
        "idempotent_requests",
        sa.Column("who", sa.String(100), nullable=False),
        sa.Column("key", sa.String(200), nullable=False),
        sa.Column("body_sha256", sa.String(64), nullable=False),
        sa.Column("answer", sa.JSON(), nullable=False),
        sa.Column("at", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("who", "key"),
    )
    op.create_index("ix_idempotent_requests_at", "idempotent_requests", ["at"])
