"""DWA-M 150 XML, type B of 04-2010: nodes (KG), pipe (HG), inspection (HI), observations (HZ).

Elements are in rising order. A station has one decimal, so HZ999 states the exact one.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

from app.reports.exchange import lists
from app.reports.exchange.ascii import one_line
from app.reports.exchange.coordinates import Ends, ends_of, utm_m
from app.reports.exchange.fields import Fields
from app.reports.exchange.isybau import characters_in_words
from app.reports.exchange.losses import left_out
from app.reports.exchange.survey import (
    END,
    START,
    Names,
    Row,
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

_FORMAT = "DWA-M 150"
_LONGEST_NODE, _LONGEST_ASSET = 16, 33
_MAX_MM, _MAX_LENGTH_M, _MAX_STATION_M, _MAX_STRETCH = 9999, 9999.999, 9999.9, 99
_MAX_UNIT_M = 999.999
_CAMERA = "2"
"""Camera of list U109: self-propelled."""
_MAX_QUANTITY, _MIN_QUANTITY = 99999.9, -9999.9
"""Limits of seven characters with one decimal."""


def write(report: Report) -> Written:
    """Write ISO-8859-1 with character references, CRLF."""
    fields = Fields(report.header)
    rows, losses = rows_of(report)
    names, lost = names_of(
        report, fields, one_line, longest_asset=_LONGEST_ASSET, longest_node=_LONGEST_NODE
    )
    losses += lost + standard_of(fields)
    root = Element("DATA")
    children(child(root, "FD"), {"FD001": "04-2010", "FD002": "B"})
    ends = ends_of(fields)
    places, lost = _places(ends, names)
    losses += lost
    system = fields.choice("asset_type", lists.SYSTEMS_M150) or "R"
    for name in dict.fromkeys((names.upstream, names.downstream)):
        node = child(root, "KG")
        children(node, {"KG001": name, "KG301": "K", "KG302": system, "KG305": "S"})
        if places:
            _geometry(node, name, "B", "Pkt", {name: places[name]})
    pipe = _pipe(root, report, fields, names, system)
    if places:
        _geometry(pipe, names.asset, "H", "L", places)
    run = child(pipe, "HI")
    losses += _run(run, report, fields, rows)
    for row in rows:
        if row.distance_m > _MAX_STATION_M:
            losses.append(about(row, "lies beyond what DWA-M 150 can hold and is left out"))
        else:
            children(child(run, "HZ"), _row(row, losses))
    losses += [*renamed(report, film(report)), left_out(report), *fields.losses(_FORMAT)]
    declaration = '<?xml version="1.0" encoding="ISO-8859-1" standalone="no"?>'
    return Written(to_bytes(root, declaration, "iso-8859-1"), tuple(losses))


def _places(ends: Ends | None, names: Names) -> tuple[dict[str, tuple[float, float]], list[Loss]]:
    """Return easting and northing of the nodes, the upstream one first; empty if unknown."""
    points = utm_m(ends) if ends else None
    if ends is None or points is None:
        return {}, [Loss("Without coordinates of both ends the file has no geometry.")]
    of_name = {names.end: points[1], names.start: points[0]}
    places = {name: of_name[name] for name in (names.upstream, names.downstream)}
    zone = f"{ends.zone}{'N' if ends.is_north else 'S'}"
    return places, [Loss(f"The coordinates are of UTM zone {zone}, which the file cannot name.")]


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


def _pipe(root: Element, report: Report, fields: Fields, names: Names, system: str) -> Element:
    words = fields.text("material")
    found = lists.material(words) if words else None
    height_mm = fields.number_within("height_mm", 0, _MAX_MM)
    width_mm = fields.number_within("width_mm", 0, _MAX_MM)
    shape = fields.choice("shape", lists.SHAPES_M150)
    if width_mm is None and shape is not None:
        width_mm = height_mm
    pipe_m = length_m(report, fields, _MAX_LENGTH_M)
    fits = pipe_m is not None and 0 <= pipe_m <= _MAX_LENGTH_M
    length = decimals(pipe_m, 3) if pipe_m is not None and fits else None
    unit_m = unit_length_m(report, fields, _MAX_UNIT_M)
    year = fields.number_within("year", 1, 9999)
    if not (found and found.german):
        fields.leave("material")
    return children(
        child(root, "HG"),
        {
            "HG001": names.asset,
            "HG003": names.upstream,
            "HG004": names.downstream,
            "HG102": fields.text("road"),
            "HG301": "K",
            "HG302": system,
            "HG303": None if year is None else decimals(year, 0),
            "HG304": found.german if found else None,
            "HG305": shape,
            "HG306": None if width_mm is None else decimals(width_mm, 0),
            "HG307": None if height_mm is None else decimals(height_mm, 0),
            "HG308": fields.text("lining_type"),
            "HG309": _lining_material(fields),
            "HG310": length,
            "HG313": "A",
            "HG314": None if unit_m is None else decimals(unit_m, 3),
        },
    )


def _lining_material(fields: Fields) -> str | None:
    words = fields.text("lining_material")
    found = lists.material(words) if words else None
    return found.german if found and found.german else words


def _run(run: Element, report: Report, fields: Fields, rows: list[Row]) -> list[Loss]:
    day, losses = day_of(report, fields)
    clock = fields.time()
    direction = fields.choice("direction", lists.DIRECTIONS_M150)
    if direction is None:
        direction = lists.DIRECTIONS_M150["with_flow"]
        losses.append(Loss("The direction is not known; the file says with the flow."))
    zero = lists.reference_point(fields.text("reference_point") or "inner face")
    weather = lists.weather(fields.text("weather"))
    control = fields.text("flow_control")
    level = fields.number_within("water_level_pct", 0, 100)
    temperature_c = fields.number_within("temperature_c", -100, 100)
    cleaned = fields.flag("cleaned")
    number = lists.flow_control(control) if control else None
    for name, is_known in (
        ("reference_point", zero), ("weather", weather), ("flow_control", number),
        ("edition", None), ("asset_type", lists.is_distinct(report.header.get("asset_type"))),
    ):  # fmt: skip
        if not is_known:
            fields.leave(name)
    fields.choice("method", {"camera": _CAMERA})
    children(
        run,
        {
            "HI001": fields.text("client"),
            "HI002": fields.text("job_ref"),
            "HI004": fields.choice("purpose", lists.PURPOSES_M150) or lists.ANY_PURPOSE_M150,
            "HI005": "EN13508",
            "HI006": joined(fields.text("camera"), fields.text("lens")),
            "HI101": direction,
            "HI102": zero.german if zero else None,
            "HI103": _CAMERA,
            "HI104": day,
            "HI105": ":".join(clock) if clock else None,
            "HI106": {"1": "1", "2": "2", "3": "4"}.get(weather.german or "") if weather else None,
            "HI107": {True: "J", False: "N", None: None}[cleaned],
            "HI108": None if temperature_c is None else plain_number(temperature_c, 1),
            "HI109": number,
            "HI110": None if level is None else decimals(level, 0),
            "HI111": fields.text("contractor"),
            "HI112": fields.text("operator"),
            "HI116": film(report),
            "HI999": general_remark(report, fields, rows),
        },
    )
    return losses


def _row(row: Row, losses: list[Loss]) -> dict[str, object]:
    remark, char1, char2 = row.remark, row.char1, row.char2
    if row.code in (START, END):
        remark = joined(remark, characters_in_words(row))
        char1, char2 = "XP", ""
    stretch = f"{row.stretch[0]}{row.stretch[1]}" if row.stretch else ""
    if row.stretch and row.stretch[1] > _MAX_STRETCH:
        remark, stretch = joined(remark, f"stretch {stretch}"), ""
        losses.append(about(row, f"has a stretch above {_MAX_STRETCH}; its remark says which"))
    exact = [f"station {decimals(row.distance_m, 2)} m"]
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
        "HZ001": decimals(row.distance_m, 1),
        "HZ002": row.code,
        "HZ003": quantities[0],
        "HZ004": quantities[1],
        "HZ005": stretch,
        "HZ006": clocks[0] if clocks else None,
        "HZ007": clocks[1] if len(clocks) > 1 else None,
        "HZ008": None if row.time_s is None else hours(row.time_s),
        "HZ009": one_line(row.photo or ""),
        "HZ010": remark,
        "HZ011": "A" if row.entry.at_joint else None,
        "HZ014": char1,
        "HZ015": char2,
        "HZ999": ", ".join(exact),
    }
