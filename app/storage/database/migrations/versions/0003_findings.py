"""Findings on the wall, their searches, and the models of users that find them."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make their tables."""
    op.create_table(
        "findings",
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("kind", sa.String(40), nullable=False),
        sa.Column("outline", sa.JSON(), nullable=False),
        sa.Column("length_mm", sa.Float()),
        sa.Column("length_sigma_mm", sa.Float()),
        sa.Column("width_mm", sa.Float()),
        sa.Column("width_sigma_mm", sa.Float()),
        sa.Column("direction", sa.String(10)),
        sa.Column("score", sa.Float(), nullable=False),
        sa.Column("code", sa.JSON()),
        sa.Column("detector", sa.String(100), nullable=False),
        sa.Column("version", sa.String(20), nullable=False),
        sa.Column("frame", sa.Integer()),
        sa.Column("u", sa.Float()),
        sa.Column("v", sa.Float()),
        sa.Column("found_at", sa.DateTime(), nullable=False),
        sa.Column("state", sa.String(10), nullable=False),
        sa.Column("decided_by", sa.String(100)),
        sa.Column("decided_at", sa.DateTime()),
        sa.Column("observation_id", sa.String(36)),
        sa.ForeignKeyConstraint(["inspection_id"], ["inspections.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("inspection_id", "id"),
    )
    op.create_table(
        "finding_searches",
        sa.Column("inspection_id", sa.String(32), nullable=False),
        sa.Column("state", sa.String(10), nullable=False),
        sa.Column("detector", sa.String(100)),
        sa.Column("detail", sa.Text()),
        sa.Column("searched_to_mm", sa.Float()),
        sa.ForeignKeyConstraint(["inspection_id"], ["inspections.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("inspection_id"),
    )
    op.create_index("ix_finding_searches_state", "finding_searches", ["state"])
    op.create_table(
        "detectors",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("declared", sa.JSON(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("created_by", sa.String(100), nullable=False),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("name"),
    )
