"""ISYBAU XML 2017-07: the survey, with the nodes and the pipe that readers require.

The order of the elements follows the official schema; lists are named by their number there.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

from app.reports.exchange import lists
from app.reports.exchange.ascii import one_line
from app.reports.exchange.coordinates import ends_of, utm_m
from app.reports.exchange.fields import Fields
from app.reports.exchange.losses import left_out
from app.reports.exchange.survey import (
    ABANDONED,
    END,
    START,
    Names,
    Row,
    abandon_reason,
    about,
    day_of,
    film,
    general_remark,
    hours,
    joined,
    length_m,
    names_of,
    plain_number,
    renamed,
    rows_of,
    standard_of,
    unit_length_m,
)
from app.reports.exchange.tree import child, children, to_bytes
from app.reports.report import Loss, Report, Written
from app.survey.rounding import decimals

_FORMAT = "ISYBAU"
_NAMESPACES = {
    "xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance",
    "xmlns": "http://www.bfr-abwasser.de",
}
_MASTER, _STATE = "STA01", "ZUS01"
_LONGEST_NAME, _LONGEST_PERSON, _LONGEST_ORDER, _LONGEST_FILM = 30, 40, 60, 255
_LONGEST_ROAD, _LONGEST_NUMBER = 40, 40
_MAX_M, _MAX_UNIT_M, _MAX_MM, _MAX_STRETCH = 999.99, 99.99, 9999, 99
_EN_2011 = "8"
"""U102: EN 13508-2 of 2011 without national rules."""
_ZONES = (31, 32, 33)
"""UTM zones of the collections of the federal states."""
_END_TO_END = {START, END}


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
    made_on = report.made_at.date().isoformat()
    collectives = children(
        child(root, "Datenkollektive"), {"Datenstatus": "1", "Erstellungsdatum": made_on}
    )
    pipe = _Pipe(report, fields, names)
    _identifiers(collectives, made_on, has_film=bool(film(report)))
    road_losses: list[Loss] = []
    pipe.road = _cut(fields.text("road"), _LONGEST_ROAD, "road", road_losses)
    losses += road_losses + _master_data(collectives, pipe)
    losses += _survey(collectives, pipe, rows)
    is_named = not fields.text("job_ref")
    losses += [
        *renamed(report, film(report)),
        left_out(report, is_named=is_named),
        *fields.losses(_FORMAT),
    ]
    declaration = '<?xml version="1.0" encoding="ISO-8859-1" standalone="yes"?>'
    return Written(to_bytes(root, declaration, "iso-8859-1"), tuple(losses))


class _Pipe:
    """The culvert as described by both master data and survey."""

    def __init__(self, report: Report, fields: Fields, names: Names) -> None:
        self.report = report
        self.fields = fields
        self.names = names
        self.length_m = length_m(report, fields, _MAX_M)
        height_mm = fields.number_within("height_mm", 0, _MAX_MM)
        width_mm = fields.number_within("width_mm", 0, _MAX_MM)
        self.profile = fields.choice("shape", lists.SHAPES_ISYBAU)
        if width_mm is None and self.profile == lists.SHAPES_ISYBAU["circular"]:
            width_mm = height_mm
        self.height = None if height_mm is None else decimals(height_mm, 0)
        self.width = None if width_mm is None else decimals(width_mm, 0)
        words = fields.text("material")
        found = lists.material(words) if words else None
        self.material = found.german if found else None
        if not self.material:
            fields.leave("material")
        year = fields.number_within("year", 1, 9999)
        self.year = None if year is None else f"{year:04.0f}"
        self.road = ""
        self.system = fields.choice("asset_type", lists.SYSTEMS_ISYBAU) or "KR"
        self.direction = fields.choice("direction", lists.DIRECTIONS_ISYBAU)
        self.ends = ends_of(fields)


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


def _master_data(collectives: Element, pipe: _Pipe) -> list[Loss]:
    names = pipe.names
    map_data, losses = _map(pipe)
    master = child(collectives, "Stammdatenkollektiv")
    children(master, {"Kennung": _MASTER, "Beschreibung": "nodes and pipe"})
    for name in dict.fromkeys((names.upstream, names.downstream)):
        node = _asset(master, name, "2", pipe.system)
        kind = child(node, "Knoten")
        child(kind, "KnotenTyp", "0")
        child(child(kind, "Schacht"), "SchachtFunktion", "1")
        if map_data:
            place = Element("Knoten")
            _point(place, "Punkt", map_data.points[name])
            _geometry(node, "1", "P", place, map_data.system)
    asset = _asset(master, names.asset, "1", pipe.system, pipe.year)
    edge = child(asset, "Kante")
    children(edge, {"KantenTyp": "0"} | _nodes(names))
    children(edge, {"Laenge": _metres(pipe.length_m), "Material": pipe.material})
    profile = child(edge, "Profil")
    children(profile, {"SonderprofilVorhanden": "0", "Profilart": pipe.profile})
    children(profile, {"Profilbreite": pipe.width, "Profilhoehe": pipe.height})
    child(child(edge, "Haltung"), "HaltungsFunktion", "1")
    if pipe.road:
        child(child(asset, "Lage"), "Strassenname", pipe.road)
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


def _map(pipe: _Pipe) -> tuple[_Map | None, list[Loss]]:
    ends, names = pipe.ends, pipe.names
    if ends is None:
        return None, [Loss("Without coordinates of both ends the file has no geometry.")]
    found = utm_m(ends) if ends.is_north and ends.zone in _ZONES else None
    if found is None:
        zones = ", ".join(map(str, _ZONES))
        return None, [
            Loss(f"ISYBAU knows UTM zones {zones}; the ends are elsewhere and are left out.")
        ]
    points = {names.end: found[1], names.start: found[0]}
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


def _survey(collectives: Element, pipe: _Pipe, rows: list[Row]) -> list[Loss]:
    report, fields, names = pipe.report, pipe.fields, pipe.names
    losses: list[Loss] = []
    state = child(collectives, "Zustandsdatenkollektiv")
    children(state, {"Kennung": _STATE, "Beschreibung": "culvert inspection"})
    order = child(child(state, "Auftraege"), "Auftrag")
    job = _cut(fields.text("job_ref") or report.name, _LONGEST_ORDER, "job", losses)
    number = _cut(fields.text("client_job_ref"), _LONGEST_NUMBER, "client's job", losses)
    children(
        order,
        {"Auftragsbezeichnung": job or "1", "Auftragsnummer": number, "Auftragskennung": "1"},
    )
    purpose = fields.choice("purpose", lists.PURPOSES_ISYBAU)
    contractor = _cut(fields.text("contractor"), _LONGEST_ORDER, "contractor", losses)
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
    if pipe.road:
        child(child(asset, "Lage"), "Strassenname", pipe.road)
    inspection = child(asset, "OptischeInspektion")
    day, lost = day_of(report, fields)
    losses += lost
    clock = fields.time()
    values = _circumstances(fields)
    zero = lists.reference_point(fields.text("reference_point") or "inner face")
    if zero is None:
        fields.leave("reference_point")
    if not lists.is_distinct(report.header.get("asset_type")):
        fields.leave("asset_type")
    unit_m = unit_length_m(report, fields, _MAX_UNIT_M)
    name = film(report)
    operator = _cut(fields.text("operator"), _LONGEST_PERSON, "operator", losses)
    method = fields.choice("method", lists.METHODS_ISYBAU)
    children(
        inspection,
        {
            "Auftragskennung": "1",
            "Inspektionsdatum": day,
            "Inspektionsverfahren": method or lists.METHODS_ISYBAU["camera"],
            "NameUntersucher": operator,
            "Uhrzeit": ":".join(clock) if clock else None,
            **values,
            "Videoablagereferenz": "1" if name else None,
            "Bemerkung": general_remark(report, fields, rows),
        },
    )
    direction = pipe.direction
    if direction is None:
        direction = lists.DIRECTIONS_ISYBAU["with_flow"]
        losses.append(Loss("The direction is not known; the file says with the flow."))
    place = _Run(direction, zero.german if zero else None, _metres(unit_m, _MAX_UNIT_M))
    _run(inspection, pipe, place, rows, losses, has_film=bool(name))
    if name:
        _film(state, _cut(name, _LONGEST_FILM, "film", losses), names.asset, direction)
    return losses


@dataclass(frozen=True)
class _Run:
    direction: str
    zero: str | None
    """Reference point by list U105."""
    unit_length: str | None


def _circumstances(fields: Fields) -> dict[str, object]:
    """Add weather to flow control."""
    weather, control = fields.text("weather"), fields.text("flow_control")
    found = lists.weather(weather)
    temperature_c = fields.number_within("temperature_c", -99, 99)
    cleaned = fields.flag("cleaned")
    number = lists.flow_control(control) if control else None
    if not found:
        fields.leave("weather")
    if not number:
        fields.leave("flow_control")
    return {
        "Wetter": found.german if found else None,
        "Temperatur": None if temperature_c is None else decimals(temperature_c, 0),
        "Reinigung": {True: "1", False: "0", None: None}[cleaned],
        "Wasserhaltung": number or ("6" if control else None),
    }


def _run(
    inspection: Element,
    pipe: _Pipe,
    place: _Run,
    rows: list[Row],
    losses: list[Loss],
    *,
    has_film: bool,
) -> None:
    run = child(inspection, "Rohrleitung")
    children(
        run,
        {
            "Rohrleitungstyp": "0",
            "Inspektionsrichtung": place.direction,
            "BezugspunktLage": place.zero,
            "Inspektionslaenge": _metres(pipe.report.distance_m),
            "Inspektionsart": "2",
            "ArtVideoreferenz": "1" if has_film else "4",
        },
    )
    basics = child(run, "RGrunddaten")
    children(basics, _nodes(pipe.names))
    children(
        basics,
        {
            "Profilhoehe": pipe.height,
            "Profilbreite": pipe.width,
            "Profilart": pipe.profile,
            "Material": pipe.material,
            "Regeleinzelrohrlaenge": place.unit_length,
        },
    )
    fitting = [row for row in rows if row.distance_m <= _MAX_M]
    losses += [
        about(row, "lies beyond the 999.99 m that ISYBAU can hold and is left out")
        for row in rows
        if row.distance_m > _MAX_M
    ]
    if has_film:
        losses += [
            about(row, "has no time in the film; the file says 00:00:00")
            for row in fitting
            if row.time_s is None
        ]
    if fitting:
        data = child(run, "Inspektionsdaten")
        reason = abandon_reason(pipe.report)
        for index, row in enumerate(fitting, 1):
            grounds = lists.grounds(reason or row.remark) if row.code == ABANDONED else None
            children(child(data, "RZustand"), {"Index": index} | _row(row, grounds, losses))


def _row(row: Row, grounds: str | None, losses: list[Loss]) -> dict[str, object]:
    remark, char1, char2 = row.remark, row.char1, row.char2
    if row.code in _END_TO_END:
        remark = joined(remark, characters_in_words(row))
        char1, char2 = "XP", ""
    stretch = row.stretch
    if stretch and stretch[1] > _MAX_STRETCH:
        remark, stretch = joined(remark, f"stretch {stretch[0]}{stretch[1]}"), None
        losses.append(about(row, f"has a stretch above {_MAX_STRETCH}; its remark says which"))
    clocks = row.clocks
    values: dict[str, object] = {
        "Station": decimals(row.distance_m, 2),
        "Timecode": f"{hours(row.time_s or 0).replace(':', '')}00",
        "InspektionsKode": row.code,
        "Charakterisierung1": char1,
        "Charakterisierung2": char2,
        "Verbindung": int(row.entry.at_joint),
    }
    for number, quantity in ((1, row.quant1), (2, row.quant2)):
        if quantity is not None:
            exact = plain_number(quantity)
            fits = abs(quantity) < 9999.995 and plain_number(quantity, 2) == exact
            kind = "Numerisch" if fits else "Text"
            values[f"Quantifizierung{number}{kind}"] = decimals(quantity, 2) if fits else exact
    return values | {
        "Streckenschaden": stretch[0] if stretch else None,
        "StreckenschadenLfdNr": stretch[1] if stretch else None,
        "PositionVon": f"{clocks[0]:02d}" if clocks else None,
        "PositionBis": f"{clocks[1] if len(clocks) > 1 else 0:02d}" if clocks else None,
        "GrundAbbruch": grounds,
        "Fotodatei": one_line(row.photo or ""),
        "Kommentar": remark,
    }


def characters_in_words(row: Row) -> str:
    """Name the character of a start or end where the format requires XP; empty if it is XP."""
    chars = f"{row.char1}{row.char2}"
    return "" if chars in ("", "XP") else f"coded {row.code} {row.char1} {row.char2}".rstrip()


def _film(state: Element, name: str, asset: str, direction: str) -> None:
    entry = child(child(state, "Filme"), "Film")
    children(entry, {"Filmname": name, "Auftragskennung": "1", "Videoablagereferenz": "1"})
    children(
        child(child(entry, "FilmObjekte"), "FilmObjekt"),
        {"Objektbezeichnung": asset, "Typ": "1", "Inspektionsrichtung": direction},
    )


def _metres(value_m: float | None, most_m: float = _MAX_M) -> str | None:
    """Format with two decimals; None for what the format cannot hold."""
    if value_m is None or not 0 <= value_m <= most_m:
        return None
    return decimals(value_m, 2)


def _cut(text: str, longest: int, what: str, losses: list[Loss]) -> str:
    clean = one_line(text)
    if len(clean) <= longest:
        return clean
    losses.append(Loss(f"ISYBAU holds {longest} characters of the name of the {what}: it is cut."))
    return clean[:longest].rstrip()
