"""Reads DWA-M 150 XML, type B: nodes (KG), pipes (HG), their inspections (HI) and rows (HZ)."""

from __future__ import annotations

from functools import partial
from typing import Any

from app.imports import german
from app.imports.survey import (
    MOST_OBSERVATIONS,
    MOST_OF_FILE,
    MOST_SURVEYS,
    Caveat,
    Cells,
    ImportedFile,
    ImportedObservation,
    ImportedSurvey,
    Notes,
    coded,
    figure,
    iso_date,
    number,
    survey_of,
    time_of_day,
    too_many_surveys,
    without_empty,
)
from app.imports.xml_file import Element, note_unread, unknown_parts
from app.survey.fields.in_words import taken_from_remarks

_DIRECTIONS = {"I": "with_flow", "O": "with_flow", "G": "against_flow", "U": "against_flow"}
"""Programs write I and G, or O and U."""
_PURPOSES = {"1": "routine", "2": "acceptance", "3": "end_of_warranty", "5": "after_repair"}
"""List HI004."""
_ANY_PURPOSE = "4"
_WEATHER = {"1": "dry", "2": "rain", "3": "frost", "4": "snow or ice melting"}
_SYSTEMS = {"R": "storm", "S": "foul", "M": "combined"}
_CAMERAS = {"0": "camera", "1": "camera", "2": "camera"}
"""List U109: any kind of camera."""
_ZONE = "UTM zone "
_STEP_M = 0.1
"""HZ001 has one decimal."""
_ROUGH = ("direction", "asset_type", "method")
_IMPLIED = frozenset(
    {"GO001", "GO002", "GO003", "GP001", "HG301", "HG313", "KG301", "KG302", "KG305"}
)
"""Elements that name and class what others state."""
_TEXTS = {
    "client": "HI001", "job_ref": "HI002", "camera": "HI006", "contractor": "HI111",
    "operator": "HI112", "video_files": "HI116", "remarks": "HI999",
}  # fmt: skip
_HELD = (
    "asset_id", "date", "time", "height_mm", "width_mm", "unit_length_m", "known_length_m", "year",
    "road", "lining_type", "lining_material", "cleaned", "temperature_c", "water_level_pct",
    "client", "job_ref", "contractor", "operator",
)  # fmt: skip


def looks_like(root: Element) -> bool:
    """Return whether a file has this format."""
    return root.name == "DATA" and any(part.name in ("FD", "KG", "HG") for part in root.children)


def read(root: Element) -> ImportedFile:
    """Read all inspections of pipes in the file; the warnings say what is left out."""
    surveys: list[ImportedSurvey] = []
    warnings = unknown_parts(root, ("FD", "KG", "HG"))
    if bare := sum(pipe.first("HI") is None for pipe in root.all("HG")):
        warnings.append(Caveat("pipes_not_inspected", values={"count": bare}))
    room = MOST_OF_FILE
    if manhole := root.first("KG", "KI"):
        warnings.append(Caveat("manholes", manhole.line))
    for pipe in root.all("HG"):
        for run in pipe.all("HI"):
            if len(surveys) == MOST_SURVEYS:
                warnings.append(too_many_surveys(run.line))
                return ImportedFile(tuple(surveys), tuple(warnings))
            surveys.append(_survey(root, pipe, run, min(room, MOST_OBSERVATIONS)))
            room -= len(surveys[-1].observations)
    return ImportedFile(tuple(surveys), tuple(warnings))


def _survey(root: Element, pipe: Element, run: Element, room: int) -> ImportedSurvey:
    notes = Notes()
    header = _header(pipe, run, notes)
    header |= _places(root, pipe, header, notes)
    rows = list(run.all("HZ"))
    observations = german.observations_of(rows, room, notes, partial(_observation, notes=notes))
    stated = without_empty(header)
    found = taken_from_remarks(stated, held=_HELD, rough=_ROUGH)
    note_unread(notes, run, pipe, *_nodes_of(root, pipe), apart=_IMPLIED | {"HI"})
    return survey_of(found, observations, notes, f"Inspection of line {run.line}")


def _nodes_of(root: Element, pipe: Element) -> list[Element]:
    ends = {pipe.value("HG003"), pipe.value("HG004")}
    return [node for node in root.all("KG") if node.value("KG001") in ends]


