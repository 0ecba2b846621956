"""ISYBAU XML 2017-07: the survey, with the nodes and the pipe that readers require.

The order of the elements follows the official schema; lists are named by their number there.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

from app.reports.exchange import lists
from app.reports.exchange.ascii import one_line
from app.reports.exchange.coordinates import Ends, ends_of
from app.reports.exchange.fields import Fields, field_name
from app.reports.exchange.german import (
    Lengths,
    Pipe,
    Survey,
    fitted,
    pipe_of,
    points_of,
    survey_of,
)
from app.reports.exchange.losses import NO_GEOMETRY, left_out
from app.reports.exchange.survey import (
    ABANDONED,
    Names,
    Row,
    film,
    general_remark,
    hours,
    names_of,
    plain_number,
    renamed,
    rows_of,
    standard_of,
)
from app.reports.exchange.tree import child, children, to_bytes
from app.reports.report import Loss, Phrase, Report, Written
from app.survey.rounding import decimals

_FORMAT = "ISYBAU"
_NAMESPACES = {
    "xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance",
    "xmlns": "http://www.bfr-abwasser.de",
}
_MASTER, _STATE = "STA01", "ZUS01"
_LONGEST_NAME, _LONGEST_PERSON, _LONGEST_ORDER, _LONGEST_FILM = 30, 40, 60, 255
_LONGEST_ROAD, _LONGEST_NUMBER = 40, 40
_LENGTHS = Lengths(most_m=999.99, most_unit_m=99.99, digits=2)
_EN_2011 = "8"
"""U102: EN 13508-2 of 2011 without national rules."""
_ZONES = (31, 32, 33)
"""UTM zones of the collections of the federal states."""


def write(report: Report) -> Written:
    """Write ISO-8859-1 with character references, CRLF."""
    fields = Fields(report.header)
    rows, losses = rows_of(report)
    names, lost = names_of(
        report, fields, one_line, longest_asset=_LONGEST_NAME, longest_node=_LONGEST_NAME
    )
    losses += lost + standard_of(fields)
    root = Element("Identifikation", _NAMESPACES)
    child(root, "Version", "2017-07")
    child(root, "Admindaten")
    made_on = fields.day() or report.created_at.date().isoformat()
    collectives = children(
        child(root, "Datenkollektive"), {"Datenstatus": "1", "Erstellungsdatum": made_on}
    )
    _identifiers(collectives, made_on, has_film=bool(film(report)))
    culvert = _Culvert(
        names=names,
        pipe=pipe_of(report, fields, lists.SHAPES_ISYBAU, _LENGTHS),
        system=fields.choice("asset_type", lists.SYSTEMS_ISYBAU) or "KR",
        road=_cut(fields.text("road"), _LONGEST_ROAD, field_name("road"), losses),
        ends=ends_of(fields),
    )
    losses += _master_data(collectives, culvert)
    losses += _survey(collectives, culvert, report, fields, rows)
    is_named = not fields.text("job_ref")
    losses += [
        *renamed(report, film(report)),
        left_out(report, is_named=is_named),
        *fields.losses(_FORMAT),
    ]
    declaration = '<?xml version="1.0" encoding="ISO-8859-1" standalone="yes"?>'
    return Written(to_bytes(root, declaration, "iso-8859-1"), tuple(losses))


@dataclass(frozen=True)
class _Culvert:
    """The culvert as described by both master data and survey."""

    names: Names
    pipe: Pipe
    system: str
    road: str
    ends: Ends | None


def _identifiers(collectives: Element, made_on: str, *, has_film: bool) -> None:
    """List every collective with its key, which the collective repeats."""
    keys = child(collectives, "Kennungen")
    master = children(child(keys, "Kollektiv"), {"Kennung": _MASTER, "Kollektivart": "1"})
    children(
        child(child(master, "Kollektiveigenschaft"), "Stammdaten"),
        {"Stammdatentyp": 1, "Bautechnik": 1, "Geometrie": 1, "Sanierung": 0, "Umfeld": 0},
    )
    state = children(child(keys, "Kollektiv"), {"Kennung": _STATE, "Kollektivart": "2"})
    children(
        child(child(state, "Kollektiveigenschaft"), "Zustandsdaten"),
        {"Inspektion": 1, "Dichtheit": 0, "Film": int(has_film)},
    )
    for collective in (master, state):
        children(collective, {"Regelwerk": "6", "Bearbeitungsstand": made_on})


def _master_data(collectives: Element, culvert: _Culvert) -> list[Loss]:
    names, pipe = culvert.names, culvert.pipe
    map_data, losses = _map(culvert)
    master = child(collectives, "Stammdatenkollektiv")
    children(master, {"Kennung": _MASTER, "Beschreibung": "nodes and pipe"})
    for name in dict.fromkeys((names.upstream, names.downstream)):
        node = _asset(master, name, "2", culvert.system)
        kind = child(node, "Knoten")
        child(kind, "KnotenTyp", "0")
        child(child(kind, "Schacht"), "SchachtFunktion", "1")
        if map_data:
            place = Element("Knoten")
            _point(place, "Punkt", map_data.points[name])
            _geometry(node, "1", "P", place, map_data.system)
    year = None if pipe.year is None else f"{pipe.year:04.0f}"
    asset = _asset(master, names.asset, "1", culvert.system, year)
    edge = child(asset, "Kante")
    children(edge, {"KantenTyp": "0"} | _nodes(names))
    children(edge, {"Laenge": pipe.length, "Material": pipe.material})
    profile = child(edge, "Profil")
    children(profile, {"SonderprofilVorhanden": "0", "Profilart": pipe.shape})
    children(profile, {"Profilbreite": pipe.width, "Profilhoehe": pipe.height})
    child(child(edge, "Haltung"), "HaltungsFunktion", "1")
    if culvert.road:
        child(child(asset, "Lage"), "Strassenname", culvert.road)
    if map_data:
        lines = Element("Kanten")
        line = child(lines, "Kante")
        _point(line, "Start", map_data.points[names.upstream])
        _point(line, "Ende", map_data.points[names.downstream])
        _geometry(asset, "4", "L", lines, map_data.system)
    return losses


def _asset(master: Element, name: str, kind: str, system: str, year: str | None = None) -> Element:
    return children(
        child(master, "AbwassertechnischeAnlage"),
        {
            "Objektbezeichnung": name,
            "Objektart": kind,
            "Status": "0",
            "Baujahr": year,
            "Entwaesserungsart": system,
        },
    )


def _nodes(names: Names) -> dict[str, object]:
    return {
        "KnotenZulauf": names.upstream,
        "KnotenZulaufTyp": "0",
        "KnotenAblauf": names.downstream,
        "KnotenAblaufTyp": "0",
    }


def _geometry(asset: Element, kind: str, form: str, shape: Element, system: str) -> None:
    geometry = children(child(asset, "Geometrie"), {"GeoObjektart": kind, "GeoObjekttyp": form})
    child(geometry, "Geometriedaten").append(shape)
    child(geometry, "CRSLage", system)


@dataclass(frozen=True)
class _Map:
    points: dict[str, tuple[float, float]]
    """Easting and northing of the nodes in metres."""
    system: str


def _map(culvert: _Culvert) -> tuple[_Map | None, list[Loss]]:
    ends = culvert.ends
    if ends is None:
        return None, [NO_GEOMETRY]
    is_known = ends.is_north and ends.zone in _ZONES
    points = points_of(ends, culvert.names) if is_known else None
    if not points:
        return None, [Loss("isybau_zones", zones=_ZONES)]
    return _Map(points, f"ETRS89_UTM{ends.zone}"), []


def _point(parent: Element, name: str, point: tuple[float, float]) -> None:
    children(
        child(parent, name),
        {
            "Rechtswert": f"{point[0]:.3f}",
            "Hochwert": f"{point[1]:.3f}",
            "PunktattributAbwasser": "SMP",
        },
    )


def _survey(
    collectives: Element, culvert: _Culvert, report: Report, fields: Fields, rows: list[Row]
) -> list[Loss]:
    names = culvert.names
    survey, losses = survey_of(report, fields, lists.DIRECTIONS_ISYBAU)
    state = child(collectives, "Zustandsdatenkollektiv")
    children(state, {"Kennung": _STATE, "Beschreibung": "culvert inspection"})
    order = child(child(state, "Auftraege"), "Auftrag")
    job = _cut(fields.text("job_ref") or report.name, _LONGEST_ORDER, field_name("job_ref"), losses)
    number = _cut(
        fields.text("client_job_ref"), _LONGEST_NUMBER, field_name("client_job_ref"), losses
    )
    children(
        order,
        {"Auftragsbezeichnung": job or "1", "Auftragsnummer": number, "Auftragskennung": "1"},
    )
    purpose = fields.choice("purpose", lists.PURPOSES_ISYBAU)
    contractor = _cut(fields.text("contractor"), _LONGEST_ORDER, field_name("contractor"), losses)
    children(
        order,
        {
            "Auftragsart": "1",
            "Inspektionszweck": purpose,
            "Kodiersystem": _EN_2011,
            "Auftragnehmer": contractor,
        },
    )
    asset = child(state, "InspizierteAbwassertechnischeAnlage")
    children(asset, {"Objektbezeichnung": names.asset, "Anlagentyp": "1"})
    if culvert.road:
        child(child(asset, "Lage"), "Strassenname", culvert.road)
    inspection = child(asset, "OptischeInspektion")
    temperature = fields.rounded("temperature_c", 0, -99, 99)
    name = film(report)
    operator = _cut(fields.text("operator"), _LONGEST_PERSON, field_name("operator"), losses)
    method = fields.choice("method", lists.METHODS_ISYBAU)
    children(
        inspection,
        {
            "Auftragskennung": "1",
            "Inspektionsdatum": survey.day,
            "Inspektionsverfahren": method or lists.METHODS_ISYBAU["camera"],
            "NameUntersucher": operator,
            "Uhrzeit": survey.clock,
            "Wetter": survey.weather,
            "Temperatur": temperature,
            "Reinigung": {True: "1", False: "0", None: None}[survey.is_cleaned],
            "Wasserhaltung": survey.flow_control or report.header.get("isybau_wasserhaltung"),
            "Videoablagereferenz": "1" if name else None,
            "Bemerkung": general_remark(report, fields, rows),
        },
    )
    losses += _run(inspection, culvert, survey, report, rows)
    if name:
        _film(
            state,
            _cut(name, _LONGEST_FILM, Phrase("part.film"), losses),
            names.asset,
            survey.direction,
        )
    return losses


def _run(
    inspection: Element, culvert: _Culvert, survey: Survey, report: Report, rows: list[Row]
) -> list[Loss]:
    pipe, has_film = culvert.pipe, bool(film(report))
    run = child(inspection, "Rohrleitung")
    children(
        run,
        {
            "Rohrleitungstyp": "0",
            "Inspektionsrichtung": survey.direction,
            "BezugspunktLage": survey.zero,
            "Inspektionslaenge": _LENGTHS.pipe(report.distance_m),
            "Inspektionsart": "2",
            "ArtVideoreferenz": "1" if has_film else "4",
        },
    )
    basics = child(run, "RGrunddaten")
    children(basics, _nodes(culvert.names))
    children(
        basics,
        {
            "Profilhoehe": pipe.height,
            "Profilbreite": pipe.width,
            "Profilart": pipe.shape,
            "Material": pipe.material,
            "Regeleinzelrohrlaenge": pipe.unit_length,
        },
    )
    fitting = [row for row in rows if row.distance_m <= _LENGTHS.most_m]
    losses = [
        Loss("too_far", row.entry, format=_FORMAT, most=_LENGTHS.most_m)
        for row in rows
        if row.distance_m > _LENGTHS.most_m
    ]
    if has_film:
        losses += [Loss("time_is_zero", row.entry) for row in fitting if row.time_s is None]
    if fitting:
        data = child(run, "Inspektionsdaten")
        for index, row in enumerate(fitting, 1):
            grounds = lists.grounds(row.remark) if row.code == ABANDONED else None
            held, lost = fitted(row)
            losses += lost
            children(child(data, "RZustand"), {"Index": index} | _row(held, grounds))
    return losses


def _row(row: Row, grounds: str | None) -> dict[str, object]:
    clocks = row.clocks
    values: dict[str, object] = {
        "Station": decimals(row.distance_m, 2),
        "Timecode": f"{hours(row.time_s or 0).replace(':', '')}00",
        "InspektionsKode": row.code,
        "Charakterisierung1": row.char1,
        "Charakterisierung2": row.char2,
        "Verbindung": int(row.entry.at_joint),
    }
    for number, quantity in ((1, row.quant1), (2, row.quant2)):
        if quantity is not None:
            exact = plain_number(quantity)
            fits = abs(quantity) < 9999.995 and plain_number(quantity, 2) == exact
            kind = "Numerisch" if fits else "Text"
            values[f"Quantifizierung{number}{kind}"] = decimals(quantity, 2) if fits else exact
    return values | {
        "Streckenschaden": row.stretch[0] if row.stretch else None,
        "StreckenschadenLfdNr": row.stretch[1] if row.stretch else None,
        "PositionVon": f"{clocks[0]:02d}" if clocks else None,
        "PositionBis": f"{clocks[1] if len(clocks) > 1 else 0:02d}" if clocks else None,
        "GrundAbbruch": grounds,
        "Fotodatei": one_line(row.photo or ""),
        "Kommentar": row.remark,
    }


def _film(state: Element, name: str, asset: str, direction: str) -> None:
    entry = child(child(state, "Filme"), "Film")
    children(entry, {"Filmname": name, "Auftragskennung": "1", "Videoablagereferenz": "1"})
    children(
        child(child(entry, "FilmObjekte"), "FilmObjekt"),
        {"Objektbezeichnung": asset, "Typ": "1", "Inspektionsrichtung": direction},
    )


def _cut(text: str, longest: int, what: Phrase, losses: list[Loss]) -> str:
    clean = one_line(text)
    if len(clean) <= longest:
        return clean
    losses.append(Loss("cut", format=_FORMAT, most=longest, what=what))
    return clean[:longest].rstrip()
