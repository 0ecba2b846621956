"""The pipe at a glance: from the side, with its stretches and observations."""

from __future__ import annotations

from app.reports.content.translator import Translator
from app.reports.drawings import svg
from app.reports.drawings.axis import Axis, tick_step_m
from app.reports.drawings.svg import Drawing
from app.reports.report import Entry, Report

_TOP, _BOTTOM = 12.0, 19.0
_EDGE = 4.0


def pipe_at_a_glance(report: Report, t: Translator, width_mm: float = svg.WIDTH) -> Drawing:
    """Draw the pipe, with a mark for every entry; the worst are on top."""
    axis = Axis.of(report)
    per_m = (width_mm - 2 * _EDGE) / axis.length_m

    def x_of(distance_m: float) -> float:
        return _EDGE + (distance_m - axis.first_m) * per_m

    first_x, last_x = x_of(axis.first_m), x_of(axis.last_m)
    shapes = [
        svg.rect(first_x, _TOP, last_x - first_x, _BOTTOM - _TOP, svg.WASH),
        *(svg.line((first_x, y), (last_x, y), svg.INK, 0.3) for y in (_TOP, _BOTTOM)),
        svg.text(width_mm, 28, t("summary.axis", unit=t.units), svg.TINY, svg.SOFT, anchor="end"),
    ]
    for distance_m in axis.ticks(tick_step_m(t, per_m, 14)):
        x = x_of(distance_m)
        said = t.figure(distance_m / t.per_unit_m)
        shapes += [
            svg.line((x, _BOTTOM), (x, _BOTTOM + 1.5), svg.RULE),
            svg.text(x, _BOTTOM + 4.3, said, svg.TINY, svg.SOFT, anchor="middle"),
        ]
    for stretch in report.stretches:
        ends = [end.distance_m for end in (stretch.start, stretch.finish)]
        if ends[0] is not None and ends[1] is not None:
            y = _BOTTOM - 1.2
            shapes.append(svg.line((x_of(ends[0]), y), (x_of(ends[1]), y), svg.INK, 0.55))
    for entry in sorted(report.entries, key=lambda entry: entry.tag.severity or 0):
        if entry.distance_m is not None:
            shapes.append(_mark(report, t, entry, x_of(entry.distance_m)))
    alt = t(
        "alt.glance",
        first=t.length(axis.first_m),
        last=t.length(axis.last_m),
        n=len(report.entries),
    )
    return Drawing(width_mm, 30, alt, shapes)


def _mark(report: Report, t: Translator, entry: Entry, x: float) -> str:
    severity = entry.tag.severity
    mark = svg.line((x, _BOTTOM), (x, _TOP - 2))
    if not severity:
        return mark
    name = f"{entry.number}: {t.short_place(entry)} {t.code(entry)}"
    number = svg.text(
        x, _TOP - 3.15, str(severity), fill=svg.ink_on(severity), anchor="middle", bold=True
    )
    return svg.to_row(
        report, entry, mark + svg.circle((x, _TOP - 4), 1.9, svg.fill_of(severity)) + number, name
    )
