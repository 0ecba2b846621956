"""Shapes of inline drawings, with escaped text."""

from __future__ import annotations

from markupsafe import escape

from app.reports.content.text import legible

INK, SOFT, RULE, WASH, WATER = "#17212b", "#4a5761", "#c2cbd2", "#f1f4f6", "#d3e3ec"
_FILLS = ("#ffffff", "#e4ecef", "#f3de9b", "#ecae4b", "#b04e1e", "#8a1713")


def severity_fill(severity: int | None, unrated: str) -> str:
    """Return the colour of a severity."""
    return unrated if severity is None else _FILLS[min(max(severity, 0), 5)]


def escaped(text: str) -> str:
    """Return text that any browser shows, for an element or an attribute."""
    return escape(legible(text))


def text_at(
    x: float,
    y: float,
    text: str,
    fill: str,
    anchor: str = "start",
    *,
    size: int = 13,
    weight: int = 400,
) -> str:
    """Return text at its baseline."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" fill="{fill}" text-anchor="{anchor}" '
        f'font-size="{size}" font-weight="{weight}">{escaped(text)}</text>'
    )


def rect(x: float, y: float, width: float, height: float, fill: str, stroke: str = "none") -> str:
    """Return a rectangle from its upper left corner."""
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" '
        f'fill="{fill}" stroke="{stroke}"/>'
    )


def line(
    x1: float,
    y1: float,
    x2: float,
    y2: float,
    stroke: str,
    *,
    dash: str = "none",
    width: float = 1,
) -> str:
    """Return a straight line."""
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{stroke}" '
        f'stroke-width="{width:g}" stroke-dasharray="{dash}"/>'
    )
