"""Paths of films as text that JSON and every database hold, and back.

A name on the disk is bytes.  What is not UTF-8 in it, Python shows as the lone surrogates U+DC80 to
U+DCFF, which no UTF-8 text may contain; the text has the private characters U+10DC80 to U+10DCFF
in their place.
"""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath

_SURROGATES = range(0xDC80, 0xDD00)
_PRIVATE = 0x100000
_TO_TEXT = {code: code + _PRIVATE for code in _SURROGATES}
_FROM_TEXT = {code + _PRIVATE: code for code in _SURROGATES}
_ILLEGIBLE = dict.fromkeys((*range(0x20), *range(0x7F, 0xA0)), " ") | dict.fromkeys(
    _FROM_TEXT, "\N{REPLACEMENT CHARACTER}"
)
_LONGEST_NAME = 200


def text_of(path: os.PathLike[str] | str) -> str:
    """Return the text of a path."""
    return os.fspath(path).translate(_TO_TEXT)


def path_of(text: str) -> Path:
    """Return the path of a text."""
    return Path(text.translate(_FROM_TEXT))


def title_of(text: str) -> str:
    """Return the file name without its suffix as one legible line, the default name of a film."""
    return line_of(PurePosixPath(text).stem) or "film"


def line_of(text: str) -> str:
    """Return text without control characters, as long as a name may be."""
    return text.translate(_ILLEGIBLE).strip()[:_LONGEST_NAME].strip()
