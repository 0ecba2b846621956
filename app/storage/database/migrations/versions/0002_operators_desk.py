"""Distance corrections, preferences of a person, code packs."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the tables and columns of the operator's desk."""
    op.add_column(
        "inspections", sa.Column("corrections", sa.JSON, nullable=False, server_default="{}")
    )
    op.add_column(
        "inspections", sa.Column("revision", sa.Integer, nullable=False, server_default="0")
    )
    op.add_column("inspections", sa.Column("corrected_mm", sa.Float))
    op.add_column("inspections", sa.Column("sigma_corrected_mm", sa.Float))
    op.add_column("events", sa.Column("remark", sa.Text))
    op.create_table(
        "preferences",
        sa.Column("who", sa.String(100), primary_key=True),
        sa.Column("chosen", sa.JSON, nullable=False),
    )
    op.create_table(
        "code_packs",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("name", sa.String(100), nullable=False, unique=True),
        sa.Column("table", sa.Text, nullable=False),
        sa.Column("created_at", sa.DateTime, nullable=False),
        sa.Column("created_by", sa.String(100), nullable=False),
    )
