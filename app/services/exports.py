"""The defect location report as tables: CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from app.catalogue.table import CodeTable
from app.errors import ExportNotAvailable
from app.services.adjustment import U95
from app.services.corrections import Corrected, Corrections, result_of
from app.services.inspections import Inspections, InspectionView
from app.services.observations import Observations, ObservationView, rig_of
from app.services.packs import Packs
from app.storage.tables import Event
from vo_core import Rig

FORMATS = ("csv", "json", "xlsx", "pdf", "en13508", "isybau", "m150", "ribx", "geojson", "zip")
SCHEMA = "chainage-report/1"

COLUMNS = (
    "report_id", "asset_id", "seq", "distance_m", "distance_u95_m", "distance_source",
    "distance_raw_m", "calibration_id", "distance_to_go_m", "joint_no", "at_joint", "code", "char1",
    "char2", "label", "quant1", "unit1", "quant2", "unit2", "clock_from", "clock_to", "cont_id",
    "cont_role", "cont_length_m", "severity", "code_pack", "video_file", "video_time_s", "frame",
    "photo_file", "photo_sha256", "x_m", "y_m", "z_m", "lon", "lat", "remark", "tagged_by",
    "tagged_at", "edited_at",
)  # fmt: skip
"""One row an observation, in this order."""

_ROLES = {"A": "start", "C": "change", "B": "finish"}
_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")

Cell = str | int | float | None


class Exports:
    """Reports of an inspection as it stands."""

    def __init__(
        self,
        inspections: Inspections,
        observations: Observations,
        corrections: Corrections,
        packs: Packs,
    ) -> None:
        self._inspections = inspections
        self._observations = observations
        self._corrections = corrections
        self._packs = packs

    def report(self, inspection_id: str, kind: str) -> tuple[str, str, bytes]:
        """File name, media type and content.

        Raises:
            ExportNotAvailable: A format that is not built yet.
        """
        view = self._inspections.get(inspection_id)
        if kind not in ("csv", "json"):
            raise ExportNotAvailable(
                f"The export as {kind} is not built yet; csv and json are there."
            )
        table = self._packs.table_of(view.row.header)
        rows = report_rows(view, self._observations.all(inspection_id), table)
        name = safe_file_name(f"{view.row.name}-defects.{kind}")
        if kind == "csv":
            return name, "text/csv; charset=utf-8", to_csv(rows)
        events = self._observations.events(inspection_id)
        corrected = self._corrections.get(inspection_id)
        return name, "application/json", to_json(view, corrected, rows, events)


def report_rows(
    inspection: InspectionView, observations: Sequence[ObservationView], table: CodeTable
) -> list[dict[str, Cell]]:
    """One mapping of COLUMNS an observation; None where nothing is known."""
    header = inspection.row.header
    rig = rig_of(inspection.row)
    lengths = _stretch_lengths_m(observations)
    return [
        _anchor_cells(inspection, view, header, rig)
        | _code_cells(view, table)
        | {"cont_length_m": lengths.get(view.row.id)}
        for view in observations
    ]


def to_csv(rows: Sequence[Mapping[str, Cell]]) -> bytes:
    """UTF-8 with BOM, CRLF, comma, decimal point; text that a spreadsheet would run is quoted."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for row in rows:
        writer.writerow([_csv_cell(name, row.get(name)) for name in COLUMNS])
    return out.getvalue().encode("utf-8-sig")


def to_json(
    inspection: InspectionView,
    corrected: Corrected,
    rows: Sequence[Mapping[str, Cell]],
    events: Sequence[Event],
) -> bytes:
    """Everything, with the version of the schema."""
    row = inspection.row
    report = {
        "schema": SCHEMA,
        "exported_at": _iso(datetime.now(UTC)),
        "inspection": {
            "id": row.id,
            "name": row.name,
            "status": row.status,
            "header": row.header,
            "rig": row.rig,
            "source": {
                "kind": row.source_kind,
                "filename": row.source_filename,
                "size": row.source_size,
                "sha256": row.source_sha256,
            },
            "video": row.video,
            "frames": row.frames_done,
            "distance_m": _metres(inspection.distance_mm),
            "distance_u95_m": _metres(_u95(inspection.sigma_distance_mm)),
            "distance_raw_m": _metres(inspection.raw_distance_mm),
            "revision": row.revision,
            "warning": row.warning,
            "error": row.error_detail,
            "created_at": _iso(row.created_at),
            "finished_at": _iso(row.finished_at),
        },
        "corrections": {
            "stated": corrected.stated.to_json(),
            "result": result_of(corrected.adjusted) if corrected.adjusted else None,
            "error": corrected.error,
        },
        "observations": [{name: cells.get(name) for name in COLUMNS} for cells in rows],
        "events": [
            {
                "at": _iso(event.at),
                "who": event.who,
                "action": event.action,
                "observation_id": event.observation_id,
                "before": event.before,
                "after": event.after,
                "remark": event.remark,
            }
            for event in events
        ],
    }
    return json.dumps(report, ensure_ascii=False, allow_nan=False, indent=1).encode()


