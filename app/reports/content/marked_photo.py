"""Draws on a copy of a photo: arrows, lines and texts of a person, and a burnt-in caption.

The photo as it was taken is never changed. `static/components/attachments/strokes.js` draws the
same marks on the page.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

from PIL import Image, ImageDraw, ImageFont

from app.reports.pdf.fonts import FACES, LATIN, has
from app.storage.blobs import Readable
from app.survey.attachments import Stroke

QUALITY = 92
_COLOURS = {"red": "#ff3b30", "yellow": "#ffd60a", "white": "#ffffff", "blue": "#3ea6ff"}
_EDGE = "#000000"
"""Around every mark, so that it is seen on any wall."""
_LINE_SHARE, _TEXT_SHARE, _LEAST_LINE, _LEAST_TEXT = 1 / 250, 1 / 28, 2.0, 12.0
"""Width of lines and height of letters against the width of the picture, and the least in px."""
_HEAD_LINES, _HEAD_RAD = 6.0, math.radians(28)
"""Length of an arrow's head in widths of its line, and half of its angle."""
_INK, _PAPER = "#ffffff", "#101418"
"""Of the caption."""


@dataclass(frozen=True)
class MarkedPhoto:
    """A copy of a photo with marks, made when it is read."""

    original: Readable
    strokes: Sequence[Stroke]
    caption: str | None
    """Written below the picture, so that it hides nothing."""

    def exists(self) -> bool:
        """Return whether there is a photo."""
        return self.original.exists()

    def read_bytes(self) -> bytes:
        """Return the copy as JPEG.

        A photo that cannot be decoded is returned as it is: who shows it reports that.

        Raises:
            FileNotFoundError: There is no photo.
        """
        content = self.original.read_bytes()
        try:
            with Image.open(io.BytesIO(content)) as taken:
                picture = taken.convert("RGB")
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
            return content
        for stroke in self.strokes:
            _draw(ImageDraw.Draw(picture), stroke, picture.width)
        if self.caption:
            picture = _captioned(picture, self.caption)
        out = io.BytesIO()
        picture.save(out, "JPEG", quality=QUALITY)
        return out.getvalue()


def _draw(draw: ImageDraw.ImageDraw, stroke: Stroke, picture_px: int) -> None:
    colour = _COLOURS[stroke.colour]
    wide = max(_LEAST_LINE, picture_px * _LINE_SHARE)
    points = [(u, v) for u, v in stroke.points]
    if stroke.kind == "text":
        font = _font(stroke.text or "", _text_px(picture_px))
        edge = max(1, round(wide / 2))
        draw.text(
            points[0],
            stroke.text or "",
            colour,
            font,
            anchor="ls",
            stroke_width=edge,
            stroke_fill=_EDGE,
        )
        return
    lines = [points]
    if stroke.kind == "arrow":
        lines.append(_head(points[0], points[1], wide * _HEAD_LINES))
    for ink, width in ((_EDGE, wide * 2), (colour, wide)):
        for line in lines:
            _polyline(draw, line, ink, width)


def _polyline(
    draw: ImageDraw.ImageDraw, points: Sequence[tuple[float, float]], ink: str, width: float
) -> None:
    """Draw connected lines with round ends; a single point is a dot."""
    draw.line(points, ink, round(width), "curve")
    radius = width / 2
    for u, v in (points[0], points[-1]):
        draw.ellipse((u - radius, v - radius, u + radius, v + radius), ink)


def _head(
    tail: tuple[float, float], tip: tuple[float, float], length: float
) -> list[tuple[float, float]]:
    """Return the two sides of an arrow's head as one line through its tip."""
    back = math.atan2(tail[1] - tip[1], tail[0] - tip[0])
    left, right = (
        (tip[0] + length * math.cos(angle), tip[1] + length * math.sin(angle))
        for angle in (back - _HEAD_RAD, back + _HEAD_RAD)
    )
    return [left, tip, right]


def _captioned(picture: Image.Image, caption: str) -> Image.Image:
    """Add a strip below the picture with the caption, in letters that let it fit."""
    margin = round(_text_px(picture.width) / 2)
    size = _text_px(picture.width)
    font = _font(caption, size)
    room = picture.width - 2 * margin
    if (wide := font.getlength(caption)) > room:
        font = _font(caption, max(size * room / wide, 1))
    strip = round(1.8 * size)
    whole = Image.new("RGB", (picture.width, picture.height + strip), _PAPER)
    whole.paste(picture)
    middle = (margin, picture.height + strip / 2)
    ImageDraw.Draw(whole).text(middle, caption, _INK, font, anchor="lm")
    return whole


def _text_px(picture_px: int) -> float:
    return max(_LEAST_TEXT, picture_px * _TEXT_SHARE)


def _font(text: str, size: float) -> ImageFont.FreeTypeFont:
    """Return the first font of the report that has every character, else the Latin one."""
    face = next((face for face in FACES if all(has(face, char) for char in text)), LATIN)
    return ImageFont.truetype(str(face.file), size)
