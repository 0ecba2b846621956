"""The picture of the whole wall as a drawing to scale, in strips as wide as the page."""

from __future__ import annotations

import math
from collections.abc import Sequence

from reportlab.lib.colors import white
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.pictures import jpeg_of
from app.reports.content.placement import capacity, spread
from app.reports.content.translator import Translator
from app.reports.content.wall import (
    Place,
    Wall,
    clock_places,
    joints_within,
    places_within,
    remarks_on,
    stretches_within,
    tick_digits,
    wall_of,
)
from app.reports.pdf.flow import Figure, Heading, note
from app.reports.pdf.styles import (
    HEIGHT,
    INK,
    SEVERITY,
    SOFT,
    TINY,
    WASH,
    WIDTH,
    on_severity,
)
from app.reports.pdf.text import draw, width_of
from app.reports.report import Entry, Report
from app.survey.rounding import decimals
from app.survey.spans import SAME_MM, Span, is_within

SCALES = (10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000, 10_000)
"""Denominators from 1 : 10 on."""
MOST_PAGES = 8
"""A finer scale that takes more pages is not used."""

_LEFT, _RIGHT = 7 * mm, 4 * mm
"""Room for the hours beside the strip, and for the last distance."""
_HEAD, _LANE, _BADGE, _FOOT, _GAP = 5 * mm, 2.6 * mm, 4.4 * mm, 8.4 * mm, 3 * mm
_LANES = 2
_MOST_ROWS = 16
"""Rows of numbers above a strip."""
_INTRODUCTION = 32 * mm
"""Heading and notes on the first page."""
_HALF_BOX = 1.8 * mm
_SLIVER = 0.02
"""A rest that is a smaller part of a strip makes the strips longer instead of one more."""
_PX_PER_POINT = 2.8
"""200 dpi."""


def unrolled_wall(report: Report, t: Translator) -> list[Flowable]:
    """Build strips from the first to the last seen place of the wall."""
    wall = wall_of(report)
    heading = Heading(t("wall.title"))
    if wall is None:
        return [heading, note(t("wall.none"))]
    scale, strips = _strips(report, t, wall)
    notes = [t("wall.help", scale=scale)]
    if scale > SCALES[0]:
        notes.append(t("wall.coarser", pages=MOST_PAGES))
    notes += remarks_on(report, wall, t)
    figures = [Figure(strip.height, strip.paint, alt=strip.alt) for strip in strips]
    # The heading stays with the first strip.
    first = CondPageBreak(min(strips[0].height + 45 * mm, HEIGHT - 1))
    return [first, heading, note(" ".join(notes)), *figures]


def _strips(report: Report, t: Translator, wall: Wall) -> tuple[int, list[_Strip]]:
    """Return the finest scale with an acceptable number of pages, and its strips."""
    for scale in SCALES:
        per_m = 1000 * mm / scale
        length_m = (WIDTH - _LEFT - _RIGHT) / per_m
        whole_m = wall.span_m[1] - wall.span_m[0]
        count = max(1, math.ceil(whole_m / length_m - _SLIVER))
        length_m = max(length_m, whole_m / count)
        if count > 60 * MOST_PAGES and scale != SCALES[-1]:
            continue
        first_m, last_m = wall.span_m
        spans = [
            (first_m + n * length_m, min(first_m + (n + 1) * length_m, last_m))
            for n in range(count)
        ]
        strips = [_Strip(report, t, wall, span, scale) for span in spans]
        if _pages(strips) <= MOST_PAGES or scale == SCALES[-1]:
            break
    return scale, strips


def _pages(strips: Sequence[_Strip]) -> float:
    """Return the number of pages, infinite if a strip is higher than a page."""
    pages, room = 1, HEIGHT - _INTRODUCTION
    for strip in strips:
        if strip.height > HEIGHT - _INTRODUCTION:
            return math.inf
        if strip.height > room:
            pages, room = pages + 1, HEIGHT
        room -= strip.height
    return pages


