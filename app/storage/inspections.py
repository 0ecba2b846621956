"""Inspections in the database: the list, the tracking queue, and the history."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Integer, and_, cast, func, select, update
from sqlalchemy.orm import Session

from app.errors import InspectionNotFound, StillRunning
from app.storage.database import Database
from app.storage.packs import require_pack_of
from app.storage.tables import ENDED, EventRow, Inspection, ObservationRow
from app.survey.records import RESCALED, RIG_CHANGED, Event
from app.survey.versions import Require
from vo_core.track import Estimate


@dataclass(frozen=True)
class Summary:
    """An inspection with the number of its observations."""

    row: Inspection
    defects: int
    worst_severity: int | None


@dataclass(frozen=True)
class Outcome:
    """The result of tracking an inspection."""

    status: str
    """done, failed or cancelled."""
    error_code: str | None = None
    error_detail: str | None = None
    warning: str | None = None


@dataclass(frozen=True)
class Rescaling:
    """A change of the distance scale that the run itself caused."""

    who: str
    before: dict[str, Any] | None
    """The scale by joints before; None if they did not count."""
    after: dict[str, Any] | None
    """The scale by joints after; without a `scale` it holds why they do not count."""
    remark: str


class InspectionStore:
    """Returns detached rows: changing them does not change the database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, inspection_id: str) -> Inspection:
        """Return the inspection with this id.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        with self._database.read() as session:
            return existing(session, inspection_id)

    def summary(self, inspection_id: str) -> Summary:
        """Return the inspection with this id and its counts.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        with self._database.read() as session:
            found = session.execute(_SUMMARY.where(Inspection.id == inspection_id)).one_or_none()
        if found is None:
            raise InspectionNotFound(_NOT_FOUND)
        return Summary(*found)

    def summaries(self) -> list[Summary]:
        """Return all inspections with their counts, the newest first."""
        with self._database.read() as session:
            query = _SUMMARY.order_by(Inspection.created_at.desc(), Inspection.id)
            return [Summary(*found) for found in session.execute(query)]

    def state(self, inspection_id: str) -> tuple[Hashable, ...]:
        """Return a state that differs after every change to the report of an ended inspection.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        newest = select(func.max(EventRow.id)).where(EventRow.inspection_id == inspection_id)
        photos = select(
            func.count(ObservationRow.photo_error),
            func.sum(cast(ObservationRow.photo_frame == ObservationRow.frame, Integer)),
        ).where(ObservationRow.inspection_id == inspection_id)
        with self._database.read() as session:
            row = existing(session, inspection_id)
            made = tuple(session.execute(photos).one())
            return (row.revision, row.status, row.finished_at, session.scalar(newest), *made)

    def counts(self) -> dict[str, int]:
        """Return the number of inspections of each status."""
        query = select(Inspection.status, func.count()).group_by(Inspection.status)
        with self._database.read() as session:
            return {status: number for status, number in session.execute(query)}  # noqa: C416

    def events(self, inspection_id: str, observation_id: str | None = None) -> list[Event]:
        """Return every event of the inspection or of one observation, oldest first."""
        query = (
            select(EventRow).where(EventRow.inspection_id == inspection_id).order_by(EventRow.id)
        )
        if observation_id is not None:
            query = query.where(EventRow.observation_id == observation_id)
        with self._database.read() as session:
            return [row.record() for row in session.scalars(query.order_by(EventRow.id))]

    def add(self, inspection: Inspection, who: str) -> None:
        """Add a new inspection; `inspection` can then be used like a result of get()."""

        def insert(session: Session) -> None:
            session.add(inspection)
            session.add(_event(inspection, "created", who, None, _editable(inspection)))

        self._database.write(insert)

    def change(
        self,
        inspection_id: str,
        who: str,
        name: str | None,
        header: Mapping[str, Any] | None,
        require: Require | None = None,
    ) -> None:
        """Replace the name or the header; None keeps it.

        Raises:
            InspectionNotFound: No inspection has this id.
            PackNotFound: The header names a code pack that does not exist.
            Exception: Whatever `require` raises for the name and header that are stored.
        """

        def apply(session: Session) -> None:
            row = existing(session, inspection_id)
            before = _editable(row)
            if require is not None:
                require(before)
            if header is not None and header.get("code_pack") != row.header.get("code_pack"):
                require_pack_of(session, header)
            row.name = row.name if name is None else name
            row.header = row.header if header is None else dict(header)
            after = _editable(row)
            if after != before:
                session.add(_event(row, "changed", who, before, after))

        self._database.write(apply)

    def correct(
        self,
        inspection_id: str,
        who: str,
        corrections: Mapping[str, Any],
        remark: str | None,
        *,
        unstated: Mapping[str, Any],
        require: Require | None = None,
    ) -> int:
        """Replace what was stated about the distances; return the next revision.

        Equal content changes nothing; `unstated` is the content before anything was stated.

        Raises:
            InspectionNotFound: No inspection has this id.
            Exception: Whatever `require` raises for what is stored.
        """

        def apply(session: Session) -> int:
            row = existing(session, inspection_id)
            before, after = row.corrections or dict(unstated), dict(corrections)
            if require is not None:
                require(before)
            if after != before:
                row.corrections = after
                row.revision += 1
                row.corrected_mm = row.sigma_corrected_mm = None
                session.add(_event(row, "corrected", who, before, after, remark))
            return row.revision

        return self._database.write(apply)

    def rescale(self, inspection_id: str, change: Rescaling, revision: int) -> int | None:
        """Record that the run changed the distance scale; return the new revision.

        Return None and record nothing if the revision is no longer `revision`.

        Raises:
            InspectionNotFound: No inspection has this id.
        """

        def apply(session: Session) -> int | None:
            row = existing(session, inspection_id)
            if row.revision != revision:
                return None
            row.revision += 1
            row.corrected_mm = row.sigma_corrected_mm = None
            session.add(
                _event(row, RESCALED, change.who, change.before, change.after, change.remark)
            )
            return row.revision

        return self._database.write(apply)

    def last_rescaled(self, inspection_id: str) -> Mapping[str, Any] | None:
        """Return the scale of the last such record; None without one, or if it no longer
        applies.
        """
        with self._database.read() as session:
            newest = session.scalars(
                select(EventRow)
                .where(
                    EventRow.inspection_id == inspection_id,
                    EventRow.action.in_(("corrected", RESCALED)),
                )
                .order_by(EventRow.id.desc())
                .limit(1)
            ).first()
            if newest is None or newest.action != RESCALED:
                return None
            return newest.after if newest.after and "scale" in newest.after else None

    def record_corrected_end(
        self, inspection_id: str, revision: int, distance_mm: float, sigma_mm: float
    ) -> None:
        """Store the corrected distance of the end, unless the track was corrected or queued
        since.
        """

        def record(session: Session) -> None:
            row = session.get(Inspection, inspection_id)
            if row is not None and row.revision == revision and row.status in ENDED:
                row.corrected_mm, row.sigma_corrected_mm = distance_mm, sigma_mm

        self._database.write(record)

    def delete(self, inspection_id: str, who: str) -> None:
        """Delete an inspection with its observations; its events stay.

        Raises:
            InspectionNotFound: No inspection has this id.
        """

        def remove(session: Session) -> None:
            row = existing(session, inspection_id)
            session.delete(row)
            session.add(_event(row, "deleted", who, _editable(row), None))

        self._database.write(remove)

    def queue_interrupted(self) -> int:
        """Queue again the inspections that were being tracked when the server ended; return their
        number.

        Recordings must be finalised first: see `interrupted_recordings`.
        """

        def queue(session: Session) -> int:
            rows = session.scalars(select(Inspection).where(_IS_TRACKED)).all()
            for row in rows:
                row.status = "queued"
            return len(rows)

        return self._database.write(queue)

    def interrupted_recordings(self) -> list[Inspection]:
        """Return the inspections that were being recorded when the server ended."""
        with self._database.read() as session:
            query = select(Inspection).where(
                Inspection.status == "running", Inspection.source_sha256 == ""
            )
            return list(session.scalars(query))

    def record_video(
        self, inspection_id: str, video_file: str, video: Mapping[str, Any], size: int, sha256: str
    ) -> None:
        """Store the video that a recording became.

        Raises:
            InspectionNotFound: No inspection has this id.
        """

        def record(session: Session) -> None:
            row = existing(session, inspection_id)
            row.video_file, row.video = video_file, dict(video)
            row.source_size, row.source_sha256 = size, sha256

        self._database.write(record)

    def queue_recording(self, inspection_id: str, warning: str) -> None:
        """Queue a finalised recording to be tracked as a file; `warning` says why.

        Raises:
            InspectionNotFound: No inspection has this id.
        """

        def queue(session: Session) -> None:
            row = existing(session, inspection_id)
            row.status, row.warning = "queued", warning
            row.queued_at = datetime.now(UTC)

        self._database.write(queue)

    def finish(self, inspection_id: str, who: str, stated: Mapping[str, Any]) -> None:
        """Add the end of the run to the header, as the event "finished".

        Raises:
            InspectionNotFound: No inspection has this id.
        """

        def apply(session: Session) -> None:
            row = existing(session, inspection_id)
            before = _editable(row)
            row.header = {**row.header, **stated}
            session.add(_event(row, "finished", who, before, _editable(row)))

        self._database.write(apply)

    def claim_oldest_queued(self) -> Inspection | None:
        """Set the oldest queued inspection to `running`; None if there is none."""
        with self._database.read() as session:
            if session.scalar(_OLDEST_QUEUED) is None:
                return None  # read first, as a write costs a sync of the disk

        def claim(session: Session) -> Inspection | None:
            inspection_id = session.scalar(_OLDEST_QUEUED)
            row = session.get(Inspection, inspection_id) if inspection_id else None
            if row is not None:
                row.status = "running"
            return row

        return self._database.write(claim)

    def cancel_unless_ended(self, inspection_id: str) -> str:
        """Set an inspection that is not running to `cancelled`; return its previous status.

        Raises:
            InspectionNotFound: No inspection has this id.
        """

        def cancel(session: Session) -> str:
            row = existing(session, inspection_id)
            before = row.status
            if before not in ENDED:
                row.status = "cancelled"
                row.finished_at = datetime.now(UTC)
            return before

        return self._database.write(cancel)

    def queue_again(self, inspection_id: str) -> None:
        """Queue an ended inspection as if it were new.

        Raises:
            InspectionNotFound: No inspection has this id.
            StillRunning: The inspection is queued or running.
        """

        def queue(session: Session) -> None:
            row = existing(session, inspection_id)
            _queue_again(session, row)

        self._database.write(queue)

    def change_rig(self, inspection_id: str, who: str, rig: Mapping[str, Any]) -> None:
        """Queue an ended inspection again with this rig; record the differences as event
        "rig_changed".

        Raises:
            InspectionNotFound: No inspection has this id.
            StillRunning: The inspection is queued or running.
        """

        def apply(session: Session) -> None:
            row = existing(session, inspection_id)
            _queue_again(session, row)
            before, after = _differences(_flat(row.rig), _flat(rig))
            if after != before:
                row.rig = dict(rig)
                row.revision += 1
                session.add(_event(row, RIG_CHANGED, who, before, after))

        self._database.write(apply)

    def record_on(
        self, inspection_id: str, who: str, between: str, values: Mapping[str, Any]
    ) -> Inspection:
        """Continue an ended recording as the event "continued"; its end is withdrawn.

        Args:
            inspection_id: The inspection.
            who: Name for the history.
            between: The robot's movement between the parts.
            values: Its columns, as for a recording that has not ended.
        Raises:
            InspectionNotFound: No inspection has this id.
            StillRunning: The inspection is queued or running.
        """

        def apply(session: Session) -> Inspection:
            row = existing(session, inspection_id)
            _require_ended(row)
            before = _editable(row)
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
            after = {**_editable(row), "robot": between}
            session.add(_event(row, "continued", who, before, after))
            return row

        return self._database.write(apply)

    def record_outcome(
        self,
        inspection_id: str,
        outcome: Outcome,
        *,
        frames_done: int,
        fps: float | None,
        last: Estimate | None,
    ) -> None:
        """Store the result of a run, its number of frames and the place of the last tracked frame.

        Raises:
            InspectionNotFound: No inspection has this id.
        """

        def record(session: Session) -> None:
            row = existing(session, inspection_id)
            row.status = outcome.status
            row.error_code = outcome.error_code
            row.error_detail = outcome.error_detail
            # A queued recording keeps the warning that says why it was queued.
            row.warning = " ".join(filter(None, (row.warning, outcome.warning))) or None
            row.frames_done = frames_done
            row.fps = fps
            row.finished_at = datetime.now(UTC)
            if last is not None:
                row.distance_mm = last.distance_mm
                row.sigma_distance_mm = last.sigma_distance_mm

        self._database.write(record)


_NOT_FOUND = "There is no such inspection."
_SUMMARY = (
    select(
        Inspection,
        func.count(ObservationRow.id),
        func.max(cast(ObservationRow.fields["severity"].as_string(), Integer)),
    )
    .outerjoin(
        ObservationRow,
        and_(ObservationRow.inspection_id == Inspection.id, ObservationRow.deleted_at.is_(None)),
    )
    .group_by(Inspection.id)
)
_IS_TRACKED = and_(Inspection.status == "running", Inspection.source_sha256 != "")
_OLDEST_QUEUED = (
    select(Inspection.id)
    .where(Inspection.status == "queued")
    .order_by(Inspection.queued_at, Inspection.id)
    .limit(1)
)


def existing(session: Session, inspection_id: str) -> Inspection:
    """Return the row of this id, within a session.

    Raises:
        InspectionNotFound: No inspection has this id.
    """
    row = session.get(Inspection, inspection_id)
    if row is None:
        raise InspectionNotFound(_NOT_FOUND)
    return row


def _require_ended(row: Inspection) -> None:
    if row.status not in ENDED:
        raise StillRunning(f"The inspection is {row.status}; stop it first.")


def _queue_again(session: Session, row: Inspection) -> None:
    _require_ended(row)
    row.status = "queued"
    row.queued_at = datetime.now(UTC)
    row.finished_at = None
    row.error_code = row.error_detail = row.warning = None
    row.frames_done = 0
    row.fps = row.distance_mm = row.sigma_distance_mm = None
    row.corrected_mm = row.sigma_corrected_mm = None
    # A photo that was missing for want of a track gets another try.
    session.execute(
        update(ObservationRow)
        .where(ObservationRow.inspection_id == row.id)
        .values(photo_error=None)
    )


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


def _editable(inspection: Inspection) -> dict[str, Any]:
    return {"name": inspection.name, "header": inspection.header}


def _event(
    inspection: Inspection,
    action: str,
    who: str,
    before: dict[str, Any] | None,
    after: dict[str, Any] | None,
    remark: str | None = None,
) -> EventRow:
    return EventRow(
        inspection_id=inspection.id,
        action=action,
        who=who,
        at=datetime.now(UTC),
        before=before,
        after=after,
        remark=remark,
    )
