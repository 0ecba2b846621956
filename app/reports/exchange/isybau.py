"""ISYBAU XML 2017-07 and 2024-06: the survey, with the nodes and the pipe that readers require.

The editions differ in version and number of rules alone. The order of the elements follows the
official schema.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from app.reports.exchange.coordinates import Ends, Point, ends_of, utm_m
from app.reports.exchange.german import fitted
from app.reports.exchange.header import Header, plain_number
from app.reports.exchange.losses import NO_GEOMETRY, left_out
from app.reports.exchange.names import FileNames, Names, film, renamed
from app.reports.exchange.rows import ABANDONED, Row, general_remark, in_columns, rows_of, texts_of
from app.reports.exchange.tree import Shared, chain, child, children, to_bytes
from app.reports.report import Loss, Phrase, Report
from app.survey.fields.lists import GROUNDS
from app.survey.rounding import decimals

_FORMAT = "ISYBAU"
_NAMESPACES = {
    "xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance",
    "xmlns": "http://www.bfr-abwasser.de",
}
_MASTER, _STATE = "STA01", "ZUS01"
_LONGEST_NAME, _LONGEST_FILM = 30, 255
_MAX_STATION_M = 999.99
_EN_2011 = "8"
"""U102: EN 13508-2 of 2011 without national rules."""
_NOT_REACHED = "GN"
"""U134: the far end was not reached."""
_ZONES = (31, 32, 33)
"""UTM zones of the collections of the federal states."""
_OF_ROW = (
    "Index", "Station", "Timecode", "InspektionsKode", "Charakterisierung1", "Charakterisierung2",
    "Verbindung", "Quantifizierung1Numerisch", "Quantifizierung1Text", "Quantifizierung2Numerisch",
    "Quantifizierung2Text", "Streckenschaden", "StreckenschadenLfdNr", "PositionVon", "PositionBis",
    "GrundAbbruch", "Fotodatei", "Kommentar",
)  # fmt: skip


@dataclass(frozen=True)
class _Version:
    """An edition of the format."""

    name: str
    rules: str
    """Of the list of rules that a collection follows."""


class IsybauFile:
    """ISO-8859-1 with character references, CRLF; an order and an inspected pipe for each
    inspection, and nodes and pipes once each.
    """

    def __init__(self, version: _Version) -> None:
        self._version = version
        self._names = FileNames(longest_asset=_LONGEST_NAME, longest_node=_LONGEST_NAME)
        self._made_on = ""
        """The day of the newest inspection."""
        self._nodes, self._pipes = Shared(), Shared()
        self._orders, self._films = Element("Auftraege"), Element("Filme")
        self._assets: list[Element] = []

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        header = Header(report, "isybau", _FORMAT)
        rows, losses = rows_of(report)
        names, lost = self._names.add(report, header)
        losses += lost
        values = header.columns(job_ref=report.name) | {
            "Auftragskennung": str(self._names.inspections),
            "KnotenZulauf": names.upstream,
            "KnotenZulaufTyp": "0",
            "KnotenAblauf": names.downstream,
            "KnotenAblaufTyp": "0",
        }
        ends = ends_of(header)
        places, lost = _places(ends, names)
        losses += lost
        if film(report):
            values["Videoablagereferenz"] = values["Auftragskennung"]
            values["Filmname"] = header.cut(film(report), _LONGEST_FILM, Phrase("part.film"))
            self._films.append(_film(values, names))
        values["Bemerkung"] = general_remark(report, header, rows)
        self._orders.append(_order(values))
        self._assets.append(_inspected(values, names, report, rows, losses))
        system = f"ETRS89_UTM{ends.zone}" if ends else ""
        for name in names.nodes:
            node = _node(name, values["Entwaesserungsart"], places.get(name), system)
            losses += self._nodes.add(name, node)
        losses += self._pipes.add(names.asset, _pipe(values, names, places, system))
        losses += [
            *renamed(report, film(report)),
            left_out(report, is_named=not header.text("job_ref")),
            *header.losses(),
        ]
        day = values.get("Inspektionsdatum", report.created_at.date().isoformat())
        self._made_on = max(self._made_on, day)
        return tuple(losses)

    def content(self) -> bytes:
        """Return the document."""
        root = Element("Identifikation", _NAMESPACES)
        child(root, "Version", self._version.name)
        child(root, "Admindaten")
        collectives = children(
            child(root, "Datenkollektive"), {"Datenstatus": "1", "Erstellungsdatum": self._made_on}
        )
        self._add_keys(child(collectives, "Kennungen"))
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

    def _add_keys(self, keys: Element) -> None:
        """List every collective with its key, which the collective repeats."""
        master = children(child(keys, "Kollektiv"), {"Kennung": _MASTER, "Kollektivart": "1"})
        children(
            chain(master, "Kollektiveigenschaft", "Stammdaten"),
            {"Stammdatentyp": 1, "Bautechnik": 1, "Geometrie": 1, "Sanierung": 0, "Umfeld": 0},
        )
        state = children(child(keys, "Kollektiv"), {"Kennung": _STATE, "Kollektivart": "2"})
        children(
            chain(state, "Kollektiveigenschaft", "Zustandsdaten"),
            {"Inspektion": 1, "Dichtheit": 0, "Film": int(len(self._films) > 0)},
        )
        for collective in (master, state):
            children(
                collective,
                {"Regelwerk": self._version.rules, "Bearbeitungsstand": self._made_on},
            )


def file_of_2017() -> IsybauFile:
    """Begin a file in 2017-07, which more programs read."""
    return IsybauFile(_Version("2017-07", "6"))


def file_of_2024() -> IsybauFile:
    """Begin a file in 2024-06."""
    return IsybauFile(_Version("2024-06", "7"))


def _places(ends: Ends | None, names: Names) -> tuple[dict[str, Point], list[Loss]]:
    """Return easting and northing of the nodes, as far as the format knows their zone."""
    if ends is None:
        return {}, [NO_GEOMETRY]
    points = utm_m(ends) if ends.is_north and ends.zone in _ZONES else None
    if points is None:
        return {}, [Loss("isybau_zones", zones=_ZONES)]
    return points.of_nodes(names), []


def _node(name: str, system: str, place: Point | None, grid: str) -> Element:
    node = _asset({"Objektbezeichnung": name, "Objektart": "2", "Entwaesserungsart": system})
    kind = child(node, "Knoten")
    child(kind, "KnotenTyp", "0")
    chain(kind, "Schacht", "SchachtFunktion").text = "1"
    if place:
        shape = Element("Knoten")
        _add_point(shape, "Punkt", place)
        _add_geometry(node, "1", "P", shape, grid)
    return node


def _pipe(
    values: Mapping[str, str], names: Names, places: Mapping[str, Point], grid: str
) -> Element:
    year = values["Baujahr"].zfill(4) if "Baujahr" in values else None
    asset = _asset({**values, "Objektbezeichnung": names.asset, "Objektart": "1", "Baujahr": year})
    edge = child(asset, "Kante")
    child(edge, "KantenTyp", "0")
    _add(edge, values, "KnotenZulauf KnotenZulaufTyp KnotenAblauf KnotenAblaufTyp Laenge Material")
    profile = child(edge, "Profil")
    child(profile, "SonderprofilVorhanden", "0")
    _add(profile, values, "Profilart Profilbreite Profilhoehe")
    chain(edge, "Haltung", "HaltungsFunktion").text = "1"
    _add_road(asset, values)
    if places:
        lines = Element("Kanten")
        line = child(lines, "Kante")
        _add_point(line, "Start", places[names.upstream])
        _add_point(line, "Ende", places[names.downstream])
        _add_geometry(asset, "4", "L", lines, grid)
    return asset


def _asset(values: Mapping[str, str | None]) -> Element:
    asset = Element("AbwassertechnischeAnlage")
    return _add(
        asset,
        {**values, "Status": "0"},
        "Objektbezeichnung Objektart Status Baujahr Entwaesserungsart",
    )


def _add(parent: Element, values: Mapping[str, object], names: str) -> Element:
    """Append the filled ones of these elements; return the parent."""
    return children(parent, {name: values.get(name) for name in names.split()})


def _add_road(asset: Element, values: Mapping[str, str]) -> None:
    if road := values.get("Strassenname"):
        child(child(asset, "Lage"), "Strassenname", road)


def _add_geometry(asset: Element, kind: str, form: str, shape: Element, grid: str) -> None:
    geometry = children(child(asset, "Geometrie"), {"GeoObjektart": kind, "GeoObjekttyp": form})
    child(geometry, "Geometriedaten").append(shape)
    child(geometry, "CRSLage", grid)


def _add_point(parent: Element, name: str, point: Point) -> None:
    children(
        child(parent, name),
        {
            "Rechtswert": f"{point[0]:.3f}",
            "Hochwert": f"{point[1]:.3f}",
            "PunktattributAbwasser": "SMP",
        },
    )


def _order(values: Mapping[str, str]) -> Element:
    return _add(
        Element("Auftrag"),
        {"Auftragsbezeichnung": "1", **values, "Auftragsart": "1", "Kodiersystem": _EN_2011},
        "Auftragsbezeichnung Auftragsnummer Auftragskennung Auftragsart Inspektionszweck "
        "Kodiersystem Auftragnehmer",
    )


def _inspected(
    values: Mapping[str, str], names: Names, report: Report, rows: list[Row], losses: list[Loss]
) -> Element:
    asset = Element("InspizierteAbwassertechnischeAnlage")
    children(asset, {"Objektbezeichnung": names.asset, "Anlagentyp": "1"})
    _add_road(asset, values)
    inspection = child(asset, "OptischeInspektion")
    _add(
        inspection,
        values,
        "Auftragskennung Inspektionsdatum Inspektionsverfahren NameUntersucher Uhrzeit Wetter "
        "Temperatur Reinigung Wasserhaltung Videoablagereferenz Bemerkung",
    )
    run = child(inspection, "Rohrleitung")
    surveyed_m, has_times = report.distance_m, bool(film(report)) or any(it.time_s for it in rows)
    is_held = surveyed_m is not None and 0 <= surveyed_m <= _MAX_STATION_M
    _add(
        run,
        {
            **values,
            "Rohrleitungstyp": "0",
            "Inspektionslaenge": decimals(surveyed_m or 0.0, 2) if is_held else None,
            "Inspektionsart": "2",
            "ArtVideoreferenz": "1" if has_times else "4",
        },
        "Rohrleitungstyp Inspektionsrichtung BezugspunktLage Inspektionslaenge Inspektionsart "
        "ArtVideoreferenz",
    )
    _add(
        child(run, "RGrunddaten"),
        values,
        "KnotenZulauf KnotenZulaufTyp KnotenAblauf KnotenAblaufTyp Profilhoehe Profilbreite "
        "Profilart Material Regeleinzelrohrlaenge",
    )
    held = list(fitted(rows, _FORMAT, _MAX_STATION_M, losses))
    if held:
        data = child(run, "Inspektionsdaten")
        for index, row in enumerate(held, 1):
            children(child(data, "RZustand"), _row(row, index))
    if has_times:
        losses += [Loss("time_is_zero", row.entry) for row in held if row.time_s is None]
    return asset


def _row(row: Row, index: int) -> dict[str, object]:
    texts = texts_of(row)
    texts["film_time_s"] = f"{texts['film_time_s'].replace(':', '') or '000000'}00"
    texts["at_joint"] = "1" if row.entry.at_joint else "0"
    if row.clock_from is not None and not texts["clock_to"]:
        texts["clock_to"] = "00"
    values: dict[str, object] = {"Index": index, **in_columns(texts, "isybau")}
    for number, quantity in ((1, row.quant1), (2, row.quant2)):
        if quantity is None:
            continue
        exact = values.pop(f"Quantifizierung{number}Numerisch")
        if abs(quantity) < 9999.995 and plain_number(quantity, 2) == exact:
            values[f"Quantifizierung{number}Numerisch"] = decimals(quantity, 2)
        else:
            values[f"Quantifizierung{number}Text"] = exact
    if row.stretch:
        values["Streckenschaden"], values["StreckenschadenLfdNr"] = row.stretch
    if row.code == ABANDONED:
        values["GrundAbbruch"] = GROUNDS.code("isybau", row.remark) or _NOT_REACHED
    return {name: values.get(name) for name in _OF_ROW}


def _film(values: Mapping[str, str], names: Names) -> Element:
    entry = _add(Element("Film"), values, "Filmname Auftragskennung Videoablagereferenz")
    _add(
        chain(entry, "FilmObjekte", "FilmObjekt"),
        {**values, "Objektbezeichnung": names.asset, "Typ": "1"},
        "Objektbezeichnung Typ Inspektionsrichtung",
    )
    return entry
