"""Places on the map by which other programs ask for features."""

from itertools import pairwise

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

_BOX = ("south", "north", "west", "east")


def upgrade() -> None:
    """Add the columns; those of assets are filled, the index is derived again."""
    for table in ("assets", "indexed_inspections"):
        for name in _BOX:
            op.add_column(table, sa.Column(name, sa.Float()))
    op.add_column("indexed_inspections", sa.Column("line", sa.JSON(none_as_null=True)))
    for name in ("lon", "lat"):
        op.add_column("indexed_defects", sa.Column(name, sa.Float()))
    place = ["lat", "lon", "inspection_id", "observation_id"]
    op.create_index("ix_indexed_defects_place", "indexed_defects", place)
    op.create_index("ix_assets_box", "assets", [*_BOX, "asset_id"])
    op.create_index("ix_indexed_inspections_box", "indexed_inspections", [*_BOX, "inspection_id"])
    assets = sa.table(
        "assets",
        sa.column("asset_id", sa.String(200)),
        sa.column("line", sa.JSON()),
        *(sa.column(name, sa.Float()) for name in _BOX),
    )
    connection = op.get_bind()
    rows = connection.execute(sa.select(assets.c.asset_id, assets.c.line)).all()
    boxes = [{"of": asset_id, **_box_of(line)} for asset_id, line in rows if line]
    if boxes:
        connection.execute(sa.update(assets).where(assets.c.asset_id == sa.bindparam("of")), boxes)


def _box_of(line: list[list[float]]) -> dict[str, float]:
    lons, lats = [lon for lon, _ in line], [lat for _, lat in line]
    crosses = any(abs(to - lon) > 180 for lon, to in pairwise(lons))
    west, east = (-180.0, 180.0) if crosses else (min(lons), max(lons))
    return {"west": west, "south": min(lats), "east": east, "north": max(lats)}