def _header(pipe: Element, run: Element, notes: Notes) -> dict[str, Any]:
    lining = pipe.value("HG309")
    header: dict[str, Any] = {
        "asset_id": pipe.value("HG001"),
        "date": iso_date(run.value("HI104")) or run.value("HI104"),
        "time": time_of_day(run.value("HI105")) or run.value("HI105"),
        "width_mm": figure(pipe.value("HG306")),
        "height_mm": figure(pipe.value("HG307")),
        "known_length_m": figure(pipe.value("HG310")),
        "unit_length_m": figure(pipe.value("HG314")),
        "year": figure(pipe.value("HG303")),
        "road": pipe.value("HG102"),
        "lining_type": pipe.value("HG308"),
        "lining_material": german.MATERIALS.get(lining, lining),
        "cleaned": {"J": True, "N": False}.get(run.value("HI107"), run.value("HI107")),
        "temperature_c": figure(run.value("HI108")),
        "water_level_pct": figure(run.value("HI110")),
        "standard": run.value("HI005").replace("EN13508", "EN 13508-2"),
    }
    header |= {name: run.value(code) for name, code in _TEXTS.items()}
    for name, parent, code, meanings in (
        ("direction", run, "HI101", _DIRECTIONS),
        ("reference_point", run, "HI102", german.REFERENCE_POINTS),
        ("method", run, "HI103", _CAMERAS),
        ("weather", run, "HI106", _WEATHER),
        ("flow_control", run, "HI109", german.FLOW_CONTROL),
        ("purpose", run, "HI004", _PURPOSES),
        ("shape", pipe, "HG305", {"0": "circular"}),
        ("material", pipe, "HG304", german.MATERIALS),
        ("asset_type", pipe, "HG302", _SYSTEMS),
    ):
        value = parent.value(code)
        if (code, value) != ("HI004", _ANY_PURPOSE):
            own = f"m150_{code.lower()}"
            german.listed(header, name, value, meanings, own, run.line, notes)
    header.setdefault("direction", "unknown")
    ends = [pipe.value("HG003"), pipe.value("HG004")]
    if header["direction"] == "against_flow":
        ends.reverse()
    header["start_node"], header["end_node"] = ends
    return header


def _places(root: Element, pipe: Element, header: dict[str, Any], notes: Notes) -> dict[str, float]:
    """Return the ends in degrees; our own exports name the UTM zone in the remark."""
    nodes = _nodes_of(root, pipe)
    points = [
        *((node.value("KG001"), point) for node in nodes for point in node.all("GO", "GP")),
        *((point.value("GP001"), point) for point in pipe.all("GO", "GP")),
    ]
    found: dict[str, tuple[float, float]] = {}
    said = _zone_in(str(header.get("remarks")))
    lost = False
    for name, point in points:
        easting = point.value("GP005") or point.value("GP003")
        northing = point.value("GP006") or point.value("GP004")
        is_utm = point.value("GP002").upper() == "UTM"
        named = said if is_utm else point.value("GP002")
        place = german.place_of(named, easting, northing)
        if place is not None:
            found.setdefault(name, place)
        elif easting and not lost:
            lost = True
            place_text = f"{easting:.20} {northing:.20}"
            notes.add("unknown_zone", point.line, place=place_text, name=name[:40])
    return german.at_ends(header, found)


def _zone_in(remarks: str) -> str:
    """Return the UTM zone that our own exports state in the remark, such as `UTM zone 47N`."""
    at = remarks.rfind(_ZONE)
    return remarks[at : at + len(_ZONE) + 3] if at >= 0 else ""


def _observation(row: Element, notes: Notes) -> ImportedObservation | None:
    exact = row.value("HZ999")
    parse = Cells(notes, row.line)
    quantities: list[float | None] = []
    for label, code in (("quantity 2", "HZ004"), ("quantity 1", "HZ003")):
        exact, value = german.more_exact(exact, label, parse.quantity(row.value(code)))
        quantities.insert(0, value)
    station_m = number(row.value("HZ001"))
    rest, distance_m = german.more_exact(exact.removesuffix(" m"), "station", None)
    if distance_m is None or abs(distance_m - (station_m or 0.0)) > _STEP_M:
        rest, distance_m = exact, station_m  # a free text of another program
    if distance_m is None:
        notes.add("no_distance", row.line, text=f"{row.value('HZ001')!r:.40}")
        return None
    continuous = parse.stretch(row.value("HZ005"))
    clocks = [parse.clock(row.value(code)) for code in ("HZ006", "HZ007")]
    time_s = parse.time_s(row.value("HZ008"))
    said = [row.value("HZ010"), rest, *parse.words]
    said += [f"class {row.value(code)}" for code in ("HZ206", "HZ207", "HZ208") if row.value(code)]
    observation = ImportedObservation(
        distance_m=distance_m,
        code=row.value("HZ002"),
        char1=row.value("HZ014"),
        char2=row.value("HZ015"),
        quant1=quantities[0],
        quant2=quantities[1],
        clock_from=clocks[0],
        clock_to=clocks[1],
        stretch=continuous,
        at_joint=bool(row.value("HZ011")),
        remark=", ".join(part for part in said if part),
        photo=row.value("HZ009") or None,
        time_s=time_s,
        line=row.line,
    )
    return coded(german.from_remark(observation), notes)
