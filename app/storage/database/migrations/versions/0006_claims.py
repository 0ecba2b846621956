"""Claims of queued inspections: who tracks one, until when, and which attempt it is."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add priority and claim; a film may be larger than 2 GiB."""
    for column in (
        sa.Column("priority", sa.Integer, nullable=False, server_default="0"),
        sa.Column("attempt", sa.Integer, nullable=False, server_default="0"),
        sa.Column("claimed_by", sa.String(64)),
        sa.Column("claimed_until", sa.DateTime),
    ):
        op.add_column("inspections", column)
    op.create_index("ix_inspections_queue", "inspections", ["status", "priority", "queued_at"])
    # SQLite keeps integers of any size in INTEGER, and would copy the table for another type;
    # dropping the old one deletes every observation of it.
    if op.get_bind().dialect.name != "sqlite":
        op.alter_column("inspections", "source_size", type_=sa.BigInteger)
