"""An inspection as it was exported: everything from which distances are derived."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

from app.survey.attachments import Kind
from app.survey.review import DRAFT, RemarkKind, ReviewState
from app.survey.stated import Stated
from app.survey.tag import StatedTag
from vo_core import Rig, Track
from vo_core.geometry.stance import Stance
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.finder import Sighting


@dataclass(frozen=True)
class ImportedTag:
    """An observation as it was stated."""

    id: str
    seq: int
    fields: Mapping[str, Any]
    """Fields of the PUT; fields that it left out are missing."""
    photo_sha256: str | None
    """Digest of its photo."""
    created_by: str
    created_at: datetime
    edited_by: str | None
    edited_at: datetime | None
    photo: str | None = None
    """Path of its photo among the files that came along, if it is there."""

    @property
    def stated(self) -> StatedTag:
        """Return the fields, which were checked when the file was read."""
        return StatedTag.kept(self.fields)


@dataclass(frozen=True)
class Happening:
    """An event of the inspection where it was exported."""

    at: datetime
    who: str
    action: str
    observation_id: str | None
    before: Mapping[str, Any] | None
    after: Mapping[str, Any] | None
    remark: str | None


@dataclass(frozen=True)
class ImportedAttachment:
    """A photo, a drawing or a voice note of an observation."""

    id: str
    observation_id: str
    kind: Kind
    rank: int
    frame: int
    strokes: tuple[Mapping[str, Any], ...]
    media_type: str | None
    duration_s: float | None
    size: int | None
    sha256: str | None
    file: str | None
    """Its path among the files that came along, if it is there."""
    created_by: str
    created_at: datetime


@dataclass(frozen=True)
class ImportedRemark:
    """What a reviewer said about an observation."""

    id: str
    observation_id: str
    kind: RemarkKind
    text: str
    version: str
    made_by: str
    made_at: datetime
    settled_by: str | None
    settled_at: datetime | None


@dataclass(frozen=True)
class ImportedReview:
    """How far the review was."""

    state: ReviewState = DRAFT
    by: str | None = None
    at: datetime | None = None


@dataclass(frozen=True)
class MovedFile:
    """A file that came along."""

    size: int
    sha256: str
    at: int | None = None
    """Where it begins in the archive file, which has it uncompressed."""
    content: bytes | None = None
    """The file itself where that was in a text, or compressed."""


@dataclass(frozen=True)
class WholeInspection:
    """An inspection as it was exported."""

    id: str
    """Id where it was exported."""
    name: str
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    header: Mapping[str, Any]
    labels: tuple[str, ...]
    rig: Rig
    source_kind: Literal["upload", "live", "import"]
    source_filename: str
    source_size: int
    source_sha256: str
    video: Mapping[str, Any]
    """Result of probing the video, which is not here."""
    tracked_with: str | None
    """Program that tracked the film; None in an older file."""
    warning: str | None
    error: str | None
    error_code: str | None
    created_at: datetime
    finished_at: datetime | None
    stated: Stated
    revision: int
    track: Track
    """The raw track; row i is frame i."""
    health: Sequence[Health]
    sightings: tuple[Sighting, ...]
    tilt: MountTilt | None
    stance: Stance
    tags: tuple[ImportedTag, ...]
    """Tags in the order of their numbers."""
    events: tuple[Happening, ...]
    """Events, the oldest first."""
    attachments: tuple[ImportedAttachment, ...] = ()
    remarks: tuple[ImportedRemark, ...] = ()
    review: ImportedReview = ImportedReview()
    report_template: Mapping[str, Any] | None = None
    """How its reports looked; None in an older file."""
    code_pack: str | None = None
    """Name of the table of codes, if a person had added it."""
    files: Mapping[str, MovedFile] = field(default_factory=dict)
    """The files that came along, by their paths in the archive file (`archive_manifest`)."""
