"""ISYBAU XML 2017-07 and 2024-06: the survey, with the nodes and the pipe that readers require.

The editions differ in version and number of rules alone. The order of the elements follows the
official schema.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from app.reports.exchange.coordinates import Ends, Point, ends_of, utm_m
from app.reports.exchange.german import fit_rows
from app.reports.exchange.header import Header, plain_number
from app.reports.exchange.losses import NO_GEOMETRY, only_json_holds
from app.reports.exchange.names import FileNames, Names, film, film_renaming
from app.reports.exchange.rows import ABANDONED, Row, general_remark, in_columns, rows_of, texts_of
from app.reports.exchange.tree import Shared, child, children, fill_template, to_bytes
from app.reports.report import Loss, Phrase, Report
from app.survey.fields.lists import GROUNDS
from app.survey.rounding import decimals

_FORMAT = "ISYBAU"
_NAMESPACES = {
    "xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance",
    "xmlns": "http://www.bfr-abwasser.de",
}
_LONGEST_NAME, _LONGEST_FILM = 30, 255
_MAX_STATION_M = 999.99
_NOT_REACHED = "GN"
"""U134: the far end was not reached."""
_ZONES = (31, 32, 33)
"""UTM zones of the collections of the federal states."""
_PIPE = """
<AbwassertechnischeAnlage>
  <Objektbezeichnung/><Objektart>1</Objektart><Status>0</Status><Baujahr/><Entwaesserungsart/>
  <Kante>
    <KantenTyp>0</KantenTyp>
    <KnotenZulauf/><KnotenZulaufTyp>0</KnotenZulaufTyp>
    <KnotenAblauf/><KnotenAblaufTyp>0</KnotenAblaufTyp>
    <Laenge/><Material/>
    <Profil>
      <SonderprofilVorhanden>0</SonderprofilVorhanden><Profilart/><Profilbreite/><Profilhoehe/>
    </Profil>
    <Haltung><HaltungsFunktion>1</HaltungsFunktion></Haltung>
  </Kante>
  <Lage><Strassenname/></Lage>
  <Geometrie>
    <GeoObjektart>4</GeoObjektart><GeoObjekttyp>L</GeoObjekttyp>
    <Geometriedaten><Kanten><Kante><Start/><Ende/></Kante></Kanten></Geometriedaten>
    <CRSLage/>
  </Geometrie>
</AbwassertechnischeAnlage>"""
_NODE = """
<AbwassertechnischeAnlage>
  <Objektbezeichnung/><Objektart>2</Objektart><Status>0</Status><Entwaesserungsart/>
  <Knoten>
    <KnotenTyp>0</KnotenTyp><Schacht><SchachtFunktion>1</SchachtFunktion></Schacht>
  </Knoten>
  <Geometrie>
    <GeoObjektart>1</GeoObjektart><GeoObjekttyp>P</GeoObjekttyp>
    <Geometriedaten><Knoten><Punkt/></Knoten></Geometriedaten>
    <CRSLage/>
  </Geometrie>
</AbwassertechnischeAnlage>"""
_ORDER = """
<Auftrag>
  <Auftragsbezeichnung/><Auftragsnummer/><Auftragskennung/><Auftragsart>1</Auftragsart>
  <Inspektionszweck/><Kodiersystem>8</Kodiersystem><Auftragnehmer/>
</Auftrag>"""
"""Kodiersystem, U102: EN 13508-2 of 2011 without national rules."""
_INSPECTED = """
<InspizierteAbwassertechnischeAnlage>
  <Objektbezeichnung/><Anlagentyp>1</Anlagentyp>
  <Lage><Strassenname/></Lage>
  <OptischeInspektion>
    <Auftragskennung/><Inspektionsdatum/><Inspektionsverfahren/><NameUntersucher/><Uhrzeit/>
    <Wetter/><Temperatur/><Reinigung/><Wasserhaltung/><Videoablagereferenz/><Bemerkung/>
    <Rohrleitung>
      <Rohrleitungstyp>0</Rohrleitungstyp><Inspektionsrichtung/><BezugspunktLage/>
      <Inspektionslaenge/><Inspektionsart>2</Inspektionsart><ArtVideoreferenz/>
      <RGrunddaten>
        <KnotenZulauf/><KnotenZulaufTyp>0</KnotenZulaufTyp>
        <KnotenAblauf/><KnotenAblaufTyp>0</KnotenAblaufTyp>
        <Profilhoehe/><Profilbreite/><Profilart/><Material/><Regeleinzelrohrlaenge/>
      </RGrunddaten>
    </Rohrleitung>
  </OptischeInspektion>
