"""Observations in the database; every change writes an event."""

from __future__ import annotations

import json
import threading
from datetime import UTC, datetime
from typing import Any

from cachetools import LRUCache
from sqlalchemy import Row, Text, cast, func, or_, select
from sqlalchemy.orm import Session

from app.errors import ObservationNotFound
from app.storage.database.database import Database
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import EventRow, ObservationRow
from app.storage.records.alerts import note_emergency
from app.storage.records.inspections import unlocked
from app.survey.observations.records import Observation
from app.survey.observations.tag import StatedTag
from app.survey.versions import Require

_RECORDS_KEPT = 20_000
"""Records held in memory, some 2 kB each."""


class ObservationStore(Store):
    """Reads and writes observations; returned records are independent of the database.

    What ends in `_within` is a part of a larger transaction.
    """

    def __init__(self, database: Database, *, has_webhook: bool = False) -> None:
        """Store the database; with a webhook, severe observations are put into its outbox."""
        super().__init__(database)
        self._has_webhook = has_webhook
        self._lock = threading.Lock()
        """Guards the next field."""
        self._records: LRUCache[tuple[str, str], tuple[Row[Any], Observation]] = LRUCache(
            _RECORDS_KEPT
        )
        """The record of each listed row, cached until the row changes."""

    @reading
    def get(self, session: Session, inspection_id: str, observation_id: str) -> Observation:
        """Return an observation, deleted or not.

        Raises:
            ObservationNotFound: No observation ever had this id.
        """
        return _existing(session, inspection_id, observation_id).record()

    @reading
    def listed(self, session: Session, inspection_id: str) -> list[Observation]:
        """Return the observations that are not deleted, in the order of their numbers."""
        query = (
            select(*_COLUMNS)
            .where(
                ObservationRow.inspection_id == inspection_id, ObservationRow.deleted_at.is_(None)
            )
            .order_by(ObservationRow.seq)
        )
        rows = session.execute(query).all()
        with self._lock:
            return [self._record(row) for row in rows]

    def _record(self, row: Row[Any]) -> Observation:
        key = (row.inspection_id, row.id)
        known_row, known = self._records.get(key, (None, None))
        if known is not None and known_row == row:
            return known
        values = row._asdict()
        record = Observation(tag=StatedTag.kept(json.loads(values.pop("fields"))), **values)
        self._records[key] = (row, record)
        return record

    @reading
    def stretch_marks(self, session: Session, inspection_id: str) -> list[str]:
        """Return the stretch marks, such as "A1", of all observations, also of deleted ones."""
        mark = ObservationRow.fields["continuous"].as_string()
        query = select(mark).where(ObservationRow.inspection_id == inspection_id, mark.is_not(None))
        return [found for found in session.scalars(query) if found]

    def put_within(
        self,
        session: Session,
        inspection_id: str,
        observation_id: str,
        tag: StatedTag,
        who: str,
        require: Require | None = None,
    ) -> bool:
        """Create, replace or restore an observation; return whether anything changed.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: The inspection is approved.
            Exception: Whatever `require` raises for the stored fields (None if there are none).
        """
        unlocked(session, inspection_id)
        row = session.get(ObservationRow, (inspection_id, observation_id))
        before = None if row is None else row.fields
        was_deleted = row is not None and row.deleted_at is not None
        if require is not None:
            require(None if was_deleted else before)
        is_changed = _put(session, inspection_id, observation_id, tag.to_json(), who)
        if is_changed and self._has_webhook:
            row = _existing(session, inspection_id, observation_id)
            note_emergency(session, row, before, was_deleted=was_deleted)
        return is_changed

    put = writing(put_within)

    def delete_within(
        self,
        session: Session,
        inspection_id: str,
        observation_id: str,
        who: str,
        require: Require | None = None,
    ) -> bool:
        """Mark an observation as deleted; return whether it was listed.

        Raises:
            ObservationNotFound: No observation ever had this id.
            InspectionLocked: The inspection is approved.
            Exception: Whatever `require` raises for the stored fields (None if it is deleted).
        """
        unlocked(session, inspection_id)
        row = _existing(session, inspection_id, observation_id)
        if require is not None:
            require(None if row.deleted_at is not None else row.fields)
        if row.deleted_at is not None:
            return False
        row.deleted_at = datetime.now(UTC)
        _log(session, row, "deleted", who, row.fields)
        return True

    delete = writing(delete_within)

    @writing
    def restore(self, session: Session, inspection_id: str, observation_id: str, who: str) -> bool:
        """Undo a deletion; return whether there was one.

        Raises:
            ObservationNotFound: No observation ever had this id.
            InspectionLocked: The inspection is approved.
        """
        unlocked(session, inspection_id)
        row = _existing(session, inspection_id, observation_id)
        if row.deleted_at is None:
            return False
        row.deleted_at = None
        _log(session, row, "restored", who, None)
        if self._has_webhook:
            note_emergency(session, row, row.fields, was_deleted=True)
        return True

    @reading
    def inspections_without_photos(self, session: Session) -> list[str]:
        """Return the ids of inspections that lack a photo."""
        query = _WITHOUT_PHOTO.with_only_columns(ObservationRow.inspection_id).distinct()
        return list(session.scalars(query))

    @reading
    def without_photo(self, session: Session, inspection_id: str) -> list[Observation]:
        """Return the observations whose photo is neither made nor given up."""
        query = _WITHOUT_PHOTO.where(ObservationRow.inspection_id == inspection_id)
        return [row.record() for row in session.scalars(query)]

    @writing
    def record_photo(self, session: Session, shown: Observation, sha256: str) -> None:
        """Record the photo of `shown`, unless its frame was changed meanwhile."""
        row = _unchanged(session, shown)
        if row is not None:
            row.photo_error = None
            row.photo_frame, row.photo_sha256 = row.frame, sha256

    @writing
    def record_photo_error(self, session: Session, shown: Observation, error: str) -> None:
        """Record why `shown` has no photo, unless its frame was changed meanwhile."""
        row = _unchanged(session, shown)
        if row is not None:
            row.photo_error = error


