"""Versions of code packs, and the project that a pack belongs to."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add their columns; a pack that is there is the first version under its name."""
    for column in (
        sa.Column("title", sa.String(100), nullable=False, server_default=""),
        sa.Column("version", sa.Integer(), nullable=False, server_default="1"),
        sa.Column("project", sa.String(200)),
    ):
        op.add_column("code_packs", column)
    packs = sa.table("code_packs", sa.column("name"), sa.column("title"))
    op.execute(packs.update().values(title=packs.c.name))
