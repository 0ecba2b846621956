"""The schema of the report in JSON: fields, types and bounds, strictly checked."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

from app.imports.archive_manifest import VOICE
from app.imports.whole_inspection import (
    ImportedAttachment,
    ImportedRemark,
    ImportedReview,
    ImportedTag,
)
from app.survey.attachments import LONGEST_VOICE_S, MOST_VOICE_BYTES, Strokes
from app.survey.given import LINE, TEXT, Frame, Header, PackName
from app.survey.labels import Labels
from app.survey.review import DRAFT
from app.survey.stated import JointsIn, StatedIn
from app.survey.tag import StatedTag
from vo_core import Track

_MOST_ROWS = 400_000
"""Most rows of a track: 3.7 hours at 30 Hz, some 64 MB of JSON."""
_MOST_TAGS = 20_000
_MOST_EVENTS = 100_000
"""Most events: 2000 defects that are each changed 50 times."""
_MOST_SIGHTINGS = 200_000


class _Part(BaseModel):
    """Strict base; fields that a later writer of this version adds are ignored."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False, frozen=True)


_Who = Annotated[str, StringConstraints(max_length=100, pattern=LINE)]
_Sentence = Annotated[str, StringConstraints(max_length=4000, pattern=TEXT)]
_INSTANT = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:.]{5,15}(?:Z|[+-][0-9]{2}:?[0-9]{2})")


def _instant(value: object) -> datetime:
    """Parse ISO 8601 with a time zone, as the export writes it."""
    if not isinstance(value, str) or not _INSTANT.fullmatch(value):
        raise ValueError("must be an instant such as 2026-09-14T09:42:00Z")
    return datetime.fromisoformat(value)


_Instant = Annotated[datetime, BeforeValidator(_instant)]
_Id = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]
_ObservationId = Annotated[
    str,
    StringConstraints(pattern=r"^[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}$"),
]


_PhotoPath = Annotated[str, StringConstraints(pattern=r"^photos/[A-Za-z0-9_.-]{1,150}$")]
"""Path of a picture that comes along, which `app.imports.moved_media` decodes."""
_VoicePath = Annotated[str, StringConstraints(pattern=r"^voice/[A-Za-z0-9_.-]{1,150}$")]
_Path = _PhotoPath | _VoicePath


class _Source(_Part):
    kind: Literal["upload", "live", "import"]
    filename: Annotated[str, StringConstraints(max_length=255, pattern=LINE)]
    size: Annotated[int, Field(ge=0, le=2**53 - 1)]
    sha256: Annotated[str, StringConstraints(pattern=r"^([0-9a-f]{64})?$")]


class _Video(_Part):
    """Fields in the order of the probe."""

    width: Annotated[int, Field(ge=1, le=8192)]
    height: Annotated[int, Field(ge=1, le=8192)]
    codec: Annotated[str, StringConstraints(max_length=100, pattern=LINE)] = ""
    container: Annotated[str, StringConstraints(max_length=100, pattern=LINE)] = ""
    pixel_format: Annotated[str, StringConstraints(max_length=100, pattern=LINE)] | None = None
    frames: Annotated[int, Field(ge=0, le=2**31 - 1)] | None = None
    duration_s: Annotated[float, Field(ge=0, le=1e8)] | None = None
    rate_hz: Annotated[float, Field(ge=0, le=1e6)] | None = None
    pixel_aspect: Annotated[float, Field(ge=0.25, le=4)] = 1.0
    media_type: Annotated[str, StringConstraints(max_length=100, pattern=LINE)] = ""
    playable: bool = False


class _Inspection(_Part):
    id: _Id
    name: Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=LINE)]
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    header: Header
    labels: Labels = Field(default_factory=list)
    """Older exports have none."""
    rig: dict[str, Any]
    source: _Source
    video: _Video
    revision: Annotated[int, Field(ge=0, le=2**30)]
    tracked_with: Annotated[str, StringConstraints(max_length=64, pattern=LINE)] | None = None
    """Older exports do not say."""
    warning: _Sentence | None = None
    error: _Sentence | None = None
    error_code: Annotated[str, StringConstraints(pattern=r"^[a-z0-9_]{1,50}$")] | None = None
    created_at: _Instant
    finished_at: _Instant | None = None


class _Joints(JointsIn):
    use: bool | None = False
    """Files without this field are older than joints that count without a person."""


class _Stated(StatedIn):
    joints: _Joints = Field(default_factory=_Joints)


class _Corrections(_Part):
    stated: _Stated


class _Event(_Part):
    at: _Instant
    who: _Who
    action: Annotated[str, StringConstraints(pattern=r"^[a-z_]{1,20}$")]
    observation_id: _ObservationId | None = None
    before: dict[str, Any] | None = None
    after: dict[str, Any] | None = None
    remark: _Sentence | None = None


