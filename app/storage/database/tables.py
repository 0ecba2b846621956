"""The tables; every change of them is a migration in `migrations/versions`."""

from __future__ import annotations

from dataclasses import fields
from datetime import UTC, date, datetime
from typing import Any, ClassVar

from sqlalchemy import (
    JSON,
    BigInteger,
    ColumnElement,
    DateTime,
    Float,
    ForeignKey,
    Index,
    Integer,
    String,
    Text,
    UniqueConstraint,
    and_,
    func,
    not_,
)
from sqlalchemy.engine import Dialect
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, validates
from sqlalchemy.types import TypeDecorator

from app.survey.fields.header import project_of
from app.survey.folding import storable
from app.survey.observations.records import Event, Observation
from app.survey.observations.review import DRAFT
from app.survey.observations.tag import StatedTag
from app.tracker import measures

ENDED = ("done", "failed", "cancelled")
"""Final states of an inspection."""
_TRACKED = ("done", "cancelled")
STATES = ("queued", "running", *ENDED)
IMPORTED = "import"
"""Kind of a source: the survey file of another program, without its film."""
LONGEST_NAME = 500
"""Of a project or an asset: a database indexes no longer text."""
ALERT_STATES = ("waiting", "told", "withdrawn", "given_up")


class UtcDateTime(TypeDecorator[datetime]):
    """An instant: aware in Python, UTC in the database (SQLite stores no time zone)."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Convert to naive UTC for the database."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Convert to aware UTC for Python."""
        return None if value is None else value.replace(tzinfo=UTC)


class Base(DeclarativeBase):
    """Registry of the tables.

    A token that is limited to projects sees the rows whose ASSET, `inspection_id` or PROJECT leads
    to one of them, and all rows of a table that has none of these: see `limits`.
    """

    PROJECT: ClassVar[str | None] = None
    """Column with the name of the project that a row belongs to."""
    ASSET: ClassVar[str | None] = None
    """Column with the id of the registered asset that a row belongs to."""
    IS_SHARED_WITHOUT_PROJECT: ClassVar[bool] = False
    """Whether a row without a project is for all of them."""
    type_annotation_map = {  # noqa: RUF012  (read by SQLAlchemy)
        datetime: UtcDateTime(),
        dict[str, Any]: JSON(none_as_null=True),
    }

    def values(self) -> dict[str, Any]:
        """Return the columns by name."""
        return {column.key: getattr(self, column.key) for column in self.__table__.columns}


BOX = ("south", "north", "west", "east")


class Boxed:
    """What lies on the map, with the box around it in degrees; all None if its place is unknown."""

    west: Mapped[float | None] = mapped_column(Float)
    south: Mapped[float | None] = mapped_column(Float)
    east: Mapped[float | None] = mapped_column(Float)
    north: Mapped[float | None] = mapped_column(Float)


class LoginSession(Base):
    """A browser that exchanged a token for a cookie; only the cookie's SHA-256 is kept."""

    __tablename__ = "sessions"

    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    token_digest: Mapped[str] = mapped_column(String(64))
    """Digest of its token: the session ends with the token."""
    created_at: Mapped[datetime]
    seen_at: Mapped[datetime]


class TokenUse(Base):
    """When a token was last used, by a browser or a program; precise to some minutes."""

    __tablename__ = "token_uses"

    token_digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    seen_at: Mapped[datetime]


