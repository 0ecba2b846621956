"""The plan sketch: all culverts with coordinates, to one scale, north up."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from app.reports.collection.collected import Collected

_EARTH_MM = 6.371e9
_STEPS = (1.0, 2.0, 2.5, 5.0)
"""Leading digits of scales and of lengths of the scale bar."""
_BAR_MM = 50.0
"""Longest scale bar on paper."""
_TOGETHER_MM = 5.0
"""Culverts nearer than this on paper share a label."""
_LARGEST_SCALE = 100.0
"""1 : 100; a single culvert is not drawn larger."""


@dataclass(frozen=True)
class Run:
    """A culvert on paper: mm from the lower left corner of the sketch."""

    one: Collected
    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def middle(self) -> tuple[float, float]:
        """The place of its mark."""
        return (self.start[0] + self.end[0]) / 2, (self.start[1] + self.end[1]) / 2


@dataclass
class Label:
    """The numbers of culverts that lie together on paper."""

    at: tuple[float, float]
    runs: list[Run] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Format the numbers, runs of them as ranges: `3, 7–9`."""
        numbers = sorted(run.one.number for run in self.runs)
        return ", ".join(
            str(first) if first == last else f"{first}–{last}" for first, last in _ranges(numbers)
        )


@dataclass(frozen=True)
class Plan:
    """The sketch, and what cannot be in it."""

    scale: float
    """1 : this."""
    bar_m: float
    """Length of the scale bar in nature."""
    runs: tuple[Run, ...]
    labels: tuple[Label, ...]
    unplaced: tuple[Collected, ...]
    """Inspections without coordinates."""

    @property
    def bar_mm(self) -> float:
        """Length of the scale bar on paper."""
        return self.bar_m * 1000 / self.scale


def plan_of(inspections: Sequence[Collected], width_mm: float, height_mm: float) -> Plan:
    """Lay out the culverts in a field of a size on paper.

    Distances are true to scale along meridians and at the middle latitude; over the extent of a
    road network the error is below the width of a line.
    """
    placed = [one for one in inspections if one.ends is not None]
    unplaced = tuple(one for one in inspections if one.ends is None)
    points = [end for one in placed for end in one.ends or ()]
    if not points:
        return Plan(_LARGEST_SCALE, 1.0, (), (), unplaced)
    west, east = _span([lon for lon, _ in points])
    south, north = _span([lat for _, lat in points])
    middle = (west + east) / 2, (south + north) / 2
    per_degree = math.radians(_EARTH_MM)
    # Near a pole a meridian is all longitudes at once: keep the scale finite.
    shrunk = max(0.01, math.cos(math.radians(middle[1])))
    wanted = max(
        (east - west) * per_degree * shrunk / width_mm, (north - south) * per_degree / height_mm
    )
    scale = _round_up(max(wanted, _LARGEST_SCALE))

    def on_paper(point: tuple[float, float]) -> tuple[float, float]:
        x = (point[0] - middle[0]) * per_degree * shrunk / scale
        y = (point[1] - middle[1]) * per_degree / scale
        return width_mm / 2 + x, height_mm / 2 + y

    runs = tuple(
        Run(one, on_paper(one.ends[0]), on_paper(one.ends[1])) for one in placed if one.ends
    )
    return Plan(scale, _round_down(_BAR_MM * scale / 1000), runs, _labels(runs), unplaced)


def _labels(runs: Iterable[Run]) -> tuple[Label, ...]:
    labels: list[Label] = []
    for run in runs:
        near = (one for one in labels if math.dist(one.at, run.middle) < _TOGETHER_MM)
        label = next(near, None)
        if label is None:
            label = Label(run.middle)
            labels.append(label)
        label.runs.append(run)
    return tuple(labels)


def _span(values: Sequence[float]) -> tuple[float, float]:
    return min(values), max(values)


def _round_up(value: float) -> float:
    """Return the next number with one of the leading digits that is not below."""
    power = 10.0 ** math.floor(math.log10(value))
    return min(step * power for step in (*_STEPS, 10.0) if step * power >= value * (1 - 1e-9))


def _round_down(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in _STEPS if step * power <= value * (1 + 1e-9))


def _ranges(numbers: Sequence[int]) -> Iterator[tuple[int, int]]:
    first = last = numbers[0]
    for number in numbers[1:]:
        if number != last + 1:
            yield first, last
            first = number
        last = number
    yield first, last
