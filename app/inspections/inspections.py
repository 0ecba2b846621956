"""Inspections: listed with their measurements, renamed, ended, tracked again, deleted."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.errors import OpenStretches
from app.inspections.corrections import Corrections
from app.inspections.films.making import checked_rig, keep_rig
from app.inspections.purpose import Purpose
from app.jobs.live.messages import CameraStatus
from app.storage.blobs import keys
from app.storage.database.tables import ENDED, Inspection
from app.storage.folder.files import delete_tree
from app.storage.index.inspection_list import Found, InspectionList
from app.storage.records.inspections import InspectionStore, Summary, require_unlocked
from app.storage.records.labels import LabelStore
from app.storage.records.observations import ObservationStore
from app.storage.records.runs import RunStore
from app.storage.storage import Storage
from app.survey.assets.search_terms import InspectionFilter, InspectionSort, Page
from app.survey.distances.interval import half_width_m
from app.survey.distances.track_rows import estimate_at
from app.survey.places.stretches import open_stretches
from app.survey.versions import require_version, version_of
from app.tracking.films.queue import Tracking
from app.tracking.films.runs import Runs
from app.tracking.live import Live, Progress, Update
from app.tracking.tracks import Tracks
from vo_core import Estimate

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class InspectionView:
    """An inspection with its counts and measurements."""

    row: Inspection
    progress: Progress
    distance_mm: float | None
    """Corrected distance of the last frame; its standard deviation follows."""
    sigma_distance_mm: float | None
    raw_distance_mm: float | None
    is_corrected: bool
    is_useful: bool | None
    """Whether the end is known well enough for the intended use; None if it is not known."""
    useful_within_m: float
    """Widest half of a 95 % interval that is of use in it."""
    observations: int
    defects: int
    """Those of its observations that are defects; a stretch is one."""
    worst_severity: int | None
    open_questions: int
    """Questions of reviewers and clients that are not settled."""
    labels: tuple[str, ...]
    camera: CameraStatus | None
    """State of the camera during a recording."""
    warning: str | None
    """A sentence about a fault of the video or the run, or about why its end is delayed."""

    @property
    def version(self) -> str:
        """Version of name and header."""
        return version_of(self.row.editable())


class Inspections:
    """Lists inspections and changes them, except for their films and runs."""

    def __init__(
        self,
        storage: Storage,
        tracks: Tracks,
        corrections: Corrections,
        runs: Runs,
        tracking: Tracking,
        live: Live,
        purpose: Purpose,
    ) -> None:
        self._store = InspectionStore(storage.database)
        self._observations = ObservationStore(storage.database)
        self._run_store = RunStore(storage.database)
        self._list = InspectionList(storage.database)
        self._labels = LabelStore(storage.database)
        self._folder = storage.folder
        self._blobs = storage.blobs
        self._tracks = tracks
        self._corrections = corrections
        self._runs = runs
        self._tracking = tracking
        self._live = live
        self._purpose = purpose

    def all(self) -> list[InspectionView]:
        """Return all inspections, the newest first."""
        return self._views(self._store.summaries())

    def found(
        self, wanted: InspectionFilter, page: Page[InspectionSort]
    ) -> tuple[Found, list[InspectionView]]:
        """Return one page of the inspections that fit."""
        found = self._list.found(wanted, page)
        return found, self._views(found.summaries)

    def ids(self, wanted: InspectionFilter, page: Page[InspectionSort]) -> list[str]:
        """Return the ids of the inspections that fit, as many as the page takes."""
        return self._list.ids(wanted, page)

    def get(self, inspection_id: str) -> InspectionView:
        """Return the inspection with this id.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        (view,) = self._views([self._store.summary(inspection_id)])
        return view

    def label(self, inspection_id: str, labels: Sequence[str], who: str) -> tuple[str, ...]:
        """Replace the labels of an inspection, also of an approved one; return them.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        self._labels.put(inspection_id, labels, who)
        self._live.observations_changed(inspection_id)
        return self._labels.of([inspection_id]).get(inspection_id, ())

    def labels_in_use(self) -> list[tuple[str, int]]:
        """Return all labels with the number of their inspections, the most used first."""
        return self._labels.in_use()

    def row(self, inspection_id: str) -> Inspection:
        """Return the stored row only.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return self._store.get(inspection_id)

    def last_estimate(self, inspection_id: str) -> Estimate | None:
        """Return the corrected estimate of the newest tracked frame."""
        track = self._tracks.get(inspection_id)
        return estimate_at(track, len(track) - 1)

    def change(
        self,
        inspection_id: str,
        who: str,
        name: str | None,
        header: Mapping[str, Any] | None,
        *,
        replaced: str | None = None,
    ) -> InspectionView:
        """Replace the name or the header; None keeps it.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            PackNotFound: The header names a code pack that does not exist.
            ChangedMeanwhile: Their version is no longer `replaced`; nothing was stored.
        """

        def require(stored: Mapping[str, Any]) -> None:
            sent = {"name": name, "header": None if header is None else dict(header)}
            yours = {**stored, **{key: value for key, value in sent.items() if value is not None}}
            require_version(stored, yours, replaced)

        self._store.change(inspection_id, who, name, header, require)
        self._live.observations_changed(inspection_id)
        return self.get(inspection_id)

    def finish(self, inspection_id: str, who: str, stated: Mapping[str, Any]) -> None:
        """State in the header how the run ended.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            OpenStretches: A stretch has no finish; the text names it.
        """
        self.row(inspection_id)  # raises unless it exists
        still_open = open_stretches(self._observations.listed(inspection_id))
        if still_open:
            raise OpenStretches(
                f"Started and not finished: {', '.join(still_open)}. Finish them first."
            )
        self._store.finish(inspection_id, who, stated)
        self._live.observations_changed(inspection_id)

    def track_with(self, inspection_id: str, rig: Mapping[str, Any], who: str) -> None:
        """Track all frames again, with this rig; tags stay.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            StillRunning: It is queued or running.
            NothingRecorded: There is no film.
            InvalidRig: The text names field, value and the allowed values.
            RigVideoMismatch: The rig's camera has another picture size.
        """
        row = self.row(inspection_id)
        checked = checked_rig(rig)
        checked.require_picture_size(row.video["width"], row.video["height"])
        self._tracking.require_film(row)
        stated = checked.model_dump(mode="json")
        self._run_store.change_rig(inspection_id, who, stated)
        keep_rig(self._blobs, inspection_id, stated)
        self._corrections.forget(inspection_id)
        self._tracking.queued(inspection_id)
        logger.info("Inspection %s is tracked again for %s.", inspection_id, who)

    def delete(self, inspection_id: str, who: str) -> None:
        """Stop an inspection and delete it with all its files; its events stay.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            StoreUnavailable: The object store is away; nothing is deleted.
        """
        row = self.row(inspection_id)
        require_unlocked(row)
        self._blobs.exists(keys.rig(inspection_id))  # asked for its errors only
        if row.status not in ENDED:
            self._tracking.cancel(inspection_id)
        self._store.delete(inspection_id, who)
        self._runs.deleted(inspection_id)
        self._tracks.forget(inspection_id)
        self._corrections.forget(inspection_id)
        self._live.publish(Update(inspection_id, "cancelled"))
        delete_tree(self._folder.inspection(inspection_id))
        self._blobs.delete_all(keys.inspection(inspection_id))
        logger.info("Inspection %s deleted by %s.", inspection_id, who)

    def _views(self, summaries: Sequence[Summary]) -> list[InspectionView]:
        labels = self._labels.of([summary.row.id for summary in summaries])
        return [self._view(summary, labels.get(summary.row.id, ())) for summary in summaries]

    def _view(self, summary: Summary, labels: tuple[str, ...]) -> InspectionView:
        row = summary.row
        run = self._runs.running(row.id)
        last = run.last if run else None
        end: tuple[float | None, float | None]
        if last is not None:
            corrected = self._corrections.estimate(row.id, last)
            end = (corrected.distance_mm, corrected.sigma_distance_mm)
        else:
            end = self._corrections.end(row) or (None, None)
        running = run if row.status == "running" else None
        hindrance = running.hindrance if running else None
        if row.status == "queued":
            hindrance = self._tracking.engine_state().problem
        use = self._purpose.get()
        length_m = None if end[0] is None else end[0] / 1000
        u95_m = None if end[1] is None else half_width_m(end[1])
        total = row.frames_done if row.status == "done" else row.video.get("frames")
        return InspectionView(
            row=row,
            progress=run.progress() if run else Progress(row.frames_done, total, row.fps),
            distance_mm=end[0],
            sigma_distance_mm=end[1],
            is_corrected=self._corrections.is_stated(row),
            is_useful=use.is_met(length_m, u95_m),
            useful_within_m=use.most_m(length_m),
            raw_distance_mm=last.distance_mm if last else row.distance_mm,
            observations=summary.observations,
            defects=summary.defects,
            worst_severity=summary.worst_severity,
            open_questions=summary.open_questions,
            labels=labels,
            camera=running.camera if running else None,
            warning=hindrance or row.warning,
        )
