"""RIBX 1.5.1, the Dutch variant of the EN 13508-2 XML: the pipe is a `ZB_A`, an entry a `ZC`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePath
from xml.etree.ElementTree import Element

from app.reports.exchange.coordinates import NAMES, Point, ends_of, rd_m
from app.reports.exchange.en13508 import columns, explanations, header_values
from app.reports.exchange.en13508_xml import DECLARATION
from app.reports.exchange.header import Header, field_name
from app.reports.exchange.losses import NO_GEOMETRY, only_json_holds
from app.reports.exchange.names import FileNames, Names, film_in_ascii, film_renaming
from app.reports.exchange.rows import CODES, Row, rows_of
from app.reports.exchange.tree import child, children, to_bytes
from app.reports.report import Loss, Phrase, Report
from app.reports.text.ascii import one_line
from app.survey.fields.declaration import OTHER
from app.survey.fields.header import FIELDS

_FORMAT = "RIBX"
_STANDARD = "EN 13508-2+A1:2011"
"""One of the two names that ABA allows; the other includes the Dutch additions."""
_CODES = re.compile(rf"{CODES.pattern}|BX[A-Z]")
"""The Dutch additions measure, such as BXA the slope."""
_GML = "http://www.opengis.net/gml"
_NEEDED = {
    "AAM": "client", "ABF": "date", "ABH": "operator", "ABI": "job_ref", "ABJ": "client_job_ref",
    "ABS": "", "ACA": "shape", "ACB": "height_mm", "ACD": "material", "ACM": "cleaned",
}  # fmt: skip
"""Codes that a delivery must contain, and their fields; ABS is the film."""
_NEVER = frozenset({"AAC", "AAE", "AAG", "AAU"})
"""Codes that RIBX has as points."""


class RibxFile:
    """UTF-8 whose letters beyond ASCII are character references, since one of the readers accepts
    ASCII only.
    """

    def __init__(self) -> None:
        self._names = FileNames()
        self._root = Element("DATA", {"xmlns:gml": _GML})
        children(child(self._root, "ZA"), {"A2": "nl", "A6": "RIBX 1.5.1"})

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        header = Header(report, "en", _FORMAT)
        rows, losses = rows_of(report, _CODES)
        names, lost = self._names.add(report, header)
        values = header_values(report, header, names, rows) | {"ABA": _STANDARD}
        losses += lost + _missing(values)
        explained = _explained(report, header, values)
        points, lost = _points(header, names)
        pipe = child(self._root, "ZB_A")
        for code in sorted({*values, *points} - (_NEVER - points.keys())):
            if code in points:
                _add_point(child(pipe, code), points[code])
            else:
                words = {"ADE": explained[code]} if code in explained else {}
                child(pipe, code, values[code], **words)
        film = film_in_ascii(report)
        for row in rows:
            children(child(pipe, "ZC"), _row(row, names, film))
        losses += [*lost, *film_renaming(report, film), only_json_holds(report), *header.losses()]
        return tuple(losses)

    def content(self) -> bytes:
        """Return the document."""
        return to_bytes(self._root, DECLARATION, "ascii")


def _missing(values: Mapping[str, str]) -> list[Loss]:
    missing = tuple(
        Phrase("part.code_of", code=code, field=field_name(name) if name else Phrase("part.film"))
        for code, name in _NEEDED.items()
        if not values.get(code)
    )
    return [Loss("ribx_requires", missing=missing)] if missing else []


def _explained(report: Report, header: Header, values: dict[str, str]) -> dict[str, str]:
    """Return what letters Z stand for, which stands beside them; add those of the film."""
    explained = {
        field.columns["en"].code: one_line(str(report.header.get(field.name) or ""))
        for field in FIELDS
        if field.listed("en") and values.get(field.columns["en"].code) == OTHER
    }
    if name := film_in_ascii(report):
        codec = str(report.source.video.get("codec") or "")
        media = {
            "ABK": "file on disk",
            "ABL": "JPEG",
            "ABR": one_line(f"{PurePath(name).suffix[1:].upper()} {codec}"),
        }
        values |= {**dict.fromkeys(media, OTHER), "ABO": "VIDEO-01"} | values
        explained |= {code: words for code, words in media.items() if values[code] == OTHER}
    return explained | explanations(header, values)


def _points(header: Header, names: Names) -> tuple[dict[str, Point], list[Loss]]:
    """Return AAE and AAG, of the nodes of AAD and AAF, if they are in the Netherlands."""
    ends = ends_of(header)
    if ends is None:
        return {}, [NO_GEOMETRY]
    found = rd_m(ends)
    if found is None:
        return {}, [Loss("dutch_grid", fields=tuple(map(field_name, NAMES)))]
    return dict(zip(("AAE", "AAG"), found.along(names), strict=True)), []


def _add_point(parent: Element, point: Point) -> None:
    place = child(parent, "gml:Point", srsName="Netherlands-RD", srsDimension="2")
    child(place, "gml:pos", f"{point[0]:.3f} {point[1]:.3f}")


def _row(row: Row, names: Names, film: str) -> dict[str, str]:
    values = columns(row, names)
    for clock in ("G", "H"):
        if clock in values:
            values[clock] = values[clock].zfill(2)
    if "N" in values and film:
        values["N"] = f"{film}|{values['N']}"
    return dict(sorted(values.items()))
