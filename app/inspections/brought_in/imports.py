"""Imports surveys of other programs, and exported inspections, as inspections of this server.

There is no film, so an imported survey is `done` at once. The track of a survey that another
program measured has one row for each observation, so that a tag stays anchored to a frame and its
distance is derived as usual. Such a track has neither sigma nor quality, as both are unknown
(`app.survey.distances.track_rows.is_unmeasured`).
"""

from __future__ import annotations

import hashlib
import threading
import uuid
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from app.access.access import Principal
from app.imports.moved.whole_inspection import WholeInspection
from app.imports.surveys.cells import clean
from app.imports.surveys.survey import ImportedObservation, ImportedSurvey
from app.inspections.brought_in.file_reader import FileReader
from app.inspections.brought_in.keeping import Imported, Keeper, Run
from app.inspections.brought_in.moved import MovedInspections
from app.inspections.films.uploads import Uploads
from app.storage.database.tables import IMPORTED, Inspection
from app.storage.records.imports import Rows
from app.survey.observations.records import Event, Observation
from app.survey.observations.tag import StatedTag
from app.survey.places.spans import is_same
from app.tracking.pictures.videos import NO_FILM, unfilmed_columns
from vo_core import Rig, Track
from vo_core.track import Estimate

_LONGEST_NAME, _LONGEST_FILENAME = 200, 255
_PICTURE_WH = (1280, 720)
_LEAST_DIAMETER_MM, _MOST_DIAMETER_MM, _ANY_DIAMETER_MM = 100.0, 5000.0, 900.0
_LEAST_UNIT_MM, _MOST_UNIT_MM = 100.0, 20_000.0
_BETWEEN_ROWS_S = 1.0
"""Time between rows of a survey without video times; of others, between rows at equal times."""
_TICK_S = 0.001


class Imports:
    """Reads files and stores their inspections."""

    def __init__(
        self,
        reader: FileReader,
        keeper: Keeper,
        moved: MovedInspections,
        uploads: Uploads,
    ) -> None:
        self._reader = reader
        self._keeper = keeper
        self._moved = moved
        self._uploads = uploads
        self._storing = threading.Lock()
        """Held while a file is stored: each of its surveys keeps a mark open until all are."""

    def add(self, content: bytes, filename: str, who: Principal) -> Imported:
        """Make an inspection of every survey in the file, or none if one cannot be stored.

        The content of the file determines its format.

        A report in JSON is restored unchanged, with its id if this server never had it.

        Args:
            content: EN 13508-2 (text or XML), RIBX, ISYBAU, DWA-M 150, a WinCan .db3, or a
                report in JSON of this program.
            filename: Name given by the user.
            who: Who imports it.

        Raises:
            InvalidImport: The file has another format, is damaged, or takes more memory or time
            than a survey; the text says what is wrong where. Busy: Other files are being read.
            DiskFull: There is no room for the inspections.
        """
        name = clean(filename, _LONGEST_FILENAME) or "file"
        found = self._reader.read(content)
        if isinstance(found, WholeInspection):
            return self._moved.add(found, name, who)
        warnings = list(found.warnings)
        with self._storing, ExitStack() as places:
            made = []
            for survey in found.surveys:
                inspection = _inspection(places.enter_context(self._keeper.place()), name, content)
                made.append(_kept(inspection, survey, who.name))
            self._keeper.keep(made)
        for survey in found.surveys:
            name_of = survey.name if len(found.surveys) > 1 else None
            warnings += [replace(caveat, survey=name_of) for caveat in survey.warnings]
        return Imported(tuple(rows.inspection.id for rows, _ in made), tuple(warnings))

    def add_archive(self, upload_id: str, who: Principal) -> Imported:
        """Make an inspection of a complete upload that is an archive file, with its film if it has
        one; if that fails, the upload stays for another try.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InvalidImport: It is no archive file, or damaged; the text says what is wrong where.
            UnreadableVideo: Its film cannot be used.
            Busy: Other archive files are being read.
            DiskFull: There is no room for the inspection.
        """
        with self._uploads.take(upload_id) as (path, info):
            whole = self._reader.read_archive(path)
            name = clean(info.filename, _LONGEST_FILENAME) or "file"
            return self._moved.add(whole, name, who, path)


def _kept(inspection: Inspection, survey: ImportedSurvey, who: str) -> tuple[Rows, Run]:
    """Complete the row of a survey's inspection; return it with its observations and its track."""
    rows = in_order(survey.observations)
    run = Run(_track(rows, survey.surveyed_m))
    has_times = any(row.time_s is not None for row in rows)
    inspection.name, inspection.header = _name(survey.name), dict(survey.header)
    inspection.rig = rig_of(survey.header).model_dump(mode="json")
    inspection.video = unfilmed_columns(
        _PICTURE_WH, float(run.track.time_s[-1]) if has_times else None
    )
    observations = [
        _observation(inspection.id, seq, row.tag(seq - 1), who) for seq, row in enumerate(rows, 1)
    ]
    events = [_created(inspection, who), *(_tagged(it, who) for it in observations)]
    if len(run.track):
        inspection.distance_mm = float(run.track.distance_mm[-1])
    return Rows(inspection, observations, events), run


