"""The tables; every change of them is a migration in `migrations/versions`."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import JSON, DateTime, Float, ForeignKey, Index, Integer, String, Text
from sqlalchemy.engine import Dialect
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator

from app.survey.records import Event, Observation
from app.survey.tag import StatedTag

ENDED = ("done", "failed", "cancelled")
"""States of an inspection that last."""
STATES = ("queued", "running", *ENDED)
IMPORTED = "import"
"""Kind of a source that is the file of another program's survey, without its film."""
ALERT_STATES = ("waiting", "told", "withdrawn", "given_up")


class UtcDateTime(TypeDecorator[datetime]):
    """An instant: aware in Python, UTC in the database (SQLite keeps no time zone)."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Naive UTC for the database."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Aware UTC for Python."""
        return None if value is None else value.replace(tzinfo=UTC)


class Base(DeclarativeBase):
    """Registry of the tables."""

    type_annotation_map = {  # noqa: RUF012  (read by SQLAlchemy)
        datetime: UtcDateTime(),
        dict[str, Any]: JSON(none_as_null=True),
    }


class LoginSession(Base):
    """A browser that exchanged a token for a cookie; only the cookie's SHA-256 is kept."""

    __tablename__ = "sessions"

    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    token_digest: Mapped[str] = mapped_column(String(64))
    """Of the token that it was made with: the session ends with it."""
    created_at: Mapped[datetime]
    seen_at: Mapped[datetime]


class Inspection(Base):
    """One run of a camera through a culvert."""

    __tablename__ = "inspections"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    status: Mapped[str] = mapped_column(String(10), index=True)
    """queued, running, done, failed or cancelled."""
    rig: Mapped[dict[str, Any]]
    header: Mapped[dict[str, Any]]
    source_kind: Mapped[str] = mapped_column(String(10))
    """Where its film came from: upload, live, or import of a survey that has none."""
    source_filename: Mapped[str] = mapped_column(String(255))
    """What the user called it; the file itself has a name of ours."""
    source_size: Mapped[int]
    source_sha256: Mapped[str] = mapped_column(String(64))
    """Empty while a live inspection is recorded."""
    video_file: Mapped[str] = mapped_column(String(20))
    """Name within the inspection's folder; empty of an import, whose film is not here."""
    video: Mapped[dict[str, Any]]
    """What the probe found: width, height, duration_s, frames, codec, playable, media_type."""
    frames_done: Mapped[int] = mapped_column(Integer, default=0)
    fps: Mapped[float | None] = mapped_column(Float)
    """Tracked frames a second, of the last run."""
    distance_mm: Mapped[float | None] = mapped_column(Float)
    """Of the last tracked frame, with its standard deviation."""
    sigma_distance_mm: Mapped[float | None] = mapped_column(Float)
    error_code: Mapped[str | None] = mapped_column(String(50))
    error_detail: Mapped[str | None] = mapped_column(Text)
    warning: Mapped[str | None] = mapped_column(Text)
    """Why the video ended early or what was skipped, in a sentence."""
    corrections: Mapped[dict[str, Any]] = mapped_column(default=dict)
    """Zero point, known lengths, joints: what brings the raw track to the stated distance."""
    revision: Mapped[int] = mapped_column(default=0)
    """Rises when distances that were published have changed."""
    corrected_mm: Mapped[float | None] = mapped_column(Float)
    """As `distance_mm`, but corrected, so that a list need not read tracks; None until known."""
    sigma_corrected_mm: Mapped[float | None] = mapped_column(Float)
    created_at: Mapped[datetime]
    queued_at: Mapped[datetime]
    finished_at: Mapped[datetime | None]

    @property
    def has_film(self) -> bool:
        """Whether this server has it, or is recording it."""
        return self.video_file != ""


