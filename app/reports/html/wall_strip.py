"""The unrolled wall as rows of inline SVG to scale, with links to the observations."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

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
from app.reports.html.links import to_row
from app.reports.html.svg import INK, SOFT, escaped, line, rect, severity_fill, text_at
from app.reports.report import Entry, Report
from app.survey.rounding import decimals
from app.survey.spans import SAME_M, SAME_MM, Span

MOST_BYTES = 6 * 2**20
"""Bytes of all pictures of the wall together, before base64, above which they are reduced."""

_LEFT, _WIDTH, _END = 34, 930, 1000
_HIGHEST = 460
_MOST_ROWS = 30
_ROWS_M = (2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
_HEAD, _LANE, _BADGE, _FOOT = 24, 14, 22, 40
_LANES = 2
_HALF_BOX = 9
_HALO = "#ffffff"
_SEAM = 0.8
"""Pictures overlap by so much, as browsers smooth their edges."""


@dataclass(frozen=True)
class WallStrips:
    """The drawing, and what to say about it."""

    rows: tuple[Markup, ...]
    sentences: tuple[str, ...]


def wall_strips(report: Report, t: Translator) -> WallStrips | None:
    """Draw the seen wall; None if nothing was seen."""
    wall = wall_of(report)
    if wall is None:
        return None
    row_m = next((row_m for row_m in _ROWS_M if _is_fit(wall, row_m)), _ROWS_M[-1])
    total = sum(tile.size for tile in wall.tiles)
    times = math.ceil(math.sqrt(total / MOST_BYTES)) if total > MOST_BYTES else 1
    sentences = [t("web.wall_help")]
    if times > 1:
        sentences.append(t("web.wall_reduced", times=times))
    sentences += remarks_on(report, wall, t)
    rows = tuple(
        Markup(_Row(report, t, wall, span_m, row_m, times, n).drawn())  # noqa: S704  (escaped)
        for n, span_m in enumerate(_spans(wall, row_m))
    )
    return WallStrips(rows, tuple(sentences))


def _is_fit(wall: Wall, row_m: float) -> bool:
    high = (wall.arc_mm[1] - wall.arc_mm[0]) / 1000 / row_m * _WIDTH
    return high <= _HIGHEST and (wall.span_m[1] - wall.span_m[0] <= _MOST_ROWS * row_m + SAME_M)


def _spans(wall: Wall, row_m: float) -> list[Span]:
    """Divide the wall into rows that end between two pictures, so that each is in the file once;
    in a gap, a row ends anywhere.
    """
    borders_m = [tile.span_m[0] for tile in wall.tiles]
    first_m, last_m = wall.span_m
    spans: list[Span] = []
    while first_m < last_m - SAME_M:
        wanted_m = first_m + row_m
        inside = [b for b in borders_m if wanted_m - row_m / 2 < b <= wanted_m + SAME_M]
        end_m = last_m if wanted_m >= last_m - SAME_M else max(inside, default=wanted_m)
        spans.append((first_m, end_m))
        first_m = end_m
    return spans


class _Row:
    """A part of the wall with its distances, joints and observations."""

    def __init__(
        self,
        report: Report,
        t: Translator,
        wall: Wall,
        span_m: Span,
        row_m: float,
        times: int,
        number: int,
    ) -> None:
        self.report = report
        self.t = t
        self.wall = wall
        self.times = times
        self.number = number
        self.span_m = span_m
        self.per_m = _WIDTH / row_m
        self.width = (self.span_m[1] - self.span_m[0]) * self.per_m
        self.high = (wall.arc_mm[1] - wall.arc_mm[0]) / 1000 * self.per_m
        self.marks = places_within(report, wall, self.span_m)
        self.stretches = stretches_within(report, self.span_m)
        self.rows = math.ceil(len(self.marks) / capacity(_BADGE, _LEFT, _LEFT + _WIDTH))
        self.lanes = min(len(self.stretches), _LANES)
        self.top = _HEAD + self.rows * _BADGE + self.lanes * _LANE
        self.bottom = self.top + self.high

    def x(self, distance_m: float) -> float:
        """Return the horizontal position, px."""
        return _LEFT + (distance_m - self.span_m[0]) * self.per_m

    def y(self, arc_mm: float) -> float:
        """Return the vertical position: what is left of the camera is above."""
        return self.top + (arc_mm - self.wall.arc_mm[0]) / 1000 * self.per_m

    def drawn(self) -> str:
        """Return the row."""
        t = self.t
        first, last = map(t.length, self.span_m)
        numbers = ", ".join(str(entry.seq) for entry, _ in self.marks) or "–"
        joints = joints_within(self.report, self.span_m)
        label = t("web.wall_row", first=first, last=last, joints=len(joints), numbers=numbers)
        whole = self.bottom + _FOOT
        shapes = [
            *self._pictures(), *self._gaps(), *self._joints(),
            rect(_LEFT, self.top, self.width, self.high, "none", INK),
            *self._clock(), *self._distances(), *self._stretches(), *self._marks(), *self._head(),
        ]  # fmt: skip
        return (
            f'<svg class="wall-row" viewBox="0 0 {_END} {whole:.0f}" role="group" '
            f'aria-label="{escaped(label)}" font-family="system-ui, sans-serif" '
            f'xmlns="http://www.w3.org/2000/svg">\n' + "\n".join(shapes) + "\n</svg>"
        )

    def _clipped(self, shapes: Sequence[str], name: str) -> list[str]:
        mark = f"wall-{name}-{self.number}"
        frame = rect(_LEFT, self.top, self.width, self.high, "none")
        clip = f'<clipPath id="{mark}">{frame}</clipPath>'
        return [clip, f'<g clip-path="url(#{mark})">', *shapes, "</g>"]

    def _pictures(self) -> list[str]:
        layout = self.wall.layout
        upper = self.y(layout.arc_from_mm)
        high = self.y(layout.arc_to_mm) - upper
        shapes = []
        enough_px = max(max(layout.width_px, layout.height_px) // self.times, 1)
        for tile in self.wall.within(self.span_m):
            picture = jpeg_of(tile.jpeg, enough_px) if tile.seen_m else None
            if picture is not None:
                left, right = map(self.x, tile.span_m)
                content = base64.b64encode(picture.content).decode()
                shapes.append(
                    f'<image x="{left:.2f}" y="{upper:.2f}" width="{right - left + _SEAM:.2f}" '
                    f'height="{high:.2f}" preserveAspectRatio="none" '
                    f'href="data:image/jpeg;base64,{content}"/>'
                )
        return self._clipped(shapes, "pictures")

    def _gaps(self) -> list[str]:
        gaps = self.wall.gaps(self.span_m)
        if not gaps:
            return []
        mark = f"wall-hatch-{self.number}"
        shapes = [
            f'<pattern id="{mark}" width="8" height="8" patternUnits="userSpaceOnUse" '
            f'patternTransform="rotate(45)"><rect width="8" height="8" fill="#ffffff"/>'
            f'<path d="M0 0V8" stroke="{SOFT}"/></pattern>'
        ]
        for low_m, high_m in gaps:
            left, right = self.x(low_m), self.x(high_m)
            middle, y = (left + right) / 2, self.top + self.high / 2
            shapes.append(rect(left, self.top, right - left, self.high, f"url(#{mark})", SOFT))
            if right - left > 90:
                shapes += [
                    rect(middle - 42, y - 11, 84, 20, "#ffffff"),
                    text_at(middle, y + 4, self.t("wall.not_seen"), INK, "middle", size=12),
                ]
        return shapes

    def _joints(self) -> list[str]:
        shapes = []
        for joint in joints_within(self.report, self.span_m):
            x = self.x(joint.distance_m)
            dash = "none" if joint.is_seen else "6 4"
            shapes += [
                line(x, self.top, x, self.bottom, colour, dash=dash, width=width)
                for colour, width in ((_HALO, 3), (INK, 1.2))
            ]
            if joint.number is not None:
                name = f"J{joint.number}"
                shapes.append(text_at(x, self.bottom + 34, name, INK, "middle", size=12))
        return shapes

    def _clock(self) -> list[str]:
        low, high = self.wall.arc_mm
        shapes, last_y = [], -math.inf
        for name, arc_mm in clock_places(self.report, feet=self.t.units == "ft"):
            if low - 1 <= arc_mm <= high + 1:
                y = self.y(arc_mm)
                end = _LEFT + self.width
                shapes += [line(_LEFT - 5, y, _LEFT, y, INK), line(end, y, end + 5, y, INK)]
                if y - last_y >= 13:
                    shapes.append(text_at(_LEFT - 8, y + 4, name, SOFT, "end", size=12))
                    last_y = y
        return shapes

    def _distances(self) -> list[str]:
        step_m = tick_step_m(self.t, self.per_m, 80)
        digits = tick_digits(self.t, step_m)
        shapes = []
        for distance_m in Axis(*self.span_m).ticks(step_m):
            x = self.x(distance_m)
            text = f"{decimals(distance_m, digits, unit=self.t.per_unit_m)} {self.t.units}"
            shapes += [
                line(x, self.bottom, x, self.bottom + 5, INK),
                text_at(x, self.bottom + 18, text, SOFT, "middle", size=12),
            ]
        return shapes

    def _stretches(self) -> list[str]:
        shapes = []
        for number, (low_m, high_m) in self.stretches:
            left, right = (self.x(min(max(m, self.span_m[0]), self.span_m[1]))
                           for m in (low_m, high_m))  # fmt: skip
            y = self.top - 6 - ((number - 1) % _LANES) * _LANE * (self.lanes > 1)
            shapes.append(line(left, y, right, y, INK, width=3))
            if right - left > 100:
                middle = (left + right) / 2
                shapes += [
                    rect(middle - 45, y - 6, 90, 12, "#ffffff"),
                    text_at(middle, y + 4, self.t("wall.stretch", n=number), INK, "middle",
                            size=11),
                ]  # fmt: skip
        return shapes

    def _marks(self) -> list[str]:
        shapes: list[str] = []
        for row in range(self.rows):
            marks = self.marks[row :: self.rows]
            wanted = [self.x(entry.distance_m or 0.0) for entry, _ in marks]
            places = spread(wanted, _BADGE, _LEFT, _LEFT + _WIDTH)
            y = self.top - self.lanes * _LANE - 12 - row * _BADGE
            for (entry, place), x in zip(marks, places, strict=True):
                shapes += [*self._lines(entry, place, x, y), self._badge(entry, x, y)]
        return shapes

    def _lines(self, entry: Entry, place: Place, badge_x: float, badge_y: float) -> list[str]:
        x = self.x(entry.distance_m or 0.0)
        shapes = [line(badge_x, badge_y, x, self.top, INK)]
        boxes = self._boxes(place)
        if not boxes:
            return [*shapes, line(x, self.top, x, self.bottom, INK, dash="4 3")]
        upper = min(y for _, y, _, _ in boxes)
        for colour, width in ((_HALO, 4), (INK, 1.5)):
            shapes.append(line(x, self.top, x, max(upper, self.top), colour, width=width))
            shapes += [
                f'<rect x="{left:.1f}" y="{y:.1f}" width="{wide:.1f}" height="{high:.1f}" '
                f'fill="none" stroke="{colour}" stroke-width="{width:g}"/>'
                for left, y, wide, high in boxes
            ]
        drawn = [
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width:g}"/>'
            for colour, width in ((INK, 4), (_HALO, 1.5))
            for points in (
                " ".join(f"{self.x(m):.1f},{self.y(mm):.1f}" for m, mm in outline)
                for outline in place.outlines
            )
        ]
        name = f"outlines-{entry.seq}"
        return [*shapes, *(self._clipped(drawn, name) if drawn else [])]

    def _boxes(self, place: Place) -> list[tuple[float, float, float, float]]:
        """Return boxes around the seen parts of the place: left, top, width, height."""
        low_mm, high_mm = self.wall.arc_mm
        left = max(self.x(place.along_m[0]) - _HALF_BOX, _LEFT)
        right = min(self.x(place.along_m[1]) + _HALF_BOX, _LEFT + self.width)
        boxes = []
        for span in place.around_mm:
            if span[1] >= low_mm - SAME_MM and span[0] <= high_mm + SAME_MM:
                upper = max(self.y(max(span[0], low_mm)) - _HALF_BOX, self.top)
                lower = min(self.y(min(span[1], high_mm)) + _HALF_BOX, self.bottom)
                boxes.append((left, upper, right - left, lower - upper))
        return boxes

    def _badge(self, entry: Entry, x: float, y: float) -> str:
        severity = entry.tag.severity
        ink = "#ffffff" if severity is not None and severity >= 4 else INK
        name = f"{entry.seq}: {self.t.short_place(entry)} {self.t.code(entry)}"
        badge = (
            f"<title>{escaped(name)}</title>"
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="10" '
            f'fill="{severity_fill(severity, "#f1f4f6")}" stroke="{INK}"/>'
            f"{text_at(x, y + 4, str(entry.seq), ink, 'middle', size=12, weight=600)}"
        )
        return to_row(self.report, entry, Markup(badge), label=name)  # noqa: S704

    def _head(self) -> list[str]:
        first, last = map(self.t.length, self.span_m)
        length_m = tick_step_m(self.t, self.per_m, 100)
        right = _LEFT + _WIDTH - 50
        left = right - length_m * self.per_m
        return [
            text_at(_LEFT, 14, self.t("wall.strip", first=first, last=last), INK, weight=600),
            rect(left, 6, right - left, 6, "#ffffff", INK),
            rect(left, 6, (right - left) / 2, 6, INK),
            text_at(right + 6, 13, f"{length_m / self.t.per_unit_m:g} {self.t.units}", INK,
                    size=12),
        ]  # fmt: skip
