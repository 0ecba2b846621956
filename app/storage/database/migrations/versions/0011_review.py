"""The state of the review of each inspection, remarks on defects, and the last use of tokens."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns and tables; every inspection begins as a draft."""
    op.add_column(
        "inspections",
        sa.Column("review_state", sa.String(10), nullable=False, server_default="draft"),
    )
    op.add_column("inspections", sa.Column("reviewed_at", sa.DateTime))
    op.add_column("inspections", sa.Column("reviewed_by", sa.String(100)))
    op.create_index("ix_inspections_review_state", "inspections", ["review_state"])
    op.create_table(
        "remarks",
        sa.Column(
            "inspection_id",
            sa.String(32),
            sa.ForeignKey("inspections.id", ondelete="CASCADE"),
            primary_key=True,
        ),
        sa.Column("id", sa.String(36), primary_key=True),
        sa.Column("observation_id", sa.String(36), nullable=False),
        sa.Column("kind", sa.String(10), nullable=False),
        sa.Column("text", sa.Text, nullable=False),
        sa.Column("version", sa.String(16), nullable=False),
        sa.Column("made_at", sa.DateTime, nullable=False),
        sa.Column("made_by", sa.String(100), nullable=False),
        sa.Column("settled_at", sa.DateTime),
        sa.Column("settled_by", sa.String(100)),
    )
    op.create_table(
        "token_uses",
        sa.Column("token_digest", sa.String(64), primary_key=True),
        sa.Column("seen_at", sa.DateTime, nullable=False),
    )
