"""Text and times that every format writes alike."""

from __future__ import annotations

import re
from datetime import datetime

_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")


def legible(text: str) -> str:
    """Replace control characters and surrogates by a mark.

    Tabs and line ends stay; the result is valid in UTF-8 and in XML 1.0.
    """
    return _UNPRINTABLE.sub("\ufffd", text)


def iso(instant: datetime | None) -> str | None:
    """Format to the second, with the time zone."""
    return None if instant is None else instant.isoformat(timespec="seconds")
