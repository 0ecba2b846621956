"""The register of assets, labels of inspections, and what the index knows of their places."""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the tables and columns; the index is derived again."""
    op.create_table(
        "assets",
        sa.Column("asset_id", sa.String(200), primary_key=True),
        sa.Column("spelling", sa.String(200), nullable=False, index=True),
        sa.Column("project", sa.String(200), index=True),
        sa.Column("header", sa.JSON, nullable=False),
        sa.Column("line", sa.JSON, nullable=False),
        sa.Column("folded", sa.Text, nullable=False),
        sa.Column("changed_at", sa.DateTime, nullable=False),
        sa.Column("changed_by", sa.String(100), nullable=False),
    )
    op.create_table(
        "inspection_labels",
        sa.Column(
            "inspection_id",
            sa.String(32),
            sa.ForeignKey("inspections.id", ondelete="CASCADE"),
            primary_key=True,
        ),
        sa.Column("label", sa.String(50), primary_key=True, index=True),
    )
    op.add_column("indexed_inspections", sa.Column("asset_spelling", sa.Text))
    for name in ("start_lat", "start_lon", "end_lat", "end_lon"):
        op.add_column("indexed_inspections", sa.Column(name, sa.Float))
    op.create_index(
        "ix_indexed_inspections_asset_spelling", "indexed_inspections", ["asset_spelling"]
    )
    op.create_index("ix_indexed_inspections_project", "indexed_inspections", ["project"])
