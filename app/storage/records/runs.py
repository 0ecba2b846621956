"""Runs in the database: the queue of films, the recordings, and how each run ended."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import and_, select, update
from sqlalchemy.orm import Session

from app.errors import ClaimLost, StillRunning
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import ENDED, ArchiveFilm, EventRow, Inspection, ObservationRow
from app.storage.records.attachments import AttachmentRow
from app.storage.records.inspections import existing, require_unlocked, unlocked
from app.survey.observations.records import CHAINAGE, RIG_CHANGED, SMOOTHED
from app.survey.rounding import metres, rounded
from vo_core.track import Estimate


@dataclass(frozen=True)
class Outcome:
    """The result of tracking an inspection."""

    status: str
    """done, failed or cancelled."""
    error_code: str | None = None
    error_detail: str | None = None
    warning: str | None = None


class RunStore(Store):
    """Queues, claims and ends runs; it returns detached rows."""

    @writing
    def queue_interrupted(self, session: Session) -> int:
        """Queue again the inspections whose tracking was interrupted; return their number.

        Recordings must be finalised first: see `open_recordings`.
        """
        rows = session.scalars(select(Inspection).where(_IS_TRACKED)).all()
        for row in rows:
            row.status = "queued"
        return len(rows)

    @reading
    def open_recordings(self, session: Session) -> list[Inspection]:
        """Return the recordings that have not ended."""
        query = select(Inspection).where(
            Inspection.status == "running", Inspection.source_sha256 == ""
        )
        return list(session.scalars(query))

    @reading
    def are_queued(self, session: Session) -> bool:
        """Return whether inspections wait to be tracked."""
        return session.scalar(_FIRST_QUEUED) is not None

    def claim_next(self, with_run: Collection[str]) -> Inspection | None:
        """Begin an attempt of the queued inspection that is first in order; return it, `running`,
        or None if there is nothing to track.

        What is running by its row, but not among those `with_run`, was interrupted and comes first.
        What has a run is left alone until this has ended, even if it is queued again already.
        """
        has_no_run = Inspection.id.not_in(with_run)

        def next_id(session: Session) -> str | None:
            interrupted = select(Inspection.id).where(_IS_TRACKED, has_no_run).limit(1)
            return session.scalar(interrupted) or session.scalar(_FIRST_QUEUED.where(has_no_run))

        with self.database.read() as session:
            if next_id(session) is None:
                return None  # read first, as a write costs a sync of the disk

        def claim(session: Session) -> Inspection | None:
            row = session.get(Inspection, next_id(session))
            if row is not None:
                row.status = "running"
                row.attempt += 1
            return row

        return self.database.write(claim)

    @writing
    def give_back(self, session: Session, inspection_id: str) -> None:
        """Queue an inspection again that nobody could begin to track."""
        row = session.get(Inspection, inspection_id)
        if row is not None and row.status == "running":
            row.status = "queued"

    @reading
    def has_outcome(
        self, session: Session, inspection_id: str, attempt: int | None, outcome: Outcome
    ) -> bool:
        """Return whether this outcome of an attempt is stored already."""
        row = existing(session, inspection_id)
        return (row.attempt, row.status) == (attempt, outcome.status)

    @reading
    def require_claim(self, session: Session, inspection_id: str, attempt: int | None) -> None:
        """Raise ClaimLost unless this attempt is the newest; InspectionNotFound without a row."""
        _require_claim(existing(session, inspection_id), attempt)

    @writing
    def cancel_unless_ended(self, session: Session, inspection_id: str) -> str:
        """Set an inspection that is not running to `cancelled`; return its previous status.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        row = existing(session, inspection_id)
        before = row.status
        if before not in ENDED:
            row.status = "cancelled"
            row.finished_at = datetime.now(UTC)
        return before

    @writing
    def queue_again(self, session: Session, inspection_id: str) -> None:
        """Queue an ended inspection as if it were new.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            StillRunning: The inspection is queued or running.
        """
        row = existing(session, inspection_id)
        _queue_again(session, row)

    @writing
    def change_rig(
        self, session: Session, inspection_id: str, who: str, rig: Mapping[str, Any]
    ) -> None:
        """Queue an ended inspection again with this rig; record the differences as event
        "rig_changed".

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            StillRunning: The inspection is queued or running.
        """
        row = existing(session, inspection_id)
        _queue_again(session, row)
        before, after = _differences(_flat(row.rig), _flat(rig))
        if after != before:
            row.rig = dict(rig)
            row.revision += 1
            session.add(EventRow.now(row, RIG_CHANGED, who, before, after))

    @writing
    def queue_recording(self, session: Session, inspection_id: str, warning: str) -> None:
        """Queue a finalised recording to be tracked as a file; `warning` says why.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        row = existing(session, inspection_id)
        row.status, row.warning = "queued", warning
        row.queued_at = datetime.now(UTC)

    @writing
    def record_on(
        self,
        session: Session,
        inspection_id: str,
        who: str,
        between: str,
        values: Mapping[str, Any],
    ) -> Inspection:
        """Continue an ended recording as the event "continued"; its end is withdrawn.

        Args:
            inspection_id: The inspection.
            who: Name for the history.
            between: The robot's movement between the parts.
            values: Its columns, as for a recording that has not ended.
        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            StillRunning: The inspection is queued or running.
        """
        row = unlocked(session, inspection_id)
        _require_ended(row)
        before = row.editable()
        row.header = {
            name: value
            for name, value in row.header.items()
            if name not in ("end_condition", "abandon_reason")
        }
        for name, value in values.items():
            setattr(row, name, value)
        row.status = "running"
        row.source_sha256 = ""
        row.finished_at = None
        row.error_code = row.error_detail = row.warning = None
        row.corrected_mm = row.sigma_corrected_mm = None
        after = {**row.editable(), "robot": between}
        session.add(EventRow.now(row, "continued", who, before, after))
        return row

    @writing
    def record_video(
        self,
        session: Session,
        inspection_id: str,
        video_file: str,
        video: Mapping[str, Any],
        size: int,
        sha256: str,
    ) -> None:
        """Store the video that a recording became.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        row = existing(session, inspection_id)
        row.video_file, row.video = video_file, dict(video)
        row.source_size, row.source_sha256 = size, sha256

    @writing
    def record_outcome(
        self,
        session: Session,
        inspection_id: str,
        outcome: Outcome,
        *,
        attempt: int | None = None,
        frames_done: int,
        fps: float | None,
        last: Estimate | None,
        tracked_with: str | None = None,
        moved_mm: NDArray[np.float64] | None = None,
    ) -> None:
        """Store the result of a run, its number of frames and the place of the last tracked frame.

        If smoothing moved observations that were made during the run, event "smoothed" says so.

        Args:
            inspection_id: The inspection.
            outcome: How the run ended.
            attempt: Number of the attempt; None for a recording.
            frames_done, fps, last: Of the run.
            tracked_with: Program that tracked it, as `app.tracker` names it.
            moved_mm: (N,) by how much smoothing moved each frame; None if it did not.
        Raises:
            InspectionNotFound: No inspection has this id.
            ClaimLost: The inspection has been claimed again since.
        """
        row = existing(session, inspection_id)
        if attempt is not None:
            _require_claim(row, attempt)
        row.status = outcome.status
        row.error_code = outcome.error_code
        row.error_detail = outcome.error_detail
        # A queued recording keeps the warning that says why it was queued.
        row.warning = " ".join(filter(None, (row.warning, outcome.warning))) or None
        row.frames_done = frames_done
        row.fps = fps
        row.tracked_with = tracked_with
        row.finished_at = datetime.now(UTC)
        if last is not None:
            row.distance_mm = last.distance_mm
            row.sigma_distance_mm = last.sigma_distance_mm
        if moved_mm is not None:
            _note_smoothed(session, row, moved_mm)


