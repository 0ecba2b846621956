"""The pipe from its zero to its far end as an inline SVG, to scale, with every entry."""

from __future__ import annotations

from markupsafe import Markup, escape

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.placement import spread
from app.reports.content.text import legible
from app.reports.content.translator import Translator
from app.reports.pdf.pipe_graphic import clock_spans, water_share
from app.reports.report import Entry, Report

_WIDTH = 1000
_TOP, _BOTTOM = 24, 24
_PIPE_LEFT, _PIPE_RIGHT = 90, 290
_LABELS = 400
_LINE = 22
"""Distance between labels."""
_LEAST = 420.0
"""Least height of the drawn pipe, px."""
_MOST = 6000.0
"""Largest height of the drawn pipe, px."""
_PX_PER_M = 36.0
_LANE = 12
_LANES = 4
_LONGEST_LABEL = 86

_INK, _SOFT, _RULE, _WASH, _WATER = "#17212b", "#4a5761", "#c2cbd2", "#f1f4f6", "#d3e3ec"
_FILLS = ("#ffffff", "#e4ecef", "#f3de9b", "#ecae4b", "#b04e1e", "#8a1713")


def pipe_strip(report: Report, t: Translator) -> Markup:
    """Draw the wall cut along its crown: 12 o'clock at both edges, 6 in the middle."""
    return Markup(_Strip(report, t).drawn())  # noqa: S704  (escaped text by text)


