"""Reads ISYBAU XML of 2006, 2013-02, 2017-07 and 2024-06, which differ in their namespaces.

Pipe and nodes come from the master data, which some files lack; a survey repeats what it needs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
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
from app.imports.xml_file import NOTHING, Element, note_unread, unknown_parts
from app.survey.fields.in_words import taken_from_remarks

_DIRECTIONS = {"O": "with_flow", "U": "against_flow"}
_PURPOSES = {
    "1": "first_survey", "2": "routine", "3": "acceptance", "4": "end_of_warranty",
    "5": "follow_up", "6": "before_repair", "7": "after_repair",
}  # fmt: skip
"""List U101."""
_METHODS = {"0": "camera", "1": "walk_through", "2": "from_end_only"}
"""List U108."""
_SHAPES = {"0": "circular", "1": "egg", "3": "rectangular"}
"""List G205."""
_SYSTEMS = {"KR": "storm", "KS": "foul", "KM": "combined"}
"""List G101."""
_FLAGS = {"1": True, "true": True, "0": False, "false": False}
_OTHER_SYSTEM = "6"
"""U102: codes that are not of EN 13508-2."""
_GROUNDS = {
    "GE": "reached from the other side", "AV": "client waives", "ZE": "aim reached",
    "IN": "not possible from there",
}  # fmt: skip
"""List U134; GN, the far end was not reached, needs no words."""
_NO_VIDEO = "4"
"""U127."""
_OTHER_FLOW_CONTROL = "6"
_ROUGH = ("direction", "asset_type")
_HELD = (
    "asset_id", "date", "time", "operator", "height_mm", "width_mm", "unit_length_m", "year",
    "known_length_m", "road", "job_ref", "client_job_ref", "contractor", "temperature_c", "cleaned",
)  # fmt: skip
_PARTS = (
    "Datenstatus", "Erstellungsdatum", "Kennungen", "Stammdatenkollektiv",
    "Zustandsdatenkollektiv",
)  # fmt: skip
_IMPLIED = frozenset(
    {
        "Anlagentyp", "CRSHoehe", "GeoObjektart", "GeoObjekttyp", "HaltungsFunktion", "Index",
        "Inspektionsart", "KantenTyp", "KnotenAblaufTyp", "KnotenZulaufTyp", "Objektart",
        "PunktattributAbwasser", "Rohrleitungstyp", "SonderprofilVorhanden", "Status",
    }
)  # fmt: skip
"""Elements that every file has, and that say nothing about one survey."""
_TIMECODE = re.compile(r"([0-9]{2})([0-5][0-9])([0-5][0-9])[0-9]{2}")


@dataclass
class _Known:
    """What the survey refers to, by name."""

    pipes: dict[str, Element] = field(default_factory=dict)
    places: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Longitude and latitude of the nodes."""
    orders: dict[str, Element] = field(default_factory=dict)
    films: dict[str, list[str]] = field(default_factory=dict)
    """By reference, and by asset."""


def looks_like(root: Element) -> bool:
    """Return whether a file has this format."""
    return root.name == "Identifikation"


def read(root: Element) -> ImportedFile:
    """Read all readable inspections of pipes in the file; the warnings say what is left out."""
    known = _known(root)
    surveys: list[ImportedSurvey] = []
    warnings: list[Caveat] = []
    for collectives in root.all("Datenkollektive"):
        warnings += unknown_parts(collectives, _PARTS)
    inspected = {asset.value("Objektbezeichnung") for asset, _ in _inspections(root)}
    if bare := len(known.pipes.keys() - inspected):
        warnings.append(Caveat("pipes_not_inspected", values={"count": bare}))
    room = MOST_OF_FILE
    for asset, inspection in _inspections(root):
        if len(surveys) == MOST_SURVEYS:
            warnings.append(too_many_surveys(inspection.line))
            break
        run = inspection.first("Rohrleitung")
        if run is None:
            named = {"name": asset.value("Objektbezeichnung")[:60]}
            warnings.append(Caveat("inspection_of_no_pipe", inspection.line, named))
            continue
        surveys.append(_survey(asset, inspection, run, known, min(room, MOST_OBSERVATIONS)))
        room -= len(surveys[-1].observations)
    return ImportedFile(tuple(surveys), tuple(warnings))