class Inspection(Base):
    """One survey of one culvert."""

    PROJECT = "project"
    __tablename__ = "inspections"
    __table_args__ = (Index("ix_inspections_queue", "status", "priority", "queued_at"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    status: Mapped[str] = mapped_column(String(10), index=True)
    """queued, running, done, failed or cancelled."""
    rig: Mapped[dict[str, Any]]
    header: Mapped[dict[str, Any]]
    project: Mapped[str | None] = mapped_column(Text, index=True)
    """Follows the header."""
    source_kind: Mapped[str] = mapped_column(String(10))
    """Origin of the film: upload, live, or import of a survey without one."""
    source_filename: Mapped[str] = mapped_column(String(255))
    """Name given by the user; the stored file has another name."""
    source_size: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"))
    source_sha256: Mapped[str] = mapped_column(String(64))
    """Empty while a live inspection is recorded."""
    video_file: Mapped[str] = mapped_column(String(20))
    """Name within the inspection's folder; empty for an import, whose film is not here."""
    video: Mapped[dict[str, Any]]
    """Result of the probe: width, height, duration_s, frames, codec, playable, media_type."""
    frames_done: Mapped[int] = mapped_column(Integer, default=0)
    fps: Mapped[float | None] = mapped_column(Float)
    """Tracked frames per second of the last run."""
    tracked_with: Mapped[str | None] = mapped_column(String(64))
    """Program of that run, as `app.tracker` names it; None if that is not known."""
    distance_mm: Mapped[float | None] = mapped_column(Float)
    """Distance of the last tracked frame; its standard deviation follows."""
    sigma_distance_mm: Mapped[float | None] = mapped_column(Float)
    error_code: Mapped[str | None] = mapped_column(String(50))
    error_detail: Mapped[str | None] = mapped_column(Text)
    warning: Mapped[str | None] = mapped_column(Text)
    """A sentence that says why the video ended early or what was skipped."""
    corrections: Mapped[dict[str, Any]] = mapped_column(default=dict)
    """Zero, known lengths and joints, which turn raw distances into corrected ones."""
    revision: Mapped[int] = mapped_column(default=0)
    """Rises when published distances change."""
    corrected_mm: Mapped[float | None] = mapped_column(Float)
    """Corrected `distance_mm`, so that a list need not read tracks; None until known."""
    sigma_corrected_mm: Mapped[float | None] = mapped_column(Float)
    created_at: Mapped[datetime]
    queued_at: Mapped[datetime]
    finished_at: Mapped[datetime | None]
    priority: Mapped[int] = mapped_column(default=0)
    """Of two queued inspections the one with the higher number is tracked first."""
    attempt: Mapped[int] = mapped_column(default=0)
    """Number of the newest run: an older one can store no result."""
    review_state: Mapped[str] = mapped_column(String(10), default=DRAFT, index=True)
    """One of `app.survey.observations.review.STATES`; who has set it, and when, follows."""
    reviewed_at: Mapped[datetime | None]
    reviewed_by: Mapped[str | None] = mapped_column(String(100))

    @validates("header")
    def _take_project(self, _key: str, header: dict[str, Any]) -> dict[str, Any]:
        name = project_of(header)
        self.project = name and storable(name)[:LONGEST_NAME]
        return header

    @property
    def has_film(self) -> bool:
        """Whether this server has the film, or is recording it."""
        return self.video_file != ""

    @property
    def may_begin_anew(self) -> bool:
        """Whether time stamps of its film may begin anew, which is known once all of it was read
        and nothing about it was odd; a recording has one time axis.
        """
        return self.source_sha256 != "" and (self.status != "done" or self.warning is not None)

    @property
    def is_outdated(self) -> bool:
        """Whether its film is here, and today's program might measure it otherwise than the one
        that tracked it.
        """
        return (
            self.status in _TRACKED
            and self.frames_done > 0
            and self.has_film
            and not (self.tracked_with or "").endswith(measures())
        )

    def editable(self) -> dict[str, Any]:
        """Return what people edit; its version guards against changes of others."""
        return {"name": self.name, "header": self.header}


def outdated() -> ColumnElement[bool]:
    """Return the condition of `Inspection.is_outdated`."""
    return and_(
        Inspection.status.in_(_TRACKED),
        Inspection.frames_done > 0,
        Inspection.video_file != "",
        not_(func.coalesce(Inspection.tracked_with, "").endswith(measures(), autoescape=True)),
    )


class ObservationRow(Base):
    """A row of `app.survey.observations.records.Observation`."""

    __tablename__ = "observations"

    inspection_id: Mapped[str] = mapped_column(
        ForeignKey("inspections.id", ondelete="CASCADE"), primary_key=True
    )
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    """UUID made by the client, so that a repeated PUT names the same observation."""
    seq: Mapped[int]
    frame: Mapped[int]
    fields: Mapped[dict[str, Any]]
    """Content of the PUT as accepted."""
    photo_frame: Mapped[int | None]
    """The frame that the photo shows; None while there is none."""
    photo_sha256: Mapped[str | None] = mapped_column(String(64))
    photo_error: Mapped[str | None] = mapped_column(Text)
    """Why there is no photo, or why the photo of an import is missing."""
    created_at: Mapped[datetime]
    created_by: Mapped[str] = mapped_column(String(100))
    edited_at: Mapped[datetime | None]
    edited_by: Mapped[str | None] = mapped_column(String(100))
    deleted_at: Mapped[datetime | None]

    @classmethod
    def of(cls, observation: Observation) -> ObservationRow:
        """Make a row to add to a session."""
        values = {each.name: getattr(observation, each.name) for each in fields(observation)}
        tag = values.pop("tag")
        return cls(**values, frame=tag.frame, fields=tag.to_json())

    def record(self) -> Observation:
        """Return the record, detached from the session."""
        values = self.values()
        del values["frame"]  # it is in the fields
        return Observation(tag=StatedTag.kept(values.pop("fields")), **values)


class RemarkRow(Base):
    """What a reviewer said about one observation."""

    __tablename__ = "remarks"

    inspection_id: Mapped[str] = mapped_column(
        ForeignKey("inspections.id", ondelete="CASCADE"), primary_key=True
    )
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    """UUID made by the client, so that a repeated PUT names the same remark."""
    observation_id: Mapped[str] = mapped_column(String(36))
    kind: Mapped[str] = mapped_column(String(10))
    """accepted, question or comment."""
    text: Mapped[str] = mapped_column(Text)
    version: Mapped[str] = mapped_column(String(16))
    """Version of the observation that the reviewer saw: a later edit voids an acceptance."""
    made_at: Mapped[datetime]
    made_by: Mapped[str] = mapped_column(String(100))
    settled_at: Mapped[datetime | None]
    """When a question was answered to the reviewer's content."""
    settled_by: Mapped[str | None] = mapped_column(String(100))


class EventRow(Base):
    """A row of `app.survey.observations.records.Event`."""

    __tablename__ = "events"
    __table_args__ = (
        Index("ix_events_subject", "inspection_id", "observation_id"),
        Index("ix_events_newest", "inspection_id", "id"),
    )

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
    def now(
        cls,
        row: Any,
        action: str,
        who: str,
        before: dict[str, Any] | None = None,
        after: dict[str, Any] | None = None,
        remark: str | None = None,
    ) -> EventRow:
        """Make the row of a present change of an inspection, an observation, or what is about one:
        `row` is its row.
        """
        is_whole = isinstance(row, Inspection)
        observation_id = getattr(row, "observation_id", row.id)
        return cls(
            inspection_id=row.id if is_whole else row.inspection_id,
            observation_id=None if is_whole else observation_id,
            action=action,
            who=who,
            at=datetime.now(UTC),
            before=before,
            after=after,
            remark=remark,
        )

    @classmethod
    def of(cls, event: Event) -> EventRow:
        """Make a row to add to a session, which assigns its id."""
        return cls(**{name: value for name, value in vars(event).items() if name != "id"})

    def record(self) -> Event:
        """Return the record, detached from the session."""
        return Event(**self.values())


class Alert(Base):
    """The notification of a severe observation by the webhook."""

    __tablename__ = "alerts"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    """UUID repeated by every try, so that the client can drop duplicates."""
    inspection_id: Mapped[str] = mapped_column(
        ForeignKey("inspections.id", ondelete="CASCADE"), index=True
    )
    observation_id: Mapped[str] = mapped_column(String(36))
    state: Mapped[str] = mapped_column(String(10), index=True)
    """One of ALERT_STATES."""
    tries: Mapped[int]
    created_at: Mapped[datetime]
    next_at: Mapped[datetime]
    """Earliest time of the next try."""
    told_at: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Text)
    """A sentence that says why the last try failed."""


class Notice(Base):
    """A message of the webhook that is about no single observation; its body is kept as it was."""

    __tablename__ = "notices"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    """UUID repeated by every try, so that the client can drop duplicates."""
    event: Mapped[str] = mapped_column(String(40))
    path: Mapped[str] = mapped_column(Text)
    """Of the page about it."""
    body: Mapped[dict[str, Any]]
    state: Mapped[str] = mapped_column(String(10), index=True)
    """One of ALERT_STATES."""
    tries: Mapped[int]
    created_at: Mapped[datetime]
    next_at: Mapped[datetime]
    """Earliest time of the next try."""
    told_at: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Text)
    """A sentence that says why the last try failed."""


