"""Text of any script: cleaned, assigned fonts, broken into lines and put in visual order.

ReportLab's paragraphs use one font for each run and fail at what they cannot place. Here every
character gets a font, right-to-left text is ordered by the bidirectional algorithm and shaped by
HarfBuzz, and lines break even within very long words.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from typing import Any

import uharfbuzz as hb
from reportlab.pdfbase.ttfonts import TTFont

from app.reports.content.fonts import LATIN, LOCK, Face, Weight, face_of, font_of, has

ELLIPSIS = "…"

_PRIVATE = 0x100000
"""Plane 16 of Unicode: no font has characters there. ReportLab writes their six digits into the
file; the five of plane 15 are not a whole number of bytes, about which readers complain.
"""
_JOINERS = "\u200c\u200d"
_NO_JOINERS = dict.fromkeys(map(ord, _JOINERS))
"""Letters that are not shaped do not join, and not every font has joiners."""
_RIGHT_TO_LEFT = ("R", "AL", "AN")
_WORD = re.compile(r"\S+\s*|\s+")
_SELECTORS = (range(0xFE00, 0xFE10), range(0xE0100, 0xE01F0))


@dataclass(frozen=True)
class Glyph:
    """A drawn glyph, in thousandths of the font size."""

    char: str
    """Character that ReportLab uses for the glyph; not the written one."""
    x: float
    """Distance from the start of the run; `y` is that from its baseline."""
    y: float


@dataclass(frozen=True)
class Piece:
    """Written text of one font and one direction."""

    text: str
    face: Face
    is_rtl: bool


@dataclass(frozen=True)
class Run:
    """Text of one font and one direction."""

    text: str
    """The written text, without joiners where they have no effect."""
    font: TTFont
    width: float
    """Thousandths of the font size."""
    glyphs: tuple[Glyph, ...] | None
    """None where each character has its own glyph."""
    is_outlined: bool
    """Whether an outline makes it bold, as the font has no such weight."""


def clean(text: str) -> str:
    """Return the text in a form that can be shown.

    Control characters and lone surrogates are removed; characters without a font are replaced by
    their code point.
    """
    if _is_plain(text):
        return text
    text = text.replace("\r\n", "\n").replace("\r", "\n").replace("\t", " ")
    kept = "".join(map(_shown, text))
    return "".join(_in_a_font(char) for char in unicodedata.normalize("NFC", kept))


def one_line(text: str) -> str:
    """Return the cleaned text with blanks for line breaks."""
    return " ".join(clean(text).split())


def width_of(text: str, size: float, weight: Weight) -> float:
    """Return the width of cleaned text in one line, in the unit of its size."""
    return sum(_word_width(word, weight) for word in _WORD.findall(text)) * size / 1000


def lines_of(text: str, size: float, weight: Weight, width: float) -> list[str]:
    """Break text into lines of at most a width; a single glyph may be wider.

    Args:
        text: Text before cleaning; its line breaks are kept.
        size: Size of the font, in any unit.
        weight: Weight of the font.
        width: Width of the lines, in the same unit.
    """
    room = 1000 * width / size
    return [line for part in clean(text).split("\n") for line in _filled(part, weight, room)]


def shortened(text: str, size: float, weight: Weight, width: float) -> str:
    """Shorten a text to one line, with an ellipsis where something is left out.

    Args:
        text, size, weight, width: As in `lines_of`.
    """
    text = one_line(text)
    if width_of(text, size, weight) <= width:
        return text
    room = max(0.0, 1000 * width / size - _word_width(ELLIPSIS, weight))
    return _filled(text, weight, room)[0] + ELLIPSIS


def visual_runs(text: str, weight: Weight) -> list[Run]:
    """Return the runs of a line of cleaned text, from left to right."""
    return [_run(piece.text, piece.face, weight, piece.is_rtl) for piece in visual_pieces(text)]


def visual_pieces(text: str) -> list[Piece]:
    """Return the pieces of a line of cleaned text, from left to right."""
    if _is_plain(text):
        return [Piece(text, LATIN, is_rtl=False)] if text else []
    if not any(map(_is_right_to_left, text)):
        return [Piece(piece, face, is_rtl=False) for face, piece in _by_face(text)]
    levels = _levels(text)
    pieces: list[tuple[int, Piece]] = []
    at = 0
    for level, same in groupby(levels):
        end = at + len(list(same))
        pieces += [
            (level, Piece(piece, face, is_rtl=level % 2 == 1))
            for face, piece in _by_face(text[at:end])
        ]
        at = end
    return [piece for _, piece in _reordered(pieces)]


def _is_plain(text: str) -> bool:
    """Return whether a text is ASCII in one line, as most are: the Latin font shows all of it."""
    return text.isascii() and text.isprintable()


def _shown(char: str) -> str:
    category = unicodedata.category(char)
    if char == "\n" or char in _JOINERS:
        return char
    if category in ("Zl", "Zp"):
        return "\n"
    if category == "Zs":
        return " "
    if category in ("Cc", "Cf", "Cs") or any(ord(char) in block for block in _SELECTORS):
        return ""
    return char


def _in_a_font(char: str) -> str:
    return char if char in f"\n{_JOINERS}" or face_of(char) else f"[U+{ord(char):04X}]"


def without_glyph(texts: Iterable[str]) -> list[str]:
    """Return the characters that no installed font shows, once each, in order, such as
    "U+1F642".
    """
    chars = {_shown(char) for text in texts for char in text} - {"", "\n"}
    return [f"U+{ord(char):04X}" for char in sorted(chars) if _in_a_font(char) != char]


def _filled(text: str, weight: Weight, room: float) -> list[str]:
    """Break a paragraph into lines of at most `room` thousandths of the font size."""
    lines: list[str] = []
    line, used = "", 0.0
    for word in _words(text):
        width = _word_width(word.rstrip(), weight)
        if used + width > room and line:
            lines.append(line)
            line, used = "", 0.0
        if width > room:
            *whole, word = _cut(word, weight, room)
            lines += whole
        line, used = line + word, used + _word_width(word, weight)
    return [line.rstrip() for line in (*lines, line)]


def _words(text: str) -> Iterator[str]:
    """Yield the pieces between which a line may break, with the blanks after them."""
    for word in _WORD.findall(text):
        piece = ""
        for char in word:
            if piece and (_stands_alone(char) or _stands_alone(piece[-1])) and not _is_tied(char):
                yield piece
                piece = ""
            piece += char
        yield piece


def _stands_alone(char: str) -> bool:
    """Return whether the script is written without blanks: lines break between any two
    characters.
    """
    return unicodedata.east_asian_width(char) == "W" and unicodedata.category(char) == "Lo"


def _is_tied(char: str) -> bool:
    """Return whether a character belongs to the one before it."""
    return char.isspace() or char in _JOINERS or unicodedata.category(char)[0] in "MP"


def _cut(word: str, weight: Weight, room: float) -> list[str]:
    """Split a word that is too long for a line."""
    pieces, piece = [], ""
    for cluster in _clusters(word):
        if piece and _word_width(piece + cluster.rstrip(), weight) > room:
            pieces.append(piece)
            piece = ""
        piece += cluster
    return [*pieces, piece]


def _clusters(word: str) -> Iterator[str]:
    cluster = ""
    for char in word:
        is_mark = unicodedata.category(char)[0] == "M" or char in _JOINERS
        if cluster and not is_mark and cluster[-1] not in _JOINERS:
            yield cluster
            cluster = ""
        cluster += char
    yield cluster


@lru_cache(8192)
def _word_width(word: str, weight: Weight) -> float:
    return sum(run.width for run in visual_runs(word, weight))


def _by_face(text: str) -> Iterator[tuple[Face, str]]:
    """Yield pieces of one font each; marks, joiners and blanks stay with what they follow."""
    face, piece = LATIN, ""
    for char in text:
        follows = char in _JOINERS or char == " " or unicodedata.category(char)[0] == "M"
        wanted = face if follows and (char in _JOINERS or has(face, char)) else face_of(char)
        if wanted is not None and wanted is not face:
            if piece:
                yield face, piece
            face, piece = wanted, ""
        piece += char
    if piece:
        yield face, piece


@lru_cache(8192)
def _run(text: str, face: Face, weight: Weight, is_rtl: bool) -> Run:
    font = font_of(face, weight)
    has_marks = any(unicodedata.category(char)[0] == "M" for char in text)
    if face.is_shaped or is_rtl or has_marks:
        return _shaped(text, font, is_rtl)
    is_outlined = face.is_large and weight > 400
    drawn = text.translate(_NO_JOINERS)
    return Run(drawn, font, font.stringWidth(drawn, 1000), None, is_outlined)


def _shaped(text: str, font: TTFont, is_rtl: bool) -> Run:
    with LOCK:
        shaper = font.hbFont()
        buffer = hb.Buffer()
        buffer.add_str(text)
        buffer.guess_segment_properties()
        buffer.direction = "rtl" if is_rtl else "ltr"
        hb.shape(shaper, buffer)
        scale, x = 1000 / shaper.face.upem, 0.0
        glyphs = []
        for info, place in zip(buffer.glyph_infos, buffer.glyph_positions, strict=True):
            char = _char_of(info.codepoint, font)
            glyphs.append(Glyph(char, x + scale * place.x_offset, scale * place.y_offset))
            x += scale * place.x_advance
    return Run(text, font, x, tuple(glyphs), is_outlined=False)


def _char_of(glyph: int, font: Any) -> str:
    """Return the character for which ReportLab draws a glyph; a private one if it has no other.

    It depends on the glyph alone, so that equal reports give equal files.

    Args:
        glyph: Number of the glyph in the font.
        font: A TTFont; its types do not show what it knows about glyphs.
    """
    face = font.face
    known = face.glyphToChar.get(glyph)
    if known:
        return chr(known[0])
    code = _PRIVATE + glyph
    face.charToGlyph[code] = glyph
    # The width of the font itself, as PDF/A demands; where shaped glyphs stand is stated for each.
    face.charWidths[code] = font.pdfScale(face.hmetrics[glyph][0])
    return chr(code)


def _is_right_to_left(char: str) -> bool:
    return unicodedata.bidirectional(char) in _RIGHT_TO_LEFT


def _levels(text: str) -> list[int]:
    """Return the embedding level of each character (UAX 9); odd levels run from right to left."""
    # Here, as it takes 13 MB and half a second, and most reports have no such text.
    from fpdf.bidi import BidiParagraph

    # The algorithm drops joiners; a mark in their place gets the level of its neighbour.
    paragraph = BidiParagraph(re.sub(f"[{_JOINERS}]", "\u0300", text))
    return [char.embedding_level for char in paragraph.get_characters()]


def _reordered(pieces: Sequence[tuple[int, Piece]]) -> list[tuple[int, Piece]]:
    """Reorder whole runs from left to right, by rule L2.

    Adjacent runs of one level are reversed together.
    """
    order = list(pieces)
    highest = max(level for level, _ in order)
    for threshold in range(highest, 0, -1):
        at = 0
        for is_deep, same in groupby([level >= threshold for level, _ in order]):
            end = at + len(list(same))
            if is_deep:
                order[at:end] = order[at:end][::-1]
            at = end
    return order
