"""The report as an XLSX workbook: two sheets for people, then the data for programs.

The data are in the sheets observations, header, joints, corrections and dictionary, where no cells
are merged and the row with the names of the columns stays in view. No cell is a formula.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import xlsxwriter
from pydantic import ValidationError
from xlsxwriter.worksheet import Worksheet

from app.reports.content.translator import Translator
from app.reports.report import Loss, Report, Written
from app.reports.tables import report_sheet, statistics_sheet, table
from app.reports.tables.cells import LONGEST_TEXT, Cells, cell_text, fit_on_page
from app.reports.tables.table import DICTIONARY, Cell, Column
from app.reports.text.legible import iso, legible
from app.survey.distances.interval import half_width_m
from app.survey.distances.stated import Joints, Stated
from app.survey.fields.header import FIELDS
from app.survey.observations.records import RESCALED, RIG_CHANGED, SMOOTHED
from app.survey.rounding import decimals, metres, rounded

_NARROWEST = 8
"""Least width of a column, in characters."""
_WIDEST = 60
"""Largest width of a column, in characters."""

_SHEETS: Mapping[str, Sequence[Column]] = {
    "observations": DICTIONARY,
    "header": (
        Column("field", "Name of a fact about the report or of a field of the header"),
        Column("value", "Its value"),
        Column("unit", "Unit of the value"),
    ),
    "joints": (
        Column("joint_no", "Number of the joint from the zero point; the first after it is 1"),
        Column("distance_m", "Where it was seen, corrected", "m"),
        Column("distance_u95_m", "Half-width of the 95 % interval of the distance", "m"),
        Column("residual_mm", "Known less measured distance when the track is only scaled", "mm"),
        Column("frame", "Number of the frame that showed it best"),
        Column("is_marked", "1 if a person clicked on it, 0 if it was found by the program"),
    ),
    "corrections": (
        Column("at", "When, ISO 8601"),
        Column("who", "Who did it"),
        Column("what", "corrected: of the whole run; moved: an observation to another frame or "
               "pixel"),
        Column("seq", "Number of the observation that was moved"),
        Column("before", "What was stated before"),
        Column("after", "What has been stated since"),
        Column("why", "In the words of the person who did it"),
    ),
    "dictionary": (
        Column("sheet", "Name of the sheet"),
        Column("column", "Name of the column"),
        Column("meaning", "What it says"),
        Column("unit", "Unit of its numbers"),
    ),
}  # fmt: skip
"""The sheets for programs with their columns."""

Row = Sequence[Cell]

_JSON_ONLY = Loss("rig_in_json")


def write(report: Report) -> Written:
    """Write numbers as numbers, instants as ISO 8601, true and false as 1 and 0."""
    content: Mapping[str, Sequence[Row]] = {
        "observations": [tuple(row.values()) for row in table.rows(report)],
        "header": [*_header(report)],
        "joints": [*_joints(report)],
        "corrections": [*_corrections(report)],
        "dictionary": [
            (name, column.name, column.meaning, column.unit)
            for name, columns in _SHEETS.items()
            for column in columns
        ],
    }
    out = io.BytesIO()
    book = _Book(out)
    book.book.set_properties({"title": legible(report.name)[:255], "created": report.made_at})
    t = Translator.of(report)
    report_sheet.add(book.book, book.cells, report, t)
    statistics_sheet.add(book.book, book.cells, report, t)
    for name, rows in content.items():
        book.add_sheet(name, _SHEETS[name], rows)
    book.book.close()
    cells = [value for rows in content.values() for row in rows for value in row]
    texts = [value for value in cells if isinstance(value, str)]
    losses = [_JSON_ONLY, *table.illegible(texts)]
    if any("\r" in text for text in texts):
        losses.append(Loss("line_ends"))
    return Written(out.getvalue(), (*losses, *book.losses))


class _Book:
    """A workbook to which sheets are added."""

    def __init__(self, out: io.BytesIO) -> None:
        self.book = xlsxwriter.Workbook(out, {"in_memory": True})
        self.cells = Cells(self.book)
        self.losses: list[Loss] = []

    def add_sheet(self, name: str, columns: Sequence[Column], rows: Iterable[Row]) -> None:
        """Add a sheet whose first row, with the names of the columns, is frozen."""
        sheet = self.book.add_worksheet(name)
        sheet.freeze_panes(1, 0)
        widths = [len(column.name) for column in columns]
        for number, column in enumerate(columns):
            self.cells.text(sheet, 0, number, column.name, bold=True, bottom=1)
        count = 0
        for count, row in enumerate(rows, 1):
            for number, (column, value) in enumerate(zip(columns, row, strict=True)):
                shown = self._write(sheet, count, number, column, value)
                widths[number] = max(widths[number], shown)
        for number, width in enumerate(widths):
            sheet.set_column(number, number, min(max(width + 2, _NARROWEST), _WIDEST))
        sheet.autofilter(0, 0, count, len(columns) - 1)
        fit_on_page(sheet)

    def _write(self, sheet: Worksheet, row: int, number: int, column: Column, value: Cell) -> int:
        """Fill a cell; return its width in characters."""
        if value is None:
            return 0
        if isinstance(value, str):
            text = cell_text(value)
            self._note_cut(text, sheet, column)
            self.cells.text(sheet, row, number, text, text_wrap=True)
            return max(map(len, text.splitlines()), default=0)
        if not math.isfinite(value):
            return 0
        is_metres = column.unit in ("m", "s") and isinstance(value, float)
        look = self.cells.look(num_format="0.000") if is_metres else self.cells.look()
        sheet.write_number(row, number, value, look)
        return len(decimals(value, 3) if is_metres else str(value))

    def _note_cut(self, text: str, sheet: Worksheet, column: Column) -> None:
        if len(text) > LONGEST_TEXT:
            self.losses.append(
                Loss(
                    "cell_cut",
                    length=len(text),
                    column=column.name,
                    sheet=sheet.name,
                    most=LONGEST_TEXT,
                )
            )


def _header(report: Report) -> Iterable[Row]:
    source = report.source
    facts: Sequence[tuple[str, Any, str | None]] = (
        ("report_id", report.id, None),
        ("name", report.name, None),
        ("status", report.status, None),
        ("revision", report.revision, None),
        ("made_at", iso(report.made_at), None),
        ("inspected_at", iso(report.created_at), None),
        ("distance_m", report.distance_m, "m"),
        ("distance_u95_m", report.u95_m, "m"),
        ("distance_raw_m", report.raw_distance_m, "m"),
        ("code_pack_name", report.pack, None),
        *(
            (f"proposals_{name}", sum(getattr(each, name) for each in report.proposals), None)
            for name in ("total", "accepted", "rejected")
            if report.proposals
        ),
        ("proposals_by", ", ".join(each.detector for each in report.proposals) or None, None),
        ("video_file", source.filename, None),
        ("video_size", source.size, "bytes"),
        ("video_sha256", source.sha256, None),
    )
    units = {field.name: field.unit for field in FIELDS}
    known = [field.name for field in FIELDS if field.name in report.header]
    others = [name for name in report.header if name not in units]
    fields = ((name, report.header[name], units.get(name)) for name in (*known, *others))
    for name, value, unit in (*facts, *fields):
        if value is not None:
            yield name, _cell(value), unit


def _cell(value: Any) -> Cell:
    """Convert a header value, which may come from another program."""
    if isinstance(value, bool):
        return int(value)
    return value if isinstance(value, str | int | float) else str(value)


def _joints(report: Report) -> Iterable[Row]:
    for joint in report.joint_evidence:
        yield (
            joint.number,
            metres(joint.distance_mm),
            half_width_m(joint.sigma_mm),
            None if joint.residual_mm is None else rounded(joint.residual_mm, 1),
            joint.frame,
            int(joint.is_marked),
        )


def _corrections(report: Report) -> Iterable[Row]:
    """Yield everything that changed a published distance."""
    described: Mapping[str, tuple[str, Callable[[Mapping[str, Any]], str]]] = {
        "corrected": ("corrected", _stated),
        RESCALED: ("rescaled", _scale),
        RIG_CHANGED: ("rig changed", _values),
        SMOOTHED: ("smoothed", _values),
    }
    numbers = {entry.id: entry.seq for entry in report.entries}
    for event in report.events:
        at, before, after = iso(event.at), event.before or {}, event.after or {}
        if event.action in described:
            what, words = described[event.action]
            yield at, event.who, what, None, words(before), words(after), event.remark
        elif event.observation_id and before and after and _anchor(before) != _anchor(after):
            seq = numbers.get(event.observation_id)
            yield at, event.who, "moved", seq, _anchored(before), _anchored(after), event.remark


def _values(fields: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in fields.items())


def _scale(fields: Mapping[str, Any]) -> str:
    scale, carried = fields.get("scale"), fields.get("counter_percent")
    parts = [
        scale and f"scale {scale} by the joints",
        carried and f"{carried} % of the frames by the counter",
    ]
    return "; ".join(part for part in parts if part) or "nothing"


def _stated(fields: Mapping[str, Any]) -> str:
    try:
        stated = Stated.from_json(fields)
    except ValidationError:  # written by another version
        return json.dumps(fields)
    zero, joints, sigma = stated.zero, stated.joints, stated.rig_sigma
    parts = [
        zero and f"zero: frame {zero.frame} at {decimals(zero.offset_m, 3)} m",
        *(
            f"{one.kind} length: frames {one.first_frame} to {one.last_frame} are "
            f"{decimals(one.length_m, 3)} m apart, +/- {one.sigma_mm:g} mm"
            for one in stated.lengths
        ),
        "joints: not used" if joints.use is False
        else joints != Joints()
        and f"joints: {len(joints.marked)} marked, {len(joints.left_out)} left out",
        *(
            f"typed: frame {one.frame} at {decimals(one.distance_m, 3)} m" for one in stated.typed
        ),
        sigma and f"rig: height +/- {sigma.height_mm:g} mm, "
        f"focal length +/- {sigma.focal_px:g} px",
        stated.forced and f"forced: {stated.forced}",
    ]  # fmt: skip
    return "; ".join(part for part in parts if part) or "nothing"


def _anchor(fields: Mapping[str, Any]) -> tuple[Any, Any]:
    return fields.get("frame"), fields.get("pixel")


def _anchored(fields: Mapping[str, Any]) -> str:
    pixel = fields.get("pixel")
    at = f", pixel {pixel[0]:g} {pixel[1]:g}" if pixel else ""
    return f"frame {fields.get('frame')}{at}"