class _Tag(_Part):
    id: _ObservationId
    seq: Annotated[int, Field(ge=1, le=2**30)]
    fields: StatedTag
    photo_sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")] | None = None
    """Older exports have none."""
    created_by: _Who
    created_at: _Instant
    edited_by: _Who | None = None
    edited_at: _Instant | None = None
    photo: _PhotoPath | None = None

    def to_imported(self) -> ImportedTag:
        """Return the tag with its fields as they are stored."""
        return ImportedTag(
            id=self.id,
            seq=self.seq,
            fields=self.fields.model_dump(exclude_none=True),
            photo_sha256=self.photo_sha256,
            created_by=self.created_by,
            created_at=self.created_at,
            edited_by=self.edited_by,
            edited_at=self.edited_at,
            photo=self.photo,
        )


class _Attachment(_Part):
    id: _ObservationId
    observation_id: _ObservationId
    kind: Literal["photo", "drawing", "voice"]
    rank: Annotated[int, Field(ge=-1000, le=1000)]
    frame: Frame
    strokes: Strokes
    media_type: Literal["audio/webm", "audio/ogg", "audio/mp4"] | None
    duration_s: Annotated[float, Field(ge=0, le=LONGEST_VOICE_S)] | None
    size: Annotated[int, Field(ge=0, le=MOST_VOICE_BYTES)] | None
    sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")] | None
    file: _Path | None
    created_by: _Who
    created_at: _Instant

    @model_validator(mode="after")
    def _is_a_voice_or_a_picture(self) -> _Attachment:
        is_voice = self.kind == "voice"
        if is_voice != (self.media_type is not None):
            raise ValueError("a voice note has a media type, and nothing else has one")
        if self.file is not None and is_voice != self.file.startswith(VOICE):
            raise ValueError(f"a {self.kind} cannot be the file {self.file}")
        return self

    def to_imported(self) -> ImportedAttachment:
        """Return the attachment with its strokes as they are stored."""
        values = {name: getattr(self, name) for name in type(self).model_fields}
        strokes = tuple(stroke.model_dump(exclude_none=True) for stroke in self.strokes)
        return ImportedAttachment(**values | {"strokes": strokes})


class _Remark(_Part):
    id: _ObservationId
    observation_id: _ObservationId
    kind: Literal["accepted", "question", "comment"]
    text: _Sentence
    version: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{1,16}$")]
    made_by: _Who
    made_at: _Instant
    settled_by: _Who | None = None
    settled_at: _Instant | None = None

    def to_imported(self) -> ImportedRemark:
        """Return the remark."""
        return ImportedRemark(**self.model_dump())


class _Review(_Part):
    state: Literal["draft", "submitted", "in_review", "approved", "reopened"] = DRAFT
    by: _Who | None = None
    at: _Instant | None = None

    def to_imported(self) -> ImportedReview:
        """Return the state."""
        return ImportedReview(self.state, self.by, self.at)


_Number = Annotated[float, Field(ge=-1e9, le=1e9)]
_Share = Annotated[float, Field(ge=0, le=1)]
_Rows = Field(max_length=_MOST_ROWS)


_NEWER = ("z_mm", "pitch_deg", "roll_deg", "looking_around")


class _TrackColumns(_Part):
    frame: Annotated[list[Frame], _Rows]
    time_s: Annotated[list[Annotated[float, Field(ge=0, le=1e9)]], _Rows]
    x_mm: Annotated[list[_Number], _Rows]
    y_mm: Annotated[list[_Number], _Rows]
    yaw_deg: Annotated[list[_Number], _Rows]
    distance_mm: Annotated[list[_Number], _Rows]
    sigma_distance_mm: Annotated[list[Annotated[float, Field(ge=0, le=1e9)]], _Rows]
    quality: Annotated[list[_Share], _Rows]
    status: Annotated[list[Literal["ok", "weak", "lost"]], _Rows]
    sigma_registration_mm: Annotated[list[Annotated[float, Field(ge=0, le=1e9)]], _Rows]
    z_mm: Annotated[list[_Number], _Rows]
    pitch_deg: Annotated[list[_Number], _Rows]
    roll_deg: Annotated[list[_Number], _Rows]
    looking_around: Annotated[list[_Share], _Rows]

    @model_validator(mode="before")
    @classmethod
    def _with_newer_columns(cls, columns: Any) -> Any:
        """Add columns that an older export lacks: it has the sigma of the registration alone, and
        neither height nor tilt nor gaze.
        """
        if not isinstance(columns, dict):
            return columns
        sigma_mm = columns.get("sigma_distance_mm")
        zeros = [0.0] * len(sigma_mm) if isinstance(sigma_mm, list) else []
        older = {"sigma_registration_mm": sigma_mm} | dict.fromkeys(_NEWER, zeros)
        return older | columns

    @model_validator(mode="after")
    def _rows_are_frames(self) -> _TrackColumns:
        _require_same_length(self)
        if any(frame != row for row, frame in enumerate(self.frame)):
            raise ValueError("the frames must be 0, 1, 2, ... without a gap")
        if any(
            later < earlier for earlier, later in zip(self.time_s, self.time_s[1:], strict=False)
        ):
            raise ValueError("time_s must not fall")
        return self

    def to_track(self) -> Track:
        """Return the rows as arrays."""
        dtypes = {"frame": np.int64, "status": np.str_}
        return Track(
            **{
                name: np.array(getattr(self, name), dtypes.get(name, np.float64))
                for name in type(self).model_fields
            }
        )


