"""DWA-M 150 XML, type B of 04-2010: nodes (KG), pipe (HG), inspection (HI), observations (HZ).

Elements are in rising order. A station has one decimal, so HZ999 states the exact one.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, tostring

from app.reports.content.ascii import one_line
from app.reports.exchange import lists
from app.reports.exchange.coordinates import Ends, ends_of
from app.reports.exchange.fields import Fields
from app.reports.exchange.german import (
    OTHER_FLOW_CONTROL,
    Lengths,
    fitted,
    or_kept,
    pipe_of,
    points_of,
    survey_of,
)
from app.reports.exchange.losses import NO_GEOMETRY, left_out
from app.reports.exchange.survey import (
    FileNames,
    Names,
    Row,
    film,
    general_remark,
    hours,
    joined,
    names_of,
    plain_number,
    renamed,
    rows_of,
    standard_of,
)
from app.reports.exchange.survey_file import of_one
from app.reports.exchange.tree import Shared, child, children, to_bytes
from app.reports.report import Loss, Report, Written
from app.survey.rounding import decimals

_FORMAT = "DWA-M 150"
_LONGEST_NODE, _LONGEST_ASSET = 16, 33
_LENGTHS = Lengths(most_m=9999.999, most_unit_m=999.999, digits=3)
_LISTED = {
    "HG302": "asset_type", "HG304": "material", "HG305": "shape", "HI004": "purpose",
    "HI101": "direction", "HI102": "reference_point", "HI103": "method", "HI106": "weather",
    "HI109": "flow_control",
}  # fmt: skip
"""Elements with a list, and their header fields."""
_MAX_STATION_M = 9999.9
_DIGITS = 1
"""Decimals of a station."""
_CAMERA = "2"
"""Camera of list U109: self-propelled."""
_MAX_QUANTITY = 99999.9
"""Largest number of seven characters with one decimal."""
_MIN_QUANTITY = -9999.9
"""Smallest number of seven characters with one decimal."""


def write(report: Report) -> Written:
    """Write one inspection."""
    return of_one(M150File(), report)


class M150File:
    """ISO-8859-1 with character references, CRLF; inspections of one pipe stand in it together."""

    def __init__(self) -> None:
        self._names = FileNames()
        self._nodes = Shared()
        self._pipes: dict[bytes, Element] = {}
        """By all that is written of a pipe, apart from its inspections."""

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        fields = Fields(report.header)
        rows, losses = rows_of(report, digits=_DIGITS)
        if any(_station(row) != decimals(row.distance_m, 2).removesuffix("0") for row in rows):
            losses.append(Loss("station_beside"))
        names, lost = names_of(
            report,
            fields,
            one_line,
            self._names,
            longest_asset=_LONGEST_ASSET,
            longest_node=_LONGEST_NODE,
        )
        losses += lost + standard_of(fields)
        ends = ends_of(fields)
        places = points_of(ends, names)
        if not places:
            losses.append(NO_GEOMETRY)
        system = fields.choice("asset_type", lists.SYSTEMS_M150) or "R"
        nodes = {name: _node(name, system, places) for name in names.nodes}
        pipe = _pipe(report, fields, names, system)
        if places:
            _geometry(pipe, names.asset, "H", "L", places)
        run = Element("HI")
        losses += _run(run, report, fields, rows, _zone(ends) if ends and places else "")
        for row in rows:
            if row.distance_m > _MAX_STATION_M:
                losses.append(Loss("too_far", row.entry, format=_FORMAT, most=_MAX_STATION_M))
            else:
                held, lost = fitted(row)
                losses += lost
                children(child(run, "HZ"), _row(held))
        losses += [*renamed(report, film(report)), left_out(report), *fields.losses(_FORMAT)]
        for name, node in nodes.items():
            if self._nodes.add(name, node):
                losses.append(Loss("written_once", name=name))
        self._pipes.setdefault(tostring(pipe), pipe).append(run)
        return tuple(losses)

    def content(self) -> bytes:
        """Return the document."""
        root = Element("DATA")
        children(child(root, "FD"), {"FD001": "04-2010", "FD002": "B"})
        self._nodes.append_to(root)
        root.extend(self._pipes.values())
        declaration = '<?xml version="1.0" encoding="ISO-8859-1" standalone="no"?>'
        return to_bytes(root, declaration, "iso-8859-1")


def _node(name: str, system: str, places: dict[str, tuple[float, float]]) -> Element:
    node = children(Element("KG"), {"KG001": name, "KG301": "K", "KG302": system, "KG305": "S"})
    if places:
        _geometry(node, name, "B", "Pkt", {name: places[name]})
    return node


def _zone(ends: Ends) -> str:
    """Return words for the remark: the coordinates themselves do not name their zone."""
    return f"UTM zone {ends.zone}{'N' if ends.is_north else 'S'}"


def _geometry(
    parent: Element, name: str, kind: str, form: str, points: dict[str, tuple[float, float]]
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


def _pipe(report: Report, fields: Fields, names: Names, system: str) -> Element:
    pipe = pipe_of(report, fields, lists.SHAPES_M150, _LENGTHS)
    values = {
        "HG001": names.asset,
        "HG003": names.upstream,
        "HG004": names.downstream,
        "HG102": fields.text("road"),
        "HG301": "K",
        "HG302": system,
        "HG303": None if pipe.year is None else decimals(pipe.year, 0),
        "HG304": pipe.material,
        "HG305": pipe.shape,
        "HG306": pipe.width,
        "HG307": pipe.height,
        "HG308": fields.text("lining_type"),
        "HG309": _lining_material(fields),
        "HG310": pipe.length,
        "HG313": "A",
        "HG314": pipe.unit_length,
    }
    return children(Element("HG"), _with_kept(report, fields, values))


def _with_kept(report: Report, fields: Fields, values: Mapping[str, object]) -> dict[str, object]:
    """Return the values of elements, with what an import kept outside their lists."""
    return {
        code: or_kept(report, fields, _LISTED[code], f"m150_{code.lower()}", value)
        if code in _LISTED
        else value
        for code, value in values.items()
    }


def _lining_material(fields: Fields) -> str | None:
    words = fields.text("lining_material")
    found = lists.material(words) if words else None
    return found.german if found and found.german else words


def _run(run: Element, report: Report, fields: Fields, rows: list[Row], zone: str) -> list[Loss]:
    survey, losses = survey_of(report, fields, lists.DIRECTIONS_M150)
    fields.leave("edition")
    level = fields.rounded("water_level_pct", 0, 0, 100)
    temperature_c = fields.number_within("temperature_c", -100, 100)
    fields.note_digits("temperature_c", 1)
    is_listed = survey.flow_control != OTHER_FLOW_CONTROL
    fields.choice("method", {"camera": _CAMERA})
    values: dict[str, object] = {
        "HI001": fields.text("client"),
        "HI002": fields.text("job_ref"),
        "HI004": fields.choice("purpose", lists.PURPOSES_M150) or lists.ANY_PURPOSE_M150,
        "HI005": "EN13508",
        "HI006": joined(fields.text("camera"), fields.text("lens")),
        "HI101": survey.direction,
        "HI102": survey.zero,
        "HI103": _CAMERA,
        "HI104": survey.day,
        "HI105": survey.clock,
        "HI106": {"1": "1", "2": "2", "3": "4"}.get(survey.weather or ""),
        "HI107": {True: "J", False: "N", None: None}[survey.is_cleaned],
        "HI108": None if temperature_c is None else plain_number(temperature_c, 1),
        "HI109": survey.flow_control if is_listed else None,
        "HI110": level,
        "HI111": fields.text("contractor"),
        "HI112": fields.text("operator"),
        "HI116": film(report),
    }
    values = _with_kept(report, fields, values)
    children(run, values | {"HI999": general_remark(report, fields, rows, zone)})
    return losses


def _station(row: Row) -> str:
    """Format the distance as HZ001 holds it."""
    return decimals(float(decimals(row.distance_m, 2)), _DIGITS)


def _row(row: Row) -> dict[str, object]:
    station = decimals(row.distance_m, 2)
    exact = [f"station {station} m"]
    quantities: list[str | None] = [None, None]
    for index, quantity in enumerate((row.quant1, row.quant2)):
        if quantity is None:
            continue
        if _MIN_QUANTITY <= quantity <= _MAX_QUANTITY:
            quantities[index] = decimals(quantity, 1)
        if quantities[index] is None or plain_number(quantity, 1) != plain_number(quantity):
            exact.append(f"quantity {index + 1} {plain_number(quantity)}")
    clocks = [f"{hour:02d}" for hour in row.clocks]
    return {
        "HZ001": _station(row),
        "HZ002": row.code,
        "HZ003": quantities[0],
        "HZ004": quantities[1],
        "HZ005": f"{row.stretch[0]}{row.stretch[1]}" if row.stretch else None,
        "HZ006": clocks[0] if clocks else None,
        "HZ007": clocks[1] if len(clocks) > 1 else None,
        "HZ008": None if row.time_s is None else hours(row.time_s),
        "HZ009": one_line(row.photo or ""),
        "HZ010": row.remark,
        "HZ011": "A" if row.entry.at_joint else None,
        "HZ014": row.char1,
        "HZ015": row.char2,
        "HZ999": ", ".join(exact),
    }
