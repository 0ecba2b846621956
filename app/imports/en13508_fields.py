"""The codes of EN 13508-2, Annex B, which its text and its XML share."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from app.imports.survey import (
    END,
    START,
    Cells,
    ImportedObservation,
    Notes,
    behind_remark,
    coded,
    iso_date,
    number,
    severity_of,
    time_of_day,
)
from app.survey.fields.header import faults
from app.survey.fields.in_words import taken_from_remarks

_OTHER = "Z"
_NOTHING: Mapping[str, str] = {}

_TEXTS: Mapping[str, str] = {
    "AAA": "asset_id", "AAB": "start_node", "AAJ": "location_text", "AAM": "client",
    "ABA": "standard", "ABH": "operator", "ABI": "job_ref", "ABJ": "client_job_ref",
    "ABS": "video_files", "ADE": "remarks",
}  # fmt: skip
_NUMBERS: Mapping[str, str] = {
    "ABQ": "expected_length_m", "ACB": "height_mm", "ACC": "width_mm", "ACG": "unit_length_m",
    "ACN": "year", "ADB": "temperature_c",
}  # fmt: skip
_PLAIN = frozenset({*_TEXTS, *_NUMBERS})
"""Codes whose values are no letters."""
_HELD = frozenset({*_TEXTS.values(), *_NUMBERS.values(), "date", "time", "cleaned", "road"}) - {
    "video_files",
    "temperature_c",
}
_MATERIALS: Mapping[str, str] = {
    "AA": "asbestos cement", "AD": "brick", "AE": "clay", "AG": "concrete",
    "AH": "reinforced concrete", "AI": "sprayed concrete", "AJ": "concrete segments",
    "AK": "fibre cement", "AL": "glass-fibre plastics", "AM": "cast iron", "AN": "grey cast iron",
    "AO": "ductile iron", "AP": "steel", "AR": "masonry", "AS": "masonry",
    "AV": "polyethylene", "AW": "polypropylene", "AX": "PVC-U", "AZ": "unknown",
}  # fmt: skip
"""Materials of ACD and ACF."""
_LETTERS: Mapping[str, tuple[str, Mapping[str, str | bool]]] = {
    "AAK": ("direction", {"A": "with_flow", "B": "against_flow", "C": "unknown"}),
    "ABE": ("method", {"A": "walk_through", "B": "camera", "C": "from_end_only"}),
    "ABP": (
        "purpose",
        {"A": "acceptance", "B": "end_of_warranty", "C": "routine", "G": "after_repair"},
    ),
    "ABC": (
        "reference_point",
        {
            "A": "inner face of the wall at the start", "B": "crown of the pipe at the start",
            "C": "centre of the start manhole", "D": "half way along the channel at the start",
        },
    ),
    "ACA": (
        "shape",
        {
            "A": "circular", "B": "rectangular", "C": "egg", "D": "u_shaped", "E": "arch",
            "F": "oval", "Z": "other",
        },
    ),
    "ACD": ("material", _MATERIALS),
    "ACE": (
        "lining_type",
        {
            "A": "factory made", "B": "sprayed", "C": "cured in place", "D": "segments",
            "E": "discrete pipes", "F": "continuous pipe", "G": "close fit", "H": "spiral wound",
        },
    ),
    "ACF": ("lining_material", _MATERIALS),
    "ACK": ("asset_type", {"A": "foul", "B": "storm", "C": "combined", "E": "culvert"}),
    "ACM": ("cleaned", {"A": True, "B": False}),
    "ADA": ("weather", {"A": "dry", "B": "rain", "C": "snow or ice melting"}),
    "ADC": ("flow_control", {"A": "none", "B": "blocked upstream", "C": "partly blocked"}),
}  # fmt: skip
_NOT_KEPT = frozenset({"AAD", "AAF"})
"""The nodes, which are the ends."""
_REMARK, _BEFORE_REMARK = "ADE", "AD"
_VIDEO_POSITION, _BY_TIME = "ABM", "A"
_COLUMNS = frozenset("ABCDEFGHIJKLMN")

Coded = Sequence[tuple[str, str]]
"""Values with their codes, in the order of the file; empty ones too."""
Rows = Sequence[tuple[int, Coded]]
"""Cells of observations, each with its line."""


def header_of(
    cells: Coded, notes: Notes, explained: Mapping[str, str] = _NOTHING
) -> dict[str, Any]:
    """Return the header of the values of a file.

    Args:
        cells: The values.
        notes: For warnings.
        explained: What a letter Z stands for, by its code, as RIBX states beside it.
    """
    stated, behind = _told_apart(cells, notes)
    explained = {**behind, **explained}
    in_use = set()
    header = _places(stated)
    for code, value in stated.items():
        if code in _TEXTS:
            header[_TEXTS[code]] = value
        elif code in _NUMBERS:
            found = number(value)
            header[_NUMBERS[code] if found is not None else _own(code)] = (
                value if found is None else found
            )
        elif code in _LETTERS:
            name, meanings = _LETTERS[code]
            meaning = meanings.get(value.upper())
            words = explained.get(code)
            if words and value.upper() == _OTHER and not faults({name: words}):
                meaning = words
                in_use.add(code)
            if meaning is None:
                if value.upper() != _OTHER:  # the remarks explain it
                    notes.add("unknown_letter", code=code, value=f"{value!r:.40}", own=_own(code))
                header[_own(code)] = value
            else:
                header[name] = meaning
        elif code == "ABF":
            header["date"] = iso_date(value) or value
        elif code == "ABG":
            header["time"] = time_of_day(value) or value
        elif (code, value) == (_VIDEO_POSITION, _BY_TIME):
            continue  # as the rows show
        elif code not in _NOT_KEPT and (code not in _PLACES or "start_lat" not in header):
            header[_own(code)] = value
    ends = {code: stated[code] for code in ("AAD", "AAF") if code in stated}
    names = list(ends.values())
    header["start_node"] = stated.get("AAB") or (names[0] if names else "")
    others = [name for name in names if name != header["start_node"]]
    header["end_node"] = others[-1] if others else names[-1] if len(names) > 1 else ""
    for code, name in ends.items():
        if name not in (header["start_node"], header["end_node"]):
            notes.add("third_node", code=code, value=f"{name!r:.40}", own=_own(code))
            header[_own(code)] = name
    header |= {
        explanation_of(code): words for code, words in explained.items() if code not in in_use
    }
    header.setdefault("video_files", "")  # words name other films than that of the observations
    return _without_needless(taken_from_remarks(header, held=_HELD))


def explanation_of(code: str) -> str:
    """Name the header field that holds what a letter Z stands for, where no field of ours does."""
    return f"ribx_{code.lower()[:20]}"


def _told_apart(cells: Coded, notes: Notes) -> tuple[dict[str, str], dict[str, str]]:
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
            if letter.upper() == _OTHER and before not in _PLAIN and not is_general:
                explained.setdefault(before, value)
            else:
                remarks.append(value)
        elif stated.setdefault(code, value) != value:
            notes.add("repeated_field", code=code, value=f"{value!r:.60}")
            remarks.append(f"{code} {value}")
    if remarks:
        stated[_REMARK] = ", ".join(remarks)
    return stated, explained


def _without_needless(header: dict[str, Any]) -> dict[str, Any]:
    """Drop each letter Z whose words are known."""
    known = {_own(code) for code, (name, _) in _LETTERS.items() if name in header}
    return {name: value for name, value in header.items() if name not in known}


_PLACES = ("AAE", "AAG")
_DEGREES = ("start_lat", "start_lon", "end_lat", "end_lon")


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


def _own(code: str) -> str:
    """Name a header field that has no counterpart here."""
    return f"en13508_{re.sub(r'[^a-z0-9]', '_', code.lower())[:40]}"


def with_film_of(rows: Rows, header: Mapping[str, Any]) -> dict[str, Any]:
    """Return the header with the film that the rows name where it names none."""
    named = (_film_of(dict(cells).get("N", "")) for _, cells in rows)
    film = header.get("video_files") or next(filter(None, named), "")
    return {**header, "video_files": film}


def observations_of(
    rows: Rows, header: Mapping[str, object], notes: Notes
) -> list[ImportedObservation]:
    """Return the observations of rows; one without a distance is left out, with a warning.

    Args:
        rows: The rows.
        header: Of the survey: names of the ends stand in D at the start and the end, and a row may
            name another film.
        notes: For warnings.
    """
    found = (_observation(cells, header, line, notes) for line, cells in rows)
    return [observation for observation in found if observation is not None]


def _observation(
    cells: Coded, header: Mapping[str, object], line: int, notes: Notes
) -> ImportedObservation | None:
    row, more = _row(cells, line, notes)
    nodes = {str(header.get(name)) for name in ("start_node", "end_node")}
    distance_m = number(row.get("I", ""))
    if distance_m is None:
        notes.add("no_distance", line, text=f"{row.get('I', '')!r:.40}")
        return None
    parse = Cells(notes, line)
    first = row.get("D", "")
    is_node = row.get("A") in (START, END) and first in nodes
    quantities = [parse.quantity("" if is_node else first), parse.quantity(row.get("E", ""))]
    clocks = [parse.clock(row.get(column, "")) for column in ("G", "H")]
    continuous = parse.stretch(row.get("J", ""))
    position = row.get("N", "")
    is_counter = _own(_VIDEO_POSITION) in header and position.isdecimal()
    time_s = parse.time_s(position, is_counter=is_counter)
    said = [row.get("F", ""), *parse.words]
    if (film := _film_of(position)) and film not in str(header.get("video_files")):
        said.append(f"film {film}")
    said += [row.get("L", ""), *more]
    if is_node:
        said[0], quantities[0] = behind_remark(said[0], "quantity")
    said[0], severity = severity_of(said[0])
    observation = ImportedObservation(
        distance_m=distance_m,
        code=row.get("A"),
        char1=row.get("B"),
        char2=row.get("C"),
        quant1=quantities[0],
        quant2=quantities[1],
        clock_from=clocks[0],
        clock_to=clocks[1],
        stretch=continuous,
        severity=severity,
        at_joint=bool(row.get("K")),
        remark=", ".join(part for part in said if part),
        photo=row.get("M") or None,
        time_s=time_s,
        line=line,
    )
    return coded(observation, notes)


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
    """Return the film of a position such as file|hh:mm:ss; empty if it names none."""
    name, separator, _ = position.rpartition("|")
    return name.strip() if separator else ""
