"""GeoJSON (RFC 7946): the run, its observations and its stretches, WGS 84, to a millimetre.

They lie on the course of the culvert (`app.survey.places.alignment`): the line of the register, or
a straight one between the ends.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.reports.exchange.header import field_name
from app.reports.exchange.losses import ONE_LINE
from app.reports.report import Entry, FormatNeeds, Loss, Phrase, Report, Stretch, Written
from app.reports.tables import table
from app.reports.tables.table import Cell
from app.reports.text.ascii import one_line
from app.survey.assets.register import Point
from app.survey.fields.header import number_of
from app.survey.places.alignment import Alignment, alignment_of, missing_of
from app.survey.rounding import decimals, rounded

_KILOMETRES = re.compile(r"(?:km\s*)?([0-9]+)\s*\+\s*([0-9]{1,3}(?:\.[0-9]+)?)", re.IGNORECASE)
"""12+340 means kilometre 12 of the road plus 340 m."""


@dataclass(frozen=True)
class _Course:
    """Where things are: on the map, and along the road."""

    alignment: Alignment
    road_start_m: float | None
    road_end_m: float | None
    """Road chainage of both ends, as far as they are stated."""

    def road_m(self, distance_m: float | None) -> float | None:
        """Return the road chainage of a distance: between the ends, else that of the start."""
        if self.road_start_m is None or self.road_end_m is None or distance_m is None:
            return self.road_start_m
        share = self.alignment.share(distance_m)
        return rounded(self.road_start_m + share * (self.road_end_m - self.road_start_m), 3)


def write(report: Report) -> Written:
    """Write the run and each stretch as a LineString, each observation as a Point; `kind` names
    them.

    Raises:
        FormatNeeds: The coordinates of the ends, or the length between them, are unknown.
    """
    header = report.header
    course = _Course(
        _alignment(report),
        road_chainage_m(header.get("road_chainage")),
        road_chainage_m(header.get("road_chainage_end")),
    )
    asset = {"asset_id": one_line(report.asset)}
    untracked = [entry for entry in report.entries if entry.distance_m is None]
    features = [
        _run(report, course, asset),
        *(
            _observation(entry, row, course, asset)
            for entry, row in zip(report.entries, table.rows(report), strict=True)
        ),
        *(
            _stretch(stretch, course, asset)
            for stretch in report.stretches
            if stretch.start.distance_m is not None and stretch.finish.distance_m is not None
        ),
    ]
    lines = ",\n".join(json.dumps(it, ensure_ascii=False, allow_nan=False) for it in features)
    text = f'{{"type":"FeatureCollection","features":[\n{lines}\n]}}\n'
    losses = [Loss("not_on_map", entry) for entry in untracked]
    losses += _assumed(course)
    losses.append(Loss("only_observations"))
    texts = [value for row in (*table.rows(report), report.header) for value in row.values()]
    if any(one_line(text) != text for text in texts if isinstance(text, str)):
        losses.append(ONE_LINE)
    return Written(text.encode(), tuple(losses))


def road_chainage_m(value: object) -> float | None:
    """Return a road chainage, from a number or text such as 12+340, or None."""
    found = _KILOMETRES.fullmatch(value.strip()) if isinstance(value, str) else None
    if found:
        return round(1000 * float(found[1]) + float(found[2]), 3)
    return number_of(value)


def _alignment(report: Report) -> Alignment:
    found = alignment_of(report.header, report.line, report.distance_m)
    if found is not None:
        return found
    missing = missing_of(report.header)
    if missing and len(report.line) < 2:
        raise FormatNeeds(
            f"GeoJSON needs the coordinates of both ends. Fill in {', '.join(missing)} "
            "of the header, in degrees.",
            Phrase("failure.no_ends", fields=tuple(map(field_name, missing))),
        )
    raise FormatNeeds(
        "GeoJSON needs the length between the ends. Fill in known_length_m of the header.",
        Phrase("failure.no_length", field=field_name("known_length_m")),
    )


def _assumed(course: _Course) -> list[Loss]:
    alignment = course.alignment
    if alignment.is_straight:
        losses = [Loss("straight_line")]
    else:
        drawn, length = (decimals(each, 2) for each in (alignment.drawn_m, alignment.length_m))
        losses = [Loss("scaled_line", drawn=drawn, length=length)]
    if course.road_start_m is not None and course.road_end_m is None:
        losses.append(Loss("road_chainage_of_start"))
    return losses


def _run(report: Report, course: _Course, asset: Mapping[str, str]) -> dict[str, Any]:
    run_m = course.alignment.length_m
    surveyed: dict[str, Any] = {"surveyed_m": report.distance_m, "surveyed_u95_m": report.u95_m}
    met = report.adjusted.distance_class() if report.adjusted else None
    if met is not None:
        surveyed["distance_class"] = f"{met.percent:g} %" if met.percent else "not met"
    road = {"road_chainage_m": course.road_m(0.0), "road_chainage_end_m": course.road_end_m}
    own = {"kind": "run", **asset, **road, "length_m": run_m, **surveyed}
    header = {one_line(str(name)): _legible(value) for name, value in report.header.items()}
    header.pop("asset_id", None)
    stated = {f"header_{name}" if name in own else name: it for name, it in header.items()}
    properties = {**stated, **own}
    return _feature("run", _line(course.alignment.part(0.0, run_m)), properties)


def _legible(value: object) -> str | int | float | bool | None:
    """Clean a header value; None for one that a table of attributes cannot hold."""
    if isinstance(value, str):
        return one_line(value) or None
    if isinstance(value, bool | int):
        return value
    return value if isinstance(value, float) and math.isfinite(value) else None


def _observation(
    entry: Entry, row: Mapping[str, Cell], course: _Course, asset: Mapping[str, str]
) -> dict[str, Any]:
    """Build an observation with the keys of the table; its geometry holds the map position."""
    geometry = None
    if entry.distance_m is not None:
        geometry = {"type": "Point", "coordinates": list(course.alignment.at(entry.distance_m))}
    fields = {name: _legible(value) for name, value in row.items() if name not in ("lon", "lat")}
    road = {"road_chainage_m": course.road_m(entry.distance_m)}
    joint = {"at_joint": True if entry.at_joint else None}
    characters = {"char1": entry.tag.char1 or "", "char2": entry.tag.char2 or ""}
    properties = {"kind": "observation", **fields, **asset, **road, **joint, **characters}
    return _feature(f"obs-{entry.seq}", geometry, properties)


def _stretch(stretch: Stretch, course: _Course, asset: Mapping[str, str]) -> dict[str, Any]:
    from_m, to_m = stretch.start.distance_m or 0.0, stretch.finish.distance_m or 0.0
    road_end_m = None if course.road_end_m is None else course.road_m(to_m)
    properties = {
        "kind": "stretch",
        **asset,
        "road_chainage_m": course.road_m(from_m),
        "road_chainage_end_m": road_end_m,
        "cont_id": stretch.number,
        "code": stretch.start.tag.code,
        "from_m": from_m,
        "to_m": to_m,
        "length_m": rounded(to_m - from_m, 3),
    }
    line = _line(course.alignment.part(from_m, to_m))
    return _feature(f"stretch-{stretch.number}", line, properties)


def _line(points: Sequence[Point]) -> dict[str, Any]:
    return {"type": "LineString", "coordinates": [list(point) for point in points]}


def _feature(
    name: str, geometry: Mapping[str, Any] | None, properties: Mapping[str, Any]
) -> dict[str, Any]:
    known = {key: value for key, value in properties.items() if value is not None}
    return {"type": "Feature", "id": name, "geometry": geometry, "properties": known}
