"""Converts between degrees and the map grids in which other programs state places."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pyproj import Transformer

DUTCH = 28992
"""EPSG code of the Dutch grid, Rijksdriehoek."""
_WGS84 = 4326
_FIRST_GAUSS_KRUGER, _GAUSS_KRUGER_ZONES = 31464, (2, 3, 4, 5)
"""German Gauss-Kruger zones have EPSG 31466 to 31469."""
_DEGREE_DECIMALS = 9
"""A tenth of a millimetre: the same millimetre of the grid comes back."""


def utm(zone: int, *, is_north: bool) -> int:
    """Return the EPSG code of a UTM zone on WGS 84."""
    return (32600 if is_north else 32700) + zone


def gauss_kruger(easting_m: float) -> int | None:
    """Return the EPSG code of the German zone that an easting begins with; None for no zone."""
    zone = int(easting_m // 1_000_000)
    return _FIRST_GAUSS_KRUGER + zone if zone in _GAUSS_KRUGER_ZONES else None


def metres(epsg: int, lon: float, lat: float) -> tuple[float, float] | None:
    """Return easting and northing of a place; None where the grid does not reach."""
    return _finite(_transformer(epsg).transform(lon, lat))


def degrees(epsg: int, easting_m: float, northing_m: float) -> tuple[float, float] | None:
    """Return longitude and latitude of a place in a grid; None where the grid does not reach."""
    from pyproj.enums import TransformDirection

    found = _finite(
        _transformer(epsg).transform(
            easting_m, northing_m, direction=TransformDirection.INVERSE, errcheck=False
        )
    )
    if found is None or abs(found[0]) > 180 or abs(found[1]) > 90:
        return None
    return round(found[0], _DEGREE_DECIMALS), round(found[1], _DEGREE_DECIMALS)


def _finite(point: tuple[float, float]) -> tuple[float, float] | None:
    first, second = map(float, point)
    return (first, second) if math.isfinite(first) and math.isfinite(second) else None


@cache
def _transformer(epsg: int) -> Transformer:
    from pyproj import Transformer

    return Transformer.from_crs(_WGS84, epsg, always_xy=True)
