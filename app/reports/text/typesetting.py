"""Text of any script: in a form that fonts can show, and in pieces of one font each."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator
from functools import lru_cache

from PIL import ImageFont

from app.reports.text.fonts import LATIN, Face, Weight, face_of, has, installed

_JOINERS = "\u200c\u200d"
_MEASURED = 100.0
"""Size at which widths are measured, px: rounding to pixels does not matter."""
_SELECTORS = (range(0xFE00, 0xFE10), range(0xE0100, 0xE01F0))


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


def is_mark(char: str) -> bool:
    """Return whether a character is written on, below or around the letter before it."""
    return unicodedata.category(char)[0] == "M"


def one_line(text: str) -> str:
    """Return the cleaned text with blanks for line breaks."""
    return " ".join(clean(text).split())


def without_glyph(texts: Iterable[str]) -> list[str]:
    """Return the characters that no installed font shows, once each, in order, such as
    "U+1F642".
    """
    chars = {_shown(char) for text in texts for char in text} - {"", "\n"}
    return [f"U+{ord(char):04X}" for char in sorted(chars) if _in_a_font(char) != char]


def pieces_of(text: str) -> Iterator[tuple[Face, str]]:
    """Yield the pieces of a line of cleaned text, each with its font.

    A font that has all of the text shows all of it, so that letters from right to left and figures
    between them are put in order together. Marks, joiners and blanks stay with what they follow.
    """
    if _is_plain(text):
        if text:
            yield LATIN, text
        return
    whole = next((face for face in installed() if all(has(face, char) for char in text)), None)
    face, piece = whole or LATIN, ""
    for char in text:
        is_tied = char in _JOINERS or char == " " or is_mark(char)
        keeps = whole or (is_tied and (char in _JOINERS or has(face, char)))
        wanted = face if keeps else face_of(char) or face
        if wanted is not face:
            if piece:
                yield face, piece
            face, piece = wanted, ""
        piece += char
    yield face, piece


def lines_of(text: str, size: float, weight: Weight, width: float) -> list[str]:
    """Break text that is drawn on a picture into lines of at most a width; a single letter may be
    wider.

    Args:
        text: Text before cleaning; its line breaks are kept.
        size: Size of the font, in any unit.
        weight: Weight of the font.
        width: Width of the lines, in the same unit.
    """
    parts = clean(text).split("\n")
    return [line for part in parts for line in _filled(part, weight, width / size)]


def width_of(text: str, size: float, weight: Weight) -> float:
    """Return the width of cleaned text in one line, in the unit of its size."""
    return _width_of(text, weight) * size


def _filled(text: str, weight: Weight, room: float) -> Iterator[str]:
    line, used, blank = "", 0.0, _width_of(" ", weight)
    for word in text.split(" "):
        width = _width_of(word, weight)
        if line and used + blank + width <= room:
            line, used = f"{line} {word}", used + blank + width
            continue
        if line:
            yield line
        line, used = word, width
        if width > room:
            *whole, line = _cut(word, weight, room)
            yield from whole
            used = _width_of(line, weight)
    yield line


def _cut(word: str, weight: Weight, room: float) -> Iterator[str]:
    """Split a word that is too long for a line."""
    piece = ""
    for cluster in _clusters(word):
        if piece and _width_of(piece + cluster, weight) > room:
            yield piece
            piece = ""
        piece += cluster
    yield piece


def _clusters(word: str) -> Iterator[str]:
    """Yield what is read as one letter: a character with its marks and what is joined to it."""
    cluster = ""
    for char in word:
        is_tied = is_mark(char) or char in _JOINERS
        if cluster and not is_tied and cluster[-1] not in _JOINERS:
            yield cluster
            cluster = ""
        cluster += char
    yield cluster


@lru_cache(8192)
def _width_of(word: str, weight: Weight) -> float:
    """Return the width of a word in heights of the font."""
    return sum(
        font_of(face, _MEASURED, weight).getlength(piece) / _MEASURED
        for face, piece in pieces_of(word)
    )


@lru_cache(64)
def font_of(face: Face, size: float, weight: Weight = 400) -> ImageFont.FreeTypeFont:
    """Return a font for drawing on pictures; its weight is not the file's own, which may be
    hair-thin.
    """
    font = ImageFont.truetype(str(face.file), size)
    if face.is_variable:
        axes = font.get_variation_axes()
        font.set_variation_by_axes(
            [weight if axis["name"] == b"Weight" else axis["default"] or 0 for axis in axes]
        )
    return font


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
    """Return the character, or its number if no font has it or it means something to one alone."""
    is_private = unicodedata.category(char) == "Co"
    is_shown = char in f"\n{_JOINERS}" or (face_of(char) and not is_private)
    return char if is_shown else f"[U+{ord(char):04X}]"
