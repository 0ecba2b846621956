"""GeoJSON (RFC 7946): the run, its observations and its stretches, WGS 84, to a centimetre."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from app.errors import ExportNotAvailable
from app.reports.exchange.ascii import one_line
from app.reports.exchange.coordinates import ends_of, missing_of
from app.reports.exchange.fields import Fields
from app.reports.exchange.losses import ONE_LINE
from app.reports.exchange.survey import length_m
from app.reports.report import Entry, Loss, Report, Stretch, Written
from app.reports.tables import table
from app.reports.tables.table import Cell
from app.survey.rounding import rounded

_KILOMETRES = re.compile(r"([0-9]+)\+([0-9]{1,3}(?:\.[0-9]+)?)")
"""12+340 means kilometre 12 of the road plus 340 m."""
Place = Callable[[float], list[float]]
"""Returns longitude and latitude of a distance in metres."""


def write(report: Report) -> Written:
    """Write the run and each stretch as a LineString, each observation as a Point; `kind` names
    them.

    Raises:
        ExportNotAvailable: The coordinates of the ends, or the length between them, are unknown.
    """
    fields = Fields(report.header)
    place = _place(report, fields)
    along: dict[str, Any] = {"asset_id": one_line(report.asset)}
    chainage_m = road_chainage_m(fields)
    if chainage_m is not None:
        along["road_chainage_m"] = chainage_m
    untracked = [entry for entry in report.entries if entry.distance_m is None]
    features = [
        _run(report, fields, place, along),
        *(
            _observation(entry, row, place, along)
            for entry, row in zip(report.entries, table.rows(report), strict=True)
        ),
        *(
            _stretch(stretch, place, along)
            for stretch in report.stretches
            if stretch.start.distance_m is not None and stretch.finish.distance_m is not None
        ),
    ]
    lines = ",\n".join(json.dumps(it, ensure_ascii=False, allow_nan=False) for it in features)
    text = f'{{"type":"FeatureCollection","features":[\n{lines}\n]}}\n'
    losses = [Loss("not_on_map", entry) for entry in untracked]
    losses.append(Loss("straight_line"))
    losses.append(Loss("only_observations"))
    texts = [value for row in (*table.rows(report), report.header) for value in row.values()]
    if any(one_line(text) != text for text in texts if isinstance(text, str)):
        losses.append(ONE_LINE)
    return Written(text.encode(), tuple(losses))


def road_chainage_m(fields: Fields) -> float | None:
    """Return the road chainage of the culvert, from a number or text such as 12+340, or None."""
    found = _KILOMETRES.fullmatch(fields.text("road_chainage"))
    if found:
        return round(1000 * float(found[1]) + float(found[2]), 3)
    return fields.number("road_chainage")


def _place(report: Report, fields: Fields) -> Place:
    ends = ends_of(fields)
    if ends is None:
        raise ExportNotAvailable(
            f"GeoJSON needs the coordinates of both ends. Fill in {', '.join(missing_of(fields))} "
            "of the header, in degrees."
        )
    run_m = length_m(report, fields)
    if run_m is None or run_m <= 0:
        raise ExportNotAvailable(
            "GeoJSON needs the length between the ends. Fill in known_length_m of the header."
        )
    (start_lon, start_lat), (end_lon, end_lat) = ends.start, ends.end

    def place(distance_m: float) -> list[float]:
        share = distance_m / run_m
        lon = start_lon + share * (end_lon - start_lon)
        lat = start_lat + share * (end_lat - start_lat)
        return [round(min(180.0, max(-180.0, lon)), 7), round(min(90.0, max(-90.0, lat)), 7)]

    return place


def _run(report: Report, fields: Fields, place: Place, along: Mapping[str, Any]) -> dict[str, Any]:
    run_m = length_m(report, fields) or 0.0
    surveyed: dict[str, Any] = {"surveyed_m": report.distance_m, "surveyed_u95_m": report.u95_m}
    met = report.adjusted.distance_class() if report.adjusted else None
    if met is not None:
        surveyed["distance_class"] = f"{met.percent:g} %" if met.percent else "not met"
    own = {"kind": "run", **along, "length_m": run_m, **surveyed}
    header = {one_line(str(name)): _legible(value) for name, value in report.header.items()}
    header.pop("asset_id", None)
    stated = {f"header_{name}" if name in own else name: it for name, it in header.items()}
    properties = {**stated, **own}
    line = {"type": "LineString", "coordinates": [place(0.0), place(run_m)]}
    return _feature("run", line, properties)


def _legible(value: object) -> str | int | float | bool | None:
    """Clean a header value; None for one that a table of attributes cannot hold."""
    if isinstance(value, str):
        return one_line(value) or None
    if isinstance(value, bool | int):
        return value
    return value if isinstance(value, float) and math.isfinite(value) else None


def _observation(
    entry: Entry, row: Mapping[str, Cell], place: Place, along: Mapping[str, Any]
) -> dict[str, Any]:
    """Build an observation with the keys of the table; its geometry holds the map position."""
    geometry = None
    if entry.distance_m is not None:
        geometry = {"type": "Point", "coordinates": place(entry.distance_m)}
    fields = {name: _legible(value) for name, value in row.items() if name not in ("lon", "lat")}
    joint = {"at_joint": True if entry.at_joint else None}
    characters = {"char1": entry.tag.char1 or "", "char2": entry.tag.char2 or ""}
    properties = {"kind": "observation", **fields, **along, **joint, **characters}
    return _feature(f"obs-{entry.seq}", geometry, properties)


def _stretch(stretch: Stretch, place: Place, along: Mapping[str, Any]) -> dict[str, Any]:
    from_m, to_m = stretch.start.distance_m or 0.0, stretch.finish.distance_m or 0.0
    properties = {
        "kind": "stretch",
        **along,
        "cont_id": stretch.number,
        "code": stretch.start.tag.code,
        "from_m": from_m,
        "to_m": to_m,
        "length_m": rounded(to_m - from_m, 3),
    }
    line = {"type": "LineString", "coordinates": [place(from_m), place(to_m)]}
    return _feature(f"stretch-{stretch.number}", line, properties)


def _feature(
    name: str, geometry: Mapping[str, Any] | None, properties: Mapping[str, Any]
) -> dict[str, Any]:
    """Build a feature without unknown properties."""
    known = {key: value for key, value in properties.items() if value is not None}
    return {"type": "Feature", "id": name, "geometry": geometry, "properties": known}
