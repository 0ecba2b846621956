"""What the readers of ISYBAU XML and DWA-M 150 share: coordinates, and what our own exports put
behind a remark.
"""

from __future__ import annotations

import re

from app.imports.surveys.cells import number, stretch
from app.survey.places import grids

_UTM = re.compile(r"UTM\D{0,10}([0-9]{1,2})\s?([NS]?)", re.IGNORECASE)
_CODED = re.compile(r"(?:^|, )coded (BC[DE])((?: [A-Z][A-Z0-9]{0,3}){1,2})$")
_XP = "XP"


def grid_of(named: str, easting_m: float) -> tuple[int, float] | None:
    """Return the EPSG code of a German grid, and the easting without the number of its zone.

    Args:
        named: Words such as `ETRS89_UTM32` or `UTM zone 47N`; others name no zone.
        easting_m: The easting, which may begin with its zone: 2 to 5 are of Gauss-Kruger.
    """
    leading = int(easting_m // 1_000_000)
    found = _UTM.search(named)
    epsg = None if found else grids.gauss_kruger(easting_m)
    if epsg is not None:
        return epsg, easting_m
    zone = int(found[1]) if found else leading
    if not 1 <= zone <= 60:
        return None
    is_north = found is None or found[2].upper() != "S"
    return grids.utm(zone, is_north=is_north), easting_m - 1_000_000 * max(leading, 0)


def place_of(named: str, easting: str, northing: str) -> tuple[float, float] | None:
    """Return longitude and latitude of a point of a German grid, or None."""
    easting_m, northing_m = number(easting, 1e8), number(northing, 1e8)
    if easting_m is None or northing_m is None:
        return None
    grid = grid_of(named, easting_m)
    return grids.degrees(grid[0], grid[1], northing_m) if grid else None


def take_from_remark(texts: dict[str, str]) -> None:
    """Take what our exports put at the end of a remark: long stretches, and other characters of
    start and end.
    """
    head, _, last = f", {texts['remark']}".rpartition(", stretch ")
    if not texts["continuous"] and head and (mark := stretch(last)):
        texts["remark"], texts["continuous"] = head[2:], mark
    coded = _CODED.search(texts["remark"])
    if coded and texts["char1"] == _XP and coded[1] == texts["code"]:
        texts["remark"] = texts["remark"][: coded.start()]
        texts["char1"], texts["char2"] = (*coded[2].split(), "")[:2]
