"""DWA-M 150 XML, type B of 04-2010: nodes (KG), pipe (HG), inspection (HI), observations (HZ).

Elements are in rising order. A station has one decimal, so HZ999 states the exact one.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, tostring

from app.reports.exchange.coordinates import Ends, Point, ends_of, utm_m
from app.reports.exchange.german import fit_rows
from app.reports.exchange.header import Header, plain_number
from app.reports.exchange.losses import NO_GEOMETRY, only_json_holds
from app.reports.exchange.names import FileNames, film, film_renaming
from app.reports.exchange.rows import Row, general_remark, in_columns, rows_of, texts_of
from app.reports.exchange.tree import Shared, child, children, to_bytes
from app.reports.report import Loss, Report
from app.survey.rounding import decimals

_FORMAT = "DWA-M 150"
_LONGEST_NODE, _LONGEST_ASSET = 16, 33
_MAX_STATION_M = 9999.9
_DIGITS = 1
"""Decimals of a station."""
_MIN_QUANTITY, _MAX_QUANTITY = -9999.9, 99999.9
"""Numbers of seven characters with one decimal."""


class M150File:
    """ISO-8859-1 with character references, CRLF; inspections of one pipe stand in it together."""

    def __init__(self) -> None:
        self._names = FileNames(longest_asset=_LONGEST_ASSET, longest_node=_LONGEST_NODE)
        self._nodes = Shared()
        self._pipes: dict[bytes, Element] = {}
        """By all that is written of a pipe, apart from its inspections."""

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        header = Header(report, "m150", _FORMAT)
        rows, losses = rows_of(report, digits=_DIGITS)
        if any(_station(row) != decimals(row.distance_m, 2).removesuffix("0") for row in rows):
            losses.append(Loss("station_beside"))
        names, lost = self._names.add(report, header)
        losses += lost
        ends = ends_of(header)
        points = utm_m(ends) if ends else None
        places = points.of_nodes(names) if points else {}
        if not places:
            losses.append(NO_GEOMETRY)
        values = header.columns() | {
            "HG001": names.asset,
            "HG003": names.upstream,
            "HG004": names.downstream,
            "HG301": "K",
            "HG313": "A",
            "HI005": "EN13508",
            "HI116": film(report),
        }
        values["HI999"] = general_remark(
            report, header, rows, _zone(ends) if ends and places else ""
        )
        run = _group("HI", values)
        for row in fit_rows(rows, _FORMAT, _MAX_STATION_M, losses):
            children(child(run, "HZ"), _row(row))
        pipe = _group("HG", values)
        if places:
            _add_geometry(pipe, names.asset, "H", "L", places)
        for name in names.nodes:
            node = children(
                Element("KG"),
                {"KG001": name, "KG301": "K", "KG302": values["HG302"], "KG305": "S"},
            )
            if places:
                _add_geometry(node, name, "B", "Pkt", {name: places[name]})
            losses += self._nodes.add(name, node)
        self._pipes.setdefault(tostring(pipe), pipe).append(run)
        losses += [*film_renaming(report, film(report)), only_json_holds(report), *header.losses()]
        return tuple(losses)

    def content(self) -> bytes:
        """Return the document."""
        root = Element("DATA")
        children(child(root, "FD"), {"FD001": "04-2010", "FD002": "B"})
        self._nodes.append_to(root)
        root.extend(self._pipes.values())
        declaration = '<?xml version="1.0" encoding="ISO-8859-1" standalone="no"?>'
        return to_bytes(root, declaration, "iso-8859-1")


def _zone(ends: Ends) -> str:
    """Return words for the remark: the coordinates themselves do not name their zone."""
    return f"UTM zone {ends.zone}{'N' if ends.is_north else 'S'}"


def _group(name: str, values: Mapping[str, str]) -> Element:
    own = {code: values[code] for code in sorted(values) if code.startswith(name)}
    return children(Element(name), own)


def _add_geometry(
    parent: Element, name: str, kind: str, form: str, points: Mapping[str, Point]
) -> None:
    geometry = child(parent, "GO")
    children(geometry, {"GO001": name, "GO002": kind, "GO003": form})
    for node, (easting_m, northing_m) in points.items():
        children(
            child(geometry, "GP"),
            {
                "GP001": node,
                "GP002": "UTM",
                "GP005": f"{easting_m:.3f}",
                "GP006": f"{northing_m:.3f}",
            },
        )


def _station(row: Row) -> str:
    return decimals(float(decimals(row.distance_m, 2)), _DIGITS)


def _row(row: Row) -> dict[str, str]:
    texts = texts_of(row)
    exact = [f"station {texts['distance_m']} m"]
    texts["distance_m"] = _station(row)
    for number, quantity in ((1, row.quant1), (2, row.quant2)):
        if quantity is None:
            continue
        is_held = _MIN_QUANTITY <= quantity <= _MAX_QUANTITY
        if not is_held or plain_number(quantity, 1) != plain_number(quantity):
            exact.append(f"quantity {number} {plain_number(quantity)}")
        texts[f"quant{number}"] = decimals(quantity, 1) if is_held else ""
    values = in_columns(texts, "m150") | {"HZ999": ", ".join(exact)}
    return dict(sorted(values.items()))
