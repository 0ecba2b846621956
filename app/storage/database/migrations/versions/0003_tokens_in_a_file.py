"""Tokens are kept in a file; sessions stay, by the digest of their token."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Rebuild the sessions without the reference, then drop the table that it pointed to."""
    op.create_table(
        "sessions_kept",
        sa.Column("digest", sa.String(64), primary_key=True),
        sa.Column("token_digest", sa.String(64), nullable=False),
        sa.Column("created_at", sa.DateTime, nullable=False),
        sa.Column("seen_at", sa.DateTime, nullable=False),
    )
    op.execute(
        "INSERT INTO sessions_kept SELECT digest, token_digest, created_at, seen_at FROM sessions"
    )
    op.drop_table("sessions")
    op.rename_table("sessions_kept", "sessions")
    op.drop_table("tokens")
