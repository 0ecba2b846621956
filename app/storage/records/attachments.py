"""Attachments in the database; every change writes an event of their observation."""

from __future__ import annotations

from collections.abc import Hashable
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Float, ForeignKey, Index, String, Text, func, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from app.errors import AttachmentNotFound, ObservationNotFound, TooManyAttachments
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import Base, EventRow, ObservationRow
from app.storage.records.inspections import unlocked
from app.survey.observations.attachments import MOST, Attachment, Stroke, in_order


class AttachmentRow(Base):
    """A row of `app.survey.observations.attachments.Attachment`; its file is a blob."""

    __tablename__ = "attachments"
    __table_args__ = (Index("ix_attachments_observation", "inspection_id", "observation_id"),)

    inspection_id: Mapped[str] = mapped_column(
        String(32), ForeignKey("inspections.id", ondelete="CASCADE"), primary_key=True
    )
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    observation_id: Mapped[str] = mapped_column(String(36))
    kind: Mapped[str] = mapped_column(String(10))
    rank: Mapped[int]
    frame: Mapped[int]
    drawing: Mapped[dict[str, Any] | None]
    """`{"strokes": [...]}` of a drawing."""
    media_type: Mapped[str | None] = mapped_column(String(20))
    duration_s: Mapped[float | None] = mapped_column(Float)
    size: Mapped[int | None]
    sha256: Mapped[str | None] = mapped_column(String(64))
    photo_error: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[datetime]
    created_by: Mapped[str] = mapped_column(String(100))
    deleted_at: Mapped[datetime | None]

    @classmethod
    def of(cls, attachment: Attachment) -> AttachmentRow:
        """Make a row to add to a session."""
        values = vars(attachment) | {"drawing": _drawing_of(attachment)}
        del values["strokes"]
        return cls(**values)

    def record(self) -> Attachment:
        """Return the record, detached from the session."""
        values = self.values()
        drawing = values.pop("drawing")
        strokes = drawing["strokes"] if drawing else ()
        return Attachment(
            **values, strokes=tuple(Stroke.model_construct(**stroke) for stroke in strokes)
        )


Key = tuple[str, str]
"""Ids of inspection and attachment."""


class AttachmentStore(Store):
    """Reads and writes attachments; returned records are independent of the database."""

    @reading
    def get(self, session: Session, inspection_id: str, attachment_id: str) -> Attachment:
        """Return an attachment, deleted or not.

        Raises:
            AttachmentNotFound: No attachment ever had this id.
        """
        return _existing(session, (inspection_id, attachment_id)).record()

    @reading
    def listed(self, session: Session, inspection_id: str) -> list[Attachment]:
        """Return the attachments of an inspection that are not deleted, in their order."""
        query = select(AttachmentRow).where(
            AttachmentRow.inspection_id == inspection_id, AttachmentRow.deleted_at.is_(None)
        )
        return in_order([row.record() for row in session.scalars(query)])

    @reading
    def state(self, session: Session, inspection_id: str) -> Hashable:
        """Return what differs once another picture is made; all other changes are events."""
        query = select(func.count(AttachmentRow.sha256), func.count(AttachmentRow.photo_error))
        made = session.execute(query.where(AttachmentRow.inspection_id == inspection_id))
        return tuple(made.one())

    @writing
    def put(self, session: Session, attachment: Attachment, who: str) -> bool:
        """Create, change or restore an attachment; return whether anything changed.

        Raises:
            InspectionLocked: It is approved.
            ObservationNotFound: No observation ever had this id.
            TooManyAttachments: The observation has as many as it may have.
        """
        unlocked(session, attachment.inspection_id)
        key = (attachment.inspection_id, attachment.id)
        row = session.get(AttachmentRow, key)
        drawing = _drawing_of(attachment)
        if row is None:
            _require_room(session, attachment)
            session.add(AttachmentRow.of(attachment))
            _log(session, attachment, "attached", who)
            return True
        stored = (row.rank, row.drawing, row.deleted_at)
        if stored == (attachment.rank, drawing, None):
            return False
        row.rank, row.drawing, row.deleted_at = attachment.rank, drawing, None
        _log(session, row.record(), "attached", who)
        return True

    def delete(self, inspection_id: str, attachment_id: str, who: str) -> bool:
        """Mark an attachment as deleted; return whether it was listed.

        Raises:
            AttachmentNotFound: No attachment ever had this id.
            InspectionLocked: It is approved.
        """
        return self._mark((inspection_id, attachment_id), who, is_deleted=True)

    def restore(self, inspection_id: str, attachment_id: str, who: str) -> bool:
        """Undo a deletion; return whether there was one.

        Raises:
            AttachmentNotFound: No attachment ever had this id.
            InspectionLocked: It is approved.
        """
        return self._mark((inspection_id, attachment_id), who, is_deleted=False)

    @writing
    def _mark(self, session: Session, key: Key, who: str, *, is_deleted: bool) -> bool:
        unlocked(session, key[0])
        row = _existing(session, key)
        if (row.deleted_at is not None) == is_deleted:
            return False
        row.deleted_at = datetime.now(UTC) if is_deleted else None
        _log(session, row.record(), "detached" if is_deleted else "attached", who)
        return True

    @reading
    def inspections_without_photos(self, session: Session) -> list[str]:
        """Return the ids of inspections that lack a picture."""
        query = _WITHOUT_PHOTO.with_only_columns(AttachmentRow.inspection_id).distinct()
        return list(session.scalars(query))

    @reading
    def without_photo(self, session: Session, inspection_id: str) -> list[Attachment]:
        """Return the attachments whose picture is neither made nor given up."""
        query = _WITHOUT_PHOTO.where(AttachmentRow.inspection_id == inspection_id)
        return [row.record() for row in session.scalars(query)]

    @writing
    def record_photo(self, session: Session, shown: Attachment, sha256: str) -> None:
        """Record that the picture is stored."""
        _existing(session, (shown.inspection_id, shown.id)).sha256 = sha256

    @writing
    def record_photo_error(self, session: Session, shown: Attachment, error: str) -> None:
        """Record why there is no picture."""
        _existing(session, (shown.inspection_id, shown.id)).photo_error = error


_WITHOUT_PHOTO = select(AttachmentRow).where(
    AttachmentRow.kind != "voice",
    AttachmentRow.deleted_at.is_(None),
    AttachmentRow.photo_error.is_(None),
    AttachmentRow.sha256.is_(None),
)


def _existing(session: Session, key: Key) -> AttachmentRow:
    row = session.get(AttachmentRow, key)
    if row is None:
        raise AttachmentNotFound("There is no such attachment.")
    return row


def _require_room(session: Session, attachment: Attachment) -> None:
    """Require that the observation exists, deleted or not, and may have one more."""
    if session.get(ObservationRow, (attachment.inspection_id, attachment.observation_id)) is None:
        raise ObservationNotFound("There is no such observation.")
    count = select(func.count()).where(
        AttachmentRow.inspection_id == attachment.inspection_id,
        AttachmentRow.observation_id == attachment.observation_id,
    )
    if (session.scalar(count) or 0) >= MOST:
        raise TooManyAttachments(f"An observation may have at most {MOST} attachments.")


def _drawing_of(attachment: Attachment) -> dict[str, object] | None:
    if attachment.kind != "drawing":
        return None
    return {"strokes": [stroke.model_dump(exclude_none=True) for stroke in attachment.strokes]}


def _log(session: Session, attachment: Attachment, action: str, who: str) -> None:
    stated = attachment.stated()
    changed = (None, stated) if action == "attached" else (stated, None)
    session.add(EventRow.now(attachment, action, who, *changed))
