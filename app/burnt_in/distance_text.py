"""Recognises a distance in a line of text: "0012.3 m", "+12.34m", "DIST: 49.5 FT"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from app.burnt_in.text_model import Letter

ShownUnit = Literal["m", "ft", ""]
"""Unit beside a number; empty if none is shown."""

UNITS: dict[str, ShownUnit] = {
    **dict.fromkeys(("m", "mt", "mtr", "mtrs", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("f", "ft", "feet", "foot", "'"), "ft"),
}
OTHER_QUANTITIES = {
    "mm",
    "cm",
    "in",
    "v",
    "c",
    "f.",
    "s",
    "sec",
    "h",
    "bar",
    "mbar",
    "deg",
    "%",
    "hz",
}
"""What may follow a number that is no distance."""

NAMES = ("dist", "length", "chain", "counter", "meter", "depth", "tape", "cable")
"""Beginnings of words that announce a distance."""

OTHER_NAMES = ("dn", "dia", "pipe", "size", "height", "width", "speed", "slope", "incl", "press")
"""Beginnings of words that announce another quantity."""

_NUMBER = re.compile(
    r"(?<![\d:/.,])(?P<sign>[+-] ?)?"
    r"(?P<whole>\d{1,5})(?: ?[.,] ?(?P<part>\d{1,3}))?"
    r"(?! ?[\d:/.,])(?: ?(?P<unit>[A-Za-z]+|['%]))?"
)
_NAME = re.compile(r"(?P<name>[A-Za-z]+)[^A-Za-z\d]*$")


@dataclass(frozen=True)
class Distance:
    """A number in a line, with what distinguishes a distance from other numbers."""

    value: float
    decimals: int
    digits: int
    """In all, leading zeros included."""
    unit: ShownUnit
    is_named: bool
    """Whether a word such as DIST stands before it."""
    sure: float
    """Probability of the least certain of its characters."""

    @property
    def likeness(self) -> int:
        """How much of a distance it has: a decimal point, a unit, a name."""
        return 4 * (self.decimals > 0) + 2 * (self.unit != "") + self.is_named


def read_distance(letters: Sequence[Letter]) -> list[Distance]:
    """Return the number of a line that most resembles a distance.

    Second is the same with its least certain digit replaced. A clock, a date and other quantities
    are no distance; the list may be empty.
    """
    text = "".join(letter.best for letter in letters)
    found = [match for match in _NUMBER.finditer(text) if _may_be_distance(match)]
    if not found:
        return []
    match, first = max(
        ((match, _distance(match, letters)) for match in found), key=lambda pair: pair[1].likeness
    )
    weakest = min(_digit_places(match), key=lambda place: letters[place].sure)
    letter = letters[weakest]
    if not letter.other.isdigit():
        return [first]
    changed = text[:weakest] + letter.other + text[weakest + 1 :]
    second = replace(first, value=_value(match, changed), sure=letter.other_sure)
    return [first, second]


def _may_be_distance(match: re.Match[str]) -> bool:
    is_other = (match["unit"] or "").lower() in OTHER_QUANTITIES
    return not is_other and not _name_before(match).startswith(OTHER_NAMES)


def _name_before(match: re.Match[str]) -> str:
    """The word right before a number; empty if there is none."""
    name = _NAME.search(match.string[: match.start()])
    return "" if name is None else name["name"].lower()


def _distance(match: re.Match[str], letters: Sequence[Letter]) -> Distance:
    part = match["part"] or ""
    last = match.end("part") if part else match.end("whole")
    return Distance(
        value=_value(match, match.string),
        decimals=len(part),
        digits=len(match["whole"]) + len(part),
        unit=UNITS.get((match["unit"] or "").lower(), ""),
        is_named=_name_before(match).startswith(NAMES),
        sure=min(letter.sure for letter in letters[match.start() : last]),
    )


def _value(match: re.Match[str], text: str) -> float:
    """The number at the place of a match, in a text that may differ in a digit."""
    sign = -1 if (match["sign"] or "").startswith("-") else 1
    whole, part = (
        text[slice(*match.span(name))] if match[name] else "0" for name in ("whole", "part")
    )
    return sign * float(f"{whole}.{part}")


def _digit_places(match: re.Match[str]) -> list[int]:
    return [
        place
        for name in ("whole", "part")
        for place in range(*match.span(name))  # (-1, -1) if it is missing
        if place >= 0
    ]
