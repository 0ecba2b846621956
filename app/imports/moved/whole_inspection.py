"""An inspection as it was exported: everything from which distances are derived.

The parts are read strictly from the report in JSON; `app.reports.exchange.chainage_json` writes
their fields.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

from app.imports.moved.archive_manifest import VOICE
from app.survey.distances.stated import Stated
from app.survey.findings.declaration import FindingCode, FindingKind
from app.survey.findings.records import Direction, Finding, FindingState, Size
from app.survey.given import LINE, TEXT, Frame, Header, PackName, Pixel
from app.survey.labels import Labels
from app.survey.observations.attachments import LONGEST_VOICE_S, MOST_VOICE_BYTES, Kind, Strokes
from app.survey.observations.review import DRAFT, RemarkKind, ReviewState
from app.survey.observations.tag import StatedTag
from vo_core import Rig, Track
from vo_core.geometry.initial_pose import InitialPose
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting


class Part(BaseModel):
    """Strict base; fields that a later writer of this version adds are ignored."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False, frozen=True)


_INSTANT = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:.]{5,15}(?:Z|[+-][0-9]{2}:?[0-9]{2})")


def _instant(value: object) -> datetime:
    """Parse ISO 8601 with a time zone, as the export writes it."""
    if not isinstance(value, str) or not _INSTANT.fullmatch(value):
        raise ValueError("must be an instant such as 2026-09-14T09:42:00Z")
    return datetime.fromisoformat(value)


_Instant = Annotated[datetime, BeforeValidator(_instant)]
_Who = Annotated[str, StringConstraints(max_length=100, pattern=LINE)]
_Word = _Who
_Sentence = Annotated[str, StringConstraints(max_length=4000, pattern=TEXT)]
_Sha256 = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
_ObservationId = Annotated[
    str,
    StringConstraints(pattern=r"^[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}$"),
]
_PhotoPath = Annotated[str, StringConstraints(pattern=r"^photos/[A-Za-z0-9_.-]{1,150}$")]
"""Path of a picture that comes along, which `app.imports.moved.moved_media` decodes."""
MediaPath = _PhotoPath | Annotated[str, StringConstraints(pattern=r"^voice/[A-Za-z0-9_.-]{1,150}$")]


class MovedSource(Part):
    """The film, which is not here."""

    kind: Literal["upload", "live", "import"]
    filename: Annotated[str, StringConstraints(max_length=255, pattern=LINE)]
    size: Annotated[int, Field(ge=0, le=2**53 - 1)]
    sha256: Annotated[str, StringConstraints(pattern=r"^([0-9a-f]{64})?$")]


class _Video(Part):
    """Result of probing the video, in the order of the probe."""

    width: Annotated[int, Field(ge=1, le=8192)]
    height: Annotated[int, Field(ge=1, le=8192)]
    codec: _Word = ""
    container: _Word = ""
    pixel_format: _Word | None = None
    frames: Annotated[int, Field(ge=0, le=2**31 - 1)] | None = None
    duration_s: Annotated[float, Field(ge=0, le=1e8)] | None = None
    rate_hz: Annotated[float, Field(ge=0, le=1e6)] | None = None
    pixel_aspect: Annotated[float, Field(ge=0.25, le=4)] = 1.0
    media_type: _Word = ""
    playable: bool = False


class MovedInspection(Part):
    """What is known of the inspection itself; older exports lack fields that have a default."""

    id: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]
    """Id where it was exported."""
    name: Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=LINE)]
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    header: Header
    labels: Labels = Field(default_factory=list)
    rig: dict[str, Any]
    source: MovedSource
    video: _Video
    tracked_with: Annotated[str, StringConstraints(max_length=64, pattern=LINE)] | None = None
    """Program that tracked the film."""
    revision: Annotated[int, Field(ge=0, le=2**30)]
    warning: _Sentence | None = None
    error: _Sentence | None = None
    error_code: Annotated[str, StringConstraints(pattern=r"^[a-z0-9_]{1,50}$")] | None = None
    created_at: _Instant
    finished_at: _Instant | None = None


class MovedEvent(Part):
    """An event of the inspection where it was exported."""

    at: _Instant
    who: _Who
    action: Annotated[str, StringConstraints(pattern=r"^[a-z_]{1,20}$")]
    observation_id: _ObservationId | None = None
    before: dict[str, Any] | None = None
    after: dict[str, Any] | None = None
    remark: _Sentence | None = None