_COLUMNS = tuple(
    cast(column, Text).label(column.name) if column.name == "fields" else column
    for column in ObservationRow.__table__.columns
    if column.name != "frame"  # it is in the fields
)
"""Columns of a record, with its fields as the stored text."""

_WITHOUT_PHOTO = select(ObservationRow).where(
    ObservationRow.deleted_at.is_(None),
    ObservationRow.photo_error.is_(None),
    or_(ObservationRow.photo_frame.is_(None), ObservationRow.photo_frame != ObservationRow.frame),
)


STATED_BY_FILE = ("at_joint", "photo_name", "film_time_s")
"""Fields of imported observations that nobody enters; a change keeps them."""


def _put(
    session: Session, inspection_id: str, observation_id: str, fields: dict[str, Any], who: str
) -> bool:
    now = datetime.now(UTC)
    row = session.get(ObservationRow, (inspection_id, observation_id))
    if row is None:
        highest = session.scalar(
            select(func.max(ObservationRow.seq)).where(
                ObservationRow.inspection_id == inspection_id
            )
        )
        row = ObservationRow(
            inspection_id=inspection_id,
            id=observation_id,
            seq=(highest or 0) + 1,
            created_at=now,
            created_by=who,
            frame=fields["frame"],
            fields=fields,
        )
        session.add(row)
        _log(session, row, "created", who, None)
        return True
    before = None if row.deleted_at is not None else row.fields
    fields = {**{name: row.fields[name] for name in STATED_BY_FILE if name in row.fields}, **fields}
    if fields == before:
        return False
    if row.frame != fields["frame"]:
        if row.photo_error is not None:  # an imported photo that is missing cannot be made again
            row.photo_frame = row.photo_sha256 = None
        row.photo_error = None
    row.frame, row.fields = fields["frame"], fields
    action = "changed" if row.deleted_at is None else "restored"
    row.edited_at, row.edited_by, row.deleted_at = now, who, None
    _log(session, row, action, who, before)
    return True


def _existing(session: Session, inspection_id: str, observation_id: str) -> ObservationRow:
    row = session.get(ObservationRow, (inspection_id, observation_id))
    if row is None:
        raise ObservationNotFound("There is no such observation.")
    return row


def _unchanged(session: Session, shown: Observation) -> ObservationRow | None:
    row = session.get(ObservationRow, (shown.inspection_id, shown.id))
    return row if row is not None and row.frame == shown.frame else None


def _log(
    session: Session, row: ObservationRow, action: str, who: str, before: dict[str, Any] | None
) -> None:
    after = None if row.deleted_at is not None else row.fields
    session.add(EventRow.now(row, action, who, before, after))