def _inspections(root: Element) -> Iterator[tuple[Element, Element]]:
    found = root.all(
        "Datenkollektive", "Zustandsdatenkollektiv", "InspizierteAbwassertechnischeAnlage"
    )
    for asset in found:
        for inspection in asset.all("OptischeInspektion"):
            yield asset, inspection


def _known(root: Element) -> _Known:
    known = _Known()
    for asset in root.all("Datenkollektive", "Stammdatenkollektiv", "AbwassertechnischeAnlage"):
        name = asset.value("Objektbezeichnung")
        if asset.first("Kante") is not None:
            known.pipes.setdefault(name, asset)
        elif place := _place(asset, "Knoten", "Punkt"):
            known.places.setdefault(name, place)
    for pipe in known.pipes.values():
        for node, end in (("KnotenZulauf", "Start"), ("KnotenAblauf", "Ende")):
            if place := _place(pipe, "Kanten", "Kante", end):
                known.places.setdefault(pipe.value("Kante", node), place)
    for state in root.all("Datenkollektive", "Zustandsdatenkollektiv"):
        for order in state.all("Auftraege", "Auftrag"):
            known.orders.setdefault(order.value("Auftragskennung"), order)
        for film in state.all("Filme", "Film"):
            name = film.value("Filmname")
            filmed = [it.value("Objektbezeichnung") for it in film.all("FilmObjekte", "FilmObjekt")]
            for key in (f"#{film.value('Videoablagereferenz')}", *filmed):
                known.films.setdefault(key, []).append(name)
    return known


def _place(asset: Element, *path: str) -> tuple[float, float] | None:
    geometry = asset.first("Geometrie")
    point = geometry.first("Geometriedaten", *path) if geometry else None
    if geometry is None or point is None:
        return None
    return german.place_of(
        geometry.value("CRSLage"), point.value("Rechtswert"), point.value("Hochwert")
    )


def _survey(
    asset: Element, inspection: Element, run: Element, known: _Known, room: int
) -> ImportedSurvey:
    notes = Notes()
    header = _header(asset, inspection, run, known, notes)
    has_video = run.value("ArtVideoreferenz") != _NO_VIDEO
    rows = list(run.all("Inspektionsdaten", "RZustand"))
    read_row = partial(_observation, notes=notes, has_video=has_video)
    observations = german.observations_of(rows, room, notes, read_row)
    surveyed_m = number(run.value("Inspektionslaenge"))
    place = asset.first("Lage") or NOTHING
    of_pipe = known.pipes.get(asset.value("Objektbezeichnung"), NOTHING)
    note_unread(notes, inspection, place, of_pipe, apart=_IMPLIED)
    otherwise = f"Inspection of line {inspection.line}"
    return survey_of(header, observations, notes, otherwise, surveyed_m=surveyed_m)


