"""The pipe from start to end, to scale, with a label for every observation in full."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise

from app.reports.content.translator import NOTHING, Translator
from app.reports.drawings import svg
from app.reports.drawings.axis import Axis, tick_step_m
from app.reports.drawings.cut_pipe import clock_spans, water_share
from app.reports.drawings.placement import spread
from app.reports.drawings.seen_wall import joints_within
from app.reports.drawings.svg import Drawing, to_row
from app.reports.report import Entry, Report, Stretch
from app.survey.places.spans import SAME_M, Span, is_within, overlap

SCALES = (
    20, 25, 40, 50, 75, 100, 125, 150, 200, 250, 300, 400, 500, 750, 1000, 1500, 2000, 2500, 5000,
    10_000, 20_000, 50_000, 100_000,
)  # fmt: skip
"""Denominators of the scale on paper."""
MOST_SHEETS = 8
"""The scale is the finest that needs no more sheets, or a finer one where labels need them."""
COARSEST = 250
"""Coarsest scale where that many sheets suffice."""
PAGE_MM = 205.0
"""Height of the pipe on a sheet."""

_PER_M, _LEAST, _MOST = 6.0, 70.0, 1000.0
"""Height of a metre in the drawing of the whole pipe, and the least and the largest height."""
_HEAD, _FOOT = 8.0, 8.0
_LINE = svg.LEADING * svg.SMALL
_BETWEEN = 1.2
"""Room between labels."""
_EDGE, _SHARE = 15.0, 0.16
"""Left edge of the wall, and its share of the width."""
_LANE, _LANES = 2.2, 3
"""Brackets of overlapping stretches side by side, before the bar of the interval."""


@dataclass(frozen=True)
class _Label:
    """What is written about an entry."""

    entry: Entry
    facts: list[str]
    meaning: list[str]
    is_stacked: bool
    """Whether the meaning is below the facts; otherwise it is beside them."""

    @property
    def height(self) -> float:
        """Height with the room to the next label."""
        both = len(self.facts), len(self.meaning)
        return (sum(both) if self.is_stacked else max(both)) * _LINE + _BETWEEN


@dataclass(frozen=True)
class Sheet:
    """A window of the pipe, and the entries whose labels fit there."""

    span_m: Span
    labels: tuple[_Label, ...]
    part: int = 1
    """Number among the sheets of the same window."""
    parts: int = 1


def whole_pipe(report: Report, t: Translator, width_mm: float = svg.WIDTH) -> Drawing:
    """Draw the pipe on one sheet, as high as it needs."""
    axis = Axis.of(report)
    labels = _labels(report, t, width_mm)
    needed = sum(label.height for label in labels) + _LINE
    height = max(min(max(_PER_M * axis.length_m, _LEAST), _MOST), needed)
    sheet = Sheet((axis.first_m, axis.last_m), tuple(labels))
    per_m = height / axis.length_m
    return _Painter(report, t, sheet, width_mm, height, per_m).drawing(foot="")


def pipe_sheets(report: Report, t: Translator) -> list[Drawing]:
    """Draw the pipe on sheets of one scale, each as high as a page."""
    scale, sheets = laid_out(report, t)
    drawings = []
    for sheet in sheets:
        first, last = map(t.length, sheet.span_m)
        foot = [
            t("graphic.scale", scale=f"{scale:,}".replace(",", "\u202f")),
            t("graphic.window", first=first, last=last),
        ]
        if sheet.parts > 1:
            foot.append(t("graphic.part", part=sheet.part, parts=sheet.parts))
        painter = _Painter(report, t, sheet, svg.WIDTH, PAGE_MM, 1000 / scale)
        drawings.append(painter.drawing(foot=" · ".join(foot)))
    return drawings


def legend(report: Report, t: Translator) -> str:
    """Explain the marks that the graphic has."""
    untracked = sum(entry.distance_m is None for entry in report.entries)
    explained = {
        "legend": True,
        "water": water_share(report),
        "joints": report.joints,
        "expected_joints": report.expected_joints,
        "untracked": untracked,
    }
    return " ".join(t(f"graphic.{key}", n=untracked) for key, has in explained.items() if has)


def laid_out(report: Report, t: Translator) -> tuple[int, list[Sheet]]:
    """Return the scale that needs the fewest sheets, the coarsest of equals, and its sheets.

    A sheet that repeats a part of the pipe, for labels that did not fit, counts twice: where
    observations are dense, a finer scale is easier to read.
    """
    axis, labels = Axis.of(report), _labels(report, t, svg.WIDTH)
    windows = {scale: len(_windows(axis, scale)) for scale in SCALES}
    few = [scale for scale, n in windows.items() if n <= MOST_SHEETS] or list(SCALES[-1:])
    whole = next((scale for scale, n in windows.items() if n == 1), SCALES[-1])
    coarsest = min(max(COARSEST, few[0]), whole)
    found = [(scale, _sheets(axis, scale, labels)) for scale in few if scale <= coarsest]
    return min(found, key=lambda one: (sum(min(s.part, 2) for s in one[1]), -one[0]))


def _windows(axis: Axis, scale: int) -> list[Span]:
    window_m = PAGE_MM * scale / 1000
    count = max(1, math.ceil((axis.length_m - SAME_M) / window_m))
    starts_m = [axis.first_m + n * window_m for n in range(count)]
    return [(start_m, min(axis.last_m, start_m + window_m)) for start_m in starts_m]


def _sheets(axis: Axis, scale: int, labels: Sequence[_Label]) -> list[Sheet]:
    windows = _windows(axis, scale)
    groups: list[list[_Label]] = [[] for _ in windows]
    for label in labels:
        number = int(((label.entry.distance_m or 0.0) - axis.first_m) * 1000 / scale / PAGE_MM)
        groups[min(max(number, 0), len(windows) - 1)].append(label)
    sheets = []
    for span_m, group in zip(windows, groups, strict=True):
        chunks = list(_chunks(group))
        sheets += [Sheet(span_m, chunk, part, len(chunks)) for part, chunk in enumerate(chunks, 1)]
    return sheets


def _chunks(labels: Sequence[_Label]) -> Iterator[tuple[_Label, ...]]:
    """Yield as many labels as a sheet has room for; none at least once."""
    chunk: list[_Label] = []
    used = 0.0
    for label in labels:
        if chunk and used + label.height > PAGE_MM:
            yield tuple(chunk)
            chunk, used = [], 0.0
        chunk.append(label)
        used += label.height
    yield tuple(chunk)


def _labels(report: Report, t: Translator, width_mm: float) -> list[_Label]:
    is_stacked = width_mm < svg.WIDTH
    room = width_mm - _labels_at(width_mm)
    facts_room, meaning_room = (room, room - 10) if is_stacked else (0.47 * room, 0.53 * room)
    labels = []
    for entry in report.entries:
        if entry.distance_m is not None:
            facts = (t.short_place(entry), t.code(entry), t.clock_in_words(entry), t.stretch(entry))
            said = " · ".join(fact for fact in facts if fact)
            facts_lines = svg.wrapped(said, facts_room - 10, bold=True)
            meaning = svg.wrapped(t.label(entry), meaning_room)
            labels.append(_Label(entry, facts_lines, meaning, is_stacked))
    return labels


def _labels_at(width_mm: float) -> float:
    return _EDGE + _SHARE * width_mm + _LANE * (_LANES + 1) + 6


class _Painter:
    """Draws one sheet."""

    def __init__(
        self,
        report: Report,
        t: Translator,
        sheet: Sheet,
        width_mm: float,
        height_mm: float,
        per_m: float,
    ) -> None:
        self.report = report
        self.t = t
        self.sheet = sheet
        self.width = width_mm
        self.height = height_mm
        self.left, self.right = _EDGE, _EDGE + _SHARE * width_mm
        self.per_m = per_m

    def drawing(self, foot: str) -> Drawing:
        """Draw everything, from the bottom layer up."""
        first, last = map(self.t.length, self.sheet.span_m)
        bottom = _HEAD + self.height + _FOOT
        layers = (
            self._wall(), self._joints(), self._ticks(), self._nodes(), self._stretches(),
            self._entries(), [svg.text(0, bottom - 1, foot, bold=True)],
        )  # fmt: skip
        alt = self.t("alt.graphic", first=first, last=last, n=len(self.sheet.labels))
        return Drawing(self.width, bottom, alt, [*chain.from_iterable(layers)])

    def _y(self, distance_m: float) -> float:
        """Return the position down the sheet; what lies beyond the pipe is drawn at its end."""
        return _HEAD + (distance_m - self.sheet.span_m[0]) * self.per_m

    def _x(self, share: float) -> float:
        return self.left + share * (self.right - self.left)

    def _wall(self) -> Iterator[str]:
        """Draw the wall, cut along its crown: 12 at both edges, 6 in the middle."""
        top, bottom = map(self._y, self.sheet.span_m)
        across, wet = self.right - self.left, water_share(self.report)
        yield svg.rect(self.left, top, across, bottom - top, svg.WASH)
        yield svg.rect(self._x(0.5 - wet / 2), top, wet * across, bottom - top, svg.WATER)
        for share, hour in ((0, "12"), (0.25, "9"), (0.5, "6"), (0.75, "3"), (1, "12")):
            x = self._x(share)
            look = (svg.INK, 0.3) if hour == "12" else (svg.RULE, 0.1)
            yield svg.line((x, top), (x, bottom), *look)
            yield svg.text(x, 3, hour, svg.TINY, svg.SOFT, anchor="middle")

    def _ticks(self) -> Iterator[str]:
        step_m = max(tick_step_m(self.t, self.per_m, 4), self.t.per_unit_m)
        x = self.left - 6
        yield svg.text(x - 1, 3, self.t.units, svg.TINY, svg.SOFT, anchor="end")
        for distance_m in Axis(*self.sheet.span_m).ticks(step_m):
            y = self._y(distance_m)
            said = self.t.figure(distance_m / self.t.per_unit_m)
            yield svg.line((x, y), (x + 1.2, y))
            yield svg.text(x - 0.8, y + 0.8, said, anchor="end")
        yield svg.line((x + 1.2, _HEAD), (x + 1.2, self._y(self.sheet.span_m[1])))

    def _joints(self) -> Iterator[str]:
        """Draw seen joints as lines with their numbers, expected ones as dashes."""
        last_y = -math.inf
        for joint in joints_within(self.report, self.sheet.span_m):
            y = self._y(joint.distance_m)
            dash = "none" if joint.is_seen else "0.5 0.5"
            yield svg.line((self.left, y), (self.right, y), svg.SOFT, 0.2, dash=dash)
            if joint.number is not None and y - last_y >= 2.6:
                x, name = self.left - 0.6, f"J{joint.number}"
                yield svg.text(x, self._beside_nodes(y), name, svg.TINY, svg.SOFT, anchor="end")
                last_y = y

    def _beside_nodes(self, y: float) -> float:
        """Return the baseline of a joint's number, which the bar of a node must not cover."""
        for _, distance_m, side in self._ends():
            node_y = self._y(distance_m)
            if abs(y - node_y) < 1.8:
                return node_y + (2 if side < 0 else -0.4)
        return y + 0.7

    def _ends(self) -> tuple[tuple[str, float, int], ...]:
        """Return name and distance of each node, and the side of it on which its bar is."""
        axis = Axis.of(self.report)
        return ("start", max(axis.first_m, 0.0), -1), ("end", axis.last_m, 1)

    def _nodes(self) -> Iterator[str]:
        for end, distance_m, side in self._ends():
            if is_within(distance_m, self.sheet.span_m):
                y = self._y(distance_m)
                bar_y, name_y = (y - 1.3, y - 2) if side < 0 else (y, y + 3.6)
                across = self.right - self.left
                yield svg.rect(self.left - 2, bar_y, across + 4, 1.3, self.report.template.accent)
                name = str(self.report.header.get(f"{end}_node") or NOTHING)
                for said in svg.wrapped(name, across + 14, svg.TINY, bold=True)[:1]:
                    middle = self._x(0.5)
                    yield svg.text(middle, name_y, said, svg.TINY, bold=True, anchor="middle")

    def _stretches(self) -> Iterator[str]:
        for lane, (low_m, high_m), number in _in_lanes(self.report.stretches):
            if not overlap((low_m, high_m), self.sheet.span_m):
                continue
            x = self.right + 2.5 + lane * _LANE
            upper = self._y(max(low_m, self.sheet.span_m[0]))
            lower = self._y(min(high_m, self.sheet.span_m[1]))
            middle = (upper + lower) / 2
            yield svg.line((x, upper), (x, lower), svg.INK, 0.4)
            for y, end_m in ((upper, low_m), (lower, high_m)):
                if is_within(end_m, self.sheet.span_m):
                    yield svg.line((x - 1, y), (x, y), svg.INK, 0.4)
            yield svg.rect(x - 0.9, middle - 1.3, 1.8, 2.6, svg.PAPER)
            yield svg.text(x, middle + 0.8, str(number), svg.TINY, bold=True, anchor="middle")

    def _entries(self) -> Iterator[str]:
        labels = self.sheet.labels
        wanted = [self._y(label.entry.distance_m or 0.0) for label in labels]
        gaps = [(one.height + two.height) / 2 for one, two in pairwise(labels)]
        half = (labels[0].height / 2, labels[-1].height / 2) if labels else (0, 0)
        places = spread(wanted, gaps, _HEAD + half[0], _HEAD + self.height - half[1])
        for label in sorted(labels, key=lambda label: label.entry.tag.severity or 0):
            yield from self._mark(label.entry)  # the worst on top
        for label, y, place in zip(labels, wanted, places, strict=True):
            first_line = place - (label.height - _BETWEEN) / 2 + svg.SMALL
            yield from self._leader(label.entry, y, first_line - 0.75)
            yield to_row(self.report, label.entry, "".join(self._written(label, first_line)))

    def _mark(self, entry: Entry) -> Iterator[str]:
        y, fill = self._y(entry.distance_m or 0.0), svg.fill_of(entry.tag.severity)
        spans = clock_spans(entry.clock_from, entry.tag.clock_to)
        if not spans:
            yield svg.line((self.left, y), (self.right, y), svg.INK, 0.15, dash="0.4 0.4")
        for low, high in spans:
            if low == high:
                yield svg.circle((self._x(low), y), 1.2, fill)
            else:
                yield svg.rect(
                    self._x(low), y - 0.8, self._x(high) - self._x(low), 1.6, fill, svg.INK
                )

    def _leader(self, entry: Entry, y: float, place: float) -> Iterator[str]:
        """Draw the line to the label, and across it the 95 % interval, to scale."""
        x = self.right + 2.5 + _LANES * _LANE
        at = _labels_at(self.width)
        yield svg.path([(self.right, y), (x + 1.2, y), (at - 1, place)], svg.SOFT, 0.12)
        if entry.u95_m is not None:
            half = entry.u95_m * self.per_m
            upper, lower = max(y - half, _HEAD), min(y + half, _HEAD + self.height)
            yield svg.line((x, upper), (x, lower), svg.INK, 0.2)
            for end in (upper, lower):
                yield svg.line((x - 0.7, end), (x + 0.7, end), svg.INK, 0.2)

    def _written(self, label: _Label, y: float) -> Iterator[str]:
        x = _labels_at(self.width)
        yield svg.badge(x, y - 2.35, label.entry.tag.severity)
        yield svg.text(x + 8.6, y, str(label.entry.number), fill=svg.SOFT, anchor="end")
        for n, said in enumerate(label.facts):
            yield svg.text(x + 10, y + n * _LINE, said, bold=True)
        if label.is_stacked:
            x, y = x + 10, y + len(label.facts) * _LINE
        else:
            x += 0.47 * (self.width - x)
        for n, said in enumerate(label.meaning):
            yield svg.text(x, y + n * _LINE, said)


def _in_lanes(stretches: Sequence[Stretch]) -> list[tuple[int, Span, int]]:
    """Return lane, ends and number: overlapping stretches side by side; beyond the last lane they
    share it.
    """
    placed = sorted(
        ((min(ends), max(ends)), stretch.number)
        for stretch in stretches
        if (
            ends := [
                end.distance_m
                for end in (stretch.start, stretch.finish)
                if end.distance_m is not None
            ]
        )
        and len(ends) == 2
    )
    reached_m = [-math.inf] * _LANES
    found = []
    for (low_m, high_m), number in placed:
        lane = next((n for n, end_m in enumerate(reached_m) if end_m < low_m - SAME_M), _LANES - 1)
        reached_m[lane] = max(reached_m[lane], high_m)
        found.append((lane, (low_m, high_m), number))
    return found
