"""The observations as one table: the columns of the CSV and of the first sheet of the XLSX."""

from __future__ import annotations

import csv
import io
from datetime import datetime

from app.reports.report import Entry, Report, Written

COLUMNS = (
    "report_id", "asset_id", "seq", "distance_m", "distance_u95_m", "distance_source",
    "distance_raw_m", "calibration_id", "distance_to_go_m", "joint_no", "at_joint", "code", "char1",
    "char2", "label", "quant1", "unit1", "quant2", "unit2", "clock_from", "clock_to", "cont_id",
    "cont_role", "cont_length_m", "severity", "code_pack", "video_file", "video_time_s", "frame",
    "photo_file", "photo_sha256", "x_m", "y_m", "z_m", "lon", "lat", "remark", "tagged_by",
    "tagged_at", "edited_at",
)  # fmt: skip
"""One row an observation, in this order."""


Cell = str | int | float | None

_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")


def write(report: Report) -> Written:
    """UTF-8 with BOM, CRLF, comma, decimal point; text that a spreadsheet would run is quoted."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for row in rows(report):
        writer.writerow([_csv_cell(name, row[name]) for name in COLUMNS])
    return Written(out.getvalue().encode("utf-8-sig"))


def rows(report: Report) -> list[dict[str, Cell]]:
    """One mapping of COLUMNS an entry; None where nothing is known."""
    return [_row(report, entry) for entry in report.entries]


def iso(instant: datetime | None) -> str | None:
    """To the second, with its zone."""
    return None if instant is None else instant.isoformat(timespec="seconds")


def plain(text: str) -> str:
    """Text that no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith(_FORMULA_STARTS) else text


def _row(report: Report, entry: Entry) -> dict[str, Cell]:
    photo = entry.photo
    return {
        "report_id": report.id,
        "asset_id": report.header.get("asset_id"),
        "seq": entry.seq,
        "distance_m": entry.distance_m,
        "distance_u95_m": entry.u95_m,
        "distance_source": entry.source,
        "distance_raw_m": entry.raw_m,
        "calibration_id": report.header.get("calibration_id"),
        "distance_to_go_m": entry.to_go_m,
        "joint_no": entry.joint_no,
        "at_joint": int(entry.at_joint),
        "code": entry.code,
        "char1": entry.char1,
        "char2": entry.char2,
        "label": entry.label("en"),
        "quant1": entry.quant1,
        "unit1": entry.unit1,
        "quant2": entry.quant2,
        "unit2": entry.unit2,
        "clock_from": entry.clock_from,
        "clock_to": entry.clock_to,
        "cont_id": entry.cont_id,
        "cont_role": entry.cont_role,
        "cont_length_m": entry.cont_length_m,
        "severity": entry.severity,
        "code_pack": report.pack,
        "video_file": report.source.filename,
        "video_time_s": entry.time_s,
        "frame": entry.frame,
        "photo_file": photo.name if photo else None,
        "photo_sha256": photo.sha256 if photo else None,
        "x_m": entry.x_m,
        "y_m": entry.y_m,
        "z_m": entry.z_m,
        "lon": entry.lon,
        "lat": entry.lat,
        "remark": entry.remark,
        "tagged_by": entry.tagged_by,
        "tagged_at": iso(entry.tagged_at),
        "edited_at": iso(entry.edited_at),
    }


def _csv_cell(name: str, value: Cell) -> Cell:
    if isinstance(value, str):
        return plain(value)
    if isinstance(value, float) and name.endswith(("_m", "_s")):
        return f"{value:.3f}"
    return value
