"""Text in the styles of the document: broken into lines, shortened and drawn."""

from __future__ import annotations

from dataclasses import dataclass

from reportlab.pdfgen.canvas import Canvas

from app.reports.content import typesetting
from app.reports.content.typesetting import Run, visual_runs
from app.reports.pdf.styles import Style


@dataclass(frozen=True)
class Line:
    """One line, ready to be drawn."""

    text: str
    style: Style

    @property
    def width(self) -> float:
        """Width in points."""
        return width_of(self.text, self.style)


def width_of(text: str, style: Style) -> float:
    """Return the width of cleaned text in one line, in points."""
    return typesetting.width_of(text, style.size, style.weight)


def lines_of(text: str, style: Style, width: float) -> list[Line]:
    """Break text into lines of at most `width` points; a single glyph may be wider.

    Args:
        text: Text before cleaning; its line breaks are kept.
        style: Style of every line.
        width: Width in points.
    """
    lines = typesetting.lines_of(text, style.size, style.weight, width)
    return [Line(line, style) for line in lines]


def shortened(text: str, style: Style, width: float) -> str:
    """Shorten a text to one line, with an ellipsis where something is left out."""
    return typesetting.shortened(text, style.size, style.weight, width)


def draw(canvas: Canvas, x: float, y: float, text: str, style: Style, align: str = "left") -> None:
    """Draw one line of cleaned text.

    Args:
        canvas: The canvas.
        x: Position of its left end, middle or right end, by `align`.
        y: Position of the baseline.
        text: Cleaned text.
        style: Size, weight and colour.
        align: left, centre or right.
    """
    runs = visual_runs(text, style.weight)
    scale = style.size / 1000
    width = sum(run.width for run in runs) * scale
    x -= {"left": 0.0, "centre": width / 2, "right": width}[align]
    canvas.setFillColor(style.colour)
    for run in runs:
        if run.glyphs is None:
            canvas.setFont(run.font.fontName, style.size)
            if run.is_outlined:  # text rendering mode 2: fill, then stroke
                canvas.setStrokeColor(style.colour)
                canvas.setLineWidth(0.03 * style.size)
            canvas.drawString(x, y, run.text, mode=2 if run.is_outlined else None)
        else:
            _draw_glyphs(canvas, x, y, run, style)
        x += run.width * scale


def _draw_glyphs(canvas: Canvas, x: float, y: float, run: Run, style: Style) -> None:
    """Draw the glyphs one by one; the text itself is included for searching and copying."""
    scale = style.size / 1000
    actual = run.text.encode("utf-16-be").hex().upper()
    canvas.addLiteral(f"/Span <</ActualText <FEFF{actual}>>> BDC")
    for glyph in run.glyphs or ():
        canvas.setFont(run.font.fontName, style.size)
        canvas.drawString(x + glyph.x * scale, y + glyph.y * scale, glyph.char)
    canvas.addLiteral("EMC")
