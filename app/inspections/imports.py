"""Imports surveys of other programs, and exported inspections, as inspections of this server.

There is no film, so an imported survey is `done` at once. The track of a survey that another
program measured has one row for each observation, so that a tag stays anchored to a frame and its
distance is derived as usual. Such a track has neither sigma nor quality, as both are unknown
(`app.inspections.observations.is_unmeasured`).
"""

from __future__ import annotations

import hashlib
import json
import logging
import secrets
import threading
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from app.errors import PackNotFound, StoreUnavailable
from app.imports.survey import ImportedObservation, ImportedSurvey, clean
from app.imports.whole_inspection import Happening, ImportedTag, WholeInspection
from app.inspections.file_reader import FileReader
from app.inspections.packs import Packs
from app.storage import keys
from app.storage.blobs import Blobs
from app.storage.files import DataFolder
from app.storage.imports import ImportStore
from app.storage.tables import ENDED, IMPORTED, Inspection
from app.survey.records import BROUGHT_IN, Event, Observation
from app.survey.stated import Stated
from app.survey.tag import StatedTag
from app.survey.track_rows import estimate_at, is_unmeasured
from app.tracking.runs import track_metadata
from app.tracking.tracks import Tracks
from app.tracking.videos import NO_FILM, unfilmed_columns
from vo_core import Rig, Track
from vo_core.geometry.stance import AS_STATED, Stance
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.finder import Sighting
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

_LONGEST_NAME, _LONGEST_FILENAME = 200, 255
_BYTES_A_ROW = 200
"""Bytes of a track row on the disk, to check the free space."""
_PICTURE_WH = (1280, 720)
_LEAST_DIAMETER_MM, _MOST_DIAMETER_MM, _ANY_DIAMETER_MM = 100.0, 5000.0, 900.0
_LEAST_UNIT_MM, _MOST_UNIT_MM = 100.0, 20_000.0
_BETWEEN_ROWS_S = 1.0
"""Time between rows of a survey without video times; of others, between rows at equal times."""
_TICK_S = 0.001


@dataclass(frozen=True)
class Imported:
    """The result of an import."""

    inspection_ids: tuple[str, ...]
    """Ids in the order of the file."""
    warnings: tuple[str, ...]
    """Sentences about what is odd or left out."""