</InspizierteAbwassertechnischeAnlage>"""
_ROW = """
<RZustand>
  <Index/><Station/><Timecode/><InspektionsKode/><Charakterisierung1/><Charakterisierung2/>
  <Verbindung/><Quantifizierung1Numerisch/><Quantifizierung1Text/><Quantifizierung2Numerisch/>
  <Quantifizierung2Text/><Streckenschaden/><StreckenschadenLfdNr/><PositionVon/><PositionBis/>
  <GrundAbbruch/><Fotodatei/><Kommentar/>
</RZustand>"""
_FILM = """
<Film>
  <Filmname/><Auftragskennung/><Videoablagereferenz/>
  <FilmObjekte>
    <FilmObjekt><Objektbezeichnung/><Typ>1</Typ><Inspektionsrichtung/></FilmObjekt>
  </FilmObjekte>
</Film>"""
_ROOT = """
<Identifikation>
  <Version/>
  <Admindaten/>
  <Datenkollektive>
    <Datenstatus>1</Datenstatus><Erstellungsdatum/>
    <Kennungen>
      <Kollektiv>
        <Kennung>STA01</Kennung><Kollektivart>1</Kollektivart>
        <Kollektiveigenschaft>
          <Stammdaten>
            <Stammdatentyp>1</Stammdatentyp><Bautechnik>1</Bautechnik><Geometrie>1</Geometrie>
            <Sanierung>0</Sanierung><Umfeld>0</Umfeld>
          </Stammdaten>
        </Kollektiveigenschaft>
        <Regelwerk/><Bearbeitungsstand/>
      </Kollektiv>
      <Kollektiv>
        <Kennung>ZUS01</Kennung><Kollektivart>2</Kollektivart>
        <Kollektiveigenschaft>
          <Zustandsdaten>
            <Inspektion>1</Inspektion><Dichtheit>0</Dichtheit><Film/>
          </Zustandsdaten>
        </Kollektiveigenschaft>
        <Regelwerk/><Bearbeitungsstand/>
      </Kollektiv>
    </Kennungen>
    <Stammdatenkollektiv>
      <Kennung>STA01</Kennung><Beschreibung>nodes and pipe</Beschreibung>
    </Stammdatenkollektiv>
    <Zustandsdatenkollektiv>
      <Kennung>ZUS01</Kennung><Beschreibung>culvert inspection</Beschreibung>
    </Zustandsdatenkollektiv>
  </Datenkollektive>
