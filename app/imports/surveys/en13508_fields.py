"""The codes of EN 13508-2, Annex B, which its text and its XML share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from app.imports.surveys.cells import behind_remark, number
from app.imports.surveys.header import header_of, with_words
from app.imports.surveys.observations import observation_of, texts_of
from app.imports.surveys.survey import (
    END,
    START,
    ImportedObservation,
    ImportedSurvey,
    Notes,
    survey_of,
)
from app.survey.fields.declaration import OTHER, explanation_of, kept_name
from app.survey.fields.header import FIELDS

_PLAIN = frozenset(
    field.columns["en"].code
    for field in FIELDS
    if "en" in field.columns and not field.listed("en") and field.kind in ("text", "number")
)
"""Codes whose values are no letters."""
_KNOWN = frozenset(field.columns["en"].code for field in FIELDS if "en" in field.columns)
_NODES = ("AAD", "AAF")
_PLACES = ("AAE", "AAG")
_DEGREES = ("start_lat", "start_lon", "end_lat", "end_lon")
_REMARK, _BEFORE_REMARK = "ADE", "AD"
_VIDEO_POSITION, _BY_TIME = "ABM", "A"
_COLUMNS = frozenset("ABCDEFGHIJKLMN")

Coded = Sequence[tuple[str, str]]
"""Values with their codes, in the order of the file; empty ones too."""
Rows = Sequence[tuple[int, Coded]]
"""Cells of observations, each with its line."""


def survey_from(
    cells: Coded,
    rows: Rows,
    notes: Notes,
    line: int,
    *,
    explained: Mapping[str, str] | None = None,
    places: Mapping[str, float] | None = None,
) -> ImportedSurvey:
    """Return the survey of a block.

    Args:
        cells: The values of its header.
        rows: Its rows.
        notes: For warnings.
        line: Where it begins.
        explained: What a letter Z stands for, by its code, as RIBX states beside it.
        places: The ends in degrees, as far as the file has them in a grid.
    """
    header = _header_of(cells, notes, explained or {}) | dict(places or {})
    named = (_film_of(dict(cells).get("N", "")) for _, cells in rows)
    header["video_files"] = header["video_files"] or next(filter(None, named), "")
    found = (_observation(cells, header, at, notes) for at, cells in rows)
    observations = [observation for observation in found if observation is not None]
    return survey_of(header, observations, notes, f"Inspection of line {line}")


def _header_of(cells: Coded, notes: Notes, beside: Mapping[str, str]) -> dict[str, Any]:
    stated, explained = _values_and_words(cells, notes)
    explained |= beside
    header = _places(stated)
    header |= header_of("en", lambda code: stated.get(code, ""), notes, None, explained)
    for code, value in stated.items():
        is_placed = code in _PLACES and "start_lat" in header
        is_shown = (code, value) == (_VIDEO_POSITION, _BY_TIME)  # as the rows show
        if code not in _KNOWN and code not in _NODES and not is_placed and not is_shown:
            header[kept_name("en", code)] = value
    ends = {code: stated[code] for code in _NODES if code in stated}
    names = list(ends.values())
    header["start_node"] = stated.get("AAB") or (names[0] if names else "")
    others = [name for name in names if name != header["start_node"]]
    header["end_node"] = others[-1] if others else names[-1] if len(names) > 1 else ""
    for code, name in ends.items():
        if name not in (header["start_node"], header["end_node"]):
            own = kept_name("en", code)
            notes.add("third_node", code=code, value=f"{name!r:.40}", own=own)
            header[own] = name
    header |= {explanation_of(code): words for code, words in explained.items()}
    header.setdefault("video_files", "")  # words name other films than that of the observations
    return with_words(header, "en")


def _values_and_words(cells: Coded, notes: Notes) -> tuple[dict[str, str], dict[str, str]]:
    """Return the values by their codes, and the words of the letters Z among them.

    A remark behind a letter Z belongs to it; others are of the survey. So is the only remark of a
    list in alphabetical order, where it stands behind the codes of its own group anyway.
    """
    stated: dict[str, str] = {}
    explained: dict[str, str] = {}
    remarks: list[str] = []
    codes = [code for code, _ in cells]
    is_alphabetical = all(one < other for one, other in pairwise(codes))
    for (before, letter), (code, value) in pairwise([("", ""), *cells]):
        if not value:
            continue
        if code == _REMARK:
            is_general = is_alphabetical and before.startswith(_BEFORE_REMARK)
            if letter.upper() == OTHER and before not in _PLAIN and not is_general:
                explained.setdefault(before, value)
            else:
                remarks.append(value)
        elif stated.setdefault(code, value) != value:
            notes.add("repeated_field", code=code, value=f"{value!r:.60}")
            remarks.append(f"{code} {value}")
    if remarks:
        stated[_REMARK] = ", ".join(remarks)
    return stated, explained


def _places(stated: Mapping[str, str]) -> dict[str, Any]:
    """Return the ends where both are stated as latitude and longitude, in degrees."""
    first, second = (_point(stated.get(code, "")) for code in _PLACES)
    if first is None or second is None:
        return {}
    if stated.get("AAB", stated.get("AAD")) != stated.get("AAD"):
        first, second = second, first
    return dict(zip(_DEGREES, (*first, *second), strict=True))


def _point(text: str) -> tuple[float, float] | None:
    lat, lon, *more = (*map(number, text.split()), None, None)[:3]
    if lat is None or lon is None or more[0] is not None:
        return None
    return (lat, lon) if abs(lat) <= 90 and abs(lon) <= 180 else None


def _observation(
    cells: Coded, header: Mapping[str, object], line: int, notes: Notes
) -> ImportedObservation | None:
    """Return an observation: names of the ends stand in D at the start and the end, and a row may
    name another film than the header.
    """
    row, more = _row(cells, line, notes)
    texts = texts_of("en", lambda letter: row.get(letter, ""))
    nodes = {str(header.get(name)) for name in ("start_node", "end_node")}
    if texts["code"] in (START, END) and texts["quant1"] in nodes:
        texts["remark"], value = behind_remark(texts["remark"], "quantity")
        texts["quant1"] = "" if value is None else repr(value)
    position = texts["film_time_s"]
    is_counter = kept_name("en", _VIDEO_POSITION) in header and position.isdecimal()
    film = _film_of(position)
    is_other = film and film not in str(header.get("video_files"))
    said = [f"film {film}" if is_other else "", row.get("L", ""), *more]
    return observation_of(texts, notes, line, more=said, is_counter=is_counter)


def _row(cells: Coded, line: int, notes: Notes) -> tuple[dict[str, str], list[str]]:
    """Return the values by their letters, and words for the remark: unknown letters, repeated
    ones.
    """
    row: dict[str, str] = {}
    more: list[str] = []
    for name, value in cells:
        if not value:
            continue
        if name not in _COLUMNS:
            if not notes.has("unknown_column", name=name[:20]):
                notes.add("unknown_column", line, name=name[:20])
            more.append(f"{name} {value}")
        elif row.setdefault(name, value) == value:
            continue
        elif name == "F":
            row[name] += f", {value}"
        else:
            if not notes.has("repeated_column", name=name):
                notes.add("repeated_column", line, name=name)
            more.append(f"{name} {value}")
    return row, more


def _film_of(position: str) -> str:
    name, separator, _ = position.rpartition("|")
    return name.strip() if separator else ""
