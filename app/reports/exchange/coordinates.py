"""Converts the ends of the culvert to the map systems of other programs."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.reports.exchange.header import Header
from app.reports.exchange.names import Names
from app.survey.places import grids

Point = tuple[float, float]
_WEST, _SOUTH, _EAST, _NORTH = 3.2, 50.7, 7.3, 53.7
"""Bounds of the Netherlands."""
NAMES = ("start_lat", "start_lon", "end_lat", "end_lon")


@dataclass(frozen=True)
class Ends:
    """Both ends: longitude and latitude in degrees, or easting and northing in metres."""

    start: Point
    end: Point

    def along(self, names: Names) -> tuple[Point, Point]:
        """Return the upstream end first."""
        is_along = names.upstream == names.start
        return (self.start, self.end) if is_along else (self.end, self.start)

    def of_nodes(self, names: Names) -> dict[str, Point]:
        """Return the places of the nodes, the upstream one first."""
        of_name = {names.end: self.end, names.start: self.start}
        return {name: of_name[name] for name in names.nodes}

    @property
    def zone(self) -> int:
        """UTM zone of the start."""
        return min(60, max(1, math.floor((self.start[0] + 180) / 6) + 1))

    @property
    def is_north(self) -> bool:
        """Whether the start is north of the equator."""
        return self.start[1] >= 0


def ends_of(header: Header) -> Ends | None:
    """Return both ends in degrees, or None unless both are known."""
    start_lat, start_lon, end_lat, end_lon = map(header.number, NAMES)
    if start_lat is None or start_lon is None or end_lat is None or end_lon is None:
        return None
    return Ends((start_lon, start_lat), (end_lon, end_lat))


def utm_m(ends: Ends) -> Ends | None:
    """Return both ends in the UTM zone of the start; None near the poles."""
    return _both(ends, grids.utm(ends.zone, is_north=ends.is_north))


def rd_m(ends: Ends) -> Ends | None:
    """Return both ends in the Dutch system; None outside the Netherlands."""
    are_dutch = all(
        _WEST <= lon <= _EAST and _SOUTH <= lat <= _NORTH for lon, lat in (ends.start, ends.end)
    )
    return _both(ends, grids.DUTCH) if are_dutch else None


def _both(ends: Ends, epsg: int) -> Ends | None:
    start, end = grids.metres(epsg, *ends.start), grids.metres(epsg, *ends.end)
    return None if start is None or end is None else Ends(start, end)