class Imports:
    """Reads files and stores their inspections."""

    def __init__(
        self,
        store: ImportStore,
        folder: DataFolder,
        blobs: Blobs,
        tracks: Tracks,
        packs: Packs,
        reader: FileReader,
    ) -> None:
        self._store = store
        self._folder = folder
        self._blobs = blobs
        self._tracks = tracks
        self._packs = packs
        self._reader = reader
        self._taking_over = threading.Lock()
        """Held while an id is taken over, so that concurrent imports of one file do not both keep
        it."""

    def add(self, content: bytes, filename: str, who: str) -> Imported:
        """Make an inspection of every survey in the file; its content determines its format.

        A report in JSON is restored unchanged, with its id if this server never had it.

        Args:
            content: EN 13508-2 text, a WinCan .db3, or a report in JSON of this program.
            filename: Name given by the user.
            who: Name of the token.

        Raises:
            InvalidImport: The file has another format, is damaged, or takes more memory or time
            than a survey; the text says what is wrong where. Busy: Other files are being read.
            DiskFull: There is no room for the inspections.
        """
        name = clean(filename, _LONGEST_FILENAME) or "file"
        found = self._reader.read(content)
        if isinstance(found, WholeInspection):
            with self._taking_over:
                return self._add_whole(found, name, content, who)
        warnings = [str(caveat) for caveat in found.warnings]
        ids = []
        for survey in found.surveys:
            ids.append(self._add_survey(survey, name, content, who))
            several = f"{survey.name}: " if len(found.surveys) > 1 else ""
            warnings += [f"{several}{caveat}" for caveat in survey.warnings]
        return Imported(tuple(ids), tuple(warnings))

    def _add_survey(self, survey: ImportedSurvey, filename: str, content: bytes, who: str) -> str:
        rows = in_order(survey.observations)
        run = Run(_track(rows, survey.surveyed_m))
        has_times = any(row.time_s is not None for row in rows)
        inspection = _inspection(filename, content)
        inspection.name, inspection.header = _name(survey.name), dict(survey.header)
        inspection.rig = rig_of(survey.header).model_dump(mode="json")
        inspection.video = unfilmed_columns(
            _PICTURE_WH, float(run.track.time_s[-1]) if has_times else None
        )
        observations = [
            _observation(inspection.id, seq, row.tag(seq - 1), who)
            for seq, row in enumerate(rows, 1)
        ]
        events = [_created(inspection, filename, who), *(_tagged(it, who) for it in observations)]
        if len(run.track):
            inspection.distance_mm = float(run.track.distance_mm[-1])
        self._keep(inspection, run, observations, events)
        return inspection.id

    def _add_whole(
        self, whole: WholeInspection, filename: str, content: bytes, who: str
    ) -> Imported:
        warnings = [
            "Such a file does not contain the film, the photos or the picture of the wall; "
            "everything stated and measured was imported."
        ]
        header = dict(whole.header)
        try:
            self._packs.require(header)
        except PackNotFound:
            warnings.append(
                f"This server has no code pack {header.pop('code_pack')}; the built-in one is "
                "used. Import the pack, then choose it in the header."
            )
        run = Run(whole.track, whole.health, whole.sightings, whole.tilt, whole.stance)
        inspection = _inspection(filename, content)
        if self._is_free(whole.id):
            inspection.id = whole.id
        inspection.name, inspection.header = whole.name, header
        inspection.rig = whole.rig.model_dump(mode="json")
        inspection.video = dict(whole.video)
        inspection.created_at, inspection.finished_at = whole.created_at, whole.finished_at
        inspection.status = whole.status
        if whole.status not in ENDED:
            inspection.status, inspection.finished_at = "cancelled", inspection.queued_at
            warnings.append("It was exported before its end; here it ends at that point.")
        # The file that the distances are based on, though it is not here.
        inspection.source_kind = whole.source_kind
        inspection.source_filename = whole.source_filename
        inspection.source_size = whole.source_size
        inspection.source_sha256 = whole.source_sha256
        inspection.warning = whole.warning
        inspection.error_code, inspection.error_detail = whole.error_code, whole.error
        inspection.corrections = whole.stated.to_json() if whole.stated != Stated() else {}
        inspection.revision = whole.revision
        if len(run.track):
            inspection.distance_mm = float(run.track.distance_mm[-1])
            sigma_mm = float(run.track.sigma_distance_mm[-1])
            inspection.sigma_distance_mm = None if is_unmeasured(run.track) else sigma_mm
        observations = [_restored(inspection.id, tag) for tag in whole.tags]
        events = [
            *(_happened(inspection.id, it) for it in whole.events),
            _brought_in(inspection, filename, who),
        ]
        self._keep(inspection, run, observations, events, whole.labels)
        return Imported((inspection.id,), tuple(warnings))

    def _is_free(self, inspection_id: str) -> bool:
        """Return whether this server never had an inspection of this id."""
        is_known = self._store.has_known(inspection_id)
        return not is_known and not any(self._blobs.listed(keys.inspection(inspection_id)))

    def _keep(
        self,
        inspection: Inspection,
        run: Run,
        observations: Sequence[Observation],
        events: Sequence[Event],
        labels: Sequence[str] = (),
    ) -> None:
        """Write the files, then commit; remove the files if that fails."""
        rows = len(run.track)
        self._folder.require_room(_BYTES_A_ROW * rows)
        inspection.frames_done = rows
        try:
            rig = json.dumps(inspection.rig, indent=2)
            self._blobs.put(keys.rig(inspection.id), rig.encode())
            self._tracks.begin(inspection.id)
            self._tracks.append(inspection.id, run.estimates())
            self._tracks.note(
                inspection.id, enumerate(run.health), run.sightings, run.tilt, run.stance
            )
            self._tracks.finish(inspection.id, track_metadata(inspection))
            self._store.add(inspection, observations, events, labels)
        except BaseException:
            self._tracks.forget(inspection.id)
            with suppress(OSError, StoreUnavailable):
                self._blobs.delete_all(keys.inspection(inspection.id))
            raise
        logger.info("Inspection %s (%s) imported.", inspection.id, inspection.name)


@dataclass(frozen=True)
class Run:
    """The results of a run, as an import stores them."""

    track: Track
    health: Sequence[Health] = ()
    sightings: Sequence[Sighting] = ()
    tilt: MountTilt | None = None
    stance: Stance = AS_STATED

    def estimates(self) -> Iterator[Estimate]:
        """Yield the estimates row by row."""
        for frame in range(len(self.track)):
            estimate = estimate_at(self.track, frame)
            assert estimate is not None  # noqa: S101  (within its length)
            yield estimate


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
    if surveyed_m is not None and (not rows or rows[-1].distance_m != surveyed_m):
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


def _inspection(filename: str, content: bytes) -> Inspection:
    now = datetime.now(UTC)
    return Inspection(
        id=secrets.token_hex(16),
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


def _restored(inspection_id: str, tag: ImportedTag) -> Observation:
    return Observation(
        inspection_id=inspection_id,
        id=tag.id,
        seq=tag.seq,
        tag=tag.stated,
        photo_frame=tag.stated.frame if tag.photo_sha256 else None,
        photo_sha256=tag.photo_sha256,
        photo_error=NO_FILM,
        created_at=tag.created_at,
        created_by=tag.created_by,
        edited_at=tag.edited_at,
        edited_by=tag.edited_by,
    )


def _created(inspection: Inspection, filename: str, who: str) -> Event:
    return Event(
        inspection_id=inspection.id,
        action="created",
        who=who,
        at=inspection.created_at,
        before=None,
        after={"name": inspection.name, "header": inspection.header},
        remark=f"Imported from {filename}.",
    )


def _brought_in(inspection: Inspection, filename: str, who: str) -> Event:
    return Event(
        inspection_id=inspection.id,
        action=BROUGHT_IN,
        who=who,
        at=inspection.queued_at,
        before=None,
        after=None,
        remark=f"Imported from {filename}.",
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


def _happened(inspection_id: str, event: Happening) -> Event:
    return Event(
        inspection_id=inspection_id,
        observation_id=event.observation_id,
        action=event.action,
        who=event.who,
        at=event.at,
        before=None if event.before is None else dict(event.before),
        after=None if event.after is None else dict(event.after),
        remark=event.remark,
    )
