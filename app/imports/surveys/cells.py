"""How texts of other programs' files are parsed."""

from __future__ import annotations

import math
import re
import unicodedata
from datetime import date

from app.survey.fields.header import LONGEST_TEXT

_MOST_M = 100_000.0
_MOST_QUANTITY = 1e6

_STRETCH = re.compile(r"([ABC])0*([1-9][0-9]{0,2})")
_NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]{1,3})?")
_CLOCK_TIME = re.compile(r"(?:([0-9]{1,3}):)?([0-5]?[0-9]):([0-5]?[0-9])(?:[:.,][0-9]{1,3})?")
_DIGITS = re.compile(r"[0-9]{1,8}")
_GERMAN_DATE = re.compile(r"([0-3]?[0-9])[./]([01]?[0-9])[./]([0-9]{4})")
_ISO_DATE = re.compile(r"([0-9]{4})-([01]?[0-9])-([0-3]?[0-9])")
_TIME = re.compile(r"([01]?[0-9]|2[0-3]):([0-5][0-9])(?::([0-5][0-9]))?")


def clean(text: str, longest: int = LONGEST_TEXT) -> str:
    """Return one line without control characters, cut to a length."""
    legible = "".join(
        " " if character.isspace() else character
        for character in text
        if character.isspace() or unicodedata.category(character) not in ("Cc", "Cs")
    )
    return " ".join(legible.split())[:longest].rstrip()


def number(text: str, most: float = _MOST_M) -> float | None:
    """Parse a number with a point or a comma; None if it is invalid or too large."""
    stripped = text.strip()
    if not _NUMBER.fullmatch(stripped):
        return None
    found = float(stripped.replace(",", "."))
    return found if math.isfinite(found) and abs(found) <= most else None


def figure(text: str) -> float | str | None:
    """Parse a number of the header; another text stays, which `fitting_header` says is none."""
    found = number(text)
    return found if found is not None else text or None


def quantity(text: str) -> float | None:
    """Parse a number within the limits of an observation."""
    return number(text, _MOST_QUANTITY)


def clock(text: str) -> int | None:
    """Parse a whole hour; 0 and 00 mean none."""
    hour = number(text, 12)
    return int(hour) if hour is not None and hour >= 1 and hour == int(hour) else None


def stretch(text: str) -> str | None:
    """Parse a stretch mark; A01 becomes A1."""
    found = _STRETCH.fullmatch(text.strip().upper())
    return f"{found[1]}{found[2]}" if found else None


def behind_remark(remark: str, label: str) -> tuple[str, float | None]:
    """Split off a number that stands, with its label, at the end of a remark."""
    rest, found, last = f", {remark}".rpartition(f", {label} ")
    value = quantity(last) if found else None
    return (remark, None) if value is None else (rest[2:], value)


def severity_of(remark: str) -> tuple[str, int | None]:
    """Split off the severity at the end of a remark, where our exports put it."""
    rest, value = behind_remark(remark, "severity")
    is_one = value is not None and value in range(6)
    return (rest, int(value or 0)) if is_one else (remark, None)


def video_time_s(text: str) -> float | None:
    """Parse hh:mm:ss, mm:ss, file|hh:mm:ss, or digits such as 5316 for 53 min 16 s."""
    part = text.rpartition("|")[2].strip()
    found = _CLOCK_TIME.fullmatch(part)
    if found:
        return float(3600 * int(found[1] or 0) + 60 * int(found[2]) + int(found[3]))
    if not _DIGITS.fullmatch(part):
        return None
    digits = int(part)
    hours, minutes, seconds = digits // 10_000, digits // 100 % 100, digits % 100
    return float(3600 * hours + 60 * minutes + seconds) if max(minutes, seconds) < 60 else None


def iso_date(text: str) -> str | None:
    """Convert 2026-09-14, 14.09.2026 or 14/09/2026, with or without a time, to ISO 8601."""
    part = text.strip().split(" ")[0].split("T")[0]
    found = _ISO_DATE.fullmatch(part)
    parts = found.groups() if found else None
    if parts is None and (found := _GERMAN_DATE.fullmatch(part)):
        parts = found.groups()[::-1]
    try:
        return date(*map(int, parts)).isoformat() if parts else None
    except ValueError:
        return None


def time_of_day(text: str) -> str | None:
    """Parse hh:mm or hh:mm:ss, with or without a date before."""
    part = text.strip().replace("T", " ").rpartition(" ")[2].partition(".")[0]
    found = _TIME.fullmatch(part)
    if not found:
        return None
    return f"{int(found[1]):02d}:{found[2]}" + (f":{found[3]}" if found[3] else "")