class _HealthColumns(_Part):
    overlap: Annotated[list[_Share], _Rows]
    brightness: Annotated[list[_Share], _Rows]
    overexposed: Annotated[list[_Share], _Rows]
    sharpness: Annotated[list[_Share], _Rows]
    fixed_pattern: Annotated[list[_Share], _Rows]

    @model_validator(mode="after")
    def _columns_fit(self) -> _HealthColumns:
        _require_same_length(self)
        return self

    def in_order(self) -> Sequence[Sequence[float]]:
        """Return the rows in the order of the fields of `Health`."""
        return [getattr(self, name) for name in type(self).model_fields]


class _TrackPart(_Part):
    columns: _TrackColumns


class _HealthPart(_Part):
    columns: _HealthColumns


class _Sighting(_Part):
    frame: Frame
    ahead_mm: Annotated[float, Field(ge=-1e6, le=1e6)]
    sigma_mm: Annotated[float, Field(gt=0, le=1e6)]
    contrast: Annotated[float, Field(ge=-1e6, le=1e6)]


class _MountTilt(_Part):
    pitch_deg: Annotated[float, Field(ge=-180, le=180)]
    roll_deg: Annotated[float, Field(ge=-180, le=180)]
    pitch_sigma_deg: Annotated[float, Field(ge=0, le=180)]
    roll_sigma_deg: Annotated[float, Field(ge=0, le=180)]


class _Stance(_Part):
    y_mm: _Number
    yaw_deg: Annotated[float, Field(ge=-180, le=180)]
    z_mm: _Number
    pitch_deg: Annotated[float, Field(ge=-180, le=180)]
    roll_deg: Annotated[float, Field(ge=-180, le=180)]


class File(_Part):
    """The whole file."""

    inspection: _Inspection
    corrections: _Corrections
    events: Annotated[list[_Event], Field(max_length=_MOST_EVENTS)]
    tags: Annotated[list[_Tag], Field(max_length=_MOST_TAGS)]
    track: _TrackPart
    health: _HealthPart
    sightings: Annotated[list[_Sighting], Field(max_length=_MOST_SIGHTINGS)]
    mount_tilt: _MountTilt | None = None
    """Older exports have none, and nothing of what follows either."""
    stance: _Stance | None = None
    attachments: Annotated[list[_Attachment], Field(max_length=_MOST_TAGS)] = Field(
        default_factory=list
    )
    remarks: Annotated[list[_Remark], Field(max_length=_MOST_EVENTS)] = Field(default_factory=list)
    review: _Review = Field(default_factory=_Review)
    code_pack: PackName | None = None
    report_template: dict[str, Any] | None = None
    """How its reports look, which `app.reports.template` checks."""
    media: dict[_Path, str] = Field(default_factory=dict)
    """Photos and voice notes in base64."""

    @model_validator(mode="after")
    def _rows_are_distinct(self) -> File:
        for kind, rows, names in (
            ("tags", self.tags, ("id", "seq")),
            ("attachments", self.attachments, ("id",)),
            ("remarks", self.remarks, ("id",)),
        ):
            for name in names:
                found = [getattr(row, name) for row in rows]
                if len(set(found)) != len(found):
                    raise ValueError(f"two {kind} have the same {name}")
        return self

    @model_validator(mode="after")
    def _rows_belong_to_tags(self) -> File:
        known = {tag.id for tag in self.tags}
        belonging = {row.observation_id for row in self.attachments}
        belonging |= {row.observation_id for row in self.remarks}
        if lost := sorted(belonging - known):
            raise ValueError(f"there is no tag {lost[0]}")
        return self


def _require_same_length(columns: BaseModel) -> None:
    lengths = {name: len(getattr(columns, name)) for name in type(columns).model_fields}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise ValueError(f"the columns must have the same number of rows (found {found})")
