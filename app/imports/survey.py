"""What a file of another program says of surveys, and how its cells are read.

A reader never refuses what it can keep: what has no field here goes to the remark, and what is odd
is named with its line.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import date
from typing import Any

from app.survey.catalogue.header import FIELDS, LONGEST_TEXT, faults
from app.survey.tag import LONGEST_IMPORTED_REMARK, StatedTag

MOST_SURVEYS = 200
MOST_OBSERVATIONS = 10_000
"""Of one survey; a long culvert in a bad state has 2000 defects."""
MOST_OF_FILE = 20_000
"""Observations of all surveys of a file."""
MOST_WARNINGS = 1000
"""Ten times what the API takes: an export adds to it, and spells other letters in Latin ones."""
LONGEST_PHOTO_NAME = 255
_MOST_HEADER_FIELDS = 100
_MOST_M = 100_000.0
_MOST_QUANTITY = 1e6

_CODE = re.compile(r"[A-Z][A-Z0-9]{1,7}")
_LETTER = re.compile(r"[A-Z][A-Z0-9]?")
_STRETCH = re.compile(r"([ABC])0*([1-9][0-9]{0,2})")
_NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]{1,3})?")
_CLOCK_TIME = re.compile(r"(?:([0-9]{1,3}):)?([0-5]?[0-9]):([0-5]?[0-9])(?:[:.,][0-9]{1,3})?")
_DIGITS = re.compile(r"[0-9]{1,8}")
_GERMAN_DATE = re.compile(r"([0-3]?[0-9])[./]([01]?[0-9])[./]([0-9]{4})")
_ISO_DATE = re.compile(r"([0-9]{4})-([01]?[0-9])-([0-3]?[0-9])")
_TIME = re.compile(r"([01]?[0-9]|2[0-3]):([0-5][0-9])(?::([0-5][0-9]))?")


@dataclass(frozen=True)
class Caveat:
    """Something odd in the file."""

    detail: str
    """A sentence for a person."""
    line: int | None = None
    """Counted from 1; None where the file has no lines."""

    def __str__(self) -> str:
        return self.detail if self.line is None else f"Line {self.line}: {self.detail}"


@dataclass(frozen=True)
class ImportedObservation:
    """One row of a survey; None is what is not said."""

    distance_m: float
    code: str | None = None
    char1: str | None = None
    char2: str | None = None
    quant1: float | None = None
    quant2: float | None = None
    clock_from: int | None = None
    clock_to: int | None = None
    stretch: str | None = None
    """A1 starts number 1, C1 changes it, B1 finishes it."""
    at_joint: bool = False
    remark: str = ""
    photo: str | None = None
    """What its picture is called, which is not here."""
    time_s: float | None = None
    """Into the film, which is not here either."""
    line: int | None = None

    def tag(self, frame: int) -> StatedTag:
        """As it is kept, at a frame of the track that is made of the survey."""
        return StatedTag.model_construct(
            frame=frame,
            code=self.code,
            char1=self.char1,
            char2=self.char2,
            quant1=self.quant1,
            quant2=self.quant2,
            clock_from=self.clock_from,
            clock_to=self.clock_to,
            continuous=self.stretch,
            remark=self.remark[:LONGEST_IMPORTED_REMARK] or None,
            at_joint=self.at_joint or None,
            photo_name=self.photo or None,
        )


@dataclass(frozen=True)
class ImportedSurvey:
    """One run of a camera through one culvert."""

    name: str
    header: Mapping[str, Any]
    """By the names of `app.survey.catalogue.header.FIELDS` and others; every known field fits."""
    observations: tuple[ImportedObservation, ...]
    """In the order of the file."""
    warnings: tuple[Caveat, ...] = ()


@dataclass(frozen=True)
class ImportedFile:
    """All surveys of a file."""

    surveys: tuple[ImportedSurvey, ...]
    warnings: tuple[Caveat, ...] = ()
    """What is not of one survey, such as a block that cannot be read."""


def clean(text: str, longest: int = LONGEST_TEXT) -> str:
    """One line without control characters, not longer than that."""
    legible = "".join(
        " " if character.isspace() else character
        for character in text
        if character.isspace() or unicodedata.category(character) not in ("Cc", "Cs", "Co", "Cn")
    )
    return " ".join(legible.split())[:longest].rstrip()


def number(text: str, most: float = _MOST_M) -> float | None:
    """With a point or a comma; None if it is none, or too large."""
    stripped = text.strip()
    if not _NUMBER.fullmatch(stripped):
        return None
    found = float(stripped.replace(",", "."))
    return found if math.isfinite(found) and abs(found) <= most else None


def quantity(text: str) -> float | None:
    """As `number`, within what an observation may hold."""
    return number(text, _MOST_QUANTITY)


def clock(text: str) -> int | None:
    """A whole hour; 0 and 00 stand for none."""
    hour = number(text, 12)
    return int(hour) if hour is not None and hour >= 1 and hour == int(hour) else None


def stretch(text: str) -> str | None:
    """A1, also of A01."""
    found = _STRETCH.fullmatch(text.strip().upper())
    return f"{found[1]}{found[2]}" if found else None


def video_time_s(text: str) -> float | None:
    """Of hh:mm:ss, mm:ss, file|hh:mm:ss, or digits such as 5316 for 53 min 16 s."""
    told = text.rpartition("|")[2].strip()
    found = _CLOCK_TIME.fullmatch(told)
    if found:
        return float(3600 * int(found[1] or 0) + 60 * int(found[2]) + int(found[3]))
    if not _DIGITS.fullmatch(told):
        return None
    digits = int(told)
    hours, minutes, seconds = digits // 10_000, digits // 100 % 100, digits % 100
    return float(3600 * hours + 60 * minutes + seconds) if max(minutes, seconds) < 60 else None


def iso_date(text: str) -> str | None:
    """Of 2026-09-14, 14.09.2026 and 14/09/2026, also with a time behind."""
    told = text.strip().split(" ")[0].split("T")[0]
    found = _ISO_DATE.fullmatch(told)
    parts = found.groups() if found else None
    if parts is None and (found := _GERMAN_DATE.fullmatch(told)):
        parts = found.groups()[::-1]
    try:
        return date(*map(int, parts)).isoformat() if parts else None
    except ValueError:
        return None


def time_of_day(text: str) -> str | None:
    """hh:mm or hh:mm:ss, also behind a date."""
    told = text.strip().replace("T", " ").rpartition(" ")[2].partition(".")[0]
    found = _TIME.fullmatch(told)
    if not found:
        return None
    return f"{int(found[1]):02d}:{found[2]}" + (f":{found[3]}" if found[3] else "")


@dataclass
class Notes:
    """Warnings of one survey, as they come; there may be too many to name all."""

    said: list[Caveat] = field(default_factory=list)

    def add(self, detail: str, line: int | None = None) -> None:
        """One more; the first ones of very many are enough."""
        if len(self.said) < MOST_WARNINGS:
            self.said.append(Caveat(detail, line))
        elif len(self.said) == MOST_WARNINGS:
            self.said.append(Caveat("There is more of that; the rest is not named."))


def too_many() -> str:
    """Why observations are left out, a sentence."""
    return (
        f"{MOST_OBSERVATIONS} observations are read of a survey, and {MOST_OF_FILE} of a file, not "
        "more."
    )


def coded(observation: ImportedObservation, notes: Notes) -> ImportedObservation:
    """The same with a code, characters and a stretch that may be stored; others join the remark."""
    changes: dict[str, Any] = {}
    said = [observation.remark]
    for name, pattern in (("code", _CODE), ("char1", _LETTER), ("char2", _LETTER)):
        value = clean(getattr(observation, name) or "", 40).upper() or None
        if value is not None and not pattern.fullmatch(value):
            notes.add(f"{name} {value!r} cannot be a {name}; the remark says so.", observation.line)
            said.append(f"{name} {value}")
            value = None
        changes[name] = value
    remark = ", ".join(part for part in said if part)
    if len(remark) > LONGEST_IMPORTED_REMARK:
        notes.add(
            f"The remark has {len(remark)} characters; "
            f"the first {LONGEST_IMPORTED_REMARK} are kept.",
            observation.line,
        )
    changes["remark"] = remark[:LONGEST_IMPORTED_REMARK]
    photo = observation.photo or ""
    if len(photo) > LONGEST_PHOTO_NAME:
        notes.add(f"The name of the photo is longer than {LONGEST_PHOTO_NAME} characters and cut.")
    changes["photo"] = photo[:LONGEST_PHOTO_NAME] or None
    return replace(observation, **changes)


def fitting_header(stated: Mapping[str, Any], notes: Notes) -> dict[str, Any]:
    """The header without what its fields may not hold; that joins the remarks."""
    kept: dict[str, Any] = {}
    outside: list[str] = []
    for name, value in stated.items():
        told = clean(value) if isinstance(value, str) else value
        if isinstance(value, str) and len(value) > LONGEST_TEXT:
            notes.add(f"Of the header field {name} {LONGEST_TEXT} characters are kept, not more.")
        if told is None or told == "":
            continue
        if faults({name: told}):
            notes.add(f"The header field {name} cannot be {told!r:.60}; the remarks say so.")
            outside.append(f"{name}: {told}")
        elif len(kept) == _MOST_HEADER_FIELDS:
            notes.add(f"The header has too many fields; {name} is left out.")
        else:
            kept[name] = told
    if outside:
        kept["remarks"] = clean(", ".join([str(kept.get("remarks", "")), *outside]).strip(", "))
    known = [field.name for field in FIELDS]
    order = {name: place for place, name in enumerate(known)}
    return dict(sorted(kept.items(), key=lambda item: order.get(item[0], len(known))))
