"""Bars of counts, each in the colour of a severity."""

from __future__ import annotations

from collections.abc import Sequence

from app.reports.content.translator import NOTHING
from app.reports.drawings import svg
from app.reports.drawings.svg import Drawing

Bar = tuple[str, int, int | None]
"""Name, count, and severity."""
_ROW = 6.0
_NAMES, _COUNTS = 62.0, 13.0


def bars(rows: Sequence[Bar], alt: str, *, has_badges: bool = False) -> Drawing:
    """Draw a bar for each row.

    Args:
        rows: From the top down.
        alt: What they show, in words.
        has_badges: Whether each is named with its severity, too.
    """
    most = max([1, *(count for _, count, _ in rows)])
    start = 5.0 if has_badges else 0.0
    shapes = []
    for number, (name, count, severity) in enumerate(rows):
        y = number * _ROW
        first, *rest = svg.wrapped(name, _NAMES - start - 2) or [""]
        length = (svg.WIDTH - _NAMES - _COUNTS) * count / most
        shapes += [
            *([svg.badge(0, y + 1.2, severity)] if has_badges else ()),
            svg.text(start, y + 3.7, first + ("…" if rest else "")),
            *(
                [svg.rect(_NAMES, y + 0.9, length, 4, svg.fill_of(severity), svg.INK)]
                if count
                else ()
            ),
            svg.text(
                _NAMES + length + 2, y + 3.7, str(count) if count else NOTHING, svg.SMALL, bold=True
            ),
        ]
    return Drawing(svg.WIDTH, len(rows) * _ROW + 1, alt, shapes)
