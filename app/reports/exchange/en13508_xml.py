"""EN 13508-2 XML: a `ZB` with the codes of the header, and a `ZC` with the letters of each row.

One strict reader refuses anything but A2 and A6 in `ZA`; another finds surveys by `ZB`.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

from app.reports.exchange.en13508 import columns, order_codes, survey_of
from app.reports.exchange.names import FileNames
from app.reports.exchange.tree import child, children, to_bytes
from app.reports.report import Loss, Report

DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>'
_EDITION = "2010"


class XmlFile:
    """UTF-8 whose letters beyond ASCII are character references, with the codes of the text."""

    def __init__(self) -> None:
        self._names = FileNames()
        self._root = Element("DATA")
        children(child(self._root, "ZA"), {"A2": "en", "A6": _EDITION})

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        survey = survey_of(report, self._names)
        pipe = child(self._root, "ZB")
        for code, behind in order_codes(survey.header, survey.explained):
            if value := survey.value(code, behind):
                child(pipe, code, value)
        for row in survey.rows:
            children(child(pipe, "ZC"), dict(sorted(columns(row, survey.names).items())))
        return survey.losses

    def content(self) -> bytes:
        """Return the document."""
        return to_bytes(self._root, DECLARATION, "ascii")
