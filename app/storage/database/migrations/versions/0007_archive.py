"""The archive: films of this machine that become inspections in their turn, and their rules."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add both tables."""
    op.create_table(
        "archive_films",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("path", sa.Text, nullable=False),
        sa.Column("relative", sa.Text, nullable=False),
        sa.Column("path_sha256", sa.String(64), nullable=False, unique=True),
        sa.Column("size", sa.BigInteger, nullable=False),
        sa.Column("modified_at", sa.DateTime, nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("project", sa.String(200)),
        sa.Column("asset", sa.String(200)),
        sa.Column("rule", sa.String(100)),
        sa.Column("rig", sa.JSON),
        sa.Column("rig_name", sa.String(200)),
        sa.Column("header", sa.JSON, nullable=False),
        sa.Column("priority", sa.Integer, nullable=False),
        sa.Column("state", sa.String(10), nullable=False),
        sa.Column("error_code", sa.String(50)),
        sa.Column("error_detail", sa.Text),
        sa.Column("wanted_at", sa.DateTime),
        sa.Column("wanted_by", sa.String(100)),
        sa.Column("added_at", sa.DateTime, nullable=False),
        sa.Column("added_by", sa.String(100), nullable=False),
        sa.Column("claimed_by", sa.String(64)),
        sa.Column("claimed_until", sa.DateTime),
    )
    op.create_index("ix_archive_films_queue", "archive_films", ["state", "priority", "wanted_at"])
    op.create_table(
        "archive_rules",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("content", sa.JSON, nullable=False),
        sa.Column("changed_at", sa.DateTime, nullable=False),
        sa.Column("changed_by", sa.String(100), nullable=False),
    )
