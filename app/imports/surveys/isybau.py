"""Reads ISYBAU XML of 2006, 2013-02, 2017-07 and 2024-06, which differ in their namespaces.

Pipe and nodes come from the master data, which some files lack; a survey repeats what it needs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from app.imports.surveys import german
from app.imports.surveys.cells import number
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
from app.imports.surveys.xml_file import NOTHING, Element, first_rows, note_unread, unknown_parts
from app.survey.fields.lists import GROUNDS

_OTHER_SYSTEM = "6"
"""U102: codes that are not of EN 13508-2."""
_NO_VIDEO = "4"
"""U127."""
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
    warnings: list[Caveat] = []
    for collectives in root.all("Datenkollektive"):
        warnings += unknown_parts(collectives, _PARTS)
    inspections = list(_inspections(root))
    inspected = {asset.value("Objektbezeichnung") for asset, _ in inspections}
    if bare := len(known.pipes.keys() - inspected):
        warnings.append(Caveat("pipes_not_inspected", values={"count": bare}))
    surveys = (
        (inspection.line, partial(_survey, asset, inspection, known))
        for asset, inspection in inspections
    )
    return file_of(surveys, warnings)


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
    asset: Element, inspection: Element, known: _Known, room: int
) -> ImportedSurvey | Caveat:
    run = inspection.first("Rohrleitung")
    name = asset.value("Objektbezeichnung")
    if run is None:
        return Caveat("inspection_of_no_pipe", inspection.line, {"name": name[:60]})
    notes = Notes()
    header = _header(asset, inspection, run, known, notes)
    has_video = run.value("ArtVideoreferenz") != _NO_VIDEO
    rows = first_rows(run.all("Inspektionsdaten", "RZustand"), room, notes)
    found = (_observation(row, notes, has_video=has_video) for row in rows)
    observations = [observation for observation in found if observation is not None]
    place, of_pipe = asset.first("Lage") or NOTHING, known.pipes.get(name, NOTHING)
    surveyed_m = number(run.value("Inspektionslaenge"))
    note_unread(notes, inspection, place, of_pipe, apart=_IMPLIED)
    otherwise = f"Inspection of line {inspection.line}"
    return survey_of(header, observations, notes, otherwise, surveyed_m=surveyed_m)


def _header(
    asset: Element, inspection: Element, run: Element, known: _Known, notes: Notes
) -> dict[str, Any]:
    name = asset.value("Objektbezeichnung")
    pipe = known.pipes.get(name, NOTHING)
    order = known.orders.get(inspection.value("Auftragskennung"), NOTHING)
    edge = pipe.first("Kante") or NOTHING
    parts = [asset, inspection, run, order]
    for parent, path in ((run, "RGrunddaten"), (edge, "Profil"), (asset, "Lage"), (pipe, "Lage")):
        parts.append(parent.first(path) or NOTHING)
    parts += [edge, pipe]

    def value_of(name: str) -> str:
        return next((text for part in parts if (text := part.value(name))), "")

    films = known.films.get(f"#{inspection.value('Videoablagereferenz')}", [])
    if not films and run.value("ArtVideoreferenz") != _NO_VIDEO:
        films = known.films.get(name, [])
    header: dict[str, Any] = {
        "video_files": ", ".join(dict.fromkeys(films)),
        "direction": "unknown",
        **header_of("isybau", value_of, notes, inspection.line),
    }
    if order.value("Kodiersystem") not in ("", _OTHER_SYSTEM):
        header["standard"] = "EN 13508-2"
    ends = [value_of("KnotenZulauf"), value_of("KnotenAblauf")]
    if header["direction"] == "against_flow":
        ends.reverse()
    header["start_node"], header["end_node"] = ends
    return with_words(header | at_ends(header, known.places), "isybau")


def _observation(row: Element, notes: Notes, *, has_video: bool) -> ImportedObservation | None:
    texts = texts_of("isybau", row.value)
    texts["continuous"] += row.value("StreckenschadenLfdNr")
    german.take_from_remark(texts)
    grounds = str(GROUNDS.value("isybau", row.value("GrundAbbruch")) or "")
    if grounds and grounds not in texts["remark"]:
        texts["remark"] = ", ".join(filter(None, (texts["remark"], grounds)))
    position = texts["film_time_s"] or row.value("Videozaehler")
    if not has_video and not position.strip("0"):
        position = ""  # a zero counts only if there is a film
    if found := _TIMECODE.fullmatch(position):
        position = ":".join(found.groups())
    texts["film_time_s"] = position
    more = [f"class {found.own_text()}" for found in row.all("Klassifizierung")]
    return observation_of(texts, notes, row.line, more=more)
