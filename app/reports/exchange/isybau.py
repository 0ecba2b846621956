"""ISYBAU XML 2017-07 and 2024-06: the survey, with the nodes and the pipe that readers require.

What stands here is alike in both, apart from the version and the number of its rules.

The order of the elements follows the official schema; lists are named by their number there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from xml.etree.ElementTree import Element

from app.reports.content.ascii import one_line
from app.reports.exchange import lists
from app.reports.exchange.coordinates import Ends, ends_of
from app.reports.exchange.fields import Fields, field_name
from app.reports.exchange.german import (
    Lengths,
    Pipe,
    Survey,
    fitted,
    or_kept,
    pipe_of,
    points_of,
    survey_of,
)
from app.reports.exchange.losses import NO_GEOMETRY, left_out
from app.reports.exchange.survey import (
    ABANDONED,
    FileNames,
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
from app.reports.exchange.survey_file import of_one
from app.reports.exchange.tree import Shared, child, children, to_bytes
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


@dataclass(frozen=True)
class Version:
    """An edition of the format."""

    name: str
    rules: str
    """Of the list of rules that a collection follows."""


V2017, V2024 = Version("2017-07", "6"), Version("2024-06", "7")


def write(report: Report) -> Written:
    """Write one inspection in 2017-07."""
    return of_one(IsybauFile(V2017), report)


def write_2024(report: Report) -> Written:
    """Write one inspection in 2024-06."""
    return of_one(IsybauFile(V2024), report)


class IsybauFile:
    """ISO-8859-1 with character references, CRLF; an order and an inspected pipe for each
    inspection, and nodes and pipes once each.
    """

    def __init__(self, version: Version) -> None:
        self._version = version
        self._names = FileNames()
        self._made_on = ""
        """The day of the newest inspection."""
        self._nodes, self._pipes = Shared(), Shared()
        self._orders, self._films = Element("Auftraege"), Element("Filme")
        self._assets: list[Element] = []

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        fields = Fields(report.header)
        rows, losses = rows_of(report)
        names, lost = names_of(
            report,
            fields,
            one_line,
            self._names,
            longest_asset=_LONGEST_NAME,
            longest_node=_LONGEST_NAME,
        )
        losses += lost + standard_of(fields)
        keep = partial(or_kept, report, fields)
        pipe = pipe_of(report, fields, lists.SHAPES_ISYBAU, _LENGTHS)
        system = fields.choice("asset_type", lists.SYSTEMS_ISYBAU) or "KR"
        culvert = _Culvert(
            number=str(self._names.inspections),
            names=names,
            pipe=replace(
                pipe,
                shape=keep("shape", "isybau_profilart", pipe.shape),
                material=keep("material", "isybau_material", pipe.material),
            ),
            system=keep("asset_type", "isybau_entwaesserungsart", system),
            road=_cut(fields.text("road"), _LONGEST_ROAD, field_name("road"), losses),
            ends=ends_of(fields),
        )
        places, lost = _map(culvert)
        losses += lost
        survey, lost = survey_of(report, fields, lists.DIRECTIONS_ISYBAU)
        losses += lost
        survey = replace(
            survey,
            direction=keep("direction", "isybau_richtung", survey.direction),
            zero=keep("reference_point", "isybau_bezug", survey.zero),
            weather=keep("weather", "isybau_wetter", survey.weather),
            flow_control=keep("flow_control", "isybau_wasserhaltung", survey.flow_control),
        )
        order = _order(culvert, report, fields, losses)
        asset = _inspected(culvert, survey, report, fields, rows, losses)
        entry = _film(culvert, survey, report, losses)
        losses += [
            *renamed(report, film(report)),
            left_out(report, is_named=not fields.text("job_ref")),
            *fields.losses(_FORMAT),
        ]
        self._made_on = max(self._made_on, fields.day() or report.created_at.date().isoformat())
        shared = [(self._nodes, name, _node(culvert, name, places)) for name in names.nodes]
        shared.append((self._pipes, names.asset, _pipe(culvert, places)))
        for elements, name, element in shared:
            if elements.add(name, element):
                losses.append(Loss("written_once", name=name))
        self._orders.append(order)
        self._assets.append(asset)
        self._films.extend(entry)
        return tuple(losses)

    def content(self) -> bytes:
        """Return the document."""
        root = Element("Identifikation", _NAMESPACES)
        child(root, "Version", self._version.name)
        child(root, "Admindaten")
        collectives = children(
            child(root, "Datenkollektive"),
            {"Datenstatus": "1", "Erstellungsdatum": self._made_on},
        )
        _identifiers(collectives, self._version, self._made_on, has_film=len(self._films) > 0)
        master = child(collectives, "Stammdatenkollektiv")
        children(master, {"Kennung": _MASTER, "Beschreibung": "nodes and pipe"})
        self._nodes.append_to(master)
        self._pipes.append_to(master)
        state = child(collectives, "Zustandsdatenkollektiv")
        children(state, {"Kennung": _STATE, "Beschreibung": "culvert inspection"})
        state.append(self._orders)
        state.extend(self._assets)
        if len(self._films):
            state.append(self._films)
        declaration = '<?xml version="1.0" encoding="ISO-8859-1" standalone="yes"?>'
        return to_bytes(root, declaration, "iso-8859-1")


@dataclass(frozen=True)
class _Culvert:
    """The culvert as described by both master data and survey."""

    number: str
    """Of the inspection in the file: its order and its film are named by it."""
    names: Names
    pipe: Pipe
    system: str
    road: str
    ends: Ends | None


def _identifiers(collectives: Element, version: Version, made_on: str, *, has_film: bool) -> None:
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
        children(collective, {"Regelwerk": version.rules, "Bearbeitungsstand": made_on})


def _node(culvert: _Culvert, name: str, map_data: _Map | None) -> Element:
    node = _asset(name, "2", culvert.system)
    kind = child(node, "Knoten")
    child(kind, "KnotenTyp", "0")
    child(child(kind, "Schacht"), "SchachtFunktion", "1")
    if map_data:
        place = Element("Knoten")
        _point(place, "Punkt", map_data.points[name])
        _geometry(node, "1", "P", place, map_data.system)
    return node


def _pipe(culvert: _Culvert, map_data: _Map | None) -> Element:
    names, pipe = culvert.names, culvert.pipe
    year = None if pipe.year is None else f"{pipe.year:04.0f}"
    asset = _asset(names.asset, "1", culvert.system, year)
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
    return asset


def _asset(name: str, kind: str, system: str, year: str | None = None) -> Element:
    return children(
        Element("AbwassertechnischeAnlage"),
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


def _order(culvert: _Culvert, report: Report, fields: Fields, losses: list[Loss]) -> Element:
    order = Element("Auftrag")
    job = _cut(fields.text("job_ref") or report.name, _LONGEST_ORDER, field_name("job_ref"), losses)
    number = _cut(
        fields.text("client_job_ref"), _LONGEST_NUMBER, field_name("client_job_ref"), losses
    )
    children(
        order,
        {
            "Auftragsbezeichnung": job or "1",
            "Auftragsnummer": number,
            "Auftragskennung": culvert.number,
        },
    )
    purpose = fields.choice("purpose", lists.PURPOSES_ISYBAU)
    purpose = or_kept(report, fields, "purpose", "isybau_zweck", purpose)
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
    return order


def _inspected(
    culvert: _Culvert,
    survey: Survey,
    report: Report,
    fields: Fields,
    rows: list[Row],
    losses: list[Loss],
) -> Element:
    asset = Element("InspizierteAbwassertechnischeAnlage")
    children(asset, {"Objektbezeichnung": culvert.names.asset, "Anlagentyp": "1"})
    if culvert.road:
        child(child(asset, "Lage"), "Strassenname", culvert.road)
    inspection = child(asset, "OptischeInspektion")
    temperature = fields.rounded("temperature_c", 0, -99, 99)
    operator = _cut(fields.text("operator"), _LONGEST_PERSON, field_name("operator"), losses)
    method = fields.choice("method", lists.METHODS_ISYBAU) or lists.METHODS_ISYBAU["camera"]
    children(
        inspection,
        {
            "Auftragskennung": culvert.number,
            "Inspektionsdatum": survey.day,
            "Inspektionsverfahren": or_kept(report, fields, "method", "isybau_verfahren", method),
            "NameUntersucher": operator,
            "Uhrzeit": survey.clock,
            "Wetter": survey.weather,
            "Temperatur": temperature,
            "Reinigung": {True: "1", False: "0", None: None}[survey.is_cleaned],
            "Wasserhaltung": survey.flow_control,
            "Videoablagereferenz": culvert.number if film(report) else None,
            "Bemerkung": general_remark(report, fields, rows),
        },
    )
    losses += _run(inspection, culvert, survey, report, rows)
    return asset


def _run(
    inspection: Element, culvert: _Culvert, survey: Survey, report: Report, rows: list[Row]
) -> list[Loss]:
    pipe, has_times = culvert.pipe, bool(film(report)) or any(row.time_s for row in rows)
    run = child(inspection, "Rohrleitung")
    children(
        run,
        {
            "Rohrleitungstyp": "0",
            "Inspektionsrichtung": survey.direction,
            "BezugspunktLage": survey.zero,
            "Inspektionslaenge": _LENGTHS.pipe(report.distance_m),
            "Inspektionsart": "2",
            "ArtVideoreferenz": "1" if has_times else "4",
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
    if has_times:
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


def _film(
    culvert: _Culvert, survey: Survey, report: Report, losses: list[Loss]
) -> tuple[Element, ...]:
    """Describe the film, if there is one."""
    if not film(report):
        return ()
    name = _cut(film(report), _LONGEST_FILM, Phrase("part.film"), losses)
    entry = children(
        Element("Film"),
        {
            "Filmname": name,
            "Auftragskennung": culvert.number,
            "Videoablagereferenz": culvert.number,
        },
    )
    children(
        child(child(entry, "FilmObjekte"), "FilmObjekt"),
        {
            "Objektbezeichnung": culvert.names.asset,
            "Typ": "1",
            "Inspektionsrichtung": survey.direction,
        },
    )
    return (entry,)


def _cut(text: str, longest: int, what: Phrase, losses: list[Loss]) -> str:
    clean = one_line(text)
    if len(clean) <= longest:
        return clean
    losses.append(Loss("cut", format=_FORMAT, most=longest, what=what))
    return clean[:longest].rstrip()
