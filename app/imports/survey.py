"""Surveys read from files of other programs, and how their cells are parsed.

A reader keeps as much as it can: values without a field go to the remark, and odd ones are reported
with their line.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from typing import Any

from app.survey.fields.header import FIELDS, LONGEST_TEXT, faults
from app.survey.tag import LONGEST_IMPORTED_REMARK, StatedTag

MOST_SURVEYS = 200
MOST_OBSERVATIONS = 10_000
"""Most observations of one survey; a long culvert in a bad state has 2000 defects."""
MOST_OF_FILE = 20_000
"""Most observations of all surveys of a file."""
MOST_WARNINGS = 1000
"""Ten times as many as the API accepts: an export adds some, and transliterates other letters."""
LONGEST_PHOTO_NAME = 255
START, END, ABANDONED = "BCD", "BCE", "BDC"
"""Codes of EN 13508-2."""
_MOST_HEADER_FIELDS = 100
_MOST_M = 100_000.0
_MOST_QUANTITY = 1e6

_CODE = re.compile(r"[A-Z][A-Z0-9]{0,7}")
_LETTER = re.compile(r"[A-Z][A-Z0-9]{0,3}")
_STRETCH = re.compile(r"([ABC])0*([1-9][0-9]{0,2})")
_NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]{1,3})?")
_CLOCK_TIME = re.compile(r"(?:([0-9]{1,3}):)?([0-5]?[0-9]):([0-5]?[0-9])(?:[:.,][0-9]{1,3})?")
_DIGITS = re.compile(r"[0-9]{1,8}")
_GERMAN_DATE = re.compile(r"([0-3]?[0-9])[./]([01]?[0-9])[./]([0-9]{4})")
_ISO_DATE = re.compile(r"([0-9]{4})-([01]?[0-9])-([0-3]?[0-9])")
_TIME = re.compile(r"([01]?[0-9]|2[0-3]):([0-5][0-9])(?::([0-5][0-9]))?")


@dataclass(frozen=True)
class Caveat:
    """Something odd in the file, which `Translator.caveat` says in the language of the reader."""

    key: str
    """Key of the sentence, without its area `caveat`."""
    line: int | None = None
    """Counted from 1; None where the file has no lines."""
    values: Mapping[str, str | int | tuple[str, ...]] = field(default_factory=dict)
    """What the sentence contains; a tuple has keys of the words `brought`, `field` the name of a
    field."""
    survey: str | None = None
    """Name of the survey that it concerns, where the file has several."""


def too_many_surveys(line: int | None = None) -> Caveat:
    """Return that the file has more surveys than are read of one."""
    return Caveat("too_many_surveys", line, {"most": MOST_SURVEYS})


@dataclass(frozen=True)
class ImportedObservation:
    """One row of a survey; None means not stated."""

    distance_m: float
    code: str | None = None
    char1: str | None = None
    char2: str | None = None
    quant1: float | None = None
    quant2: float | None = None
    clock_from: int | None = None
    clock_to: int | None = None
    severity: int | None = None
    stretch: str | None = None
    """A1 starts number 1, C1 changes it, B1 finishes it."""
    at_joint: bool = False
    remark: str = ""
    photo: str | None = None
    """Name of its picture, which is not here."""
    time_s: float | None = None
    """Time in the film, which is not here either."""
    line: int | None = None

    def tag(self, frame: int) -> StatedTag:
        """Return the tag to store, at a frame of the track made from the survey."""
        return StatedTag.model_construct(
            frame=frame,
            code=self.code,
            char1=self.char1,
            char2=self.char2,
            quant1=self.quant1,
            quant2=self.quant2,
            clock_from=self.clock_from,
            clock_to=self.clock_to,
            severity=self.severity,
            continuous=self.stretch,
            remark=self.remark[:LONGEST_IMPORTED_REMARK] or None,
            at_joint=self.at_joint or None,
            photo_name=self.photo or None,
            film_time_s=self.time_s,
        )


@dataclass(frozen=True)
class ImportedSurvey:
    """One survey of one culvert."""

    name: str
    header: Mapping[str, Any]
    """Values by the names of `app.survey.fields.header.FIELDS` and others; known fields are
    valid."""
    observations: tuple[ImportedObservation, ...]
    """Observations in the order of the file."""
    warnings: tuple[Caveat, ...] = ()
    surveyed_m: float | None = None
    """How far the survey came, if that is stated and not only where the observations are."""


@dataclass(frozen=True)
class ImportedFile:
    """All surveys of a file."""

    surveys: tuple[ImportedSurvey, ...]
    warnings: tuple[Caveat, ...] = ()
    """Caveats that concern no single survey, such as an unreadable block."""


def without_empty(header: Mapping[str, Any]) -> dict[str, Any]:
    """Return the stated fields; an empty film stays, as words of a remark name other films than
    that of the observations.
    """
    return {
        name: value
        for name, value in header.items()
        if value not in (None, "") or name == "video_files"
    }


def survey_of(
    header: dict[str, Any],
    observations: Sequence[ImportedObservation],
    notes: Notes,
    otherwise: str,
    *,
    surveyed_m: float | None = None,
) -> ImportedSurvey:
    """Return a survey by its codes of EN 13508-2, with how it ended; an asset without a name has
    that of its ends, the upper one first.

    Args:
        header: What is stated in the file.
        observations: The observations.
        notes: The warnings so far.
        otherwise: Its name if neither asset nor date is known.
        surveyed_m: How far it came, if that is stated.
    """
    codes = {observation.code for observation in observations}
    if codes & {END, ABANDONED}:
        header["end_condition"] = "complete" if END in codes else "abandoned"
    said = [it.remark for it in observations if it.code == ABANDONED]
    if header.get("end_condition") == "abandoned" and said[-1]:
        header["abandon_reason"] = said[-1]
    ends = [str(header.get(name) or "") for name in ("start_node", "end_node")]
    if not header.get("asset_id") and all(ends):
        along = ends[::-1] if header.get("direction") == "against_flow" else ends
        header["asset_id"] = "-".join(along)
    parts = (str(header.get(name) or "") for name in ("asset_id", "date"))
    return ImportedSurvey(
        " ".join(part for part in parts if part) or otherwise,
        fitting_header(header, notes),
        tuple(observations),
        tuple(notes.said),
        surveyed_m,
    )


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


@dataclass
class Notes:
    """Collects the warnings of one survey, up to a limit."""

    said: list[Caveat] = field(default_factory=list)

    def add(self, key: str, line: int | None = None, /, **values: str | int) -> None:
        """Add a warning, as in `Caveat`; beyond the limit it is dropped."""
        if len(self.said) < MOST_WARNINGS:
            self.said.append(Caveat(key, line, values))
        elif len(self.said) == MOST_WARNINGS:
            self.said.append(Caveat("more_warnings"))

    def has(self, key: str, **values: str | int) -> bool:
        """Return whether a warning was given with these values, at whatever line."""
        return any((said.key, said.values) == (key, values) for said in self.said)

    def add_too_many(self, line: int | None = None) -> None:
        """Add why observations are left out."""
        self.add("too_many_observations", line, survey=MOST_OBSERVATIONS, file=MOST_OF_FILE)


@dataclass
class Cells:
    """Parses the cells of a row; what cannot be parsed becomes words of its remark."""

    notes: Notes
    line: int | None = None
    words: list[str] = field(default_factory=list)

    def quantity(self, text: str) -> float | None:
        """Parse a number within the limits of an observation."""
        found = quantity(text)
        if text and found is None:
            self.words.append(f"quantity {text}")
        return found

    def clock(self, text: str) -> int | None:
        """Parse a whole hour; 0 and 00 mean none."""
        found = clock(text)
        if found is None and text.strip("0"):
            self.notes.add("no_hour", self.line, text=f"{text!r:.20}")
            self.words.append(f"clock {text}")
        return found

    def stretch(self, text: str) -> str | None:
        """Parse a stretch mark; A01 becomes A1."""
        found = stretch(text)
        if text and found is None:
            self.notes.add("no_stretch", self.line, text=f"{text!r:.20}")
            self.words.append(f"stretch {text}")
        return found

    def time_s(self, text: str, *, is_counter: bool = False) -> float | None:
        """Parse a time in the film; a counter states none."""
        found = None if is_counter else video_time_s(text)
        if text and found is None:
            self.notes.add("no_video_time", self.line, text=f"{text!r:.40}")
            self.words.append(f"video {text}")
        return found


def coded(observation: ImportedObservation, notes: Notes) -> ImportedObservation:
    """Check code, characters and stretch; move those that cannot be stored to the remark."""
    changes: dict[str, Any] = {}
    said = [observation.remark]
    for name, pattern in (("code", _CODE), ("char1", _LETTER), ("char2", _LETTER)):
        value = clean(getattr(observation, name) or "", 40).upper() or None
        if value is not None and not pattern.fullmatch(value):
            notes.add("invalid_code", observation.line, field=name, value=repr(value))
            said.append(f"{name} {value}")
            value = None
        changes[name] = value
    remark = ", ".join(part for part in said if part)
    if len(remark) > LONGEST_IMPORTED_REMARK:
        notes.add("long_remark", observation.line, length=len(remark), most=LONGEST_IMPORTED_REMARK)
    changes["remark"] = remark[:LONGEST_IMPORTED_REMARK]
    photo = observation.photo or ""
    if len(photo) > LONGEST_PHOTO_NAME:
        notes.add("long_photo_name", most=LONGEST_PHOTO_NAME)
    changes["photo"] = photo[:LONGEST_PHOTO_NAME] or None
    return replace(observation, **changes)


def fitting_header(stated: Mapping[str, Any], notes: Notes) -> dict[str, Any]:
    """Check the header; move values that its fields do not allow to the remarks."""
    kept: dict[str, Any] = {}
    outside: list[str] = []
    for name, value in stated.items():
        cleaned = clean(value) if isinstance(value, str) else value
        if isinstance(value, str) and len(value) > LONGEST_TEXT:
            notes.add("long_field", field=name, most=LONGEST_TEXT)
        if cleaned is None or cleaned == "":
            continue
        if faults({name: cleaned}):
            notes.add("impossible_field", field=name, value=f"{cleaned!r:.60}")
            outside.append(f"{name}: {cleaned}")
        elif len(kept) == _MOST_HEADER_FIELDS:
            notes.add("too_many_fields", field=name)
        else:
            kept[name] = cleaned
    if outside:
        kept["remarks"] = clean(", ".join([str(kept.get("remarks", "")), *outside]).strip(", "))
    known = [field.name for field in FIELDS]
    order = {name: place for place, name in enumerate(known)}
    return dict(sorted(kept.items(), key=lambda item: order.get(item[0], len(known))))
