"""Reads DWA-M 150 XML, type B: nodes (KG), pipes (HG), their inspections (HI) and rows (HZ)."""

from __future__ import annotations

from functools import partial
from typing import Any

from app.imports.surveys import german
from app.imports.surveys.cells import behind_remark, number
from app.imports.surveys.header import at_ends, header_of, with_words
from app.imports.surveys.observations import observation_of, texts_of
from app.imports.surveys.survey import (
    Caveat,
    ImportedFile,
    ImportedObservation,
    ImportedSurvey,
    Notes,
    file_of,
    survey_of,
)
from app.imports.surveys.xml_file import Element, first_rows, note_unread, unknown_parts

_ZONE = "UTM zone "
_STEP_M = 0.1
"""HZ001 has one decimal."""
_IMPLIED = frozenset(
    {"GO001", "GO002", "GO003", "GP001", "HG301", "HG313", "KG301", "KG302", "KG305"}
)
"""Elements that name and class what others state."""


def looks_like(root: Element) -> bool:
    """Return whether a file has this format."""
    return root.name == "DATA" and any(part.name in ("FD", "KG", "HG") for part in root.children)


def read(root: Element) -> ImportedFile:
    """Read all inspections of pipes in the file; the warnings say what is left out."""
    warnings = unknown_parts(root, ("FD", "KG", "HG"))
    if bare := sum(pipe.first("HI") is None for pipe in root.all("HG")):
        warnings.append(Caveat("pipes_not_inspected", values={"count": bare}))
    if manhole := root.first("KG", "KI"):
        warnings.append(Caveat("manholes", manhole.line))
    runs = (
        (run.line, partial(_survey, root, pipe, run))
        for pipe in root.all("HG")
        for run in pipe.all("HI")
    )
    return file_of(runs, warnings)


def _survey(root: Element, pipe: Element, run: Element, room: int) -> ImportedSurvey:
    notes = Notes()
    ends = {pipe.value("HG003"), pipe.value("HG004")}
    nodes = [node for node in root.all("KG") if node.value("KG001") in ends]
    header = _header(pipe, run, notes)
    header |= _places(nodes, pipe, header, notes)
    rows = first_rows(run.all("HZ"), room, notes)
    observations = [found for row in rows if (found := _observation(row, notes)) is not None]
    note_unread(notes, run, pipe, *nodes, apart=_IMPLIED | {"HI"})
    header = with_words(header, "m150")
    return survey_of(header, observations, notes, f"Inspection of line {run.line}")


def _header(pipe: Element, run: Element, notes: Notes) -> dict[str, Any]:
    def value_of(code: str) -> str:
        return (pipe if code.startswith("HG") else run).value(code)

    header = {"video_files": "", "direction": "unknown"}
    header |= header_of("m150", value_of, notes, run.line)
    if "standard" in header:
        header["standard"] = header["standard"].replace("EN13508", "EN 13508-2")
    ends = [pipe.value("HG003"), pipe.value("HG004")]
    if header["direction"] == "against_flow":
        ends.reverse()
    header["start_node"], header["end_node"] = ends
    return header


def _places(
    nodes: list[Element], pipe: Element, header: dict[str, Any], notes: Notes
) -> dict[str, float]:
    """Return the ends in degrees; our own exports name the UTM zone in the remark."""
    points = [
        *((node.value("KG001"), point) for node in nodes for point in node.all("GO", "GP")),
        *((point.value("GP001"), point) for point in pipe.all("GO", "GP")),
    ]
    found: dict[str, tuple[float, float]] = {}
    remarks = str(header.get("remarks"))
    at = remarks.rfind(_ZONE)
    said = remarks[at : at + len(_ZONE) + 3] if at >= 0 else ""
    for name, point in points:
        easting = point.value("GP005") or point.value("GP003")
        northing = point.value("GP006") or point.value("GP004")
        is_utm = point.value("GP002").upper() == "UTM"
        named = said if is_utm else point.value("GP002")
        place = german.place_of(named, easting, northing)
        if place is not None:
            found.setdefault(name, place)
        elif easting and not notes.has("unknown_zone"):
            place_text = f"{easting:.20} {northing:.20}"
            notes.add("unknown_zone", point.line, place=place_text, name=name[:40])
    return at_ends(header, found)


def _observation(row: Element, notes: Notes) -> ImportedObservation | None:
    texts = texts_of("m150", row.value)
    exact = row.value("HZ999")
    for number_of in (2, 1):
        exact, value = behind_remark(exact, f"quantity {number_of}")
        if value is not None:
            texts[f"quant{number_of}"] = repr(value)
    rest, distance_m = behind_remark(exact.removesuffix(" m"), "station")
    station_m = number(texts["distance_m"])
    if distance_m is not None and abs(distance_m - (station_m or 0.0)) <= _STEP_M:
        exact, texts["distance_m"] = rest, repr(distance_m)
    german.take_from_remark(texts)
    classes = (row.value(code) for code in ("HZ206", "HZ207", "HZ208"))
    more = [exact, *(f"class {found}" for found in classes if found)]
    return observation_of(texts, notes, row.line, more=more)
