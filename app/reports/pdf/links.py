"""Links between a defect, its row and its photo."""

from __future__ import annotations

from app.reports.content.translator import Translator
from app.reports.pdf.grid import Cell, Linked
from app.reports.report import Entry, Report


def number_of(report: Report, entry: Entry, t: Translator) -> Cell:
    """Return the number of an entry, which links to its photo, else to nothing."""
    place = photo_of(report, entry)
    if place is None:
        return str(entry.number)
    return Linked(str(entry.number), place, t("alt.to_photo", seq=entry.number))


def row_of(entry: Entry) -> str:
    """Return the name of an entry's row in the table of observations."""
    return f"row-{entry.number}"


def photo_of(report: Report, entry: Entry) -> str | None:
    """Return the name of the place of an entry's first photo; None if none is shown."""
    is_shown = "photos" in report.template.sections
    has_photo = any(photo.jpeg is not None for photo in entry.photos)
    return place_of_photo(entry) if is_shown and has_photo else None


def place_of_photo(entry: Entry) -> str:
    """Return the name of the place of an entry's first photo."""
    return f"photo-{entry.number}"
