"""Shapes of SVG 1.1 in millimetres, and the drawing that they make.

Presentation attributes only, so that a typesetter without style sheets shows the same as a browser.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from markupsafe import Markup, escape

from app.reports.content.sizes import Outline
from app.reports.report import Entry, Report
from app.reports.text import typesetting
from app.reports.text.typesetting import one_line

WIDTH = 174.0
"""Between the margins of an A4 page, mm."""
NARROW = 84.0
"""Width of a drawing whose letters can be read on a phone, mm."""

INK, SOFT, RULE, WASH, WATER = "#17212b", "#4a5761", "#c2cbd2", "#f1f4f6", "#d3e3ec"
PAPER = "#ffffff"
SEVERITY = (PAPER, "#e4ecef", "#f3de9b", "#ecae4b", "#b04e1e", "#8a1713")
"""Colours of the severities 0 to 5, which get darker with each."""
_FIRST_LIGHT_INK = 4
"""From this severity on, letters on its colour are white."""

_MEASURE = (("#080a0c", 2.4), ("#5ff2e0", 1.1))
"""Colours and widths of a measure, in points on a photo that is 83 mm wide."""

NORMAL, SMALL, TINY = 2.7, 2.4, 2.05
"""Heights of letters."""
LEADING = 1.3
"""Distance of lines in heights of letters."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Drawing:
    """A drawing, and what it shows in words."""

    width_mm: float
    height_mm: float
    alt: str
    shapes: Sequence[str]
    """From the bottom layer up."""

    @property
    def svg(self) -> Markup:
        """The whole file, which is also an element of a page."""
        return Markup(  # noqa: S704  (texts are escaped where they become shapes)
            f'<svg xmlns="http://www.w3.org/2000/svg" class="drawing" role="group" '
            f'aria-label="{escape(one_line(self.alt))}" width="{self.width_mm:g}mm" '
            f'height="{self.height_mm:.2f}mm" viewBox="0 0 {self.width_mm:g} {self.height_mm:.2f}" '
            f'font-family="Noto Sans, sans-serif">\n' + "\n".join(self.shapes) + "\n</svg>"
        )


def fill_of(severity: int | None) -> str:
    """Return the colour of a severity; that of unrated ones is its own."""
    return WASH if severity is None else SEVERITY[min(max(severity, 0), 5)]


def ink_on(severity: int | None) -> str:
    """Return the colour of letters on the colour of a severity."""
    return PAPER if severity is not None and severity >= _FIRST_LIGHT_INK else INK


def text(
    x: float,
    y: float,
    said: str,
    size: float = SMALL,
    fill: str = INK,
    *,
    anchor: str = "start",
    bold: bool = False,
) -> str:
    """Return a line of text from its baseline."""
    return (
        f'<text x="{x:.2f}" y="{y:.2f}" font-size="{size:g}" fill="{fill}" '
        f'text-anchor="{anchor}" font-weight="{600 if bold else 400}">'
        f"{escape(one_line(said))}</text>"
    )


def wrapped(said: str, width: float, size: float = SMALL, *, bold: bool = False) -> list[str]:
    """Return the lines of a text; browsers without its font need a little more room."""
    return typesetting.lines_of(said, size, 600 if bold else 400, 0.95 * width)


def width_of(said: str, size: float = TINY) -> float:
    """Return about the width of a bold text in one line."""
    return typesetting.width_of(one_line(said), size, 600)


def rect(
    x: float,
    y: float,
    width: float,
    height: float,
    fill: str,
    stroke: str = "none",
    stroke_width: float = 0.15,
) -> str:
    """Return a rectangle from its upper left corner."""
    return (
        f'<rect x="{x:.2f}" y="{y:.2f}" width="{max(width, 0):.2f}" height="{max(height, 0):.2f}" '
        f'fill="{fill}" stroke="{stroke}" stroke-width="{stroke_width:g}"/>'
    )


def line(
    start: Point, end: Point, stroke: str = INK, width: float = 0.15, *, dash: str = "none"
) -> str:
    """Return a straight line."""
    return (
        f'<line x1="{start[0]:.2f}" y1="{start[1]:.2f}" x2="{end[0]:.2f}" y2="{end[1]:.2f}" '
        f'stroke="{stroke}" stroke-width="{width:g}" stroke-dasharray="{dash}"/>'
    )


def path(
    points: Iterable[Point], stroke: str = INK, width: float = 0.15, *, fill: str = "none"
) -> str:
    """Return connected lines; with a colour inside they are an area without an edge."""
    places = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
    look = (
        f'fill="none" stroke="{stroke}" stroke-width="{width:g}"'
        if fill == "none"
        else f'fill="{fill}"'
    )
    return f'<polyline points="{places}" {look}/>'


def circle(middle: Point, radius: float, fill: str, stroke: str = INK) -> str:
    """Return a circle."""
    return (
        f'<circle cx="{middle[0]:.2f}" cy="{middle[1]:.2f}" r="{radius:g}" fill="{fill}" '
        f'stroke="{stroke}" stroke-width="0.15"/>'
    )


def badge(x: float, y: float, severity: int | None) -> str:
    """Return a square with a severity, from its upper left corner."""
    said = "" if severity is None else str(severity)
    return rect(x, y, 3.2, 3.2, fill_of(severity), INK) + text(
        x + 1.6, y + 2.4, said, TINY, ink_on(severity), anchor="middle", bold=True
    )


def picture(jpeg: bytes, corner: Point, size: Point) -> str:
    """Return a picture by its upper left corner, with this width and height."""
    content = base64.b64encode(jpeg).decode()
    (x, y), (width, height) = corner, size
    return (
        f'<image x="{x:.2f}" y="{y:.2f}" width="{width:.2f}" height="{height:.2f}" '
        f'preserveAspectRatio="none" href="data:image/jpeg;base64,{content}"/>'
    )


def clipped(name: str, frame: str, shapes: Iterable[str]) -> list[str]:
    """Return shapes as far as they are inside a frame; names are unique in a page."""
    return [
        f'<clipPath id="{name}">{frame}</clipPath>',
        f'<g clip-path="url(#{name})">',
        *shapes,
        "</g>",
    ]


def measures(outlines: Iterable[Outline], wide: int, high: int) -> Iterator[str]:
    """Yield what was measured on a photo of a size in px, with a dark edge so that it is seen on
    any wall.
    """
    for outline in outlines:
        points = " ".join(f"{x * wide:.1f},{y * high:.1f}" for x, y in outline.points)
        shape = "polygon" if outline.is_closed else "polyline"
        for colour, width in _MEASURE:
            yield (
                f'<{shape} points="{points}" fill="none" stroke="{colour}" '
                f'stroke-linejoin="round" stroke-width="{width * wide / 235:.2f}"/>'
            )


def north_arrow(tip: Point, length: float, name: str) -> list[str]:
    """Return an arrow that points up, with its name above it."""
    x, y = tip
    head = [(x, y), (x + 0.27 * length, y + length), (x, y + 0.8 * length)]
    head.append((x - 0.27 * length, y + length))
    return [path(head, fill=INK), text(x, y - 1, name, bold=True, anchor="middle")]


def to_row(report: Report, entry: Entry, shapes: str, label: str = "") -> str:
    """Return shapes that lead to the row of an entry, where the page has the table.

    Args:
        report: The report.
        entry: The entry.
        shapes: What is drawn.
        label: What a screen reader says instead; empty: the texts in it.
    """
    if "observations" not in report.template.sections:
        return shapes
    named = f' aria-label="{escape(one_line(label))}"' if label else ""
    return f'<a href="#no-{entry.number}"{named}>{shapes}</a>'
