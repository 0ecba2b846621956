"""Joints that count without a person, and end distances with their full uncertainty."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_ENDED = ("done", "failed", "cancelled")


def upgrade() -> None:
    """Keep reported distances: joints do not count where nothing was stated before.

    The sigmas of corrected ends lacked the rig's tolerances; they are computed anew.
    """
    inspections = sa.table(
        "inspections",
        sa.column("id", sa.String),
        sa.column("status", sa.String),
        sa.column("corrections", sa.JSON),
        sa.column("corrected_mm", sa.Float),
        sa.column("sigma_corrected_mm", sa.Float),
    )
    op.execute(inspections.update().values(corrected_mm=None, sigma_corrected_mm=None))
    ended = sa.select(inspections.c.id, inspections.c.corrections).where(
        inspections.c.status.in_(_ENDED)
    )
    for id_, stated in op.get_bind().execute(ended).all():
        if "joints" not in stated:
            op.execute(
                inspections.update()
                .where(inspections.c.id == id_)
                .values(corrections=stated | {"joints": {"use": False}})
            )
