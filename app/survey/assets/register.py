"""The register of assets: what it holds of a culvert, and what a new inspection takes from it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from app.survey.fields.declaration import Value
from app.survey.fields.header import ASSET_FIELDS, is_empty, project_of

Point = tuple[float, float]
"""Longitude and latitude in degrees (WGS 84)."""
Line = tuple[Point, ...]
"""The culvert from its start to its end; one point or none where more is not known."""

LONGEST_ID = 200
LONGEST_REGISTERED = 2_000
"""Longest text of a field, in characters."""
MOST_POINTS = 1_000
_DECIMALS = 7
"""Of degrees: a centimetre on the ground."""
_TOGETHER = (
    ("shape", "height_mm", "width_mm"),
    ("known_length_m", "known_length_source"),
    ("start_lat", "start_lon", "end_lat", "end_lon"),
)
"""Fields that only mean something together."""
_WKT = re.compile(
    r"(?:SRID=4326;)?\s*(POINT|LINESTRING|MULTILINESTRING)\s*(?:ZM|Z|M)?\s*(EMPTY|\(.*\))", re.I
)


class InvalidLine(ValueError):
    """The text states no line on the ground; the message says what to write."""


@dataclass(frozen=True, slots=True)
class Asset:
    """A culvert of the register; `registered` makes one of what people state."""

    asset_id: str
    project: str | None = None
    header: Mapping[str, Value] = field(default_factory=dict)
    """Fields of `ASSET_FIELDS` that are not empty."""
    line: Line = ()


def registered(
    asset_id: str, project: str | None, header: Mapping[str, Value], line: Line
) -> Asset:
    """Return an asset with texts of one line each, known fields only and none that is empty."""
    tidy = {name: _tidy(header[name]) for name in ASSET_FIELDS if name in header}
    return Asset(
        asset_id=one_line(asset_id),
        project=one_line(project or "") or None,
        header={name: value for name, value in tidy.items() if not is_empty(value)},
        line=tuple((round(lon, _DECIMALS), round(lat, _DECIMALS)) for lon, lat in line),
    )


def one_line(text: str) -> str:
    """Return text with single spaces between its words and no line break."""
    return " ".join(text.split())


def fields_of(asset: Asset) -> dict[str, Value]:
    """Return what the register knows of an asset as fields of a header, without its id."""
    known: dict[str, Value] = dict(asset.header)
    if asset.project is not None:
        known["project"] = asset.project
    if asset.line:
        known["start_lon"], known["start_lat"] = asset.line[0]
    if len(asset.line) > 1:
        known["end_lon"], known["end_lat"] = asset.line[-1]
    return known


def completed(header: Mapping[str, Value], asset: Asset | None) -> dict[str, Value]:
    """Return the header of a new inspection, with what the register knows in its empty fields.

    What the header states stays.  None states that a field is to stay empty.  Fields that belong
    together are filled only if the header contradicts none of them.
    """
    stated: dict[str, Value] = {name: value for name, value in header.items() if value is not None}
    if asset is None:
        return stated
    known = fields_of(asset)
    if project_of(header) is not None:
        known.pop("project", None)
    for names in _TOGETHER:
        if any(name in known and header.get(name, "") not in ("", known[name]) for name in names):
            known = {name: value for name, value in known.items() if name not in names}
    empty = {name: value for name, value in known.items() if header.get(name, "") == ""}
    return stated | empty


def line_of(text: str) -> Line:
    """Return the line of a text in WKT: POINT, LINESTRING, or MULTILINESTRING of one line.

    Raises:
        InvalidLine: The text is none of these, or leaves the globe.
    """
    found = _WKT.fullmatch(text.strip())
    if found is None:
        raise InvalidLine(
            "wkt must be POINT (lon lat) or LINESTRING (lon lat, lon lat, ...) "
            f"(found {text[:60]!r})"
        )
    kind, body = found[1].upper(), found[2]
    if body.upper() == "EMPTY":
        return ()
    inner = body[1:-1].strip()
    if kind == "MULTILINESTRING":
        if inner.count("(") != 1:
            raise InvalidLine("wkt has several lines; state one line for each asset")
        inner = inner.removeprefix("(").removesuffix(")")
    points = tuple(_point_of(part) for part in inner.split(","))
    if kind == "POINT" and len(points) > 1:
        raise InvalidLine("wkt states a POINT of several points; write LINESTRING")
    require_line(points)
    return points


def require_line(line: Line) -> None:
    """Raise InvalidLine if a point is not on the globe, or the line has too many points."""
    if len(line) > MOST_POINTS:
        raise InvalidLine(f"a line has at most {MOST_POINTS} points (found {len(line)})")
    for lon, lat in line:
        if not (abs(lon) <= 180 and abs(lat) <= 90):
            raise InvalidLine(
                f"longitude {lon:g} and latitude {lat:g} are not degrees of WGS 84 (EPSG:4326); "
                "export the table in that reference system, longitude first in wkt"
            )


def wkt_of(line: Line) -> str:
    """Write a line as WKT; nothing for no line."""
    points = ", ".join(f"{lon} {lat}" for lon, lat in line)
    return "" if not line else f"{'POINT' if len(line) == 1 else 'LINESTRING'} ({points})"


def texts_of(asset: Asset) -> Iterator[str]:
    """Yield what the search finds an asset by."""
    yield asset.asset_id
    yield asset.project or ""
    yield from (value for value in asset.header.values() if isinstance(value, str))


def _tidy(value: Value) -> Value:
    return one_line(value) if isinstance(value, str) else value


def _point_of(text: str) -> Point:
    try:
        lon, lat, *_height = map(float, text.split())
    except ValueError as error:
        raise InvalidLine(
            f"wkt needs longitude and latitude for each point (found {text.strip()[:60]!r})"
        ) from error
    return lon, lat
