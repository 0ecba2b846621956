"""Finds the distance counter among the texts that are burnt into a film.

A line of text is burnt in if it is detected at the same place in pictures from the whole film. The
counter is the line that reads as a distance in most of them: it has a decimal point, and it changes
or shows its unit, its name or leading zeros. A clock and a date do not read as a distance.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from app.burnt_in.box import Box
from app.burnt_in.distance_text import Distance, ShownUnit, read_distance
from app.burnt_in.fields import combs, field_of
from app.burnt_in.text_model import Letter
from vo_core.types import ByteImage

LEAST_SHARE = 0.4
"""Share of the pictures in which a line must be detected and read as a distance."""

LEAST_SURE = 0.5
"""Least probability of each character of a distance, for the search."""

FITTED_ON = 6
"""Number of pictures on which a box is fitted."""

AS_LEGIBLE = 0.97
"""A field is as legible as a whole picture if its digits are this many times as certain."""

WORTH_FITTING = 0.01
"""Gain of legibility from which an edge of the box is moved."""

FIT_STEP, FIT_STEPS = 0.12, 2
"""Share of the height by which an edge is moved at a time, and how often it may be."""

T = TypeVar("T")
Read = Callable[[ByteImage], tuple[Letter, ...]]


@dataclass(frozen=True)
class CounterPlace:
    """Where the counter stands, and how it is written."""

    box: Box
    decimals: int
    """Digits after the point."""
    unit: ShownUnit
    has_fields: bool
    """Whether the film is interlaced and one field is as legible as a whole picture."""


@dataclass
class _Place:
    """A place of the picture where lines were detected."""

    boxes: list[Box] = field(default_factory=list)

    def box(self) -> Box:
        """Wide enough for the longest line, and as high as most."""
        corners = np.array([[b.left, b.top, b.right, b.bottom] for b in self.boxes])
        _, top, _, bottom = np.median(corners, axis=0)
        return Box(int(corners[:, 0].min()), int(top), int(corners[:, 2].max()), int(bottom))


@dataclass(frozen=True)
class _Line:
    """A burnt-in line that reads as a distance."""

    box: Box
    found: list[Distance]
    """Its readings, in the pictures in which it has one."""


def find_counter(
    pictures: Sequence[ByteImage],
    lines: Sequence[Sequence[Box]],
    read: Read,
    within: Box | None = None,
) -> CounterPlace | None:
    """Find the counter, or None if no text reads as one.

    Args:
        pictures: (H, W, 3) BGR each, from the whole film.
        lines: The lines of text in some of the pictures.
        read: Reads a line of text.
        within: A part of the picture that holds the counter and perhaps other lines; there the
            counter may lack a decimal point.
    """
    line = _best_line(pictures, lines, read, within)
    if line is None:
        return None
    units = [distance.unit for distance in line.found if distance.unit]
    box = _fitted(line.box, pictures[:: -(-len(pictures) // FITTED_ON)], read)
    return CounterPlace(
        box=box,
        decimals=_most_frequent([distance.decimals for distance in line.found]),
        unit=_most_frequent(units) if len(units) > LEAST_SHARE * len(line.found) else "",
        has_fields=_has_fields([box.cut_from(picture) for picture in pictures], read),
    )


def _best_line(
    pictures: Sequence[ByteImage],
    lines: Sequence[Sequence[Box]],
    read: Read,
    within: Box | None,
) -> _Line | None:
    """The line that resembles a counter most, or None if none does."""
    places: list[_Place] = []
    for found_lines in lines:
        for box in found_lines:
            if within is None or within.holds_middle_of(box):
                _add(places, box)
    boxes = [p.box() for p in places if len(p.boxes) >= LEAST_SHARE * len(lines)]
    if within is not None:
        boxes.append(within)
    readings = [_distances(box, pictures, read) for box in boxes]
    scores = [_resemblance(found, needs_point=within is None) for found in readings]
    best = max(range(len(boxes)), key=lambda n: scores[n], default=None)
    if best is None or scores[best] <= 0:
        return None
    return _Line(boxes[best], [distance for distance in readings[best] if distance is not None])


def _distances(box: Box, pictures: Sequence[ByteImage], read: Read) -> list[Distance | None]:
    found = [read_distance(read(box.cut_from(picture))) for picture in pictures]
    return [readings[0] if readings else None for readings in found]


def _resemblance(readings: list[Distance | None], *, needs_point: bool) -> float:
    """How much a line resembles a counter; 0 if it is none."""
    found = [r for r in readings if r and r.sure >= LEAST_SURE and (r.decimals or not needs_point)]
    if not found or len(found) < LEAST_SHARE * len(readings):
        return 0.0
    hints = (
        2 * _mostly(distance.unit != "" for distance in found)
        + 2 * (len({distance.value for distance in found}) > 1)
        + 1 * _mostly(distance.is_named for distance in found)
        + 1 * _mostly(distance.digits - distance.decimals >= 3 for distance in found)
    )
    if needs_point:
        return hints + len(found) / len(readings) if hints >= 2 else 0.0
    return (
        hints
        + 4 * _mostly(distance.decimals > 0 for distance in found)
        + len(found) / len(readings)
    )


def _mostly(answers: Iterable[bool]) -> bool:
    return bool(np.mean(list(answers)) > 0.5)


def _most_frequent(values: Sequence[T]) -> T:
    return Counter(values).most_common(1)[0][0]


def _fitted(box: Box, pictures: Sequence[ByteImage], read: Read) -> Box:
    """Move the edges of a box, one after the other, to where the digits are read most surely.

    Loose boxes are the most frequent cause of misread digits: with a margin of a quarter of the
    height, 8 of 10 readings of a dot matrix of 12 px were wrong, and none in the fitted box.
    """
    height, width = pictures[0].shape[:2]
    best, most = box, _legibility(box, pictures, read)
    for edge, last, steps in (
        ("top", height, (-FIT_STEP, FIT_STEP)),
        ("bottom", height, (-FIT_STEP, FIT_STEP)),
        ("left", width, (-FIT_STEP,)),  # no digit may be cut
        ("right", width, (FIT_STEP,)),
    ):
        start = getattr(best, edge)
        for step in steps:
            for times in range(1, FIT_STEPS + 1):
                place = start + round(times * step * box.height)
                moved = replace(best, **{edge: min(max(place, 0), last)})
                legibility = _legibility(moved, pictures, read)
                if legibility <= most * (1 + WORTH_FITTING):
                    break
                best, most = moved, legibility
    return best


def _legibility(box: Box, pictures: Sequence[ByteImage], read: Read) -> float:
    """Mean certainty of the distances in the crops, and of an interlaced film in their even rows,
    one field. Digits count, so that none is cut off.
    """
    crops = [box.cut_from(picture) for picture in pictures]
    whole = _mean_sure(crops, read)
    return whole + (_mean_sure(_fields(crops), read) if _is_interlaced(crops) else whole)


def _has_fields(crops: Sequence[ByteImage], read: Read) -> bool:
    return _is_interlaced(crops) and (
        _mean_sure(_fields(crops), read) > AS_LEGIBLE * _mean_sure(crops, read)
    )


def _is_interlaced(crops: Sequence[ByteImage]) -> bool:
    return any(combs(crop) for crop in crops)


def _fields(crops: Sequence[ByteImage]) -> list[ByteImage]:
    return [field_of(crop, 0) for crop in crops]


def _mean_sure(crops: Sequence[ByteImage], read: Read) -> float:
    found = [read_distance(read(crop)) for crop in crops]
    return float(np.mean([r[0].sure * r[0].digits if r else 0.0 for r in found]))


def joined(boxes: list[Box]) -> list[Box]:
    """Join boxes that follow each other on a line, as a number and its unit."""
    lines: list[Box] = []
    for box in sorted(boxes, key=lambda box: box.left):
        for n, line in enumerate(lines):
            shared = min(line.bottom, box.bottom) - max(line.top, box.top)
            is_level = shared > 0.5 * max(line.height, box.height)
            if is_level and box.left - line.right < min(line.height, box.height):
                lines[n] = line.union(box)
                break
        else:
            lines.append(box)
    return lines


def _add(places: list[_Place], box: Box) -> None:
    """Add a box to the place that it overlaps, or to a new one."""
    for place in places:
        if place.boxes[0].overlap(box) > 0.5:
            place.boxes.append(box)
            return
    places.append(_Place([box]))
