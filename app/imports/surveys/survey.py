"""Surveys read from files of other programs.

A reader keeps as much as it can: values without a field go to the remark, and odd ones are reported
with their line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from app.imports.surveys.cells import clean
from app.survey.fields.header import FIELDS, LONGEST_TEXT, faults
from app.survey.observations.tag import StatedTag

MOST_SURVEYS = 200
MOST_OBSERVATIONS = 10_000
"""Most observations of one survey; a long culvert in a bad state has 2000 defects."""
MOST_OF_FILE = 20_000
"""Most observations of all surveys of a file."""
MOST_WARNINGS = 1000
"""Ten times as many as the API accepts: an export adds some, and transliterates other letters."""
START, END, ABANDONED = "BCD", "BCE", "BDC"
"""Codes of EN 13508-2."""
_MOST_HEADER_FIELDS = 100
_AS_STATED = {"stretch": "continuous", "photo": "photo_name", "time_s": "film_time_s"}
"""Names of a tag for fields of an observation."""


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
        stated = {
            _AS_STATED.get(each.name, each.name): getattr(self, each.name)
            for each in fields(self)
            if each.name not in ("distance_m", "line")
        }
        stated |= {"remark": self.remark or None, "at_joint": self.at_joint or None}
        return StatedTag.model_construct(frame=frame, **stated)


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


def file_of(
    blocks: Iterable[tuple[int | None, Callable[[int], ImportedSurvey | Caveat]]],
    warnings: list[Caveat],
) -> ImportedFile:
    """Read the surveys of a file, up to the limits of what is read of one.

    Args:
        blocks: Each with its line and what reads at most so many observations of it, or says why
            it is left out.
        warnings: Of the file; reading the blocks may add to them.
    """
    surveys: list[ImportedSurvey] = []
    room = MOST_OF_FILE
    for line, read in blocks:
        if len(surveys) == MOST_SURVEYS:
            warnings.append(Caveat("too_many_surveys", line, {"most": MOST_SURVEYS}))
            break
        found = read(min(room, MOST_OBSERVATIONS))
        if isinstance(found, Caveat):
            warnings.append(found)
        else:
            surveys.append(found)
            room -= len(found.observations)
    return ImportedFile(tuple(surveys), tuple(warnings))


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
