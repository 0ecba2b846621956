"""The picture of the whole wall to scale, in strips as wide as the page."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from app.reports.content.pictures import jpeg_of
from app.reports.content.translator import Translator
from app.reports.drawings import svg
from app.reports.drawings.axis import Axis, tick_step_m
from app.reports.drawings.placement import capacity, spread
from app.reports.drawings.seen_wall import (
    Place,
    Wall,
    clock_places,
    joints_within,
    places_within,
    stretches_within,
    tick_digits,
)
from app.reports.drawings.svg import Drawing
from app.reports.report import Entry, Report
from app.survey.places.spans import SAME_M, SAME_MM, Span, is_within

SCALES = (10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000, 10_000)
"""Denominators from 1 : 10 on."""
MOST_PAGES = 8
"""A finer scale that takes more pages is not used."""
PAPER_PX_PER_MM = 8.0
"""200 dpi."""

_PAGE, _INTRODUCTION = 250.0, 32.0
"""Height of a page, and of what is above the first strip."""
_LEFT, _RIGHT = 7.0, 4.0
"""Room for the hours beside the strip, and for the last distance."""
_HEAD, _LANE, _BADGE, _FOOT = 6.0, 2.6, 4.4, 9.4
_LANES = 2
_MOST_ROWS = 16
"""Rows of numbers above a strip."""
_MOST_STRIPS = 60 * MOST_PAGES
_HALF_BOX = 1.8
_SEAM = 0.05
"""Pictures overlap by so much, as edges are smoothed."""
_HALO = ((svg.PAPER, 0.5), (svg.INK, 0.2))
"""Lines are seen on a dark and on a light wall."""


def wall_scale(report: Report, wall: Wall) -> int:
    """Return the finest scale with an acceptable number of pages, as its denominator."""
    return next(
        (scale for scale in SCALES if _pages(report, wall, scale) <= MOST_PAGES), SCALES[-1]
    )


def wall_strips(
    report: Report, t: Translator, wall: Wall, *, px_per_mm: float = PAPER_PX_PER_MM
) -> Iterator[Drawing]:
    """Draw strips from the first to the last seen place of the wall.

    Args:
        report: The report.
        t: Its words.
        wall: What was seen, by `wall_of`.
        px_per_mm: Sufficient resolution of the pictures.
    """
    scale = wall_scale(report, wall)
    for number, span_m in enumerate(_spans(wall, scale)):
        yield _Strip(report, t, wall, span_m, scale).drawing(number, px_per_mm)


def _longest_m(scale: int) -> float:
    return (svg.WIDTH - _LEFT - _RIGHT) * scale / 1000


def _spans(wall: Wall, scale: int) -> list[Span]:
    """Divide the wall into strips that end between two pictures, so that each is drawn once; in a
    gap, a strip ends anywhere.
    """
    longest_m = _longest_m(scale)
    borders_m = [tile.span_m[0] for tile in wall.tiles]
    first_m, last_m = wall.span_m
    spans: list[Span] = []
    while first_m < last_m - SAME_M:
        wanted_m = first_m + longest_m
        inside = [m for m in borders_m if wanted_m - longest_m / 2 < m <= wanted_m + SAME_M]
        end_m = last_m if wanted_m >= last_m - SAME_M else max(inside, default=wanted_m)
        spans.append((first_m, end_m))
        first_m = end_m
    return spans


def _pages(report: Report, wall: Wall, scale: int) -> float:
    """Return the number of pages, infinite if there are many or a strip is higher than a page."""
    if wall.span_m[1] - wall.span_m[0] > _MOST_STRIPS * _longest_m(scale):
        return math.inf
    pages, room = 1, _PAGE - _INTRODUCTION
    for span_m in _spans(wall, scale):
        height = _Strip(report, None, wall, span_m, scale).height
        if height > _PAGE - _INTRODUCTION:
            return math.inf
        if height > room:
            pages, room = pages + 1, _PAGE
        room -= height
    return pages


class _Strip:
    """A part of the wall that is as long as the page is wide."""

    def __init__(
        self, report: Report, t: Translator | None, wall: Wall, span_m: Span, scale: int
    ) -> None:
        self.report = report
        self.t = t or Translator.of(report)
        self.wall = wall
        self.span_m = span_m
        self.scale = scale
        self.per_m = 1000 / scale
        self.marks = places_within(report, wall, span_m)
        self.stretches = stretches_within(report, span_m)
        self.width = (span_m[1] - span_m[0]) * self.per_m
        self.high = (wall.arc_mm[1] - wall.arc_mm[0]) / scale
        self.lanes = min(len(self.stretches), _LANES)
        rows = math.ceil(len(self.marks) / capacity(_BADGE, _LEFT, svg.WIDTH - _RIGHT))
        self.rows = min(rows, _MOST_ROWS)
        self.top = _HEAD + self.rows * _BADGE + self.lanes * _LANE
        self.bottom = self.top + self.high
        self.height = self.bottom + _FOOT

    def drawing(self, number: int, px_per_mm: float) -> Drawing:
        """Draw the strip."""
        t = self.t
        alt = t(
            "wall.alt",
            first=t.length(self.span_m[0]),
            last=t.length(self.span_m[1]),
            scale=self.scale,
            joints=len(joints_within(self.report, self.span_m)),
            numbers=", ".join(str(entry.number) for entry, _ in self.marks) or "–",
        )
        inside = [*self._pictures(px_per_mm), *self._gaps()]
        outlines = [shape for _, place in self.marks for shape in self._outlines(place)]
        shapes = [
            *svg.clipped(f"wall-{number}", self._frame(), inside),
            *self._joints(), self._frame(svg.INK), *self._clock(), *self._distances(),
            *self._stretches(), *self._marks(),
            *(svg.clipped(f"outlines-{number}", self._frame(), outlines) if outlines else ()),
            *self._head(),
        ]  # fmt: skip
        return Drawing(svg.WIDTH, self.height, alt, shapes)

    def _x(self, distance_m: float) -> float:
        return _LEFT + (distance_m - self.span_m[0]) * self.per_m

    def _y(self, arc_mm: float) -> float:
        """Return the vertical position: what is left of the camera is above, like in the tiles."""
        return self.top + (arc_mm - self.wall.arc_mm[0]) / self.scale

    def _frame(self, stroke: str = "none") -> str:
        return svg.rect(_LEFT, self.top, self.width, self.high, "none", stroke, 0.2)

    def _pictures(self, px_per_mm: float) -> Iterator[str]:
        layout = self.wall.layout
        top, bottom = self._y(layout.arc_from_mm), self._y(layout.arc_to_mm)
        for tile in self.wall.within(self.span_m):
            left, right = map(self._x, tile.span_m)
            enough_px = round(px_per_mm * max(right - left, bottom - top))
            jpeg = jpeg_of(tile.jpeg, max(enough_px, 1)) if tile.seen_m else None
            if jpeg is not None:
                yield svg.picture(jpeg.content, (left, top), (right - left + _SEAM, bottom - top))

    def _gaps(self) -> Iterator[str]:
        """Hatch the parts that were not seen, and name them where there is room."""
        for gap_m in self.wall.gaps(self.span_m):
            left, right = map(self._x, gap_m)
            yield svg.rect(left, self.top, right - left, self.high, svg.PAPER, svg.SOFT)
            for n in range(math.floor((left - self.high) / 2), math.ceil(right / 2)):
                start, end = max(2.0 * n, left), min(2 * n + self.high, right)
                if start < end:
                    yield svg.line((start, self.bottom - (start - 2 * n)),
                               (end, self.bottom - (end - 2 * n)), svg.SOFT, 0.12)  # fmt: skip
            yield from self._named(self.t("wall.not_seen"), left, right, self.top + self.high / 2)

    def _named(self, name: str, left: float, right: float, y: float) -> Iterator[str]:
        """Write a name on a white ground if it fits between two places."""
        room = svg.width_of(name) + 1.6
        if room < right - left:
            middle = (left + right) / 2
            yield svg.rect(middle - room / 2, y - 1.3, room, 2.6, svg.PAPER)
            yield svg.text(middle, y + 0.75, name, svg.TINY, anchor="middle", bold=True)

    def _clock(self) -> Iterator[str]:
        low, high = self.wall.arc_mm
        last_y = -math.inf
        for name, arc_mm in clock_places(self.report, feet=self.t.units == "ft"):
            if low - 1 <= arc_mm <= high + 1:
                y, end = self._y(arc_mm), _LEFT + self.width
                yield svg.line((_LEFT - 1.2, y), (_LEFT, y))
                yield svg.line((end, y), (end + 1.2, y))
                if y - last_y >= 2.2:
                    yield svg.text(_LEFT - 1.8, y + 0.7, name, svg.TINY, svg.SOFT, anchor="end")
                    last_y = y

    def _distances(self) -> Iterator[str]:
        step_m = tick_step_m(self.t, self.per_m, 14)
        digits = tick_digits(self.t, step_m)
        for distance_m in Axis(*self.span_m).ticks(step_m):
            x = self._x(distance_m)
            said = f"{self.t.figure(distance_m / self.t.per_unit_m, digits)} {self.t.units}"
            yield svg.line((x, self.bottom), (x, self.bottom + 1.3))
            yield svg.text(x, self.bottom + 3.6, said, svg.TINY, svg.SOFT, anchor="middle")

    def _joints(self) -> Iterator[str]:
        for joint in joints_within(self.report, self.span_m):
            x = self._x(joint.distance_m)
            dash = "none" if joint.is_seen else "1 0.7"
            for colour, width in _HALO:
                yield svg.line((x, self.top), (x, self.bottom), colour, width, dash=dash)
            if joint.number is not None:
                yield svg.line((x, self.bottom + 4.6), (x, self.bottom + 5.4))
                yield svg.text(x, self.bottom + 7.6, f"J{joint.number}", svg.TINY, anchor="middle",
                           bold=True)  # fmt: skip

    def _stretches(self) -> Iterator[str]:
        for number, (start_m, finish_m) in self.stretches:
            low, high = max(start_m, self.span_m[0]), min(finish_m, self.span_m[1])
            y = self.top - 1.1 - ((number - 1) % _LANES) * _LANE * (self.lanes > 1)
            left, right = self._x(low), self._x(high)
            yield svg.line((left, y), (right, y), svg.INK, 0.5)
            for end_m, x in ((start_m, left), (finish_m, right)):
                if is_within(end_m, self.span_m):
                    yield svg.line((x, self.top), (x, y - 0.7), svg.INK, 0.25)
            yield from self._named(self.t("wall.stretch", n=number), left, right, y)

    def _marks(self) -> Iterator[str]:
        for row in range(self.rows):
            marks = self.marks[row :: self.rows]
            wanted = [self._x(entry.distance_m or 0.0) for entry, _ in marks]
            # Hundreds at one place have no room each, but the strip must fit on a page.
            gap = min(_BADGE, (svg.WIDTH - _RIGHT - _LEFT) / max(1, len(marks) - 1))
            y = self.top - self.lanes * _LANE - 2.4 - row * _BADGE
            for (entry, place), x in zip(
                marks, spread(wanted, gap, _LEFT, svg.WIDTH - _RIGHT), strict=True
            ):
                yield from self._place(entry, place, (x, y))
                yield self._number(entry, x, y)

    def _place(self, entry: Entry, place: Place, badge: tuple[float, float]) -> Iterator[str]:
        """Draw the line from the number of an entry to the boxes around its place."""
        x = self._x(entry.distance_m or 0.0)
        yield svg.line(badge, (x, self.top))
        boxes = self._boxes(place)
        if not boxes:
            yield svg.line((x, self.top), (x, self.bottom), svg.INK, 0.18, dash="0.5 0.35")
            return
        upper = max(min(y for _, y, _, _ in boxes), self.top)
        for colour, width in _HALO:
            yield svg.line((x, self.top), (x, upper), colour, width)
            yield from (svg.rect(*box, "none", colour, width) for box in boxes)

    def _boxes(self, place: Place) -> list[tuple[float, float, float, float]]:
        """Return boxes around the seen parts of the place: left, top, width, height."""
        low_mm, high_mm = self.wall.arc_mm
        left = max(self._x(place.along_m[0]) - _HALF_BOX, _LEFT)
        right = min(self._x(place.along_m[1]) + _HALF_BOX, _LEFT + self.width)
        boxes = []
        for first_mm, last_mm in place.around_mm:
            if last_mm >= low_mm - SAME_MM and first_mm <= high_mm + SAME_MM:
                upper = max(self._y(max(first_mm, low_mm)) - _HALF_BOX, self.top)
                lower = min(self._y(min(last_mm, high_mm)) + _HALF_BOX, self.bottom)
                boxes.append((left, upper, right - left, lower - upper))
        return boxes

    def _outlines(self, place: Place) -> Iterator[str]:
        """Draw what was measured where it was measured."""
        if self._boxes(place):
            for colour, width in ((svg.INK, 0.6), (svg.PAPER, 0.25)):
                for points in place.outlines:
                    drawn = [(self._x(x_m), self._y(arc_mm)) for x_m, arc_mm in points]
                    yield svg.path(drawn, colour, width)

    def _number(self, entry: Entry, x: float, y: float) -> str:
        severity = entry.tag.severity
        name = f"{entry.number}: {self.t.short_place(entry)} {self.t.code(entry)}"
        shapes = svg.circle((x, y), 1.9, svg.fill_of(severity)) + svg.text(
            x,
            y + 0.75,
            str(entry.number),
            svg.TINY,
            svg.ink_on(severity),
            anchor="middle",
            bold=True,
        )
        return svg.to_row(self.report, entry, shapes, name)

    def _head(self) -> Sequence[str]:
        t = self.t
        first, last = map(t.length, self.span_m)
        length_m = tick_step_m(t, self.per_m, 25)
        right = svg.WIDTH - _RIGHT - 12
        left = right - length_m * self.per_m
        bar = f"{t.figure(length_m / t.per_unit_m)} {t.units}"
        return [
            svg.text(_LEFT, 2.4, t("wall.strip", first=first, last=last), svg.TINY, bold=True),
            svg.text(left - 1.6, 2.4, t("wall.scale", scale=self.scale), svg.TINY, anchor="end"),
            svg.rect(left, 1.2, right - left, 1.2, svg.PAPER, svg.INK),
            svg.rect(left, 1.2, (right - left) / 2, 1.2, svg.INK),
            svg.text(right + 1.2, 2.4, bar, svg.TINY),
        ]
