"""Distinct file names in any script, or in ASCII only."""

from __future__ import annotations

import hashlib
import re
import unicodedata

from app.reports.text.ascii import transliterate

_LONGEST = 200
"""Bytes in UTF-8: file systems allow 255, and a suffix follows."""
_CHECKSUM = 6


def safe_file_name(name: str) -> str:
    """Keep letters and digits of any script, dot, dash and underscore; never empty, hidden or a
    path.
    """
    whole = unicodedata.normalize("NFC", name.encode("utf-8", "ignore").decode())
    safe = re.sub(r"[^\w.-]+", "_", whole).strip("._")
    stem, dot, suffix = safe.rpartition(".")
    if not dot:
        stem, suffix = safe, ""
    short = stem.encode()[:_LONGEST].decode("utf-8", "ignore")
    return f"{short}{dot}{suffix[: _CHECKSUM * 2]}" or "report"


def ascii_file_name(name: str) -> str:
    """Return the name in ASCII; if that changed letters, a checksum keeps names distinct."""
    safe = safe_file_name(name)
    if safe.isascii():
        return safe
    digest = hashlib.sha256(safe.encode()).hexdigest()[:_CHECKSUM]
    stem, dot, suffix = safe.rpartition(".") if "." in safe else (safe, "", "")
    return f"{_latin(stem) or 'file'}-{digest}{dot}{_latin(suffix)}"


def _latin(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", transliterate(text)).strip("._")


_LONGEST_STEM = 100
"""Longest asset in the name of a photo: file systems and exchange formats allow 255 characters."""


def file_stem(asset: str) -> str:
    """Return the stem of the names of photos, voice notes and clips.

    For every format, so in ASCII: EN 13508-2 text and RIBX allow nothing else.
    """
    stem = ascii_file_name(asset)
    return stem if len(stem) <= _LONGEST_STEM else stem[-_LONGEST_STEM:].lstrip("._-")
