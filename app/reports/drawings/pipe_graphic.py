"""The pipe from start to end, to scale, with a label for every observation in full."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.cut_pipe import clock_spans, water_share
from app.reports.content.placement import spread
from app.reports.content.translator import NOTHING, Translator
from app.reports.drawings import svg
from app.reports.drawings.svg import Drawing
from app.reports.report import Entry, Report, Stretch
from app.survey.spans import SAME_M, Span, is_within, overlap

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
    enough = [scale for scale in SCALES if len(_windows(axis, scale)) <= MOST_SHEETS]
    limit = max(COARSEST, min(enough, default=SCALES[-1]))
    whole = min((scale for scale in SCALES if len(_windows(axis, scale)) == 1), default=limit)
    coarsest = min(limit, whole)
    best = coarsest, _sheets(axis, coarsest, labels)
    for scale in (scale for scale in reversed(SCALES) if scale < coarsest):
        if len(_windows(axis, scale)) > _burden(best[1]):
            break  # the windows alone need more sheets
        sheets = _sheets(axis, scale, labels)
        if _burden(sheets) < _burden(best[1]):
            best = scale, sheets
    return best


def _burden(sheets: Sequence[Sheet]) -> int:
    return sum(1 if sheet.part == 1 else 2 for sheet in sheets)


def _windows(axis: Axis, scale: int) -> list[Span]:
    """Return the parts of the pipe that a sheet each shows."""
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
    """Write the labels of all entries with a distance."""
    is_stacked = width_mm < svg.WIDTH
    room = width_mm - _labels_at(width_mm)
    facts_room, meaning_room = (room, room) if is_stacked else (0.47 * room, 0.53 * room)
    labels = []
    for entry in report.entries:
        if entry.distance_m is not None:
            facts = (t.short_place(entry), t.code(entry), t.clock_in_words(entry), t.stretch(entry))
            said = " · ".join(fact for fact in facts if fact)
            labels.append(
                _Label(
                    entry,
                    svg.wrapped(said, facts_room - 10, bold=True),
                    svg.wrapped(t.label(entry), meaning_room - (10 if is_stacked else 0)),
                    is_stacked,
                )
            )
    return labels


def _labels_at(width_mm: float) -> float:
    """Return where labels begin."""
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
        t = self.t
        first, last = map(t.length, self.sheet.span_m)
        bottom = _HEAD + self.height + _FOOT
        shapes = [
            *self._wall(),
            *self._joints(),
            *self._ticks(),
            *self._nodes(),
            *self._stretches(),
            *self._entries(),
            svg.text(0, bottom - 1, foot, bold=True),
        ]
        alt = t("alt.graphic", first=first, last=last, n=len(self.sheet.labels))
        return Drawing(self.width, bottom, alt, shapes)

    def _y(self, distance_m: float) -> float:
        """Return the position down the sheet; what lies beyond the pipe is drawn at its end."""
        return _HEAD + (distance_m - self.sheet.span_m[0]) * self.per_m

    def _x(self, share: float) -> float:
        return self.left + share * (self.right - self.left)

    def _wall(self) -> list[str]:
        """Draw the wall, cut along its crown: 12 at both edges, 6 in the middle."""
        top, bottom = map(self._y, self.sheet.span_m)
        wet = water_share(self.report)
        hours = ((0, "12"), (0.25, "9"), (0.5, "6"), (0.75, "3"), (1, "12"))
        return [
            svg.rect(self.left, top, self.right - self.left, bottom - top, svg.WASH),
            svg.rect(
                self._x(0.5 - wet / 2), top, self._x(wet) - self.left, bottom - top, svg.WATER
            ),
            *(
                svg.line(
                    (self._x(share), top),
                    (self._x(share), bottom),
                    svg.INK if share in (0, 1) else svg.RULE,
                    0.3 if share in (0, 1) else 0.1,
                )
                for share, _ in hours
            ),
            *(
                svg.text(self._x(share), 3, hour, svg.TINY, svg.SOFT, anchor="middle")
                for share, hour in hours
            ),
        ]

    def _ticks(self) -> list[str]:
        step_m = max(tick_step_m(self.t, self.per_m, 4), self.t.per_unit_m)
        x = self.left - 6
        shapes = [svg.text(x - 1, 3, self.t.units, svg.TINY, svg.SOFT, anchor="end")]
        for distance_m in Axis(*self.sheet.span_m).ticks(step_m):
            y = self._y(distance_m)
            said = self.t.figure(distance_m / self.t.per_unit_m)
            shapes += [
                svg.line((x, y), (x + 1.2, y)),
                svg.text(x - 0.8, y + 0.8, said, anchor="end"),
            ]
        return [*shapes, svg.line((x + 1.2, _HEAD), (x + 1.2, self._y(self.sheet.span_m[1])))]

    def _joints(self) -> list[str]:
        """Draw seen joints as lines with their numbers, expected ones as dashes."""
        shapes = []
        last_y = -math.inf
        for joint in self.report.joints:
            if is_within(joint.distance_mm / 1000, self.sheet.span_m):
                y = self._y(joint.distance_mm / 1000)
                shapes.append(svg.line((self.left, y), (self.right, y), svg.SOFT, 0.2))
                if joint.number is not None and y - last_y >= 2.6:
                    beside = self._beside_nodes(y)
                    name = f"J{joint.number}"
                    shapes.append(
                        svg.text(self.left - 0.6, beside, name, svg.TINY, svg.SOFT, anchor="end")
                    )
                    last_y = y
        for expected in self.report.expected_joints:
            if is_within(expected.distance_mm / 1000, self.sheet.span_m):
                y = self._y(expected.distance_mm / 1000)
                shapes.append(
                    svg.line((self.left, y), (self.right, y), svg.SOFT, 0.2, dash="0.5 0.5")
                )
        return shapes

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

    def _nodes(self) -> list[str]:
        shapes = []
        accent = self.report.template.accent
        for end, distance_m, side in self._ends():
            if is_within(distance_m, self.sheet.span_m):
                y = self._y(distance_m)
                name = str(self.report.header.get(f"{end}_node") or NOTHING)
                names = svg.wrapped(name, self.right - self.left + 14, svg.TINY, bold=True)[:1]
                shapes += [
                    svg.rect(
                        self.left - 2,
                        y + (-1.3 if side < 0 else 0),
                        self.right - self.left + 4,
                        1.3,
                        accent,
                    ),
                    *(
                        svg.text(
                            self._x(0.5),
                            y + (-2 if side < 0 else 3.6),
                            said,
                            svg.TINY,
                            bold=True,
                            anchor="middle",
                        )
                        for said in names
                    ),
                ]
        return shapes

    def _stretches(self) -> list[str]:
        shapes = []
        for lane, (low_m, high_m), number in _in_lanes(self.report.stretches):
            if not overlap((low_m, high_m), self.sheet.span_m):
                continue
            x = self.right + 2.5 + lane * _LANE
            upper = self._y(max(low_m, self.sheet.span_m[0]))
            lower = self._y(min(high_m, self.sheet.span_m[1]))
            ends = [(upper, low_m), (lower, high_m)]
            middle = (upper + lower) / 2
            shapes += [
                svg.line((x, upper), (x, lower), svg.INK, 0.4),
                *(
                    svg.line((x - 1, y), (x, y), svg.INK, 0.4)
                    for y, end_m in ends
                    if is_within(end_m, self.sheet.span_m)
                ),
                svg.rect(x - 0.9, middle - 1.3, 1.8, 2.6, svg.PAPER),
                svg.text(x, middle + 0.8, str(number), svg.TINY, bold=True, anchor="middle"),
            ]
        return shapes

    def _entries(self) -> list[str]:
        labels = self.sheet.labels
        wanted = [self._y(label.entry.distance_m or 0.0) for label in labels]
        gaps = [(one.height + two.height) / 2 for one, two in pairwise(labels)]
        half = (labels[0].height / 2, labels[-1].height / 2) if labels else (0, 0)
        places = spread(wanted, gaps, _HEAD + half[0], _HEAD + self.height - half[1])
        worst_on_top = sorted(labels, key=lambda label: label.entry.tag.severity or 0)
        shapes = [shape for label in worst_on_top for shape in self._mark(label.entry)]
        for label, y, place in zip(labels, wanted, places, strict=True):
            first_line = place - (label.height - _BETWEEN) / 2 + svg.SMALL
            shapes += self._leader(label.entry, y, first_line - 0.75)
            shapes.append(self._written(label, first_line))
        return shapes

    def _mark(self, entry: Entry) -> Iterator[str]:
        """Draw the mark of an entry on the wall."""
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

    def _written(self, label: _Label, y: float) -> str:
        """Write a label, which leads to its row."""
        x = _labels_at(self.width)
        beside = x + 0.47 * (self.width - x)
        meaning_at = (x + 10, len(label.facts) * _LINE) if label.is_stacked else (beside, 0.0)
        shapes = [
            svg.badge(x, y - 2.35, label.entry.tag.severity),
            svg.text(x + 8.6, y, str(label.entry.number), fill=svg.SOFT, anchor="end"),
            *(
                svg.text(x + 10, y + n * _LINE, said, bold=True)
                for n, said in enumerate(label.facts)
            ),
            *(
                svg.text(meaning_at[0], y + meaning_at[1] + n * _LINE, said)
                for n, said in enumerate(label.meaning)
            ),
        ]
        return svg.to_row(self.report, label.entry, "".join(shapes))


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