class _Strip:
    def __init__(self, report: Report, t: Translator) -> None:
        self.report = report
        self.t = t
        self.axis = Axis.of(report)
        self.placed = [entry for entry in report.entries if entry.distance_m is not None]
        wanted = max(_PX_PER_M * self.axis.length_m, _LINE * (len(self.placed) + 1), _LEAST)
        self.height = min(wanted, max(_MOST, _LINE * (len(self.placed) + 1)))

    def y(self, distance_m: float) -> float:
        """Convert to px; places beyond the axis are drawn at its end."""
        inside_m = min(max(distance_m, self.axis.first_m), self.axis.last_m)
        return _TOP + (inside_m - self.axis.first_m) / self.axis.length_m * self.height

    def drawn(self) -> str:
        """Return picture and legend."""
        t = self.t
        hints = [t("graphic.legend")]
        if water_share(self.report):
            hints.append(t("graphic.water"))
        if self.report.joints:
            hints.append(t("graphic.joints"))
        if self.report.expected_joints:
            hints.append(t("graphic.expected_joints"))
        if untracked := len(self.report.entries) - len(self.placed):
            hints.append(t("graphic.untracked", n=untracked))
        whole = self.height + _TOP + _BOTTOM
        description = t("web.strip", n=len(self.placed), end=t.length(self.axis.last_m))
        shapes = [
            *self._pipe(), *self._ticks(), *self._joints(), *self._stretches(), *self._entries(),
        ]  # fmt: skip
        return (
            f'<svg class="strip" viewBox="0 0 {_WIDTH} {whole:.0f}" role="group" '
            f'aria-label="{_e(description)}" font-family="system-ui, sans-serif" font-size="13" '
            f'xmlns="http://www.w3.org/2000/svg">\n' + "\n".join(shapes) + "\n</svg>"
            f"<p>{_e(' '.join(hints))}</p>"
        )

    def _pipe(self) -> list[str]:
        top, width = _TOP, _PIPE_RIGHT - _PIPE_LEFT
        shapes = [_rect(_PIPE_LEFT, top, width, self.height, _WASH, _INK)]
        share = water_share(self.report)
        if share:
            middle = (_PIPE_LEFT + _PIPE_RIGHT) / 2
            left, wet = middle - share * width / 2, share * width
            shapes.append(_rect(left, top, wet, self.height, _WATER))
        shapes += [
            _text(_PIPE_LEFT + share * width, top - 8, label, _SOFT, "middle", size=11)
            for share, label in ((0, "12"), (0.25, "9"), (0.5, "6"), (0.75, "3"), (1, "12"))
        ]
        return shapes

    def _ticks(self) -> list[str]:
        step_m = tick_step_m(self.t, self.height / self.axis.length_m, 24)
        shapes = []
        for distance_m in self.axis.ticks(step_m):
            y = self.y(distance_m)
            label = f"{distance_m / self.t.per_unit_m:g}"
            shapes += [
                _line(_PIPE_LEFT - 8, y, _PIPE_LEFT, y, _SOFT),
                _text(_PIPE_LEFT - 12, y + 4, label, _INK, "end"),
            ]
        return [*shapes, _text(_PIPE_LEFT - 12, _TOP - 8, self.t.units, _SOFT, "end", size=11)]

    def _joints(self) -> list[str]:
        shapes = []
        for joint in self.report.joints:
            y = self.y(joint.distance_mm / 1000)
            shapes.append(_line(_PIPE_LEFT, y, _PIPE_RIGHT, y, _SOFT))
            if joint.number is not None:
                shapes.append(_text(_PIPE_RIGHT + 4, y + 4, f"J{joint.number}", _SOFT, size=10))
        expected = [self.y(joint.distance_mm / 1000) for joint in self.report.expected_joints]
        shapes += [_line(_PIPE_LEFT, y, _PIPE_RIGHT, y, _RULE, dash="4 4") for y in expected]
        return shapes

    def _stretches(self) -> list[str]:
        shapes = []
        for stretch in self.report.stretches:
            start_m, finish_m = stretch.start.distance_m, stretch.finish.distance_m
            if start_m is None or finish_m is None:
                continue
            x = _PIPE_RIGHT + 30 + _LANE * ((stretch.number - 1) % _LANES)
            low, high = sorted((self.y(start_m), self.y(finish_m)))
            shapes += [
                f'<path d="M{x - 5} {low:.1f}H{x}V{high:.1f}H{x - 5}" fill="none" '
                f'stroke="{_INK}" stroke-width="2"/>',
                _text(x + 2, (low + high) / 2 + 4, str(stretch.number), _INK, size=10),
            ]
        return shapes

    def _entries(self) -> list[str]:
        """Draw marks at their clock positions, with the interval, and labels on leader lines."""
        wanted = [self.y(entry.distance_m or 0.0) for entry in self.placed]
        places = spread(wanted, _LINE, _TOP, _TOP + self.height + _BOTTOM - 6)
        shapes = []
        for entry, y, label_y in zip(self.placed, wanted, places, strict=True):
            shapes += [*self._mark(entry, y), *self._label(entry, y, label_y)]
        return shapes

    def _mark(self, entry: Entry, y: float) -> list[str]:
        fill = _SOFT if entry.tag.severity is None else _FILLS[min(max(entry.tag.severity, 0), 5)]
        width = _PIPE_RIGHT - _PIPE_LEFT
        shapes = []
        if entry.u95_m is not None and entry.distance_m is not None:
            low, high = (self.y(entry.distance_m + sign * entry.u95_m) for sign in (-1, 1))
            x = _PIPE_RIGHT + 14
            shapes.append(
                f'<path d="M{x - 3} {low:.1f}h6m-3 0V{high:.1f}m-3 0h6" fill="none" '
                f'stroke="{_INK}"/>'
            )
        for first, last in clock_spans(entry.clock_from, entry.tag.clock_to):
            left, right = _PIPE_LEFT + first * width, _PIPE_LEFT + last * width
            if right - left < 8:
                shapes.append(
                    f'<circle cx="{left:.1f}" cy="{y:.1f}" r="5" fill="{fill}" stroke="{_INK}"/>'
                )
            else:
                shapes.append(_rect(left, y - 4, right - left, 8, fill, _INK))
        return shapes

    def _label(self, entry: Entry, y: float, label_y: float) -> list[str]:
        t = self.t
        words = [t.short_place(entry), t.code(entry)]
        if clock := t.clock_in_words(entry):
            words.append(clock)
        words.append(t.label(entry))
        text = f"{entry.seq}: " + " · ".join(words)
        if len(text) > _LONGEST_LABEL:
            text = text[: _LONGEST_LABEL - 1] + "…"
        fill = "none" if entry.tag.severity is None else _FILLS[min(max(entry.tag.severity, 0), 5)]
        return [
            f'<path d="M{_PIPE_RIGHT} {y:.1f}H{_LABELS - 52}L{_LABELS - 26} {label_y:.1f}'
            f'H{_LABELS - 16}" fill="none" stroke="{_SOFT}" stroke-width="0.8"/>',
            _rect(_LABELS - 14, label_y - 5, 10, 10, fill, _INK),
            f'<a href="#no-{entry.seq}">{_text(_LABELS, label_y + 4, text, _INK)}</a>',
        ]


def _e(text: str) -> str:
    return escape(legible(text))


def _text(
    x: float, y: float, text: str, fill: str, anchor: str = "start", *, size: int = 13
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" fill="{fill}" text-anchor="{anchor}" '
        f'font-size="{size}">{_e(text)}</text>'
    )


def _rect(x: float, y: float, width: float, height: float, fill: str, stroke: str = "none") -> str:
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" '
        f'fill="{fill}" stroke="{stroke}"/>'
    )


def _line(x1: float, y1: float, x2: float, y2: float, stroke: str, *, dash: str = "none") -> str:
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{stroke}" '
        f'stroke-dasharray="{dash}"/>'
    )