def in_order(observations: Sequence[ImportedObservation]) -> list[ImportedObservation]:
    """Sort observations by the time in the film if every row has it, else by distance."""
    if all(row.time_s is not None for row in observations):
        return sorted(observations, key=lambda row: (row.time_s or 0.0, row.distance_m))
    return sorted(observations, key=lambda row: row.distance_m)


def rig_of(header: Mapping[str, Any]) -> Rig:
    """Make a rig for an unknown camera, with the pipe of the header where it is stated."""
    width, height = _PICTURE_WH
    diameter_mm = _within(
        header.get("height_mm"), _LEAST_DIAMETER_MM, _MOST_DIAMETER_MM, _ANY_DIAMETER_MM
    )
    pipe: dict[str, Any] = {"shape": "flat"}
    if header.get("shape", "circular") == "circular":
        pipe = {"shape": "circular", "diameter_mm": diameter_mm}
    unit_m = header.get("unit_length_m")
    if isinstance(unit_m, int | float) and _LEAST_UNIT_MM <= 1000 * unit_m <= _MOST_UNIT_MM:
        pipe["segment_length_mm"] = 1000.0 * unit_m
    return Rig.parse(
        {
            "camera": {
                "model": "pinhole", "width": width, "height": height, "fx": 1100.0, "fy": 1100.0,
                "cx": (width - 1) / 2, "cy": (height - 1) / 2,
            },
            "mount": {"view": "down", "height_mm": 0.6 * diameter_mm, "rotation_deg": 0.0},
            "pipe": pipe,
        }
    )  # fmt: skip


def _within(value: object, least: float, most: float, otherwise: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return otherwise
    return float(value) if least <= value <= most else otherwise


def _track(rows: Sequence[ImportedObservation], surveyed_m: float | None) -> Track:
    """Make a track whose row i is the i-th observation; times rise, so that each row is
    distinct.

    Where the survey ends elsewhere than at its last observation, one more row is its end.
    """
    if surveyed_m is not None and not (rows and is_same(rows[-1].distance_m, surveyed_m)):
        rows = [*rows, ImportedObservation(surveyed_m)]
    times_s: list[float] = []
    has_times = any(row.time_s is not None for row in rows)
    for row in rows:
        least_s = times_s[-1] + (_TICK_S if has_times else _BETWEEN_ROWS_S) if times_s else 0.0
        times_s.append(max(least_s, row.time_s or 0.0))
    return Track.from_estimates(
        Estimate(
            frame=frame, time_s=time_s, x_mm=1000 * row.distance_m, y_mm=0.0, yaw_deg=0.0,
            distance_mm=1000 * row.distance_m, sigma_distance_mm=0.0, quality=0.0, status="ok",
            sigma_registration_mm=0.0,
        )
        for frame, (row, time_s) in enumerate(zip(rows, times_s, strict=True))
    )  # fmt: skip


def _inspection(inspection_id: str, filename: str, content: bytes) -> Inspection:
    now = datetime.now(UTC)
    return Inspection(
        id=inspection_id,
        status="done",
        source_kind=IMPORTED,
        source_filename=filename,
        source_size=len(content),
        source_sha256=hashlib.sha256(content).hexdigest(),
        video_file="",
        corrections={},
        revision=0,
        created_at=now,
        queued_at=now,
        finished_at=now,
    )


def _name(text: str) -> str:
    return clean(text, _LONGEST_NAME) or "Imported survey"


def _observation(inspection_id: str, seq: int, tag: StatedTag, who: str) -> Observation:
    return Observation(
        inspection_id=inspection_id,
        id=str(uuid.uuid4()),
        seq=seq,
        tag=tag,
        photo_error=NO_FILM,
        created_at=datetime.now(UTC),
        created_by=who,
    )


def _created(inspection: Inspection, who: str) -> Event:
    return Event(
        inspection_id=inspection.id,
        action="created",
        who=who,
        at=inspection.created_at,
        before=None,
        after={"name": inspection.name, "header": inspection.header},
        remark=f"Imported from {inspection.source_filename}.",
    )


def _tagged(observation: Observation, who: str) -> Event:
    return Event(
        inspection_id=observation.inspection_id,
        observation_id=observation.id,
        action="created",
        who=who,
        at=observation.created_at,
        before=None,
        after=observation.tag.to_json(),
    )
