"""The pipe from its zero to its far end as an inline SVG, to scale, with every entry."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.cut_pipe import clock_spans, water_share
from app.reports.content.placement import spread
from app.reports.content.translator import Translator
from app.reports.html.links import to_row
from app.reports.html.svg import (
    INK,
    RULE,
    SOFT,
    WASH,
    WATER,
    escaped,
    line,
    rect,
    severity_fill,
    text_at,
)
from app.reports.report import Entry, Report

_TOP, _BOTTOM = 24, 24
_LINE = 22
"""Distance between labels."""
_LEAST = 420.0
"""Least height of the drawn pipe, px."""
_MOST = 6000.0
"""Largest height of the drawn pipe, px."""
_PX_PER_M = 36.0
_LANE = 12
_LANES = 4


@dataclass(frozen=True)
class _Format:
    """Where things stand across the drawing, px."""

    name: str
    """Class of the drawing, for the style sheet."""
    width: int
    pipe: tuple[int, int]
    labels: int
    longest_label: int
    """Characters after which a label is cut."""
    is_short: bool
    """Whether labels have number, place and code only."""

    @property
    def middle(self) -> float:
        """Place of the invert, px: the wall is cut along its crown."""
        return (self.pipe[0] + self.pipe[1]) / 2

    @property
    def across(self) -> int:
        """Width of the pipe."""
        return self.pipe[1] - self.pipe[0]


_FORMATS = (
    _Format("strip-wide", 1000, (90, 290), 400, 86, is_short=False),
    _Format("strip-narrow", 358, (40, 136), 214, 20, is_short=True),
)
"""For a desk, and for a phone, which shows it in its own size."""


def pipe_strip(report: Report, t: Translator) -> Markup:
    """Draw the wall cut along its crown: 12 o'clock at both edges, 6 in the middle.

    There is a drawing for each format, of which the style sheet shows one.
    """
    drawings = [_Strip(report, t, form).drawn() for form in _FORMATS]
    text = "\n".join([*drawings, _legend(report, t)])
    return Markup(text)  # noqa: S704  (escaped text by text)


def _legend(report: Report, t: Translator) -> str:
    hints = [t("graphic.legend")]
    if water_share(report):
        hints.append(t("graphic.water"))
    if report.joints:
        hints.append(t("graphic.joints"))
    if report.expected_joints:
        hints.append(t("graphic.expected_joints"))
    if untracked := sum(entry.distance_m is None for entry in report.entries):
        hints.append(t("graphic.untracked", n=untracked))
    return f"<p>{escaped(' '.join(hints))}</p>"


class _Strip:
    def __init__(self, report: Report, t: Translator, form: _Format) -> None:
        self.report = report
        self.t = t
        self.form = form
        self.axis = Axis.of(report)
        self.placed = [entry for entry in report.entries if entry.distance_m is not None]
        wanted = max(_PX_PER_M * self.axis.length_m, _LINE * (len(self.placed) + 1), _LEAST)
        self.height = min(wanted, max(_MOST, _LINE * (len(self.placed) + 1)))

    def y(self, distance_m: float) -> float:
        """Convert to px; places beyond the axis are drawn at its end."""
        inside_m = min(max(distance_m, self.axis.first_m), self.axis.last_m)
        return _TOP + (inside_m - self.axis.first_m) / self.axis.length_m * self.height

    def drawn(self) -> str:
        """Return the drawing."""
        t = self.t
        whole = self.height + _TOP + _BOTTOM
        description = t("web.strip", n=len(self.placed), end=t.length(self.axis.last_m))
        shapes = [
            *self._pipe(), *self._ticks(), *self._joints(), *self._stretches(), *self._entries(),
        ]  # fmt: skip
        return (
            f'<svg class="strip {self.form.name}" viewBox="0 0 {self.form.width} {whole:.0f}" '
            f'role="group" aria-label="{escaped(description)}" '
            f'font-family="system-ui, sans-serif" font-size="13" '
            f'xmlns="http://www.w3.org/2000/svg">\n' + "\n".join(shapes) + "\n</svg>"
        )

    def _pipe(self) -> list[str]:
        top, width, edge = _TOP, self.form.across, self.form.pipe[0]
        shapes = [rect(edge, top, width, self.height, WASH, INK)]
        share = water_share(self.report)
        if share:
            left, wet = self.form.middle - share * width / 2, share * width
            shapes.append(rect(left, top, wet, self.height, WATER))
        shapes += [
            text_at(edge + share * width, top - 8, label, SOFT, "middle", size=11)
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
                line(self.form.pipe[0] - 8, y, self.form.pipe[0], y, SOFT),
                text_at(self.form.pipe[0] - 12, y + 4, label, INK, "end"),
            ]
        return [
            *shapes,
            text_at(self.form.pipe[0] - 12, _TOP - 8, self.t.units, SOFT, "end", size=11),
        ]

    def _joints(self) -> list[str]:
        shapes = []
        for joint in self.report.joints:
            y = self.y(joint.distance_mm / 1000)
            shapes.append(line(self.form.pipe[0], y, self.form.pipe[1], y, SOFT))
            if joint.number is not None:
                shapes.append(
                    text_at(self.form.pipe[1] + 4, y + 4, f"J{joint.number}", SOFT, size=10)
                )
        expected = [self.y(joint.distance_mm / 1000) for joint in self.report.expected_joints]
        shapes += [
            line(self.form.pipe[0], y, self.form.pipe[1], y, RULE, dash="4 4") for y in expected
        ]
        return shapes

    def _stretches(self) -> list[str]:
        shapes = []
        for stretch in self.report.stretches:
            start_m, finish_m = stretch.start.distance_m, stretch.finish.distance_m
            if start_m is None or finish_m is None:
                continue
            x = self.form.pipe[1] + 30 + _LANE * ((stretch.number - 1) % _LANES)
            low, high = sorted((self.y(start_m), self.y(finish_m)))
            shapes += [
                f'<path d="M{x - 5} {low:.1f}H{x}V{high:.1f}H{x - 5}" fill="none" '
                f'stroke="{INK}" stroke-width="2"/>',
                text_at(x + 2, (low + high) / 2 + 4, str(stretch.number), INK, size=10),
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
        fill = severity_fill(entry.tag.severity, "#ffffff")
        width = self.form.across
        shapes = []
        if entry.u95_m is not None and entry.distance_m is not None:
            low, high = (self.y(entry.distance_m + sign * entry.u95_m) for sign in (-1, 1))
            x = self.form.pipe[1] + 14
            shapes.append(
                f'<path d="M{x - 3} {low:.1f}h6m-3 0V{high:.1f}m-3 0h6" fill="none" '
                f'stroke="{INK}"/>'
            )
        for first, last in clock_spans(entry.clock_from, entry.tag.clock_to):
            left, right = self.form.pipe[0] + first * width, self.form.pipe[0] + last * width
            if right - left < 8:
                shapes.append(
                    f'<circle cx="{left:.1f}" cy="{y:.1f}" r="5" fill="{fill}" stroke="{INK}"/>'
                )
            else:
                shapes.append(rect(left, y - 4, right - left, 8, fill, INK))
        return shapes

    def _label(self, entry: Entry, y: float, label_y: float) -> list[str]:
        t = self.t
        if self.form.is_short:
            text = f"{entry.seq}: {t.length(entry.distance_m)} {t.code(entry)}"
        else:
            words = [t.short_place(entry), t.code(entry), t.clock_in_words(entry), t.label(entry)]
            text = f"{entry.seq}: " + " · ".join(word for word in words if word)
        if len(text) > self.form.longest_label:
            text = text[: self.form.longest_label - 1] + "…"
        fill = severity_fill(entry.tag.severity, "none")
        x = self.form.labels
        return [
            f'<path d="M{self.form.pipe[1]} {y:.1f}H{x - 52}L{x - 26} {label_y:.1f}'
            f'H{x - 16}" fill="none" stroke="{SOFT}" stroke-width="0.8"/>',
            rect(x - 14, label_y - 5, 10, 10, fill, INK),
            to_row(self.report, entry, Markup(text_at(x, label_y + 4, text, INK))),  # noqa: S704
        ]