class MovedTag(Part):
    """An observation as it was stated."""

    id: _ObservationId
    seq: Annotated[int, Field(ge=1, le=2**30)]
    fields: StatedTag
    photo_sha256: _Sha256 | None = None
    """Digest of its photo."""
    photo: _PhotoPath | None = None
    """Path of its photo among the files that came along, if it is there."""
    created_by: _Who
    created_at: _Instant
    edited_by: _Who | None = None
    edited_at: _Instant | None = None

    @property
    def stated(self) -> StatedTag:
        """The fields in the form in which they are stored."""
        return StatedTag.kept(self.fields.model_dump(exclude_none=True))


class MovedAttachment(Part):
    """A photo, a drawing or a voice note of an observation."""

    id: _ObservationId
    observation_id: _ObservationId
    kind: Kind
    rank: Annotated[int, Field(ge=-1000, le=1000)]
    frame: Frame
    strokes: Strokes
    media_type: Literal["audio/webm", "audio/ogg", "audio/mp4"] | None
    duration_s: Annotated[float, Field(ge=0, le=LONGEST_VOICE_S)] | None
    size: Annotated[int, Field(ge=0, le=MOST_VOICE_BYTES)] | None
    sha256: _Sha256 | None
    file: MediaPath | None
    """Its path among the files that came along, if it is there."""
    created_by: _Who
    created_at: _Instant

    @model_validator(mode="after")
    def _is_a_voice_or_a_picture(self) -> Self:
        is_voice = self.kind == "voice"
        if is_voice != (self.media_type is not None):
            raise ValueError("a voice note has a media type, and nothing else has one")
        if self.file is not None and is_voice != self.file.startswith(VOICE):
            raise ValueError(f"a {self.kind} cannot be the file {self.file}")
        return self


class MovedRemark(Part):
    """What a reviewer said about an observation."""

    id: _ObservationId
    observation_id: _ObservationId
    kind: RemarkKind
    text: _Sentence
    version: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{1,16}$")]
    made_by: _Who
    made_at: _Instant
    settled_by: _Who | None = None
    settled_at: _Instant | None = None


_Mm = Annotated[float, Field(ge=-1e8, le=1e8)]
_Sigma = Annotated[float, Field(ge=0, le=1e8)]


class MovedSize(Part):
    """A raw length with its standard uncertainty."""

    mm: _Sigma
    sigma_mm: _Sigma


class MovedFinding(Part):
    """A proposal on the wall, in raw coordinates, with what was decided about it."""

    id: _ObservationId
    kind: FindingKind
    outline_mm: Annotated[
        list[Annotated[list[_Mm], Field(min_length=2, max_length=2)]],
        Field(min_length=1, max_length=1000),
    ]
    length: MovedSize | None
    width: MovedSize | None
    direction: Direction | None
    score: Annotated[float, Field(ge=0, le=1)]
    code: FindingCode | None
    detector: PackName
    version: Annotated[str, StringConstraints(max_length=20, pattern=LINE)]
    frame: Frame | None
    pixel: Pixel | None
    found_at: _Instant
    state: FindingState
    decided_by: _Who | None = None
    decided_at: _Instant | None = None
    observation_id: _ObservationId | None = None

    def finding(self, inspection_id: str) -> Finding:
        """Return it as that of an inspection."""
        values = {name: getattr(self, name) for name in type(self).model_fields}
        sizes = {
            name: None if size is None else Size(size.mm, size.sigma_mm)
            for name, size in (("length", self.length), ("width", self.width))
        }
        return Finding(
            **values
            | sizes
            | {
                "inspection_id": inspection_id,
                "outline_mm": tuple((x, y) for x, y in self.outline_mm),
                "code": self.code and self.code.model_dump(exclude_none=True),
                "pixel": None if self.pixel is None else (self.pixel[0], self.pixel[1]),
            }
        )


class MovedReview(Part):
    """How far the review was."""

    state: ReviewState = DRAFT
    by: _Who | None = None
    at: _Instant | None = None


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

    about: MovedInspection
    rig: Rig
    stated: Stated
    track: Track
    """The raw track; row i is frame i."""
    health: Sequence[Health]
    sightings: tuple[Sighting, ...]
    tilt: MountTilt | None
    initial_pose: InitialPose
    tags: tuple[MovedTag, ...]
    """Tags in the order of their numbers."""
    events: tuple[MovedEvent, ...]
    """Events, the oldest first."""
    attachments: tuple[MovedAttachment, ...]
    remarks: tuple[MovedRemark, ...]
    review: MovedReview
    findings: tuple[MovedFinding, ...] = ()
    report_template: Mapping[str, Any] | None = None
    """How its reports looked; None in an older file."""
    code_pack: str | None = None
    """Name of the table of codes, if a person had added it."""
    files: Mapping[str, MovedFile] = field(default_factory=dict)
    """The files that came along, by their paths in the archive file (`archive_manifest`)."""
