"""Plan sketch of many culverts, to scale, with a scale bar and a north arrow."""

from __future__ import annotations

from app.reports.collection.plan import Plan
from app.reports.content.translator import FOOT_M, Translator
from app.reports.drawings import svg
from app.reports.drawings.svg import Drawing

HEIGHT = 190.0
EDGE = 10.0
"""Margin within the frame, so that labels fit."""
FOOT = 14.0
"""Room for the scale bar below the sketch."""
_MARK = 1.1
_LONGEST_LABEL = 38.0


def road_plan(sketch: Plan, accent: str, t: Translator) -> Drawing:
    """Draw a sketch that was laid out within the margins, with the lines in a colour."""
    lowest = HEIGHT - EDGE - FOOT

    def at(point: tuple[float, float]) -> tuple[float, float]:
        return EDGE + point[0], lowest - point[1]

    shapes = [svg.rect(0, 0, svg.WIDTH, HEIGHT, svg.PAPER, svg.RULE)]
    for run in sketch.runs:
        shapes += [
            svg.line(at(run.start), at(run.end), accent, 0.5),
            svg.circle(at(run.middle), _MARK, svg.fill_of(run.one.worst)),
        ]
    for label in sketch.labels:
        x, y = at(label.at)
        side, anchor = (-1, "end") if label.at[0] > svg.WIDTH * 0.75 else (1, "start")
        first, *rest = svg.wrapped(label.text, _LONGEST_LABEL, bold=True)
        said = first + ("…" if rest else "")
        shapes.append(svg.text(x + side * (_MARK + 0.8), y - 0.9, said, anchor=anchor, bold=True))
    alt = t(
        "collection.plan_alt",
        n=len(sketch.runs),
        scale=scale_of(sketch),
        names="; ".join(f"{run.one.number} {run.one.asset}" for run in sketch.runs),
    )
    north = svg.north_arrow((svg.WIDTH - 8, HEIGHT - 15), 9, t("collection.north"))
    return Drawing(svg.WIDTH, HEIGHT, alt, [*shapes, *_bar(sketch, t), *north])


def scale_of(sketch: Plan) -> str:
    """Return the scale as it is written: `1 : 2 500`."""
    return f"1 : {sketch.scale:,.0f}".replace(",", "\u202f")


def _bar(sketch: Plan, t: Translator) -> list[str]:
    x, y, half = EDGE, HEIGHT - 10.6, sketch.bar_mm / 2
    return [
        svg.rect(x, y, half, 1.6, svg.INK, svg.INK),
        svg.rect(x + half, y, half, 1.6, svg.WASH, svg.INK),
        svg.text(x, y - 1.4, "0", anchor="middle"),
        svg.text(x + 2 * half, y - 1.4, _length(sketch.bar_m, t), anchor="middle"),
        svg.text(x, y + 5.6, scale_of(sketch), fill=svg.SOFT),
    ]


def _length(length_m: float, t: Translator) -> str:
    if t.units == "ft":
        return t.local(f"{length_m:g} m ({length_m / FOOT_M:,.0f} ft)")
    return f"{length_m / 1000:g} km" if length_m >= 1000 else f"{length_m:g} m"
