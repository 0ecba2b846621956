"""Decodes text of other programs by the encoding that it names."""

from __future__ import annotations

import codecs
import re

from app.imports.surveys.survey import Caveat

_LATIN = "cp1252"
"""Also of files that name ISO-8859-1, whose further letters it has, as browsers take it."""
_PAGE = re.compile(r"(?:ibm|cp|dos|oem|windows|win|microsoft|codepage)[-_ ]?([0-9]{3,5})")
_ISO = re.compile(r"iso[-_ ]?8859[-_ ]([0-9]{1,2})(?::[0-9]{4})?")
_BY_NAME = {"ansi": _LATIN, "latin1": _LATIN, "latin-1": _LATIN}
_MARKS = ((codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
_LOST = "\N{REPLACEMENT CHARACTER}"


def decoded(content: bytes, named: str) -> tuple[str, tuple[Caveat, ...]]:
    """Return the text, and warnings where its letters may be wrong.

    Text that is valid UTF-8 is UTF-8, whatever it names: other encodings hardly ever are.

    Args:
        content: The bytes.
        named: The encoding that they name, such as `ISO-8859-1:1998` or `IBM850`; empty for none.
    """
    for mark, encoding in (*_MARKS, *_without_mark(content)):
        if content.startswith(mark):
            return content.decode(encoding, "replace"), ()
    try:
        return content.decode("utf-8-sig"), ()
    except UnicodeDecodeError:
        pass  # so it is of one byte a letter
    known = _codec(named)
    text = content.decode(known or _LATIN, "replace")
    said = [] if known else [Caveat("letters_assumed", values={"named": f"{named!r:.40}"})]
    if lost := text.count(_LOST):
        said.append(Caveat("letters_lost", values={"count": lost, "encoding": known or _LATIN}))
    return text, tuple(said)


def _without_mark(content: bytes) -> tuple[tuple[bytes, str], ...]:
    """Return the form of UTF-16 without a mark: each letter of ASCII has a zero beside it."""
    return tuple(
        (content[:2], encoding)
        for at, encoding in ((0, "utf-16-be"), (1, "utf-16-le"))
        if len(content) > 1 and content[at] == 0 and content[1 - at] != 0
    )


def _codec(named: str) -> str | None:
    """Return Python's name of an encoding of one byte a letter, or None."""
    name = named.strip().lower()
    page, iso = _PAGE.fullmatch(name), _ISO.fullmatch(name)
    if iso and iso[1] == "1":
        return _LATIN
    found = f"cp{page[1]}" if page else f"iso8859-{iso[1]}" if iso else _BY_NAME.get(name, "")
    try:
        return codecs.lookup(found).name if found else None
    except LookupError:
        return None