class ObservationRow(Base):
    """A row of `app.survey.records.Observation`."""

    __tablename__ = "observations"

    inspection_id: Mapped[str] = mapped_column(
        ForeignKey("inspections.id", ondelete="CASCADE"), primary_key=True
    )
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    """UUID made by the client, so that a repeated PUT is the same observation."""
    seq: Mapped[int]
    frame: Mapped[int]
    fields: Mapped[dict[str, Any]]
    """What was PUT, as it was accepted."""
    photo_frame: Mapped[int | None]
    """The frame that the photo shows; None while there is none."""
    photo_sha256: Mapped[str | None] = mapped_column(String(64))
    photo_error: Mapped[str | None] = mapped_column(Text)
    """Why there is no photo, or why that of an import is not here."""
    created_at: Mapped[datetime]
    created_by: Mapped[str] = mapped_column(String(100))
    edited_at: Mapped[datetime | None]
    edited_by: Mapped[str | None] = mapped_column(String(100))
    deleted_at: Mapped[datetime | None]

    @classmethod
    def of(cls, observation: Observation) -> ObservationRow:
        """To be added to a session."""
        return cls(
            inspection_id=observation.inspection_id,
            id=observation.id,
            seq=observation.seq,
            frame=observation.frame,
            fields=observation.tag.to_json(),
            photo_frame=observation.photo_frame,
            photo_sha256=observation.photo_sha256,
            photo_error=observation.photo_error,
            created_at=observation.created_at,
            created_by=observation.created_by,
            edited_at=observation.edited_at,
            edited_by=observation.edited_by,
            deleted_at=observation.deleted_at,
        )

    def record(self) -> Observation:
        """What the row holds, apart from the session."""
        return Observation(
            inspection_id=self.inspection_id,
            id=self.id,
            seq=self.seq,
            tag=StatedTag.kept(self.fields),
            photo_frame=self.photo_frame,
            photo_sha256=self.photo_sha256,
            photo_error=self.photo_error,
            created_at=self.created_at,
            created_by=self.created_by,
            edited_at=self.edited_at,
            edited_by=self.edited_by,
            deleted_at=self.deleted_at,
        )


class EventRow(Base):
    """A row of `app.survey.records.Event`."""

    __tablename__ = "events"
    __table_args__ = (Index("ix_events_subject", "inspection_id", "observation_id"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    inspection_id: Mapped[str] = mapped_column(String(32))
    observation_id: Mapped[str | None] = mapped_column(String(36))
    action: Mapped[str] = mapped_column(String(20))
    who: Mapped[str] = mapped_column(String(100))
    at: Mapped[datetime]
    before: Mapped[dict[str, Any] | None]
    after: Mapped[dict[str, Any] | None]
    remark: Mapped[str | None] = mapped_column(Text)

    @classmethod
    def of(cls, event: Event) -> EventRow:
        """To be added to a session, which gives it its id."""
        return cls(
            inspection_id=event.inspection_id,
            observation_id=event.observation_id,
            action=event.action,
            who=event.who,
            at=event.at,
            before=None if event.before is None else dict(event.before),
            after=None if event.after is None else dict(event.after),
            remark=event.remark,
        )

    def record(self) -> Event:
        """What the row holds, apart from the session."""
        return Event(
            id=self.id,
            inspection_id=self.inspection_id,
            observation_id=self.observation_id,
            action=self.action,
            who=self.who,
            at=self.at,
            before=self.before,
            after=self.after,
            remark=self.remark,
        )


class Alert(Base):
    """A severe observation that the client is to be notified of by the webhook."""

    __tablename__ = "alerts"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    """UUID that every try names, so that the client can drop what comes twice."""
    inspection_id: Mapped[str] = mapped_column(
        ForeignKey("inspections.id", ondelete="CASCADE"), index=True
    )
    observation_id: Mapped[str] = mapped_column(String(36))
    state: Mapped[str] = mapped_column(String(10), index=True)
    """One of ALERT_STATES."""
    tries: Mapped[int]
    created_at: Mapped[datetime]
    next_at: Mapped[datetime]
    """Not before then it is tried again."""
    told_at: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Text)
    """Why the last try failed, in a sentence."""


class Preference(Base):
    """What a person has chosen for the page: language, units, quick codes."""

    __tablename__ = "preferences"

    who: Mapped[str] = mapped_column(String(100), primary_key=True)
    """Name of the token."""
    chosen: Mapped[dict[str, Any]]


class CodePack(Base):
    """A table of codes that a person brought along, beside the built-in one."""

    __tablename__ = "code_packs"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(100), unique=True)
    table: Mapped[str] = mapped_column(Text)
    """The CSV as it was accepted."""
    created_at: Mapped[datetime]
    created_by: Mapped[str] = mapped_column(String(100))


class Heartbeat(Base):
    """One row that `/readyz` writes, to know that the database takes writes."""

    __tablename__ = "heartbeat"

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime]
