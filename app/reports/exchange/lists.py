"""Translates words of the header to the letters and numbers of other programs.

The letters of EN 13508-2 are those of its Annex C, as public programs list them; where none fits, Z
(other) is used together with the words.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

OTHER = "Z"

DIRECTIONS_EN: Mapping[str, str] = {"with_flow": "A", "against_flow": "B", "unknown": "C"}
DIRECTIONS_ISYBAU: Mapping[str, str] = {"with_flow": "O", "against_flow": "U"}
DIRECTIONS_M150: Mapping[str, str] = {"with_flow": "I", "against_flow": "G"}

SHAPES_EN: Mapping[str, str] = {
    "circular": "A", "rectangular": "B", "egg": "C", "u_shaped": "D", "arch": "E", "oval": "F",
    "other": OTHER,
}  # fmt: skip
SHAPES_ISYBAU: Mapping[str, str] = {"circular": "0", "egg": "1", "rectangular": "3"}
"""List G205."""
SHAPES_M150: Mapping[str, str] = {"circular": "0"}
"""List HG305; only the circle is known."""

METHODS_EN: Mapping[str, str] = {"walk_through": "A", "camera": "B", "from_end_only": "C"}
METHODS_ISYBAU: Mapping[str, str] = {"camera": "0", "walk_through": "1", "from_end_only": "2"}
"""List U108."""

PURPOSES_EN: Mapping[str, str] = {
    "acceptance": "A", "end_of_warranty": "B", "routine": "C", "after_repair": "G",
    "first_survey": OTHER, "follow_up": OTHER, "before_repair": OTHER,
}  # fmt: skip
"""List ABP."""
USES_EN: Mapping[str, str] = {
    "foul": "A", "storm": "B", "combined": "C", "culvert": "E", "drain": OTHER,
}  # fmt: skip
"""List ACK."""
GRAVITY_EN = "A"
"""ACJ: all uses that the header knows run by gravity."""
FLOW_CONTROL_EN: Mapping[str, str] = {"1": "A", "2": "B", "3": "C"}
"""ADC from U107: no measures, blocked upstream, partly blocked."""
WARM_EN = "A"
"""ADB: above freezing; the list cannot hold the degrees."""
FROST_EN = "B"
"""ADB: at or below freezing."""

PURPOSES_ISYBAU: Mapping[str, str] = {
    "first_survey": "1", "routine": "2", "acceptance": "3", "end_of_warranty": "4",
    "follow_up": "5", "before_repair": "6", "after_repair": "7",
}  # fmt: skip
"""List U101."""
PURPOSES_M150: Mapping[str, str] = {
    "routine": "1", "acceptance": "2", "end_of_warranty": "3", "after_repair": "5",
}  # fmt: skip
"""List HI004."""
ANY_PURPOSE_M150 = "4"
"""Purpose: to assess the condition."""

SYSTEMS_ISYBAU: Mapping[str, str] = {
    "culvert": "KR", "storm": "KR", "drain": "KR", "foul": "KS", "combined": "KM",
}  # fmt: skip
"""List G101."""
SYSTEMS_M150: Mapping[str, str] = {
    "culvert": "R", "storm": "R", "drain": "R", "foul": "S", "combined": "M",
}  # fmt: skip
"""List HG302."""


def is_distinct(asset_type: object) -> bool:
    """Return whether the German lists of pipe contents know this type: culverts and drains are
    storm.
    """
    return asset_type not in ("culvert", "drain")


@dataclass(frozen=True)
class Meaning:
    """The codes for some words."""

    en: str
    """Letter of EN 13508-2 and RIBX."""
    german: str | None
    """Number of the ISYBAU list, which DWA-M 150 shares."""


_Words = tuple[tuple[str, Meaning], ...]

_MATERIALS: _Words = (
    (r"asbestos", Meaning("AA", "AZ")),
    (r"fib(re|er) cement", Meaning("AK", "FZ")),
    (r"sprayed|shotcrete", Meaning("AI", None)),
    (r"polymer", Meaning(OTHER, None)),
    (r"segment", Meaning("AJ", "BS")),
    (r"reinforced|bertetulang|\brcp?\b|\brcc\b", Meaning("AH", "SB")),
    (r"concrete|konkrit", Meaning("AG", "B")),
    (r"brick|\bbata\b", Meaning("AD", "MA")),
    (r"masonry|stone\b|batu\b", Meaning(OTHER, "MA")),
    (r"clay|stoneware|vitrified|tanah liat", Meaning("AE", "STZ")),
    (r"ductile", Meaning("AO", "GGG")),
    (r"gr[ea]y (cast )?iron", Meaning("AN", "GG")),
    (r"cast iron", Meaning("AM", "GG")),
    (r"steel|keluli|corrugated metal|\bcmp\b", Meaning("AP", "ST")),
    (r"hdpe", Meaning("AV", "PEHD")),
    (r"polyethylene|\bpe\b", Meaning("AV", "PE")),
    (r"polypropylene|\bpp\b", Meaning("AW", "PP")),
    (r"pvc", Meaning("AX", "PVCU")),
    (r"\bgrp\b|glass", Meaning("AL", "GFK")),
    (r"unknown|not known|tidak diketahui", Meaning("AZ", None)),
)
_WEATHER: _Words = (
    (r"snow|melt|thaw", Meaning("C", "3")),
    (r"\b(dry|sun|sunny|clear|fine|no rain|kering|cerah)\b", Meaning("A", "1")),
    (r"rain|shower|wet|hujan", Meaning("B", "2")),
)
"""Lists ADA and U106."""
_FLOW_CONTROL: _Words = (
    (r"^(none|no|nil|tiada)\b", Meaning(OTHER, "1")),
    (r"upstream|hulu", Meaning(OTHER, "2")),
    (r"part", Meaning(OTHER, "3")),
    (r"lateral", Meaning(OTHER, "4")),
    (r"backwater", Meaning(OTHER, "5")),
)
"""List U107."""
_LININGS: tuple[tuple[str, str], ...] = (
    (r"factory|manufactur|kilang", "A"),
    (r"spray|gunite|shotcrete", "B"),
    (r"cured|cipp|\bliner\b", "C"),
    (r"segment", "D"),
    (r"discrete", "E"),
    (r"slip|continuous", "F"),
    (r"close.?fit", "G"),
    (r"spiral", "H"),
)
"""List ACE."""
_REASONS: tuple[tuple[str, str], ...] = (
    (r"client|waive", "AV"),
    (r"(aim|target|goal) (was |is )?reached", "ZE"),
    (r"(?<!not )reached from the other", "GE"),
    (r"not possible from", "IN"),
)
"""List U134."""
NOT_REACHED = "GN"
"""The far end was not reached."""
_REFERENCE_POINTS: _Words = (
    (r"cent(re|er).*(manhole|chamber|shaft)", Meaning("C", "1")),
    (r"inner (face|wall)|headwall|inside face", Meaning("A", "2")),
    (r"(crown|end) of (the )?pipe|pipe end", Meaning("B", "3")),
    (r"half ?way", Meaning("D", "4")),
)
"""Lists ABC and U105."""


def material(words: str) -> Meaning | None:
    """Find the codes of ACD and G102, or None."""
    return _first(_MATERIALS, words)


def weather(words: str) -> Meaning | None:
    """Find the codes of ADA and U106, or None."""
    return _first(_WEATHER, words)


def flow_control(words: str) -> str | None:
    """Find the code of U107, or None."""
    found = _first(_FLOW_CONTROL, words)
    return found.german if found else None


def lining(words: str) -> str:
    """Find the letter of ACE, or Z."""
    return _letter(_LININGS, words) or OTHER


def grounds(words: str) -> str:
    """Find the code of U134, why a survey was abandoned."""
    return _letter(_REASONS, words) or NOT_REACHED


def reference_point(words: str) -> Meaning | None:
    """Find the codes of ABC and U105, or None."""
    return _first(_REFERENCE_POINTS, words)


def _first(meanings: _Words, words: str) -> Meaning | None:
    lower = words.lower()
    return next((meaning for pattern, meaning in meanings if re.search(pattern, lower)), None)


def _letter(letters: tuple[tuple[str, str], ...], words: str) -> str | None:
    lower = words.lower()
    return next((letter for pattern, letter in letters if re.search(pattern, lower)), None)
