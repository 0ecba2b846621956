"""Cleans text of any origin, so that every format can hold it."""

from __future__ import annotations

import re

_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")


def legible(text: str) -> str:
    """Replace control characters and surrogates by a mark.

    Tabs and line ends stay; the result is valid in UTF-8 and in XML 1.0.
    """
    return _UNPRINTABLE.sub("\ufffd", text)
