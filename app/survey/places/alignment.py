"""The line of a culvert on the map: places by distance, along a line of any number of points."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import accumulate
from typing import TYPE_CHECKING

from app.survey.assets.register import Line, Point
from app.survey.fields.declaration import Value
from app.survey.fields.header import number_of

if TYPE_CHECKING:
    from pyproj import Geod

DEGREE_DECIMALS = 8
"""A millimetre on the ground, so that rounding adds nothing to the interval of a distance."""
_NEAR_M = 10.0
_NEAR_SHARE = 0.1
"""How far the ends of a line may lie from the stated ones: 10 m, or a tenth of its length."""


@cache
def _globe() -> Geod:
    from pyproj import Geod

    return Geod(ellps="WGS84")


@dataclass(frozen=True)
class Alignment:
    """A line of two or more points, on which the length of the culvert is spread evenly."""

    line: Line
    length_m: float
    """Known, or surveyed; the line may be drawn longer or shorter."""

    @cached_property
    def drawn_m(self) -> float:
        """Length of the line on the ellipsoid."""
        return self._ends_m[-1]

    @property
    def is_straight(self) -> bool:
        """Whether only the ends are known."""
        return len(self.line) == 2

    def share(self, distance_m: float) -> float:
        """Return which part of the whole lies before a distance; below 0 or above 1 beyond it."""
        return distance_m / self.length_m

    def at(self, distance_m: float) -> Point:
        """Return longitude and latitude; beyond an end the line goes straight on."""
        along_m = self.share(distance_m) * self.drawn_m
        leg = self._leg(along_m)
        (lon, lat), (to_lon, to_lat) = self._unwrapped[leg], self._unwrapped[leg + 1]
        start_m, end_m = self._ends_m[leg], self._ends_m[leg + 1]
        # Straight in degrees, as a map draws the line (RFC 7946, 3.1.1).
        part = (along_m - start_m) / (end_m - start_m) if end_m > start_m else 0.0
        return _on_the_globe(lon + part * (to_lon - lon), lat + part * (to_lat - lat))

    def part(self, from_m: float, to_m: float) -> list[Point]:
        """Return the line between two distances, with the points between them."""
        low_m, high_m = (self.share(each) * self.drawn_m for each in sorted((from_m, to_m)))
        between = [
            _on_the_globe(*point)
            for point, at_m in zip(self._unwrapped[1:-1], self._ends_m[1:-1], strict=True)
            if low_m < at_m < high_m
        ]
        if from_m > to_m:
            between.reverse()
        return [self.at(from_m), *between, self.at(to_m)]

    def _leg(self, along_m: float) -> int:
        """Return the leg of a place; the first or the last that has a length beyond the ends."""
        last = len(self.line) - 2
        leg = min(max(bisect_right(self._ends_m, along_m) - 1, 0), last)
        while leg < last and self._ends_m[leg + 1] <= self._ends_m[leg]:
            leg += 1
        while leg > 0 and self._ends_m[leg + 1] <= self._ends_m[leg]:
            leg -= 1
        return leg

    @cached_property
    def _unwrapped(self) -> tuple[Point, ...]:
        """The points, with longitudes that do not jump at 180 degrees."""
        found = [self.line[0]]
        for lon, lat in self.line[1:]:
            before = found[-1][0]
            found.append((before + (lon - before + 180) % 360 - 180, lat))
        return tuple(found)

    @cached_property
    def _ends_m(self) -> list[float]:
        """Length of the line at each point."""
        lons, lats = zip(*self.line, strict=True)
        return [0.0, *accumulate(map(float, _globe().line_lengths(lons, lats)))]


def alignment_of(
    header: Mapping[str, Value], line: Line, surveyed_m: float | None
) -> Alignment | None:
    """Return the line of a culvert; None unless its ends and its length are known.

    Args:
        header: Of the survey, whose stated ends and length count.
        line: Of the register, in either direction; it counts if its ends are near the stated ones.
        surveyed_m: Length if none is known.
    """
    known_m = number_of(header.get("known_length_m"))
    length_m = known_m if known_m is not None and known_m > 0 else surveyed_m
    if length_m is None or length_m <= 0:
        return None
    start, end = (_stated(header, name) for name in ("start", "end"))
    if start is None or end is None:
        return Alignment(line, length_m) if len(line) > 1 else None
    for way in (line, line[::-1]):
        if len(way) > 2 and _is_near(way, start, end):
            return Alignment((start, *way[1:-1], end), length_m)
    return Alignment((start, end), length_m)


def missing_of(header: Mapping[str, Value]) -> list[str]:
    """Return the header fields of the ends that are not stated as degrees."""
    return [
        f"{end}_{name}"
        for end in ("start", "end")
        for name in ("lat", "lon")
        if _degrees(header, f"{end}_{name}") is None
    ]


def _is_near(way: Line, start: Point, end: Point) -> bool:
    length_m = _distance_m(start, end)
    return all(
        _distance_m(*pair) <= max(_NEAR_M, _NEAR_SHARE * length_m)
        for pair in ((way[0], start), (way[-1], end))
    )


def _distance_m(one: Point, other: Point) -> float:
    return float(_globe().inv(*one, *other)[2])


def _stated(header: Mapping[str, Value], end: str) -> Point | None:
    lon, lat = _degrees(header, f"{end}_lon"), _degrees(header, f"{end}_lat")
    return None if lon is None or lat is None else (lon, lat)


def _degrees(header: Mapping[str, Value], name: str) -> float | None:
    found = number_of(header.get(name))
    most = 90 if name.endswith("_lat") else 180
    return found if found is not None and abs(found) <= most else None


def _on_the_globe(lon: float, lat: float) -> Point:
    lon = lon if abs(lon) <= 180 else (lon + 180) % 360 - 180
    return round(lon, DEGREE_DECIMALS), round(min(90.0, max(-90.0, lat)), DEGREE_DECIMALS)
