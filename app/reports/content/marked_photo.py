"""Draws on a copy of a photo: arrows, lines and texts of a person, and a burnt-in caption.

The photo as it was taken is never changed. `static/components/defects/attachments/strokes.js`
draws the same marks on the page.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

from PIL import Image, ImageDraw

from app.reports.text.typesetting import font_of, lines_of, one_line, pieces_of
from app.storage.blobs.blobs import Readable
from app.survey.observations.attachments import Stroke

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
_MARK_SHARE, _MARK_ROWS, _MARK_DEG, _MARK_INK = 1 / 16, 4, 25.0, "#5a5a5a"
"""Of the text across: height of letters against the width of the picture, rows, turn, and how much
of it is seen, as a grey."""
_LEADING = 1.3
"""Distance of its lines in heights of letters."""


@dataclass(frozen=True)
class MarkedPhoto:
    """A copy of a photo with marks, made when it is read."""

    original: Readable
    strokes: Sequence[Stroke]
    caption: str | None
    """Written below the picture, so that it hides nothing; it may have several lines."""
    mark: str | None = None
    """Written across the picture, which shows through."""

    @property
    def drawn(self) -> str:
        """The marks as text: equal for equal drawings."""
        return "".join(stroke.model_dump_json() for stroke in self.strokes)

    def picture_share(self, width_px: int, height_px: int) -> float:
        """Return the share of the copy's height that a photo of this size takes."""
        if not self.caption:
            return 1.0
        lines = _lines(self.caption, width_px)
        return height_px / (height_px + _strip_px(width_px, len(lines)))

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
        if self.mark:
            picture = _marked_across(picture, self.mark)
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
        text, size = one_line(stroke.text or ""), _text_px(picture_px)
        _write(draw, points[0], text, size, colour, anchor="ls", edge=max(1, round(wide / 2)))
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


def _marked_across(picture: Image.Image, mark: str) -> Image.Image:
    """Write a text across the picture, in rows from the lower left to the upper right."""
    side = math.ceil(math.hypot(*picture.size))
    rows, size = Image.new("L", (side, side)), picture.width * _MARK_SHARE
    pen = ImageDraw.Draw(rows)
    for row in range(_MARK_ROWS):
        middle = side * (row + 0.5) / _MARK_ROWS
        _write(pen, (side * 0.2, middle), f"{mark}   {mark}", size, _MARK_INK, anchor="lm")
    turned = rows.rotate(_MARK_DEG)
    left, top = (side - picture.width) // 2, (side - picture.height) // 2
    over = turned.crop((left, top, left + picture.width, top + picture.height))
    return Image.composite(Image.new("RGB", picture.size, _INK), picture, over)


def _captioned(picture: Image.Image, caption: str) -> Image.Image:
    """Add a strip below the picture with the caption, in as many lines as it takes."""
    lines = _lines(caption, picture.width)
    strip = _strip_px(picture.width, len(lines))
    whole = Image.new("RGB", (picture.width, picture.height + strip), _PAPER)
    whole.paste(picture)
    pen = ImageDraw.Draw(whole)
    leading = _LEADING * _text_px(picture.width)
    top = picture.height + (strip - leading * len(lines)) / 2
    for n, line in enumerate(lines):
        middle = (_margin_px(picture.width), top + (n + 0.5) * leading)
        _write(pen, middle, line, _text_px(picture.width), _INK, anchor="lm")
    return whole


def _lines(caption: str, picture_px: int) -> list[str]:
    size = _text_px(picture_px)
    return lines_of(caption, size, 400, picture_px - 2 * _margin_px(picture_px))


def _write(
    pen: ImageDraw.ImageDraw,
    at: tuple[float, float],
    text: str,
    size: float,
    ink: str,
    *,
    anchor: str,
    edge: int = 0,
) -> None:
    """Write a line of any script from its left end, with an edge around the letters, px."""
    x, y = at
    for face, piece in pieces_of(text):
        font = font_of(face, size)
        pen.text((x, y), piece, ink, font, anchor=anchor, stroke_width=edge, stroke_fill=_EDGE)
        x += font.getlength(piece)


def _strip_px(picture_px: int, lines: int) -> int:
    return round((_LEADING * lines + 0.5) * _text_px(picture_px))


def _margin_px(picture_px: int) -> int:
    return round(min(_text_px(picture_px) / 2, picture_px / 20))


def _text_px(picture_px: int) -> float:
    return max(_LEAST_TEXT, picture_px * _TEXT_SHARE)
