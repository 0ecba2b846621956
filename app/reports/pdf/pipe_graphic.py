"""The pipe from start to end, to scale, with a label for every observation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from reportlab.lib.colors import white
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.cut_pipe import clock_spans, water_share
from app.reports.content.placement import capacity, spread
from app.reports.content.translator import NOTHING, Translator
from app.reports.content.typesetting import one_line
from app.reports.pdf.flow import Figure, Heading, batches, draw_badge
from app.reports.pdf.styles import (
    ACCENT,
    CELL,
    HEIGHT,
    INK,
    RULE,
    SEVERITY,
    SMALL,
    SOFT,
    TINY,
    WASH,
    WATER,
    WIDTH,
)
from app.reports.pdf.text import draw, lines_of, shortened, width_of
from app.reports.report import Entry, Report, Stretch
from app.survey.spans import SAME_M, Span, is_within

SCALES = (
    20, 25, 40, 50, 75, 100, 125, 150, 200, 250, 300, 400, 500, 750, 1000, 1500, 2000, 2500, 5000,
    10_000, 20_000, 50_000, 100_000,
)  # fmt: skip
"""Denominators from 1 : 20 to 1 : 100 000."""

LABEL = 4.6 * mm
"""Height of a label."""
MOST_SHEETS = 8
COARSEST = 250
"""Coarsest scale used where the number of sheets is acceptable."""

_HEAD = 20 * mm
_LEGEND = 13 * mm
_STRIP = (21 * mm, 49 * mm)
_BRACKET = 51.5 * mm
_LANE = 2.2 * mm
_LANES = 4
_ELBOWS = (61 * mm, 68 * mm)
_LABELS = 69 * mm


@dataclass(frozen=True)
class Sheet:
    """One page: a window of the pipe, and the entries whose labels fit there."""

    first_m: float
    last_m: float
    entries: tuple[Entry, ...]
    part: int
    """Number among the pages of the same window, from 1."""
    parts: int

    @property
    def span_m(self) -> Span:
        """Where its window begins and ends on the axis."""
        return self.first_m, self.last_m


def pipe_graphic(report: Report, t: Translator) -> list[Flowable]:
    """Build the pages of the graphic, each with the same head."""
    body = HEIGHT - 32 * mm - _LEGEND
    scale, sheets = laid_out(report, body)
    parts: list[Flowable] = []
    for number, sheet in enumerate(sheets, 1):
        title = t("graphic.title")
        if number > 1:
            title = t("graphic.continued", title=title)
        painter = _Painter(report, t, sheet, scale, body)
        alt = t(
            "alt.graphic",
            first=t.length(sheet.first_m),
            last=t.length(sheet.last_m),
            n=len(sheet.entries),
        )
        parts += [
            CondPageBreak(HEIGHT - 1),  # each sheet has a page of its own
            Heading(title, bookmark=number == 1, is_continued=number > 1),
            Figure(body + _HEAD / 2 + _LEGEND, painter.paint, alt=alt),
        ]
    return parts


def laid_out(report: Report, height: float) -> tuple[int, list[Sheet]]:
    """Return the scale that needs the fewest pages, the coarsest of equals, and its pages.

    A page that repeats a part of the pipe, for labels that did not fit, counts twice: where
    observations are dense, a finer scale is easier to read.

    Args:
        report: The report, with entries by distance.
        height: Height of the strip on a page, in points.
    """
    axis = Axis.of(report)
    per_page = capacity(LABEL, 0, height - LABEL)
    fits = [scale for scale in SCALES if _windows(axis, _window_m(scale, height)) <= 1]
    whole = min(fits, default=SCALES[-1])
    enough = [s for s in SCALES if _windows(axis, _window_m(s, height)) <= MOST_SHEETS]
    coarsest = min(whole, max(COARSEST, min(enough, default=SCALES[-1])))
    best = coarsest, _sheets(report, axis, _window_m(coarsest, height), per_page)
    for scale in [scale for scale in reversed(SCALES) if scale < coarsest]:
        window_m = _window_m(scale, height)
        if _windows(axis, window_m) > _burden(best[1]):
            break  # the windows alone need more pages
        sheets = _sheets(report, axis, window_m, per_page)
        if _burden(sheets) < _burden(best[1]):
            best = scale, sheets
    return best


def _burden(sheets: Sequence[Sheet]) -> int:
    return sum(1 if sheet.part == 1 else 2 for sheet in sheets)


def _window_m(scale: int, height: float) -> float:
    """Return the length of pipe that a page shows."""
    return height / mm * scale / 1000


def _windows(axis: Axis, window_m: float) -> int:
    """Return how many windows show the whole axis."""
    return max(1, math.ceil((axis.length_m - SAME_M) / window_m))


def _sheets(report: Report, axis: Axis, window_m: float, per_page: int) -> list[Sheet]:
    count = _windows(axis, window_m)
    groups: list[list[Entry]] = [[] for _ in range(count)]
    for entry in report.entries:
        if entry.distance_m is not None:
            index = int((entry.distance_m - axis.first_m) / window_m)
            groups[min(max(index, 0), count - 1)].append(entry)
    sheets = []
    for index, group in enumerate(groups):
        chunks = list(batches(group, per_page)) or [()]
        first_m = axis.first_m + index * window_m
        last_m = min(axis.last_m, first_m + window_m)
        sheets += [
            Sheet(first_m, last_m, chunk, part, len(chunks)) for part, chunk in enumerate(chunks, 1)
        ]
    return sheets


class _Painter:
    """Draws one sheet."""

    def __init__(
        self, report: Report, t: Translator, sheet: Sheet, scale: int, height: float
    ) -> None:
        self.report = report
        self.t = t
        self.sheet = sheet
        self.scale = scale
        self.points_per_m = 1000 * mm / scale
        self.bottom = _LEGEND
        self.top = _LEGEND + height

    def y_of(self, distance_m: float) -> float:
        """Return the position down the page."""
        return self.top - (distance_m - self.sheet.first_m) * self.points_per_m

    def x_of(self, hour: float) -> float:
        """Return the position across the strip: 12 at both edges, 9 on the left, 3 on the right."""
        left, right = _STRIP
        return right - (hour % 12) / 12 * (right - left)

    def paint(self, canvas: Canvas) -> None:
        """Draw everything, from the bottom layer up."""
        self._head(canvas)
        self._strip(canvas)
        self._joints(canvas)
        self._ticks(canvas)
        self._nodes(canvas)
        self._entries(canvas)
        self._stretches(canvas)
        self._legend(canvas)

    def _head(self, canvas: Canvas) -> None:
        y = self.top + 7.5 * mm
        style = SMALL.bold().on(ACCENT)
        draw(canvas, 0, y, self.t.units, style)
        left, right = _STRIP
        for hour, x in ((12, left), (9, self.x_of(9)), (6, self.x_of(6)), (3, self.x_of(3)),
                        (12, right)):  # fmt: skip
            draw(canvas, x, y, str(hour), TINY.soft(), "centre")
        x = _LABELS
        for name, width in self._columns():
            draw(canvas, x, y, shortened(name, style, width - 1 * mm), style)
            x += width
        canvas.setStrokeColor(RULE)
        canvas.setLineWidth(0.8)
        canvas.line(0, y - 1.6 * mm, WIDTH, y - 1.6 * mm)

    def _columns(self) -> list[tuple[str, float]]:
        t = self.t
        return [
            (t("entry.severity_short"), 6.5 * mm),
            (t("entry.no"), 7.5 * mm),
            (t("entry.place"), 24.5 * mm),
            (t("entry.code"), 13 * mm),
            (t("entry.clock_short"), 13 * mm),
            (t("entry.what"), WIDTH - _LABELS - 64.5 * mm),
        ]

    def _strip(self, canvas: Canvas) -> None:
        left, right = _STRIP
        top, bottom = self.y_of(self.sheet.first_m), self.y_of(self.sheet.last_m)
        canvas.setFillColor(WASH)
        canvas.rect(left, bottom, right - left, top - bottom, 0, 1)
        share = water_share(self.report)
        if share:
            width = share * (right - left)
            canvas.setFillColor(WATER)
            canvas.rect((left + right - width) / 2, bottom, width, top - bottom, 0, 1)
        canvas.setStrokeColor(RULE)
        canvas.setLineWidth(0.3)
        for hour in (3, 6, 9):
            canvas.line(self.x_of(hour), top, self.x_of(hour), bottom)
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.9)
        canvas.line(left, top, left, bottom)
        canvas.line(right, top, right, bottom)

    def _ticks(self, canvas: Canvas) -> None:
        step_m = max(tick_step_m(self.t, self.points_per_m, 4 * mm), self.t.per_unit_m)
        canvas.setLineWidth(0.4)
        axis = Axis(self.sheet.first_m, self.sheet.last_m)
        for distance_m in axis.ticks(step_m):
            y = self.y_of(distance_m)
            canvas.setStrokeColor(INK)
            canvas.line(11 * mm, y, 12.5 * mm, y)
            draw(canvas, 10 * mm, y - 0.8 * mm, f"{distance_m / self.t.per_unit_m:g}",
                 SMALL, "right")  # fmt: skip
        canvas.setStrokeColor(INK)
        canvas.line(12.5 * mm, self.y_of(axis.first_m), 12.5 * mm, self.y_of(axis.last_m))

    def _joints(self, canvas: Canvas) -> None:
        """Draw seen joints as lines with their numbers, expected ones as dashes."""
        left, right = _STRIP
        canvas.setStrokeColor(SOFT)
        canvas.setLineWidth(0.5)
        last_y = math.inf
        for joint in self.report.joints:
            if (y := self._joint_y(joint.distance_mm)) is None:
                continue
            canvas.line(left, y, right, y)
            if joint.number is not None and last_y - y >= 2.6 * mm:
                name = f"J{joint.number}"
                draw(canvas, left - 1 * mm, self._beside_nodes(y), name, TINY.soft(), "right")
                last_y = y
        canvas.setDash(1.2, 1.2)
        for expected in self.report.expected_joints:
            if (y := self._joint_y(expected.distance_mm)) is not None:
                canvas.line(left, y, right, y)
        canvas.setDash()

    def _joint_y(self, distance_mm: float) -> float | None:
        """Return the position of a joint; None on another sheet."""
        distance_m = distance_mm / 1000
        if not is_within(distance_m, self.sheet.span_m):
            return None
        return self.y_of(distance_m)

    def _beside_nodes(self, y: float) -> float:
        """Return the baseline of a joint's number, which the bar of a node must not cover."""
        for _, distance_m, side in self._ends():
            node_y = self.y_of(distance_m)
            if abs(y - node_y) < 1.8 * mm:
                return node_y + (-1.9 * mm if side > 0 else 0.4 * mm)
        return y - 0.7 * mm

    def _ends(self) -> tuple[tuple[str, float, int], ...]:
        """Return name and distance of each node, and the side of it on which its bar is."""
        axis = Axis.of(self.report)
        return ("start", max(axis.first_m, 0.0), 1), ("end", axis.last_m, -1)

    def _nodes(self, canvas: Canvas) -> None:
        left, right = _STRIP
        for end, distance_m, side in self._ends():
            if not is_within(distance_m, self.sheet.span_m):
                continue
            y = self.y_of(distance_m)
            canvas.setFillColor(ACCENT)
            canvas.rect(left - 2 * mm, y + (0 if side > 0 else -1.3 * mm), right - left + 4 * mm,
                        1.3 * mm, 0, 1)  # fmt: skip
            name = str(self.report.header.get(f"{end}_node") or NOTHING)
            at = y + 2 * mm if side > 0 else y - 4 * mm
            style = TINY.bold()
            draw(canvas, (left + right) / 2, at, shortened(name, style, right - left), style,
                 "centre")  # fmt: skip

    def _stretches(self, canvas: Canvas) -> None:
        for lane, stretch in _in_lanes(self.report.stretches):
            start_m, finish_m = stretch.start.distance_m, stretch.finish.distance_m
            if start_m is None or finish_m is None:
                continue
            low, high = sorted((start_m, finish_m))
            if high < self.sheet.first_m - SAME_M or low > self.sheet.last_m + SAME_M:
                continue
            x = _BRACKET + lane * _LANE
            upper = self.y_of(max(low, self.sheet.first_m))
            lower = self.y_of(min(high, self.sheet.last_m))
            canvas.setStrokeColor(INK)
            canvas.setLineWidth(1.1)
            canvas.line(x, upper, x, lower)
            if is_within(low, self.sheet.span_m):
                canvas.line(x - 1 * mm, upper, x, upper)
            if is_within(high, self.sheet.span_m):
                canvas.line(x - 1 * mm, lower, x, lower)
            self._number(canvas, x, (upper + lower) / 2, str(stretch.number))

    def _number(self, canvas: Canvas, x: float, y: float, number: str) -> None:
        """Draw a number on a white ground, as leader lines pass behind it."""
        style = TINY.bold()
        half = width_of(number, style) / 2 + 0.4 * mm
        canvas.setFillColor(white)
        canvas.rect(x - half, y - 1.3 * mm, 2 * half, 2.6 * mm, 0, 1)
        draw(canvas, x, y - 0.8 * mm, number, style, "centre")

    def _entries(self, canvas: Canvas) -> None:
        entries = self.sheet.entries
        wanted = [-self.y_of(entry.distance_m or 0.0) for entry in entries]
        places = spread(wanted, LABEL, -(self.top - LABEL / 2), -(self.bottom + LABEL / 2))
        for entry in sorted(entries, key=lambda entry: entry.tag.severity or 0):
            self._mark(canvas, entry)
        for entry, place in zip(entries, places, strict=True):
            self._error_bar(canvas, entry)
            self._leader(canvas, self.y_of(entry.distance_m or 0.0), -place)
            self._label(canvas, entry, -place)

    def _mark(self, canvas: Canvas, entry: Entry) -> None:
        """Draw the mark of an entry on the wall."""
        y = self.y_of(entry.distance_m or 0.0)
        left, right = _STRIP
        canvas.setStrokeColor(INK)
        canvas.setFillColor(SEVERITY.get(entry.tag.severity or 0, WASH))
        canvas.setLineWidth(0.4)
        spans = clock_spans(entry.clock_from, entry.tag.clock_to)
        if not spans:
            canvas.setDash(0.8, 0.8)
            canvas.line(left, y, right, y)
            canvas.setDash()
        for low, high in spans:
            x, width = left + low * (right - left), (high - low) * (right - left)
            if width:
                canvas.rect(x, y - 0.8 * mm, width, 1.6 * mm, 1, 1)
            else:
                canvas.circle(x, y, 1.2 * mm, 1, 1)

    def _error_bar(self, canvas: Canvas, entry: Entry) -> None:
        """Draw the 95 % interval, to the scale of the page."""
        if entry.u95_m is None:
            return
        y, half = self.y_of(entry.distance_m or 0.0), entry.u95_m * self.points_per_m
        x = _BRACKET + _LANES * _LANE - 0.6 * mm
        upper, lower = min(y + half, self.top), max(y - half, self.bottom)
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.6)
        canvas.line(x, lower, x, upper)
        for end in (lower, upper):
            canvas.line(x - 0.7 * mm, end, x + 0.7 * mm, end)

    def _leader(self, canvas: Canvas, y: float, label_y: float) -> None:
        canvas.setStrokeColor(SOFT)
        canvas.setLineWidth(0.35)
        path = canvas.beginPath()
        path.moveTo(_STRIP[1], y)
        path.lineTo(_ELBOWS[0], y)
        path.lineTo(_ELBOWS[1], label_y)
        canvas.drawPath(path, 1, 0)

    def _label(self, canvas: Canvas, entry: Entry, y: float) -> None:
        t = self.t
        x, base = _LABELS, y - 0.9 * mm
        draw_badge(canvas, x, y - 1.7 * mm, entry.tag.severity)
        stretch = t.stretch(entry)
        texts = [
            None,
            (str(entry.number), CELL.soft()),
            (t.short_place(entry), CELL.bold()),
            (t.code(entry), CELL),
            (t.clock(entry), CELL),
            ((f"{stretch} " if stretch else "") + t.label(entry), CELL),
        ]
        for text, (_, width) in zip(texts, self._columns(), strict=True):
            if text is not None:
                draw(canvas, x, base, shortened(text[0], text[1], width - 1 * mm), text[1])
            x += width

    def _legend(self, canvas: Canvas) -> None:
        t = self.t
        scale = t("graphic.scale", scale=f"{self.scale:,}".replace(",", " "))
        shown = t(
            "graphic.window",
            first=t.length(self.sheet.first_m),
            last=t.length(self.sheet.last_m),
        )
        if self.sheet.parts > 1:
            shown += " · " + t("graphic.part", part=self.sheet.part, parts=self.sheet.parts)
        draw(canvas, 0, 7.2 * mm, one_line(f"{scale} · {shown}"), SMALL.bold())
        hints = [t("graphic.legend")]
        if water_share(self.report):
            hints.append(t("graphic.water"))
        if self.report.joints:
            hints.append(t("graphic.joints"))
        if self.report.expected_joints:
            hints.append(t("graphic.expected_joints"))
        untracked = sum(entry.distance_m is None for entry in self.report.entries)
        if untracked:
            hints.append(t("graphic.untracked", n=untracked))
        for n, line in enumerate(lines_of(" ".join(hints), TINY.soft(), WIDTH)[:2]):
            draw(canvas, 0, (3.6 - 2.6 * n) * mm, line.text, line.style)


def _in_lanes(stretches: Sequence[Stretch]) -> list[tuple[int, Stretch]]:
    """Arrange overlapping stretches side by side; beyond the last lane they share it."""
    ends: list[float] = []
    found = []
    for stretch in sorted(stretches, key=lambda stretch: stretch.start.distance_m or 0.0):
        start_m, finish_m = stretch.start.distance_m or 0.0, stretch.finish.distance_m or 0.0
        lane = next((n for n, end in enumerate(ends) if end < start_m - SAME_M), len(ends))
        lane = min(lane, _LANES - 2)
        ends[lane:] = [
            max(finish_m, ends[lane] if lane < len(ends) else finish_m),
            *ends[lane + 1 :],
        ]
        found.append((lane, stretch))
    return found