def safe_file_name(name: str) -> str:
    """Letters, digits, dot, dash and underscore only; never empty, hidden or a path."""
    return re.sub(r"[^\w.-]+", "_", name, flags=re.ASCII).strip("._") or "report"


def _anchor_cells(
    inspection: InspectionView, view: ObservationView, header: Mapping[str, Any], rig: Rig
) -> dict[str, Cell]:
    row, place = view.row, view.place
    has_photo = row.photo_frame == row.frame
    cells: dict[str, Cell] = {
        "report_id": inspection.row.id,
        "asset_id": header.get("asset_id"),
        "seq": row.seq,
        "calibration_id": header.get("calibration_id"),
        "video_file": inspection.row.source_filename,
        "frame": row.frame,
        "photo_file": f"photos/{row.id}-{row.frame}.jpg" if has_photo else None,
        "photo_sha256": row.photo_sha256 if has_photo else None,
        "at_joint": 0,
        "tagged_by": row.created_by,
        "tagged_at": _iso(row.created_at),
        "edited_at": _iso(row.edited_at),
    }
    if place is None:
        return cells
    return (
        cells
        | _wall_position_m(view, rig)
        | {
            "distance_m": _metres(place.distance_mm),
            "distance_u95_m": _metres(place.u95_mm),
            "distance_source": place.source,
            "distance_raw_m": _metres(place.raw_mm),
            "distance_to_go_m": _distance_to_go_m(header, place.distance_mm),
            "joint_no": place.joint_no,
            "at_joint": int(place.joint is not None),
            "video_time_s": round(place.time_s, 3),
        }
    )


def _code_cells(view: ObservationView, table: CodeTable) -> dict[str, Cell]:
    fields = view.row.fields
    code = table.find(fields.get("code"), fields.get("char1"), fields.get("char2"))
    continuous = fields.get("continuous")
    names = ("code", "char1", "char2", "quant1", "quant2", "clock_to", "severity", "remark")
    return {name: fields.get(name) for name in names} | {
        "label": code.label if code else None,
        "code_pack": table.name,
        "unit1": code.unit_q1 if code and "quant1" in fields else None,
        "unit2": code.unit_q2 if code and "quant2" in fields else None,
        "clock_from": view.clock,
        "cont_id": int(continuous[1:]) if continuous else None,
        "cont_role": _ROLES[continuous[0]] if continuous else None,
    }


def _stretch_lengths_m(observations: Sequence[ObservationView]) -> dict[str, float | None]:
    """Length of the stretch that an observation starts, if it is finished and tracked."""
    finishes = {
        view.row.fields["continuous"][1:]: view.place.distance_mm
        for view in observations
        if view.place and str(view.row.fields.get("continuous", "")).startswith("B")
    }
    lengths = {}
    for view in observations:
        continuous = str(view.row.fields.get("continuous", ""))
        finish_mm = finishes.get(continuous[1:])
        if continuous.startswith("A") and view.place and finish_mm is not None:
            lengths[view.row.id] = _metres(finish_mm - view.place.distance_mm)
    return lengths


def _wall_position_m(view: ObservationView, rig: Rig) -> dict[str, Cell]:
    """Of the wall point: X along the axis, Y right, Z down from the axis, or from the floor."""
    wall = view.place.wall if view.place else None
    if wall is None:
        return {}
    z_mm = 0.0
    if wall.clock_h is not None and rig.pipe.diameter_mm is not None:
        z_mm = -rig.pipe.diameter_mm / 2 * math.cos(math.radians(30 * wall.clock_h))
    return {
        "x_m": _metres(wall.distance_mm),
        "y_m": _metres(wall.lateral_mm),
        "z_m": _metres(z_mm),
    }


def _distance_to_go_m(header: Mapping[str, Any], distance_mm: float) -> float | None:
    """To the far end, if its distance was entered as a number."""
    try:
        known_m = float(header["known_length_m"])
    except (KeyError, TypeError, ValueError):
        return None
    return round(known_m - distance_mm / 1000, 3) if math.isfinite(known_m) else None


def _csv_cell(name: str, value: Cell) -> Cell:
    if isinstance(value, str) and value.startswith(_FORMULA_STARTS):
        return f"'{value}"
    if isinstance(value, float) and name.endswith(("_m", "_s")):
        return f"{value:.3f}"
    return value


def _metres(mm: float | None) -> float | None:
    return None if mm is None else round(mm / 1000, 3)


def _u95(sigma_mm: float | None) -> float | None:
    return None if sigma_mm is None else U95 * sigma_mm


def _iso(instant: datetime | None) -> str | None:
    return None if instant is None else instant.isoformat(timespec="seconds")