def _header(
    asset: Element, inspection: Element, run: Element, known: _Known, notes: Notes
) -> dict[str, Any]:
    name = asset.value("Objektbezeichnung")
    pipe = known.pipes.get(name, NOTHING)
    edge = pipe.first("Kante") or NOTHING
    basics = [run.first("RGrunddaten") or NOTHING, edge.first("Profil") or NOTHING, edge]

    def basic(name: str) -> str:
        return next((text for part in basics if (text := part.value(name))), "")

    order = known.orders.get(inspection.value("Auftragskennung"), NOTHING)
    films = known.films.get(f"#{inspection.value('Videoablagereferenz')}", [])
    if not films and run.value("ArtVideoreferenz") != _NO_VIDEO:
        films = known.films.get(name, [])
    cleaned = inspection.value("Reinigung")
    header: dict[str, Any] = {
        "asset_id": name,
        "date": iso_date(inspection.value("Inspektionsdatum"))
        or inspection.value("Inspektionsdatum"),
        "time": time_of_day(inspection.value("Uhrzeit")) or inspection.value("Uhrzeit"),
        "operator": inspection.value("NameUntersucher"),
        "height_mm": figure(basic("Profilhoehe")),
        "width_mm": figure(basic("Profilbreite")),
        "unit_length_m": figure(basic("Regeleinzelrohrlaenge")),
        "known_length_m": figure(edge.value("Laenge")),
        "year": figure(pipe.value("Baujahr")),
        "road": asset.value("Lage", "Strassenname") or pipe.value("Lage", "Strassenname"),
        "job_ref": order.value("Auftragsbezeichnung"),
        "client_job_ref": order.value("Auftragsnummer"),
        "contractor": order.value("Auftragnehmer"),
        "temperature_c": figure(inspection.value("Temperatur")),
        "cleaned": _FLAGS.get(cleaned, cleaned),
        "video_files": ", ".join(dict.fromkeys(films)),
        "remarks": inspection.value("Bemerkung"),
    }
    if order.value("Kodiersystem") not in ("", _OTHER_SYSTEM):
        header["standard"] = "EN 13508-2"
    control = inspection.value("Wasserhaltung")
    for field_name, value, meanings, own in (
        ("direction", run.value("Inspektionsrichtung"), _DIRECTIONS, "isybau_richtung"),
        ("reference_point", run.value("BezugspunktLage"), german.REFERENCE_POINTS, "isybau_bezug"),
        ("method", inspection.value("Inspektionsverfahren"), _METHODS, "isybau_verfahren"),
        ("purpose", order.value("Inspektionszweck"), _PURPOSES, "isybau_zweck"),
        ("weather", inspection.value("Wetter"), german.WEATHER, "isybau_wetter"),
        ("flow_control", control, german.FLOW_CONTROL, "isybau_wasserhaltung"),
        ("shape", basic("Profilart"), _SHAPES, "isybau_profilart"),
        ("material", basic("Material"), german.MATERIALS, "isybau_material"),
        ("asset_type", pipe.value("Entwaesserungsart"), _SYSTEMS, "isybau_entwaesserungsart"),
    ):
        if (field_name, value) == ("flow_control", _OTHER_FLOW_CONTROL):
            header[own] = value  # its words are in the remark
        else:
            german.listed(header, field_name, value, meanings, own, inspection.line, notes)
    header.setdefault("direction", "unknown")
    ends = [basic("KnotenZulauf"), basic("KnotenAblauf")]
    if header["direction"] == "against_flow":
        ends.reverse()
    header["start_node"], header["end_node"] = ends
    header |= german.at_ends(header, known.places)
    stated = without_empty(header)
    found = taken_from_remarks(stated, held=_HELD, rough=_ROUGH)
    if "flow_control" in found:
        found.pop("isybau_wasserhaltung", None)
    return found


def _observation(row: Element, notes: Notes, *, has_video: bool) -> ImportedObservation | None:
    value = row.value
    distance_m = number(value("Station"))
    if distance_m is None:
        notes.add("no_distance", row.line, text=f"{value('Station')!r:.40}")
        return None
    said = [value("Kommentar")]
    grounds = _GROUNDS.get(value("GrundAbbruch"), "")
    if grounds and grounds not in said[0]:
        said.append(grounds)
    parse = Cells(notes, row.line)
    quantities = [
        parse.quantity(value(f"Quantifizierung{n}Numerisch") or value(f"Quantifizierung{n}Text"))
        for n in (1, 2)
    ]
    continuous = parse.stretch(value("Streckenschaden") + value("StreckenschadenLfdNr"))
    clocks = [parse.clock(value(name)) for name in ("PositionVon", "PositionBis")]
    time_s = _time_s(row, parse, has_video=has_video)
    said += parse.words
    said += [f"class {found.own_text()}" for found in row.all("Klassifizierung")]
    observation = ImportedObservation(
        distance_m=distance_m,
        code=value("InspektionsKode"),
        char1=value("Charakterisierung1"),
        char2=value("Charakterisierung2"),
        quant1=quantities[0],
        quant2=quantities[1],
        clock_from=clocks[0],
        clock_to=clocks[1],
        stretch=continuous,
        at_joint=value("Verbindung") in ("1", "true"),
        remark=", ".join(part for part in said if part),
        photo=value("Fotodatei") or None,
        time_s=time_s,
        line=row.line,
    )
    return coded(german.from_remark(observation), notes)


def _time_s(row: Element, parse: Cells, *, has_video: bool) -> float | None:
    """Return the time in the film; a zero counts only if there is one."""
    timecode, counter = row.value("Timecode"), row.value("Videozaehler")
    if not has_video and not (timecode or counter).strip("0"):
        return None
    found = _TIMECODE.fullmatch(timecode)
    if found:
        return float(3600 * int(found[1]) + 60 * int(found[2]) + int(found[3]))
    return parse.time_s(timecode or counter)