class AcceptanceLink(Base):
    """A link by which a client without an account sees some inspections; only the SHA-256 of its
    secret is kept.
    """

    __tablename__ = "acceptance_links"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    digest: Mapped[str] = mapped_column(String(64), unique=True)
    note: Mapped[str] = mapped_column(String(200))
    """For whom or what it is; the client sees it."""
    made_at: Mapped[datetime] = mapped_column(index=True)
    made_by: Mapped[str] = mapped_column(String(100))
    expires_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]
    revoked_by: Mapped[str | None] = mapped_column(String(100))
    opened: Mapped[int] = mapped_column(default=0)
    """How often its page was opened, and when last."""
    opened_at: Mapped[datetime | None]


class AcceptanceSection(Base):
    """An inspection that a link shows."""

    __tablename__ = "acceptance_sections"

    link_id: Mapped[str] = mapped_column(
        ForeignKey("acceptance_links.id", ondelete="CASCADE"), primary_key=True
    )
    place: Mapped[int] = mapped_column(primary_key=True)
    """1, 2, ... in the order of the page; part of its address."""
    inspection_id: Mapped[str] = mapped_column(String(32), index=True)
    """No reference: the inspection may be deleted, which the page then says."""
    name: Mapped[str] = mapped_column(String(200))
    """Of the inspection when the link was made."""
    version: Mapped[str] = mapped_column(String(40))
    """Of what people stated when the link was made: see `acceptance.versions_of`."""


