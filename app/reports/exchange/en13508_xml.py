"""EN 13508-2 XML: a `ZB` with the codes of the header, and a `ZC` with the letters of each row.

One strict reader refuses anything but A2 and A6 in `ZA`; another finds surveys by `ZB`.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

from app.reports.content.ascii import transliterate
from app.reports.exchange.en13508 import (
    columns,
    coordinates,
    header_fields,
    losses_in_ascii,
)
from app.reports.exchange.fields import Fields
from app.reports.exchange.survey import FileNames, names_of, rows_of
from app.reports.exchange.survey_file import of_one
from app.reports.exchange.tree import child, children, to_bytes
from app.reports.report import Loss, Report, Written

DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>'
_FORMAT = "EN 13508-2"
_EDITION = "2010"


def write(report: Report) -> Written:
    """Write one inspection."""
    return of_one(XmlFile(), report)


class XmlFile:
    """UTF-8 that contains only ASCII, as the text of the standard does."""

    def __init__(self) -> None:
        self._names = FileNames()
        self._root = Element("DATA")
        children(child(self._root, "ZA"), {"A2": "en", "A6": _EDITION})

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        fields = Fields(report.header)
        rows, losses = rows_of(report)
        names, lost = names_of(report, fields, transliterate, self._names)
        losses += lost
        header, lost = header_fields(report, fields, names, rows)
        losses += lost
        pipe = Element("ZB")
        children(pipe, dict(sorted((header | coordinates(fields, names)).items())))
        for row in rows:
            children(child(pipe, "ZC"), dict(sorted(columns(row, names).items())))
        losses += [*losses_in_ascii(report), *fields.losses(_FORMAT)]
        self._root.append(pipe)
        return tuple(losses)

    def content(self) -> bytes:
        """Return the document."""
        return to_bytes(self._root, DECLARATION, "ascii")
