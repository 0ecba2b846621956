"""Converts the ends of the culvert to the map systems of other programs."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.reports.exchange.fields import Fields
from app.survey import grids

_RD_BOUNDS = (3.2, 50.7, 7.3, 53.7)
"""West, south, east and north of the Netherlands."""
NAMES = ("start_lat", "start_lon", "end_lat", "end_lon")


@dataclass(frozen=True)
class Ends:
    """Longitude and latitude of both ends, in degrees."""

    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def zone(self) -> int:
        """UTM zone of the start."""
        return min(60, max(1, math.floor((self.start[0] + 180) / 6) + 1))

    @property
    def is_north(self) -> bool:
        """Whether the start is north of the equator."""
        return self.start[1] >= 0

    @property
    def is_dutch(self) -> bool:
        """Whether both ends lie within the bounds of the Dutch system."""
        west, south, east, north = _RD_BOUNDS
        return all(
            west <= lon <= east and south <= lat <= north for lon, lat in (self.start, self.end)
        )


def ends_of(fields: Fields) -> Ends | None:
    """Return both ends, or None unless both are known."""
    found = [_degrees(fields, name) for name in NAMES]
    start_lat, start_lon, end_lat, end_lon = found
    if start_lat is None or start_lon is None or end_lat is None or end_lon is None:
        return None
    return Ends((start_lon, start_lat), (end_lon, end_lat))


def _degrees(fields: Fields, name: str) -> float | None:
    most = 90 if name.endswith("_lat") else 180
    return fields.number_within(name, -most, most)


def utm_m(ends: Ends) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return easting and northing of both ends in the zone of the start; None near the poles."""
    return _both(ends, grids.utm(ends.zone, is_north=ends.is_north))


def rd_m(ends: Ends) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return x and y of both ends in the Dutch system; None outside the Netherlands."""
    return _both(ends, grids.DUTCH) if ends.is_dutch else None


def _both(ends: Ends, epsg: int) -> tuple[tuple[float, float], tuple[float, float]] | None:
    start, end = grids.metres(epsg, *ends.start), grids.metres(epsg, *ends.end)
    return None if start is None or end is None else (start, end)
