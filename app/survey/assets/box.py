"""Boxes of longitude and latitude, by which what lies on a map is found."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple


class Box(NamedTuple):
    """A box in degrees (WGS 84); west of it lies beyond east if it crosses 180 degrees."""

    west: float
    south: float
    east: float
    north: float


def box_around(line: Sequence[Sequence[float]]) -> dict[str, float | None]:
    """Return the fields of the box around points of longitude and latitude; None around nothing.

    Around a line that crosses 180 degrees it goes the whole way round, so that it is found on both
    sides.
    """
    if not line:
        return dict.fromkeys(Box._fields)
    lons, lats = [point[0] for point in line], [point[1] for point in line]
    crosses = any(abs(to - lon) > 180 for lon, to in pairwise(lons))
    west, east = (-180.0, 180.0) if crosses else (min(lons), max(lons))
    return Box(west, min(lats), east, max(lats))._asdict()
