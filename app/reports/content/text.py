"""Text that came from anywhere, so that every format can hold it."""

from __future__ import annotations

import re

_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")


def legible(text: str) -> str:
    """The same with a mark in place of control characters and of halves of characters.

    Tabs and line ends stay; what is left fits in UTF-8 and in XML 1.0.
    """
    return _UNPRINTABLE.sub("\ufffd", text)