_IS_TRACKED = and_(Inspection.status == "running", Inspection.source_sha256 != "")
_FIRST_QUEUED = (
    select(Inspection.id)
    .where(Inspection.status == "queued")
    .order_by(Inspection.priority.desc(), Inspection.queued_at, Inspection.id)
    .limit(1)
)


def _require_claim(row: Inspection, attempt: int | None) -> None:
    if row.attempt != attempt or row.status != "running":
        raise ClaimLost(
            f"Attempt {attempt} of inspection {row.id} ended after another had begun; its result "
            "is not used."
        )


def _require_ended(row: Inspection) -> None:
    if row.status not in ENDED:
        raise StillRunning(f"The inspection is {row.status}; stop it first.")


def _note_smoothed(session: Session, row: Inspection, moved_mm: NDArray[np.float64]) -> None:
    frames = session.scalars(
        select(ObservationRow.frame).where(
            ObservationRow.inspection_id == row.id,
            ObservationRow.deleted_at.is_(None),
            # Earlier ones have been shown at the final distances of an earlier run.
            ObservationRow.created_at >= row.queued_at,
            ObservationRow.frame < len(moved_mm),
        )
    )
    most_mm = max((abs(float(moved_mm[frame])) for frame in frames), default=0.0)
    if metres(most_mm) > 0:
        after = {"measured_moved_mm": rounded(most_mm, 1)}
        session.add(EventRow.now(row, SMOOTHED, CHAINAGE, after=after))


def _queue_again(session: Session, row: Inspection) -> None:
    require_unlocked(row)
    _require_ended(row)
    row.status = "queued"
    row.queued_at = datetime.now(UTC)
    row.finished_at = None
    row.error_code = row.error_detail = row.warning = None
    row.frames_done = 0
    row.fps = row.distance_mm = row.sigma_distance_mm = None
    row.corrected_mm = row.sigma_corrected_mm = None
    # A film of the archive that was refused, as its inspection was locked, is so no more.
    refused = (ArchiveFilm.id == row.id, ArchiveFilm.state == "refused")
    session.execute(update(ArchiveFilm).where(*refused).values(state="idle"))
    # A photo that was missing for want of a track gets another try.
    for table in (ObservationRow, AttachmentRow):
        session.execute(update(table).where(table.inspection_id == row.id).values(photo_error=None))


def _flat(rig: Mapping[str, Any]) -> dict[str, Any]:
    """Flatten a rig: `mount.height_mm` and so on."""
    return {
        f"{group}.{name}": value for group, fields in rig.items() for name, value in fields.items()
    }


def _differences(
    before: Mapping[str, Any], after: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the values that differ."""
    names = [n for n in {**before, **after} if before.get(n) != after.get(n)]
    return {n: before.get(n) for n in names}, {n: after.get(n) for n in names}
