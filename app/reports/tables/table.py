"""The observations as one table: the columns of the CSV and of the first sheet of the XLSX."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime

from app.reports.content.sizes import figure_text
from app.reports.report import Entry, Loss, Report, Written
from app.reports.text.legible import iso, legible
from app.survey.observations.tag import MEANINGS
from app.survey.rounding import decimals
from vo_core.csv_rows import plain

Cell = str | int | float | None


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str
    meaning: str
    unit: str | None = None
    source: str | Callable[[Report, Entry], object] = ""
    """Attribute of an entry or of its tag, if it has another name than the column; or what returns
    the value."""

    def value(self, report: Report, entry: Entry) -> Cell:
        """Return the value for an entry; None means unknown."""
        if callable(self.source):
            value = self.source(report, entry)
        else:
            name = self.source or self.name
            value = getattr(entry if hasattr(entry, name) else entry.tag, name)
        if isinstance(value, datetime):
            return iso(value)
        return int(value) if isinstance(value, bool) else value  # type: ignore[return-value]


def _measured(_: Report, entry: Entry) -> str | None:
    found = [f"{figure.kind} {figure_text(figure)}" for figure in entry.figures if figure]
    return "; ".join(found) or None


def _stated(name: str, unit: str | None = None) -> Column:
    """Return the column of a field that a person states."""
    return Column(name, MEANINGS[name], unit)


DICTIONARY = (
    Column("report_id", "Of the inspection, and so of its report", source=lambda r, _: r.id),
    Column("asset_id", "Name of the culvert, of the header",
           source=lambda r, _: r.header.get("asset_id")),
    Column("seq", "Number of the observation; never used twice in an inspection"),
    Column("number", "Its number in reports for people: its place along the pipe, from 1"),
    Column("distance_m", "From the zero point along the axis, corrected", "m"),
    Column("distance_u95_m", "Half-width of the 95 % interval of the distance", "m", "u95_m"),
    Column("distance_source", "Basis: odometry, joint, closure, counter, bridged or typed",
           source="source"),
    Column("distance_raw_m", "The same distance as it was measured, before corrections", "m",
           "raw_m"),
    Column("calibration_id", "Calibration of the camera, of the header",
           source=lambda r, _: r.header.get("calibration_id")),
    Column("distance_to_go_m", "From here to the far end, where its distance is known", "m",
           "to_go_m"),
    Column("joint_no", "Number of the joint beside it; the first after the zero point is 1"),
    Column("at_joint", "1 within 200 mm of a joint that was seen, else 0"),
    _stated("code"),
    _stated("char1"),
    _stated("char2"),
    Column("label", "The code in words, of the code pack", source=lambda _, e: e.label("en")),
    _stated("quant1", "unit1"),
    Column("unit1", "Unit of quant1: mm, %, deg, ppm or count"),
    _stated("quant2", "unit2"),
    Column("unit2", "Unit of quant2"),
    _stated("clock_from", "h"),
    _stated("clock_to", "h"),
    Column("cont_id", "Number of the stretch (continuous defect) that it belongs to"),
    Column("cont_role", "Its part in the stretch: start, change or finish"),
    Column("cont_length_m", "Length of the stretch, given at its start", "m"),
    _stated("severity"),
    Column("code_pack", "Name of the table of codes", source=lambda r, _: r.pack),
    Column("video_file", "Name of the video", source=lambda r, _: r.source.filename),
    Column("video_time_s", "Time of the frame in the video", "s", "time_s"),
    _stated("frame"),
    Column("photo_file", "Name of the photo, as in the evidence bundle of its server",
           source=lambda _, e: e.photo and e.photo.name),
    Column("photo_sha256", "SHA-256 of the photo, hexadecimal",
           source=lambda _, e: e.photo and e.photo.sha256),
    Column("x_m", "Wall point along the axis", "m"),
    Column("y_m", "Wall point to the right of the axis", "m"),
    Column("z_m", "Wall point below the axis of a pipe, or below a floor", "m"),
    Column("lon", "Longitude between the ends of the header, WGS 84", "deg"),
    Column("lat", "Latitude between the ends of the header, WGS 84", "deg"),
    _stated("remark"),
    Column("tagged_by", "Who tagged it"),
    Column("tagged_at", "When, ISO 8601"),
    Column("edited_at", "When it was changed last, ISO 8601; empty if never"),
    Column("measured", "Sizes measured on the wall, with the half-widths of their 95 % intervals",
           source=_measured),
    _stated("recommendation"),
    _stated("cost"),
)  # fmt: skip

COLUMNS = tuple(column.name for column in DICTIONARY)
"""Columns of a row, one row for each observation."""


def write(report: Report) -> Written:
    """Write UTF-8 with BOM and CRLF; text like a formula is quoted.

    Cells are separated by commas and numbers have a decimal point; in the German style, which Excel
    opens there without an import, they are separated by semicolons and have a decimal comma.
    """
    is_german = report.extras.csv_style == "german"
    form = _german_cell if is_german else _csv_cell
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n", delimiter=";" if is_german else ",")
    writer.writerow(COLUMNS)
    losses = [Loss("table_only")]
    found = rows(report)
    for row in found:
        writer.writerow([form(name, row[name]) for name in COLUMNS])
    texts = [value for row in found for value in row.values() if isinstance(value, str)]
    if any(plain(text) != text for text in texts):
        losses.append(Loss("apostrophe"))
    return Written(out.getvalue().encode("utf-8-sig"), (*losses, *illegible(texts)))


def illegible(texts: Iterable[str]) -> list[Loss]:
    """Return the loss where marks replace control characters."""
    if all(legible(text) == text for text in texts):
        return []
    return [Loss("illegible")]


def rows(report: Report) -> list[dict[str, Cell]]:
    """Return one mapping of COLUMNS for each entry; None means unknown."""
    return [
        {column.name: column.value(report, entry) for column in DICTIONARY}
        for entry in report.entries
    ]


def _csv_cell(name: str, value: Cell) -> Cell:
    if isinstance(value, str):
        return plain(legible(value))
    if isinstance(value, float) and name.endswith(("_m", "_s")):
        return decimals(value, 3)
    return value


def _german_cell(name: str, value: Cell) -> Cell:
    cell = _csv_cell(name, value)
    is_number = isinstance(value, float)
    return str(cell).replace(".", ",") if is_number else cell
