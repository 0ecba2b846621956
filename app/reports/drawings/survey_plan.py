"""Sketch of one survey: both ends of the pipe, the directions of flow and travel, and north."""

from __future__ import annotations

import math

from app.reports.content.translator import NOTHING, Translator
from app.reports.drawings import svg
from app.reports.drawings.svg import Drawing
from app.reports.report import Report
from app.survey.fields.header import number_of

_LEFT, _RIGHT, _MIDDLE = 36.0, svg.WIDTH - 36.0, 16.0


def survey_plan(report: Report, t: Translator) -> Drawing:
    """Draw the sketch from the header."""
    nodes = [str(report.header.get(f"{end}_node") or NOTHING) for end in ("start", "end")]
    length = t.length(report.distance_m)
    middle = (_LEFT + _RIGHT) / 2
    shapes = [
        svg.rect(0, 0, svg.WIDTH, 31, svg.WASH),
        *(
            svg.line((_LEFT, _MIDDLE + dy), (_RIGHT, _MIDDLE + dy), svg.INK, 0.3)
            for dy in (-2.4, 2.4)
        ),
        *_end(report, t, "start", nodes[0]),
        *_end(report, t, "end", nodes[1]),
        *_arrow((_LEFT + 12, _MIDDLE - 6.5), 26),
        svg.text(_LEFT + 41, _MIDDLE - 5.6, t("header.plan_camera")),
        svg.text(
            middle,
            _MIDDLE + 11.5,
            t("header.plan_length", length=length),
            bold=True,
            anchor="middle",
        ),
        *_north(report, (svg.WIDTH - 8, 8)),
    ]
    direction = report.header.get("direction")
    if direction in ("with_flow", "against_flow"):
        start, run = (middle - 13, 26) if direction == "with_flow" else (middle + 13, -26)
        shapes += _arrow((start, _MIDDLE), run)
        shapes.append(svg.text(middle, _MIDDLE + 6.8, t("header.plan_flow"), anchor="middle"))
    return Drawing(
        svg.WIDTH, 32, t("alt.plan", start=nodes[0], end=nodes[1], length=length), shapes
    )


def _end(report: Report, t: Translator, end: str, name: str) -> list[str]:
    at, side, anchor = (_LEFT, -1, "end") if end == "start" else (_RIGHT, 1, "start")
    x = at + 4 * side
    names = svg.wrapped(name, 30, svg.NORMAL, bold=True)
    shapes = [
        svg.rect(at - 1.2, _MIDDLE - 5, 2.4, 10, report.template.accent),
        *(
            svg.text(x, _MIDDLE - 1.2 - 3.5 * n, said, svg.NORMAL, bold=True, anchor=anchor)
            for n, said in enumerate(reversed(names[:3]))
        ),
        svg.text(x, _MIDDLE + 2.6, t(f"header.plan_{end}"), svg.TINY, svg.SOFT, anchor=anchor),
    ]
    for n, axis in enumerate(("lat", "lon")):
        value = number_of(report.header.get(f"{end}_{axis}"))
        if value is not None:
            place = f"{t.value('_lat', value)} {'NE'[n]}"
            shapes.append(
                svg.text(x, _MIDDLE + 6 + 2.9 * n, place, svg.TINY, svg.SOFT, anchor=anchor)
            )
    return shapes


def _arrow(start: tuple[float, float], length: float) -> list[str]:
    """Draw an arrow to the right, or to the left if its length is negative."""
    (x, y), tip = start, start[0] + length
    back = tip - math.copysign(2.2, length)
    head = svg.path([(tip, y), (back, y + 1.1), (back, y - 1.1)], fill=svg.INK)
    return [svg.line((x, y), (back, y), svg.INK, 0.25), head]


def _north(report: Report, middle: tuple[float, float]) -> list[str]:
    """Draw north against the pipe, drawn from left to right, where both ends are known."""
    values = [
        number_of(report.header.get(f"{end}_{axis}"))
        for end in ("start", "end")
        for axis in ("lat", "lon")
    ]
    lat, lon, end_lat, end_lon = (math.nan if value is None else value for value in values)
    east, north = (end_lon - lon) * math.cos(math.radians(lat)), end_lat - lat
    if not math.hypot(east, north) >= 1e-9:
        return []
    turn = math.degrees(math.atan2(north, east))
    arrow = [
        svg.line((0, 4), (0, -4), svg.RULE, 0.2),
        svg.path([(0, -4.5), (1.1, -1.5), (-1.1, -1.5)], fill=svg.INK),
        svg.text(1.6, -2.2, "N", svg.TINY),
    ]
    x, y = middle
    return [f'<g transform="translate({x:g} {y:g}) rotate({turn:.2f})">', *arrow, "</g>"]