class AcceptanceAnswer(Base):
    """What a client said about a section, and what was replied; it is never changed or deleted."""

    __tablename__ = "acceptance_answers"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    """UUID in the form, so that one that is sent again is the same answer."""
    link_id: Mapped[str] = mapped_column(
        ForeignKey("acceptance_links.id", ondelete="CASCADE"), index=True
    )
    place: Mapped[int]
    inspection_id: Mapped[str] = mapped_column(String(32), index=True)
    kind: Mapped[str] = mapped_column(String(10))
    """accepted or question."""
    person: Mapped[str] = mapped_column(String(100))
    """The name that the client typed; nobody has checked it."""
    text: Mapped[str] = mapped_column(Text)
    version: Mapped[str] = mapped_column(String(40))
    """Of what the client saw."""
    at: Mapped[datetime]
    reply: Mapped[str | None] = mapped_column(Text)
    replied_at: Mapped[datetime | None]
    replied_by: Mapped[str | None] = mapped_column(String(100))


class WorkOrder(Base):
    """An asset of the register that an office wants inspected, with its reason and day."""

    ASSET = "asset_id"
    __tablename__ = "work_orders"
    __table_args__ = (UniqueConstraint("number", "asset_id"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    number: Mapped[str] = mapped_column(String(100))
    """The office's own; one order may have many assets, each a row of its own."""
    asset_id: Mapped[str] = mapped_column(String(200), index=True)
    reason: Mapped[str] = mapped_column(Text)
    due_on: Mapped[date | None]
    note: Mapped[str] = mapped_column(Text)
    ordered_at: Mapped[datetime]
    """Inspections that are made later count for it."""
    ordered_by: Mapped[str] = mapped_column(String(100))
    state: Mapped[str] = mapped_column(String(12), index=True)
    """One of `app.survey.assets.work_orders.STATES`: derived from the inspections of the asset
    until the order has ended."""
    inspection_id: Mapped[str | None] = mapped_column(String(32))
    """The inspection that the state is of."""
    changed: Mapped[int] = mapped_column(index=True)
    """Rises with every change of any order, so that a program can ask for what is newer."""
    changed_at: Mapped[datetime]
    ended_by: Mapped[str | None] = mapped_column(String(100))
    """Who closed or cancelled it."""


class IdempotentRequest(Base):
    """A request that was answered under a key of its sender, so that it can be sent again."""

    __tablename__ = "idempotent_requests"

    who: Mapped[str] = mapped_column(String(100), primary_key=True)
    key: Mapped[str] = mapped_column(String(200), primary_key=True)
    body_sha256: Mapped[str] = mapped_column(String(64))
    answer: Mapped[dict[str, Any]]
    at: Mapped[datetime] = mapped_column(index=True)


class Preference(Base):
    """A person's choices for the page: language, units, quick codes."""

    __tablename__ = "preferences"

    who: Mapped[str] = mapped_column(String(100), primary_key=True)
    """Name of the token."""
    chosen: Mapped[dict[str, Any]]


class CodePack(Base):
    """One version of a table of codes that a person added beside the built-in one."""

    PROJECT = "project"
    IS_SHARED_WITHOUT_PROJECT = True
    __tablename__ = "code_packs"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(100), unique=True)
    """As reports print it: the title, with the version from the second on."""
    table: Mapped[str] = mapped_column(Text)
    """The CSV as accepted."""
    title: Mapped[str] = mapped_column(String(100), server_default="")
    """What all its versions are called."""
    version: Mapped[int] = mapped_column(server_default="1")
    project: Mapped[str | None] = mapped_column(String(200))
    """The only project whose inspections may be coded with it; None: all."""
    created_at: Mapped[datetime]
    created_by: Mapped[str] = mapped_column(String(100))


class LibraryRig(Base):
    """A rig that a person keeps under a name, for the next inspections."""

    __tablename__ = "rigs"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    """UUID, given by the client."""
    name: Mapped[str] = mapped_column(String(100), unique=True)
    rig: Mapped[dict[str, Any]]
    changed_at: Mapped[datetime]
    changed_by: Mapped[str] = mapped_column(String(100))


class ArchiveFilm(Base):
    """A film of the archive: a file of this machine of which an inspection is made in its turn."""

    PROJECT = "project"
    __tablename__ = "archive_films"
    __table_args__ = (Index("ix_archive_films_queue", "state", "priority", "wanted_at"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    """The id of its inspection too, so that no film becomes two."""
    path: Mapped[str] = mapped_column(Text)
    """Text of the resolved path; see `app.archive.paths`."""
    relative: Mapped[str] = mapped_column(Text)
    """Text of the path within the added folder, which the patterns of rules fit."""
    path_sha256: Mapped[str] = mapped_column(String(64), unique=True)
    """Of the path: an index of PostgreSQL holds no text as long as a path may be."""
    size: Mapped[int] = mapped_column(BigInteger)
    modified_at: Mapped[datetime]
    name: Mapped[str] = mapped_column(String(200))
    project: Mapped[str | None] = mapped_column(String(200))
    asset: Mapped[str | None] = mapped_column(String(200))
    rule: Mapped[str | None] = mapped_column(String(100))
    """Name of the rule that gave it its rig."""
    rig: Mapped[dict[str, Any] | None]
    rig_name: Mapped[str | None] = mapped_column(String(200))
    header: Mapped[dict[str, Any]]
    priority: Mapped[int] = mapped_column(default=0)
    state: Mapped[str] = mapped_column(String(10))
    """idle, waiting, paused or refused; see `app.storage.archive.selection`."""
    error_code: Mapped[str | None] = mapped_column(String(50))
    error_detail: Mapped[str | None] = mapped_column(Text)
    wanted_at: Mapped[datetime | None]
    wanted_by: Mapped[str | None] = mapped_column(String(100))
    added_at: Mapped[datetime]
    added_by: Mapped[str] = mapped_column(String(100))


class ArchiveRules(Base):
    """One row: the rules that give the films of the archive their rigs."""

    __tablename__ = "archive_rules"

    id: Mapped[int] = mapped_column(primary_key=True)
    content: Mapped[dict[str, Any]]
    changed_at: Mapped[datetime]
    changed_by: Mapped[str] = mapped_column(String(100))


class ReportTemplateRow(Base):
    """How the reports of a project look; see `app.reports.template`."""

    PROJECT = "project"
    IS_SHARED_WITHOUT_PROJECT = True
    __tablename__ = "report_templates"

    project: Mapped[str] = mapped_column(String(200), primary_key=True)
    """Empty: of every project without a template of its own."""
    content: Mapped[dict[str, Any]]
    changed_at: Mapped[datetime]
    changed_by: Mapped[str] = mapped_column(String(100))


class Heartbeat(Base):
    """One row that `/readyz` writes to check that the database accepts writes."""

    __tablename__ = "heartbeat"

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime]


class RegisteredAsset(Boxed, Base):
    """A culvert of the owner's register, inspected or not."""

    PROJECT = "project"
    __tablename__ = "assets"
    __table_args__ = (Index("ix_assets_box", *BOX, "asset_id"),)

    asset_id: Mapped[str] = mapped_column(String(200), primary_key=True)
    """As people write it in the header of an inspection."""
    normalised_id: Mapped[str] = mapped_column(String(200), index=True)
    """What all ways of writing it have in common: see `app.survey.folding.normalised_id`."""
    project: Mapped[str | None] = mapped_column(String(200), index=True)
    header: Mapped[dict[str, Any]]
    """Fields of a header that belong to the asset: what a new inspection begins with."""
    line: Mapped[list[list[float]]] = mapped_column(JSON)
    """Longitude and latitude in degrees from the start to the end; one point or none if unknown."""
    folded: Mapped[str] = mapped_column(Text)
    """Text for the search, without case and accents."""
    changed_at: Mapped[datetime]
    changed_by: Mapped[str] = mapped_column(String(100))


class MadeProject(Base):
    """A project that a person made, so that it is there before anything belongs to it."""

    PROJECT = "name"
    __tablename__ = "projects"

    name: Mapped[str] = mapped_column(String(200), primary_key=True)
    folded: Mapped[str] = mapped_column(Text)
    """Text for the search, without case and accents."""
    made_at: Mapped[datetime]
    made_by: Mapped[str] = mapped_column(String(100))


class InspectionLabel(Base):
    """A word by which people sort their inspections."""

    __tablename__ = "inspection_labels"

    inspection_id: Mapped[str] = mapped_column(
        String(32), ForeignKey("inspections.id", ondelete="CASCADE"), primary_key=True
    )
    label: Mapped[str] = mapped_column(String(50), primary_key=True, index=True)


class IndexedInspection(Boxed, Base):
    """What the search knows of an inspection; derived, so that it may be deleted at any time."""

    __tablename__ = "indexed_inspections"
    __table_args__ = (Index("ix_indexed_inspections_box", *BOX, "inspection_id"),)

    inspection_id: Mapped[str] = mapped_column(
        String(32), ForeignKey("inspections.id", ondelete="CASCADE"), primary_key=True
    )
    index_version: Mapped[int]
    """How it was derived; the next three columns show from which state of the inspection."""
    revision: Mapped[int]
    finished_at: Mapped[datetime | None]
    newest_event: Mapped[int | None]
    name: Mapped[str] = mapped_column(String(200))
    project: Mapped[str | None] = mapped_column(Text, index=True)
    asset: Mapped[str | None] = mapped_column(Text, index=True)
    asset_normalised_id: Mapped[str | None] = mapped_column(Text, index=True)
    """Of the asset: see `app.survey.folding.normalised_id`."""
    surveyed_on: Mapped[date]
    folded: Mapped[str] = mapped_column(Text)
    """Name, project and asset without case and accents."""
    start_lat: Mapped[float | None] = mapped_column(Float)
    """Ends of the culvert by the header in degrees, each known as a pair or not at all."""
    start_lon: Mapped[float | None] = mapped_column(Float)
    end_lat: Mapped[float | None] = mapped_column(Float)
    end_lon: Mapped[float | None] = mapped_column(Float)
    line: Mapped[list[list[float]] | None] = mapped_column(JSON(none_as_null=True))
    """Course on the map: longitude and latitude in degrees, from where the distance is 0."""
    distance_m: Mapped[float | None] = mapped_column(Float)
    """Corrected distance of the end, with half of its 95 % interval."""
    distance_u95_m: Mapped[float | None] = mapped_column(Float)
    defects: Mapped[int]
    worst_severity: Mapped[int | None]
    frames: Mapped[int | None]
    """Tracked frames; None where no film was measured. Shares of them follow."""
    weak_share: Mapped[float | None] = mapped_column(Float)
    lost_share: Mapped[float | None] = mapped_column(Float)
    too_fast_share: Mapped[float | None] = mapped_column(Float)
    dark_share: Mapped[float | None] = mapped_column(Float)
    overexposed_share: Mapped[float | None] = mapped_column(Float)
    blurred_share: Mapped[float | None] = mapped_column(Float)
    dirty_lens_share: Mapped[float | None] = mapped_column(Float)


class IndexedDefect(Base):
    """An observation with its derived place, for the search; deleted with its inspection's row."""

    __tablename__ = "indexed_defects"
    __table_args__ = (
        Index("ix_indexed_defects_asset", "asset"),
        Index("ix_indexed_defects_place", "lat", "lon", "inspection_id", "observation_id"),
        Index("ix_indexed_defects_newest", "created_at", "inspection_id", "observation_id"),
        # All that is filtered but text: SQLite reads it in place of the rows, five times as fast.
        Index(
            "ix_indexed_defects_filters",
            "severity",
            "code",
            "distance_m",
            "clock_hours",
            "surveyed_on",
            "created_at",
            "inspection_id",
            "observation_id",
        ),
    )

    inspection_id: Mapped[str] = mapped_column(
        String(32),
        ForeignKey("indexed_inspections.inspection_id", ondelete="CASCADE"),
        primary_key=True,
    )
    observation_id: Mapped[str] = mapped_column(String(36), primary_key=True)
    revision: Mapped[int]
    """Of the inspection whose corrections gave the distance."""
    inspection: Mapped[str] = mapped_column(String(200))
    """Its name; like project, asset and day a copy, so that one table answers."""
    project: Mapped[str | None] = mapped_column(Text)
    asset: Mapped[str | None] = mapped_column(Text)
    surveyed_on: Mapped[date]
    seq: Mapped[int]
    frame: Mapped[int]
    code: Mapped[str | None] = mapped_column(String(8))
    char1: Mapped[str | None] = mapped_column(String(2))
    char2: Mapped[str | None] = mapped_column(String(2))
    label: Mapped[str | None] = mapped_column(Text)
    label_ms: Mapped[str | None] = mapped_column(Text)
    quant1: Mapped[float | None] = mapped_column(Float)
    unit1: Mapped[str | None] = mapped_column(String(8))
    quant2: Mapped[float | None] = mapped_column(Float)
    unit2: Mapped[str | None] = mapped_column(String(8))
    severity: Mapped[int | None]
    continuous: Mapped[str | None] = mapped_column(String(4))
    distance_m: Mapped[float | None] = mapped_column(Float)
    distance_u95_m: Mapped[float | None] = mapped_column(Float)
    lon: Mapped[float | None] = mapped_column(Float)
    """Place on the course of the inspection, in degrees; latitude follows."""
    lat: Mapped[float | None] = mapped_column(Float)
    clock: Mapped[int | None]
    clock_to: Mapped[int | None]
    clock_hours: Mapped[int]
    """The hours that it covers, as bits: 1 for 1 o'clock to 2048 for 12 o'clock."""
    remark: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[datetime]
    folded: Mapped[str] = mapped_column(Text)
    """What the search of text reads: remark, code, label and what the inspection is called."""
