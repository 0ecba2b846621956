"""The tables of the export of everything: their columns, and their rows some at a time.

Names and kinds of columns are a contract with whoever analyses them: a change that a reader notices
takes another `SCHEMA`. docs/archive_export.md lists the columns.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from app.errors import DamagedTrack, InspectionNotFound
from app.inspections.corrections import Corrections
from app.storage.index.defect_index import DefectIndex, FoundDefect
from app.storage.index.queries import FoundInspection
from app.survey.distances.film_quality import problems_of
from app.survey.folding import storable
from app.survey.observations.tag import MEANINGS
from app.tracking.tracks import Tracks
from vo_core.track import COLUMNS

logger = logging.getLogger(__name__)

SCHEMA = "chainage-archive/1"
_FRAMES_AT_ONCE = 10_000

Kind = Literal["text", "integer", "number", "boolean", "day", "time"]
Columns = Mapping[str, Sequence[Any]]
"""Values by the name of the column, all of the same length; None is unknown."""


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str
    kind: Kind
    meaning: str
    unit: str | None = None


@dataclass(frozen=True)
class Table:
    """One table: its name, what a row is, and its columns."""

    name: str
    row: str
    columns: tuple[Column, ...]


INSPECTIONS = Table(
    "inspections",
    "One inspection",
    (
        Column("inspection_id", "text", "Id of the inspection"),
        Column("revision", "integer", "Rises when published distances change"),
        Column("name", "text", "Its name"),
        Column("project", "text", "Header field project, else job_ref, else client_job_ref"),
        Column("asset", "text", "Header field asset_id"),
        Column("surveyed_on", "day", "Header field date, else the day when it was created"),
        Column("status", "text", "queued, running, done, failed or cancelled"),
        Column("error_code", "text", "Why it failed"),
        Column("source_kind", "text", "Origin of the film: upload, live or import"),
        Column("source_filename", "text", "Name of the film's file, as it was given"),
        Column("source_sha256", "text", "SHA-256 of that file, hexadecimal"),
        Column("distance_m", "number", "Corrected distance of the last frame", "m"),
        Column("distance_u95_m", "number", "Half-width of its 95 % interval", "m"),
        Column(
            "defects",
            "integer",
            "Number of its defects; a stretch is one, start and end are none",
        ),
        Column("worst_severity", "integer", "Largest severity of them"),
        Column("created_at", "time", "When it was created"),
        Column("finished_at", "time", "When its tracking ended"),
    ),
)


def _stated(name: str, kind: Kind, unit: str | None = None) -> Column:
    """Return the column of a field that a person states."""
    return Column(name, kind, MEANINGS[name], unit)


DEFECTS = Table(
    "defects",
    "One observation",
    (
        Column("inspection_id", "text", "Id of the inspection"),
        Column("observation_id", "text", "Id of the observation"),
        Column("revision", "integer", "Revision of the inspection that the distance is of"),
        Column("inspection", "text", "Name of the inspection"),
        Column("project", "text", "As in the table of the inspections"),
        Column("asset", "text", "As in the table of the inspections"),
        Column("surveyed_on", "day", "As in the table of the inspections"),
        Column("seq", "integer", "Number within the inspection; never used twice"),
        _stated("frame", "integer"),
        _stated("code", "text"),
        _stated("char1", "text"),
        _stated("char2", "text"),
        Column("label", "text", "The code in English words, of its code pack"),
        Column("label_ms", "text", "The code in Malay words"),
        _stated("quant1", "number", "unit1"),
        Column("unit1", "text", "Unit of quant1: mm, %, deg, ppm or count"),
        _stated("quant2", "number", "unit2"),
        Column("unit2", "text", "Unit of quant2"),
        _stated("severity", "integer"),
        _stated("continuous", "text"),
        Column(
            "distance_m", "number", "Corrected distance; unknown until the frame is tracked", "m"
        ),
        Column("distance_u95_m", "number", "Half-width of its 95 % interval", "m"),
        Column("clock", "integer", MEANINGS["clock_from"], "h"),
        _stated("clock_to", "integer", "h"),
        _stated("remark", "text"),
        Column("photo", "boolean", "Whether its server has a photo"),
        Column("created_at", "time", "When it was tagged"),
    ),
)
QUALITY = Table(
    "quality",
    "One film that was measured",
    (
        Column("inspection_id", "text", "Id of the inspection"),
        Column("frames", "integer", "Number of tracked frames"),
        Column("weak_share", "number", "Share measured with low confidence", "1"),
        Column("lost_share", "number", "Share without a lock", "1"),
        Column(
            "too_fast_share",
            "number",
            "Share with too little wall in common with the frame before",
            "1",
        ),
        Column("dark_share", "number", "Share that is too dark", "1"),
        Column("overexposed_share", "number", "Share in which too much of the wall is white", "1"),
        Column("blurred_share", "number", "Share that is blurred", "1"),
        Column(
            "dirty_lens_share", "number", "Share in which dirt or text on the picture is seen", "1"
        ),
        Column(
            "problems",
            "text",
            "Of lost, too_fast, too_dark, overexposed, blurred, lens_dirty, with spaces",
        ),
    ),
)
TRACKS = Table(
    "tracks",
    "One frame of a film",
    (
        Column("inspection_id", "text", "Id of the inspection"),
        Column("frame", "integer", "Number of the frame; the first one is 0"),
        Column("time_s", "number", "Presentation time", "s"),
        Column("x_mm", "number", "Along the pipe from the zero point", "mm"),
        Column("y_mm", "number", "To the right of the first frame's position", "mm"),
        Column("yaw_deg", "number", "Clockwise seen from above", "deg"),
        Column("distance_mm", "number", "Corrected distance of the camera", "mm"),
        Column("sigma_distance_mm", "number", "Its standard uncertainty", "mm"),
        Column("quality", "number", "0 nothing recognised, 1 certain", "1"),
        Column("status", "text", "ok, weak or lost"),
        Column(
            "sigma_registration_mm", "number", "Part of it without the tolerances of the rig", "mm"
        ),
        Column("z_mm", "number", "Below the first frame's height", "mm"),
        Column("pitch_deg", "number", "Nose up, against the first frame", "deg"),
        Column("roll_deg", "number", "Right side down, against the first frame", "deg"),
        Column(
            "looking_around",
            "number",
            "1 while the robot stands and its camera looks around, else 0",
            "1",
        ),
        Column("distance_raw_mm", "number", "The distance as it was measured, uncorrected", "mm"),
    ),
)
TABLES = (INSPECTIONS, DEFECTS, QUALITY, TRACKS)


class Rows:
    """Reads the rows of each table, some at a time, so that memory stays bounded."""

    def __init__(self, index: DefectIndex, corrections: Corrections, tracks: Tracks) -> None:
        self._index = index
        self._corrections = corrections
        self._tracks = tracks
        self._of: Mapping[str, Callable[[], Iterator[Columns]]] = {
            INSPECTIONS.name: self._inspections,
            DEFECTS.name: self._defects,
            QUALITY.name: self._quality,
            TRACKS.name: self._frames,
        }

    def of(self, table: Table) -> Iterator[Columns]:
        """Yield the rows of a table, by inspection."""
        return self._of[table.name]()

    def _inspections(self) -> Iterator[Columns]:
        for found in self._index.every_inspection():
            yield _columns(INSPECTIONS, [_inspection(one) for one in found])

    def _defects(self) -> Iterator[Columns]:
        for found in self._index.every_defect():
            yield _columns(DEFECTS, [_defect(one) for one in found])

    def _quality(self) -> Iterator[Columns]:
        for found in self._index.every_inspection():
            films = [_film(one) for one in found if one.row.frames is not None]
            if films:
                yield _columns(QUALITY, films)

    def _frames(self) -> Iterator[Columns]:
        for found in self._index.every_inspection():
            for one in found:
                if one.row.frames is not None:
                    try:
                        yield from self._track(one.row.inspection_id)
                    except InspectionNotFound:  # deleted meanwhile
                        continue
                    except DamagedTrack as damage:  # it costs no other inspection
                        logger.warning("Rows of %s are missing: %s", one.row.name, damage)

    def _track(self, inspection_id: str) -> Iterator[Columns]:
        track = self._corrections.track(inspection_id)
        raw_mm = self._tracks.get(inspection_id).distance_mm
        for first in range(0, len(track), _FRAMES_AT_ONCE):
            part = slice(first, min(first + _FRAMES_AT_ONCE, len(track)))
            values = {name: getattr(track, name)[part].tolist() for name in COLUMNS}
            yield {
                "inspection_id": [inspection_id] * len(values["frame"]),
                **values,
                "distance_raw_mm": raw_mm[part].tolist(),
            }


def _columns(table: Table, rows: Sequence[Mapping[str, Any]]) -> Columns:
    return {column.name: [row[column.name] for row in rows] for column in table.columns}


def _inspection(found: FoundInspection) -> dict[str, Any]:
    indexed = ("name", "project", "asset", "surveyed_on", "distance_m", "distance_u95_m", "defects",
               "worst_severity", "inspection_id", "revision")  # fmt: skip
    present = ("status", "error_code", "source_kind", "source_sha256", "created_at", "finished_at")
    return {
        **{name: getattr(found.row, name) for name in indexed},
        **{name: getattr(found.inspection, name) for name in present},
        "source_filename": storable(found.inspection.source_filename),
    }


def _defect(found: FoundDefect) -> dict[str, Any]:
    names = (column.name for column in DEFECTS.columns if column.name != "photo")
    return {name: getattr(found.row, name) for name in names} | {"photo": found.has_photo}


def _film(found: FoundInspection) -> dict[str, Any]:
    names = (column.name for column in QUALITY.columns if column.name != "problems")
    values = {name: getattr(found.row, name) for name in names}
    return values | {"problems": " ".join(problems_of(values))}