class _Strip:
    """A part of the wall that is as long as the page is wide."""

    def __init__(
        self,
        report: Report,
        t: Translator,
        wall: Wall,
        span_m: Span,
        scale: int,
    ) -> None:
        self.report = report
        self.t = t
        self.wall = wall
        self.span_m = span_m
        self.scale = scale
        self.per_m = 1000 * mm / scale
        self.marks = places_within(report, wall, span_m)
        self.stretches = stretches_within(report, span_m)
        self.width = (span_m[1] - span_m[0]) * self.per_m
        self.high = (wall.arc_mm[1] - wall.arc_mm[0]) / 1000 * self.per_m
        self.top = _FOOT + self.high
        self.lanes = min(len(self.stretches), _LANES)
        rows = math.ceil(len(self.marks) / capacity(_BADGE, _LEFT, WIDTH - _RIGHT))
        self.rows = min(rows, _MOST_ROWS)

    @property
    def height(self) -> float:
        """Height with the numbers above and the distances below."""
        return self.top + self.lanes * _LANE + self.rows * _BADGE + _HEAD + _GAP

    @property
    def alt(self) -> str:
        """What the strip shows, in words."""
        t = self.t
        return t(
            "wall.alt",
            first=t.length(self.span_m[0]),
            last=t.length(self.span_m[1]),
            scale=self.scale,
            joints=len(joints_within(self.report, self.span_m)),
            numbers=", ".join(str(entry.number) for entry, _ in self.marks) or "–",
        )

    def x_of(self, distance_m: float) -> float:
        """Return the position along the page."""
        return _LEFT + (distance_m - self.span_m[0]) * self.per_m

    def y_of(self, arc_mm: float) -> float:
        """Return the vertical position: what is left of the camera is above, like in the tiles."""
        return _FOOT + (self.wall.arc_mm[1] - arc_mm) / 1000 * self.per_m

    def paint(self, canvas: Canvas) -> None:
        """Draw the strip."""
        self._pictures(canvas)
        self._joints(canvas)
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.6)
        canvas.rect(_LEFT, _FOOT, self.width, self.high, 1, 0)
        self._clock(canvas)
        self._distances(canvas)
        self._stretches(canvas)
        self._marks(canvas)
        self._head(canvas)

    def _pictures(self, canvas: Canvas) -> None:
        canvas.saveState()
        frame = canvas.beginPath()
        frame.rect(_LEFT, _FOOT, self.width, self.high)
        canvas.clipPath(frame, 0, 0)
        layout = self.wall.layout
        bottom, top = self.y_of(layout.arc_to_mm), self.y_of(layout.arc_from_mm)
        for tile in self.wall.within(self.span_m):
            left, right = map(self.x_of, tile.span_m)
            enough_px = round(_PX_PER_POINT * max(right - left, top - bottom))
            picture = jpeg_of(tile.jpeg, max(enough_px, 1)) if tile.seen_m else None
            if picture is not None:
                canvas.drawImage(picture, left, bottom, right - left, top - bottom)
        for gap in self.wall.gaps(self.span_m):
            self._gap(canvas, gap)
        canvas.restoreState()

    def _gap(self, canvas: Canvas, gap_m: Span) -> None:
        """Hatch a part that was not seen, and name it where there is room."""
        left, right = map(self.x_of, gap_m)
        canvas.saveState()
        path = canvas.beginPath()
        path.rect(left, _FOOT, right - left, self.high)
        canvas.setFillColor(white)
        canvas.clipPath(path, 0, 1)
        canvas.setStrokeColor(SOFT)
        canvas.setLineWidth(0.35)
        step = 2 * mm
        for n in range(math.floor((left - self.high) / step), math.ceil(right / step)):
            canvas.line(n * step, _FOOT, n * step + self.high, self.top)
        name, style = self.t("wall.not_seen"), TINY.bold()
        room = width_of(name, style) + 2 * mm
        if room <= right - left:
            middle, y = (left + right) / 2, _FOOT + self.high / 2
            canvas.setFillColor(white)
            canvas.rect(middle - room / 2, y - 1.6 * mm, room, 3.2 * mm, 0, 1)
            draw(canvas, middle, y - 0.7 * mm, name, style, "centre")
        canvas.restoreState()

    def _clock(self, canvas: Canvas) -> None:
        low, high = self.wall.arc_mm
        last_y = math.inf
        for name, arc_mm in clock_places(self.report, feet=self.t.units == "ft"):
            if low - 1 <= arc_mm <= high + 1:
                y = self.y_of(arc_mm)
                canvas.setStrokeColor(INK)
                canvas.setLineWidth(0.4)
                canvas.line(_LEFT - 1.2 * mm, y, _LEFT, y)
                end = _LEFT + self.width
                canvas.line(end, y, end + 1.2 * mm, y)
                if last_y - y >= 2.2 * mm:
                    draw(canvas, _LEFT - 1.8 * mm, y - 0.7 * mm, name, TINY.soft(), "right")
                    last_y = y

    def _distances(self, canvas: Canvas) -> None:
        step_m = tick_step_m(self.t, self.per_m, 14 * mm)
        digits = tick_digits(self.t, step_m)
        for distance_m in Axis(*self.span_m).ticks(step_m):
            x = self.x_of(distance_m)
            canvas.setStrokeColor(INK)
            canvas.setLineWidth(0.4)
            canvas.line(x, _FOOT, x, _FOOT - 1.3 * mm)
            text = f"{decimals(distance_m, digits, unit=self.t.per_unit_m)} {self.t.units}"
            draw(canvas, x, _FOOT - 3.6 * mm, text, TINY.soft(), "centre")

    def _joints(self, canvas: Canvas) -> None:
        for joint in joints_within(self.report, self.span_m):
            x = self.x_of(joint.distance_m)
            for colour, width in ((white, 1.4), (INK, 0.6)):
                canvas.setStrokeColor(colour)
                canvas.setLineWidth(width)
                canvas.setDash(() if joint.is_seen else (3, 2))
                canvas.line(x, _FOOT, x, self.top)
            canvas.setDash()
            if joint.number is not None:
                canvas.line(x, _FOOT - 4.6 * mm, x, _FOOT - 5.4 * mm)
                draw(canvas, x, _FOOT - 7.6 * mm, f"J{joint.number}", TINY.bold(), "centre")

    def _stretches(self, canvas: Canvas) -> None:
        for number, (start_m, finish_m) in self.stretches:
            low, high = max(start_m, self.span_m[0]), min(finish_m, self.span_m[1])
            y = self.top + 1.1 * mm + ((number - 1) % _LANES) * _LANE * (self.lanes > 1)
            left, right = self.x_of(low), self.x_of(high)
            canvas.setStrokeColor(INK)
            canvas.setLineWidth(1.4)
            canvas.line(left, y, right, y)
            canvas.setLineWidth(0.7)
            for end_m, x in ((start_m, left), (finish_m, right)):
                if is_within(end_m, self.span_m):
                    canvas.line(x, self.top, x, y + 0.7 * mm)
            name, style = self.t("wall.stretch", n=number), TINY.bold()
            wide = width_of(name, style) + 1.2 * mm
            if wide < right - left:
                middle = (left + right) / 2
                canvas.setFillColor(white)
                canvas.rect(middle - wide / 2, y - 1 * mm, wide, 2 * mm, 0, 1)
                draw(canvas, middle, y - 0.7 * mm, name, style, "centre")

    def _marks(self, canvas: Canvas) -> None:
        numbers = self.top + self.lanes * _LANE + 1.2 * mm
        for row in range(self.rows):
            marks = self.marks[row :: self.rows]
            wanted = [self.x_of(entry.distance_m or 0.0) for entry, _ in marks]
            # Hundreds at one place have no room each, but the strip must fit on a page.
            gap = min(_BADGE, (WIDTH - _RIGHT - _LEFT) / max(1, len(marks) - 1))
            places = spread(wanted, gap, _LEFT, WIDTH - _RIGHT)
            for (entry, place), badge_x in zip(marks, places, strict=True):
                self._mark(canvas, entry, place, badge_x, numbers + row * _BADGE)

    def _mark(
        self, canvas: Canvas, entry: Entry, place: Place, badge_x: float, badge_y: float
    ) -> None:
        x = self.x_of(entry.distance_m or 0.0)
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.5)
        canvas.line(badge_x, badge_y, x, self.top)
        boxes = self._boxes(place)
        if boxes:
            upper = max(y + height for _, y, _, height in boxes)
            for colour, width in ((white, 1.8), (INK, 0.8)):
                canvas.setStrokeColor(colour)
                canvas.setLineWidth(width)
                canvas.line(x, self.top, x, min(upper, self.top))
                for box in boxes:
                    canvas.rect(*box, 1, 0)
            self._outlines(canvas, place)
        else:
            canvas.setDash(1.5, 1)
            canvas.line(x, self.top, x, _FOOT)
            canvas.setDash()
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.4)
        canvas.setFillColor(SEVERITY.get(entry.tag.severity or 0, WASH))
        canvas.circle(badge_x, badge_y + 1.5 * mm, 1.9 * mm, 1, 1)
        style = TINY.bold().on(on_severity(entry.tag.severity))
        draw(canvas, badge_x, badge_y + 0.8 * mm, str(entry.number), style, "centre")

    def _boxes(self, place: Place) -> list[tuple[float, float, float, float]]:
        """Return boxes around the seen parts of the place: left, bottom, width, height."""
        low_mm, high_mm = self.wall.arc_mm
        left = max(self.x_of(place.along_m[0]) - _HALF_BOX, _LEFT)
        right = min(self.x_of(place.along_m[1]) + _HALF_BOX, _LEFT + self.width)
        boxes = []
        for first_mm, last_mm in place.around_mm:
            if last_mm >= low_mm - SAME_MM and first_mm <= high_mm + SAME_MM:
                bottom = max(self.y_of(min(last_mm, high_mm)) - _HALF_BOX, _FOOT)
                top = min(self.y_of(max(first_mm, low_mm)) + _HALF_BOX, self.top)
                boxes.append((left, bottom, right - left, top - bottom))
        return boxes

    def _outlines(self, canvas: Canvas, place: Place) -> None:
        """Draw what was measured where it was measured."""
        canvas.saveState()
        frame = canvas.beginPath()
        frame.rect(_LEFT, _FOOT, self.width, self.high)
        canvas.clipPath(frame, 0, 0)
        for colour, width in ((INK, 1.8), (white, 0.8)):
            canvas.setStrokeColor(colour)
            canvas.setLineWidth(width)
            for points in place.outlines:
                path = canvas.beginPath()
                path.moveTo(self.x_of(points[0][0]), self.y_of(points[0][1]))
                for x_m, arc_mm in points[1:]:
                    path.lineTo(self.x_of(x_m), self.y_of(arc_mm))
                canvas.drawPath(path)
        canvas.restoreState()

    def _head(self, canvas: Canvas) -> None:
        """Name the strip, with its scale and a bar of a round length."""
        y = self.height - _HEAD + 1 * mm
        first, last = map(self.t.length, self.span_m)
        draw(canvas, _LEFT, y, self.t("wall.strip", first=first, last=last), TINY.bold())
        length_m = tick_step_m(self.t, self.per_m, 25 * mm)
        right = WIDTH - _RIGHT - 12 * mm
        left = right - length_m * self.per_m
        canvas.setStrokeColor(INK)
        canvas.setFillColor(INK)
        canvas.setLineWidth(0.4)
        canvas.rect(left, y, right - left, 1.2 * mm, 1, 0)
        canvas.rect(left, y, (right - left) / 2, 1.2 * mm, 0, 1)
        text = f"{length_m / self.t.per_unit_m:g} {self.t.units}"
        draw(canvas, right + 1.2 * mm, y, text, TINY)
        draw(canvas, left - 1.6 * mm, y, self.t("wall.scale", scale=self.scale), TINY, "right")
