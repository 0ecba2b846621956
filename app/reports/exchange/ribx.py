"""RIBX 1.5.1, the Dutch variant of the EN 13508-2 XML: the pipe is a `ZB_A`, an entry a `ZC`."""

from __future__ import annotations

import re
from pathlib import PurePath
from xml.etree.ElementTree import Element

from app.reports.content.ascii import one_line
from app.reports.exchange import lists
from app.reports.exchange.coordinates import NAMES, ends_of, rd_m
from app.reports.exchange.en13508 import MADE_OF, columns, explanations, header_fields
from app.reports.exchange.en13508_xml import DECLARATION
from app.reports.exchange.fields import Fields, field_name
from app.reports.exchange.losses import NO_GEOMETRY, left_out
from app.reports.exchange.survey import (
    CODES,
    FileNames,
    Names,
    Row,
    film_in_ascii,
    names_of,
    renamed,
    rows_of,
)
from app.reports.exchange.survey_file import of_one
from app.reports.exchange.tree import child, children, to_bytes
from app.reports.report import Loss, Phrase, Report, Written

_FORMAT = "RIBX"
_STANDARD = "EN 13508-2+A1:2011"
"""One of the two names that ABA allows; the other includes the Dutch additions."""
_CODES = re.compile(rf"{CODES.pattern}|BX[A-Z]")
"""The Dutch additions measure, such as BXA the slope."""
_GML = "http://www.opengis.net/gml"
_NEEDED = {
    "AAM": field_name("client"), "ABF": field_name("date"), "ABH": field_name("operator"),
    "ABI": field_name("job_ref"), "ABJ": field_name("client_job_ref"), "ABS": Phrase("part.film"),
    "ACA": field_name("shape"), "ACB": field_name("height_mm"), "ACD": field_name("material"),
    "ACM": field_name("cleaned"),
}  # fmt: skip
"""Fields that a delivery must contain, by what they are made of."""


def write(report: Report) -> Written:
    """Write one inspection."""
    return of_one(RibxFile(), report)


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
        fields = Fields(report.header)
        rows, losses = rows_of(report, _CODES)
        names, lost = names_of(report, fields, one_line, self._names)
        losses += lost
        pipe = Element("ZB_A")
        losses += _header(pipe, report, fields, names, rows)
        name = film_in_ascii(report)
        for row in rows:
            children(child(pipe, "ZC"), _row(row, names, name))
        losses += [
            *renamed(report, name),
            left_out(report),
            *fields.losses(_FORMAT),
        ]
        self._root.append(pipe)
        return tuple(losses)

    def content(self) -> bytes:
        """Return the document."""
        return to_bytes(self._root, DECLARATION, "ascii")


def _header(
    pipe: Element, report: Report, fields: Fields, names: Names, rows: list[Row]
) -> list[Loss]:
    stated, losses = header_fields(report, fields, names, rows)
    clock = fields.time()
    values = dict(stated) | {"ABA": _STANDARD, "ABG": ":".join(clock) if clock else ""}
    explained = _explained(values, report)
    if name := film_in_ascii(report):
        media = {"ABK": lists.OTHER, "ABL": lists.OTHER, "ABR": lists.OTHER, "ABO": "VIDEO-01"}
        values = media | values
        codec = str(report.source.video.get("codec") or "")
        kind = one_line(f"{PurePath(name).suffix[1:].upper()} {codec}")
        media = {"ABK": "file on disk", "ABL": "JPEG", "ABR": kind}
        explained |= {code: words for code, words in media.items() if values[code] == lists.OTHER}
    explained |= explanations(fields, values)
    points, lost = _points(report, fields, names)
    for code in sorted({*values, *points}):
        if code in points:
            _point(child(pipe, code), points[code])
        elif values.get(code) and code not in ("AAC", "AAE", "AAG", "AAU"):
            attributes = {"ADE": explained[code]} if code in explained else {}
            child(pipe, code, values[code], **attributes)
    missing = tuple(
        Phrase("part.code_of", code=code, field=what)
        for code, what in _NEEDED.items()
        if not values.get(code)
    )
    if missing:
        losses.append(Loss("ribx_requires", missing=missing))
    return [*losses, *lost]


def _explained(values: dict[str, str], report: Report) -> dict[str, str]:
    """Return what the letter Z stands for, as an attribute."""
    return {
        code: one_line(str(report.header.get(name) or ""))
        for code, name in MADE_OF.items()
        if values.get(code) == lists.OTHER
    }


def _points(
    report: Report, fields: Fields, names: Names
) -> tuple[dict[str, tuple[float, float]], list[Loss]]:
    """Return AAE and AAG, of the nodes of AAD and AAF, if they are in the Netherlands."""
    ends = ends_of(fields)
    found = rd_m(ends) if ends else None
    if found is None:
        if ends is None:
            return {}, [NO_GEOMETRY]
        return {}, [Loss("dutch_grid", fields=tuple(map(field_name, NAMES)))]
    first, second = found if names.upstream == names.start else found[::-1]
    return {"AAE": first, "AAG": second}, []


def _point(parent: Element, point: tuple[float, float]) -> None:
    place = child(parent, "gml:Point", srsName="Netherlands-RD", srsDimension="2")
    child(place, "gml:pos", f"{point[0]:.3f} {point[1]:.3f}")


def _row(row: Row, names: Names, film_name: str) -> dict[str, str]:
    values = columns(row, names)
    for clock in ("G", "H"):
        if clock in values:
            values[clock] = values[clock].zfill(2)
    if "N" in values:
        values["N"] = f"{film_name}|{values['N']}" if film_name else values["N"]
    return dict(sorted(values.items()))
