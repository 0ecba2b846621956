"""The lists that ISYBAU XML and DWA-M 150 share, in words of the header, and their coordinates."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from app.imports.survey import (
    ImportedObservation,
    Notes,
    behind_remark,
    number,
    severity_of,
    stretch,
)
from app.imports.xml_file import Element
from app.survey import grids

MATERIALS: Mapping[str, str] = {
    "AZ": "asbestos cement", "FZ": "fibre cement", "BS": "concrete segments",
    "SB": "reinforced concrete", "B": "concrete", "MA": "masonry", "STZ": "vitrified clay",
    "GGG": "ductile iron", "GG": "cast iron", "ST": "steel", "PEHD": "HDPE", "PE": "polyethylene",
    "PP": "polypropylene", "PVCU": "PVC-U", "GFK": "glass-fibre plastics",
}  # fmt: skip
"""List G102."""
WEATHER: Mapping[str, str] = {"1": "dry", "2": "rain", "3": "snow or ice melting"}
"""List U106."""
FLOW_CONTROL: Mapping[str, str] = {
    "1": "none", "2": "blocked upstream", "3": "partly blocked", "4": "laterals blocked",
    "5": "backwater",
}  # fmt: skip
"""List U107, but for 6, other measures, which a remark explains."""
REFERENCE_POINTS: Mapping[str, str] = {
    "1": "centre of the start manhole", "2": "inner face of the wall at the start",
    "3": "crown of the pipe at the start", "4": "half way along the channel at the start",
}  # fmt: skip
"""List U105."""

_UTM = re.compile(r"UTM\D{0,10}([0-9]{1,2})\s?([NS]?)", re.IGNORECASE)
_CODED = re.compile(r"(?:^|, )coded (BC[DE])((?: [A-Z][A-Z0-9]{0,3}){1,2})$")
_XP = "XP"


def listed(
    header: dict[str, Any],
    name: str,
    value: str,
    meanings: Mapping[str, Any],
    own: str,
    line: int,
    notes: Notes,
) -> None:
    """Put the meaning of a code into the header; keep, with a warning, one that is unknown.

    Args:
        header: Where it goes.
        name: The header field.
        value: The code; empty for none.
        meanings: What codes mean.
        own: Name of the header field that keeps an unknown code.
        line, notes: Of the warning.
    """  # fmt: skip
    if not value:
        return
    found = meanings.get(value.upper())
    if found is not None:
        header[name] = found
        return
    header[own] = value
    notes.add("unknown_value", line, field=name, value=f"{value!r:.40}", own=own)


def grid_of(named: str, easting_m: float) -> tuple[int, float] | None:
    """Return the EPSG code of a German grid, and the easting without the number of its zone.

    Args:
        named: Words such as `ETRS89_UTM32` or `UTM zone 47N`; others name no zone.
        easting_m: The easting, which may begin with its zone: 2 to 5 are of Gauss-Kruger.
    """
    leading = int(easting_m // 1_000_000)
    found = _UTM.search(named)
    epsg = None if found else grids.gauss_kruger(easting_m)
    if epsg is not None:
        return epsg, easting_m
    zone = int(found[1]) if found else leading
    if not 1 <= zone <= 60:
        return None
    is_north = found is None or found[2].upper() != "S"
    return grids.utm(zone, is_north=is_north), easting_m - 1_000_000 * max(leading, 0)


def place_of(named: str, easting: str, northing: str) -> tuple[float, float] | None:
    """Return longitude and latitude of a point of a German grid, or None."""
    easting_m, northing_m = number(easting, 1e8), number(northing, 1e8)
    if easting_m is None or northing_m is None:
        return None
    grid = grid_of(named, easting_m)
    return grids.degrees(grid[0], grid[1], northing_m) if grid else None


def at_ends(
    header: Mapping[str, Any], places: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    """Return the fields of the places of both ends, by the names of their nodes."""
    found: dict[str, float] = {}
    for end in ("start", "end"):
        place = places.get(str(header.get(f"{end}_node")))
        if place is not None:
            found[f"{end}_lon"], found[f"{end}_lat"] = place
    return found


def observations_of(
    rows: Sequence[Element],
    room: int,
    notes: Notes,
    read: Callable[[Element], ImportedObservation | None],
) -> list[ImportedObservation]:
    """Return the observations of the rows, at most `room`; `read` makes one, or warns."""
    if len(rows) > room:
        notes.add_too_many(rows[room].line)
    return [found for row in rows[:room] if (found := read(row)) is not None]


def from_remark(observation: ImportedObservation) -> ImportedObservation:
    """Take what our exports put at the end of a remark: long stretches, other characters of start
    and end, the severity.
    """
    remark = observation.remark
    changes: dict[str, Any] = {}
    head, _, last = f", {remark}".rpartition(", stretch ")
    if observation.stretch is None and head != "" and (mark := stretch(last)):
        remark, changes["stretch"] = head[2:], mark
    coded = _CODED.search(remark)
    if coded and observation.char1 == _XP and coded[1] == observation.code:
        letters = coded[2].split()
        remark = remark[: coded.start()]
        changes |= {"char1": letters[0], "char2": letters[1] if len(letters) > 1 else None}
    remark, changes["severity"] = severity_of(remark)
    return replace(observation, remark=remark, **changes)


def more_exact(remark: str, label: str, otherwise: float | None) -> tuple[str, float | None]:
    """Return the rest of a remark and the number at its end, or the one that was read."""
    rest, value = behind_remark(remark, label)
    return (remark, otherwise) if value is None else (rest, value)
