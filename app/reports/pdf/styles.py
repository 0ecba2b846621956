"""Paper, type and colours of the document; all of them are distinct in grey."""

from __future__ import annotations

from dataclasses import dataclass, replace

from reportlab.lib.colors import Color, HexColor, white
from reportlab.lib.pagesizes import A4
from reportlab.lib.units import mm

from app.reports.content.fonts import Weight

PAGE_WIDTH, PAGE_HEIGHT = A4
LEFT = RIGHT = 18 * mm
TOP, BOTTOM = 25 * mm, 20 * mm
WIDTH = PAGE_WIDTH - LEFT - RIGHT
HEIGHT = PAGE_HEIGHT - TOP - BOTTOM

INK = HexColor(0x17212B)
SOFT = HexColor(0x56636E)
RULE = HexColor(0xC2CBD2)
WASH = HexColor(0xF1F4F6)
ACCENT = HexColor(0x1D3B50)
"""Titles; the canvas draws them in the colour of the report's template (`paper`)."""
ALARM = HexColor(0x8A1713)
WATER = HexColor(0xD3E3EC)

SEVERITY: dict[int, Color] = {
    0: white,
    1: HexColor(0xE4ECEF),
    2: HexColor(0xF3DE9B),
    3: HexColor(0xECAE4B),
    4: HexColor(0xC4622D),
    5: ALARM,
}
"""Colours that get darker with every grade."""


@dataclass(frozen=True)
class Style:
    """Appearance of a text; sizes in points."""

    size: float
    leading: float
    weight: Weight = 400
    colour: Color = INK

    def soft(self) -> Style:
        """Return the style for less important text."""
        return replace(self, colour=SOFT)

    def on(self, colour: Color) -> Style:
        """Return the style in another colour."""
        return replace(self, colour=colour)

    def bold(self) -> Style:
        """Return the style in bold."""
        return replace(self, weight=600)


TITLE = Style(26, 32, 600, ACCENT)
HEADING = Style(15, 20, 600, ACCENT)
SUBHEADING = Style(10.5, 14, 600, ACCENT)
BODY = Style(9, 13)
CELL = Style(7.6, 10.2)
LINK = Style(7.6, 10.2, 600, HexColor(0x0B5394))
"""A text that links elsewhere."""
SMALL = Style(6.8, 9)
TINY = Style(5.8, 7.2)


def on_severity(severity: int | None) -> Color:
    """Return the text colour on the colour of a severity."""
    return white if severity is not None and severity >= 4 else INK