</Identifikation>"""


@dataclass(frozen=True)
class _Version:
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
        number = str(self._names.inspections)
        values = {"Auftragsbezeichnung": "1"} | header.columns(job_ref=report.name)
        values |= {
            "Objektbezeichnung": names.asset,
            "Auftragskennung": number,
            "KnotenZulauf": names.upstream,
            "KnotenAblauf": names.downstream,
            "Inspektionslaenge": _length(report.distance_m),
        }
        has_times = bool(film(report)) or any(row.time_s for row in rows)
        values["ArtVideoreferenz"] = "1" if has_times else "4"
        if "Baujahr" in values:
            values["Baujahr"] = values["Baujahr"].zfill(4)
        if film(report):
            values["Videoablagereferenz"] = number
            values["Filmname"] = header.cut(film(report), _LONGEST_FILM, Phrase("part.film"))
            self._films.append(fill_template(_FILM, values))
        values["Bemerkung"] = general_remark(report, header, rows)
        self._orders.append(fill_template(_ORDER, values))
        held = list(fit_rows(rows, _FORMAT, _MAX_STATION_M, losses))
        if has_times:
            losses += [Loss("time_is_zero", row.entry) for row in held if row.time_s is None]
        self._assets.append(_inspected(values, held))
        losses += self._add_assets(values, names, ends_of(header))
        losses += [
            *film_renaming(report, film(report)),
            only_json_holds(report, is_named=not header.text("job_ref")),
            *header.losses(),
        ]
        day = values.get("Inspektionsdatum", report.created_at.date().isoformat())
        self._made_on = max(self._made_on, day)
        return tuple(losses)

    def _add_assets(
        self, values: Mapping[str, str], names: Names, ends: Ends | None
    ) -> Iterator[Loss]:
        """Add nodes and pipe, with their places as far as the format knows their UTM zone."""
        points = utm_m(ends) if ends and ends.is_north and ends.zone in _ZONES else None
        if points is None:
            yield NO_GEOMETRY if ends is None else Loss("isybau_zones", zones=_ZONES)
        places = points.of_nodes(names) if points else {}
        values = {**values, "CRSLage": f"ETRS89_UTM{ends.zone}" if ends else ""}
        for name in names.nodes:
            node = fill_template(_NODE, {**values, "Objektbezeichnung": name}, keep=("Punkt",))
            _place(node, {"Punkt": places.get(name)})
            yield from self._nodes.add(name, node)
        pipe = fill_template(_PIPE, values, keep=("Start", "Ende"))
        ends_of_pipe = {"Start": places.get(names.upstream), "Ende": places.get(names.downstream)}
        _place(pipe, ends_of_pipe)
        yield from self._pipes.add(names.asset, pipe)

    def content(self) -> bytes:
        """Return the document."""
        values = {
            "Version": self._version.name,
            "Erstellungsdatum": self._made_on,
            "Film": str(int(len(self._films) > 0)),
            "Regelwerk": self._version.rules,
            "Bearbeitungsstand": self._made_on,
        }
        root = fill_template(_ROOT, values, keep=("Admindaten",))
        root.attrib.update(_NAMESPACES)
        *_, master, state = root[-1]
        self._nodes.append_to(master)
        self._pipes.append_to(master)
        state.append(self._orders)
        state.extend(self._assets)
        if len(self._films):
            state.append(self._films)
        declaration = '<?xml version="1.0" encoding="ISO-8859-1" standalone="yes"?>'
        return to_bytes(root, declaration, "iso-8859-1")


def file_of_2017() -> IsybauFile:
    """Begin a file in 2017-07, which more programs read."""
    return IsybauFile(_Version("2017-07", "6"))


def file_of_2024() -> IsybauFile:
    """Begin a file in 2024-06."""
    return IsybauFile(_Version("2024-06", "7"))


def _length(surveyed_m: float | None) -> str:
    if surveyed_m is None or not 0 <= surveyed_m <= _MAX_STATION_M:
        return ""
    return decimals(surveyed_m, 2)


def _place(asset: Element, points: Mapping[str, Point | None]) -> None:
    """Fill in the points of an asset, or remove its geometry."""
    geometry = asset[-1]
    for name, point in points.items():
        if point is None:
            asset.remove(geometry)
            return
        (element,) = geometry.iter(name)
        children(
            element,
            {
                "Rechtswert": f"{point[0]:.3f}",
                "Hochwert": f"{point[1]:.3f}",
                "PunktattributAbwasser": "SMP",
            },
        )


def _inspected(values: Mapping[str, str], rows: list[Row]) -> Element:
    asset = fill_template(_INSPECTED, values)
    if rows:
        data = child(asset[-1][-1], "Inspektionsdaten")
        data.extend(fill_template(_ROW, _row(row, index)) for index, row in enumerate(rows, 1))
    return asset


def _row(row: Row, index: int) -> dict[str, str]:
    texts = texts_of(row)
    texts["film_time_s"] = f"{texts['film_time_s'].replace(':', '') or '000000'}00"
    texts["at_joint"] = "1" if row.entry.at_joint else "0"
    if row.clock_from is not None and not texts["clock_to"]:
        texts["clock_to"] = "00"
    values = {"Index": str(index), **in_columns(texts, "isybau")}
    for number, quantity in ((1, row.quant1), (2, row.quant2)):
        if quantity is None:
            continue
        exact = values.pop(f"Quantifizierung{number}Numerisch")
        if abs(quantity) < 9999.995 and plain_number(quantity, 2) == exact:
            values[f"Quantifizierung{number}Numerisch"] = decimals(quantity, 2)
        else:
            values[f"Quantifizierung{number}Text"] = exact
    if row.stretch:
        letter, stretch = row.stretch
        values |= {"Streckenschaden": letter, "StreckenschadenLfdNr": str(stretch)}
    if row.code == ABANDONED:
        values["GrundAbbruch"] = GROUNDS.code("isybau", row.remark) or _NOT_REACHED
    return values
