"""Converts text for readers that accept only one line, or only ASCII."""

from __future__ import annotations

import re
import unicodedata

from anyascii import anyascii

_ILLEGAL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f\ud800-\udfff\ufffd-\uffff]")
_OWN = str.maketrans(
    {
        "ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "ẞ": "SS",
        "±": "+/-", "°": " deg", "…": "...",
    }
)  # fmt: skip
"""Letters for which inspectors use other forms than anyascii."""


def one_line(text: str) -> str:
    """Join lines, collapse blanks, and drop what XML 1.0 does not allow."""
    return " ".join(_ILLEGAL.sub("", text).split())


def transliterate(text: str) -> str:
    """Return one line of printable ASCII; a letter without a Latin form becomes its number."""
    composed = unicodedata.normalize("NFC", one_line(text))
    return one_line("".join(map(_latin, composed.translate(_OWN))))


def _latin(character: str) -> str:
    found = anyascii(character)
    is_lost = not found and unicodedata.category(character) in ("Lu", "Ll", "Lt", "Nd", "No")
    return f"U+{ord(character):04X}" if is_lost else found
