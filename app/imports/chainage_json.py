"""Reads the report in JSON: everything from which distances are derived.

`app.reports.exchange.chainage_json` writes it.

Derived values (`observations`, results) are not read but computed anew. Photos and video are not in
the file.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails

from app.errors import InvalidImport
from app.survey.given import LINE, TEXT, Frame, Header
from app.survey.stated import JointsIn, Stated, StatedIn
from app.survey.tag import StatedTag
from vo_core import Rig, Track
from vo_core.errors import InvalidRig, RigVideoMismatch
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.finder import Sighting

FAMILY, VERSION = "chainage-report", 2

_SHOWN_FAULTS = 10
_MOST_ROWS = 400_000
"""Most rows of a track: 3.7 hours at 30 Hz, some 64 MB of JSON."""
_MOST_TAGS = 20_000
_MOST_EVENTS = 100_000
"""Most events: 2000 defects that are each changed 50 times."""
_MOST_SIGHTINGS = 200_000
_MOST_PARTS = 1_000_000
"""Most values and lists in all events together: ten for each."""

_HALF_CHARACTER = re.compile(rb"\\u[dD][89a-fA-F]")
"""An escaped surrogate; most belong to a pair."""

Part = TypeVar("Part", bound=BaseModel)


@dataclass(frozen=True)
class ImportedTag:
    """An observation as it was stated."""

    id: str
    seq: int
    fields: Mapping[str, Any]
    """Fields of the PUT; fields that it left out are missing."""
    photo_sha256: str | None
    """Digest of its photo, which is not in the file."""
    created_by: str
    created_at: datetime
    edited_by: str | None
    edited_at: datetime | None

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
class WholeInspection:
    """An inspection as it was exported."""

    id: str
    """Id where it was exported."""
    name: str
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    header: Mapping[str, Any]
    rig: Rig
    source_kind: Literal["upload", "live", "import"]
    source_filename: str
    source_size: int
    source_sha256: str
    video: Mapping[str, Any]
    """Result of probing the video, which is not here."""
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
    tags: tuple[ImportedTag, ...]
    """Tags in the order of their numbers."""
    events: tuple[Happening, ...]
    """Events, the oldest first."""


def read(content: bytes) -> WholeInspection:
    """Check a file strictly and return its inspection.

    Raises:
        InvalidImport: The file is not JSON or not of this schema or version, or a value is not
        allowed; the text names faults and places.
    """
    values = _parsed(content)
    _require_version(values)
    file = _checked(_File, values)
    inspection = file.inspection
    try:
        rig = Rig.parse(inspection.rig)
        rig.require_picture_size(inspection.video.width, inspection.video.height)
    except (InvalidRig, RigVideoMismatch) as error:
        raise InvalidImport(f"The file cannot be imported: {error}") from error
    track = file.track.columns.to_track()
    health = [Health(*row) for row in zip(*file.health.columns.in_order(), strict=True)]
    _require(_beyond_the_track(file, len(track)) + _outside_the_picture(file, rig))
    _require_few_parts(file.events)
    return WholeInspection(
        id=inspection.id,
        name=inspection.name,
        status=inspection.status,
        header=inspection.header,
        rig=rig,
        source_kind=inspection.source.kind,
        source_filename=inspection.source.filename,
        source_size=inspection.source.size,
        source_sha256=inspection.source.sha256,
        video=inspection.video.model_dump(),
        warning=inspection.warning,
        error=inspection.error,
        error_code=inspection.error_code,
        created_at=inspection.created_at,
        finished_at=inspection.finished_at,
        stated=file.corrections.stated.to_stated(),
        revision=inspection.revision,
        track=track,
        health=tuple(health),
        sightings=tuple(Sighting(**sighting.model_dump()) for sighting in file.sightings),
        tilt=MountTilt(**file.mount_tilt.model_dump()) if file.mount_tilt else None,
        tags=tuple(_tag(tag) for tag in sorted(file.tags, key=lambda tag: tag.seq)),
        events=tuple(Happening(**event.model_dump()) for event in file.events),
    )


def is_chainage_json(content: bytes) -> bool:
    """Return whether the file declares this format, in any version."""
    head = content[:4096].removeprefix(b"\xef\xbb\xbf").lstrip()
    return head.startswith(b"{") and b'"schema"' in head and FAMILY.encode() in head


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
    frames: Annotated[int, Field(ge=0, le=2**31)] | None = None
    duration_s: Annotated[float, Field(ge=0, le=1e8)] | None = None
    rate_hz: Annotated[float, Field(ge=0, le=1e6)] | None = None
    media_type: Annotated[str, StringConstraints(max_length=100, pattern=LINE)] = ""
    playable: bool = False


class _Inspection(_Part):
    id: _Id
    name: Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=LINE)]
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    header: Header
    rig: dict[str, Any]
    source: _Source
    video: _Video
    revision: Annotated[int, Field(ge=0, le=2**31)]
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
    seq: Annotated[int, Field(ge=1, le=2**31)]
    fields: StatedTag
    photo_sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")] | None = None
    """Older exports have none."""
    created_by: _Who
    created_at: _Instant
    edited_by: _Who | None = None
    edited_at: _Instant | None = None


_Number = Annotated[float, Field(ge=-1e9, le=1e9)]
_Share = Annotated[float, Field(ge=0, le=1)]
_Rows = Field(max_length=_MOST_ROWS)


_LEVEL = ("z_mm", "pitch_deg", "roll_deg")


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

    @model_validator(mode="before")
    @classmethod
    def _with_newer_columns(cls, columns: Any) -> Any:
        """Add columns that an older export lacks: it has the sigma of the registration alone, and
        neither height nor tilt.
        """
        if not isinstance(columns, dict):
            return columns
        sigma_mm = columns.get("sigma_distance_mm")
        level = [0.0] * len(sigma_mm) if isinstance(sigma_mm, list) else []
        older = {"sigma_registration_mm": sigma_mm} | dict.fromkeys(_LEVEL, level)
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


class _File(_Part):
    inspection: _Inspection
    corrections: _Corrections
    events: Annotated[list[_Event], Field(max_length=_MOST_EVENTS)]
    tags: Annotated[list[_Tag], Field(max_length=_MOST_TAGS)]
    track: _TrackPart
    health: _HealthPart
    sightings: Annotated[list[_Sighting], Field(max_length=_MOST_SIGHTINGS)]
    mount_tilt: _MountTilt | None = None
    """Older exports have none."""

    @model_validator(mode="after")
    def _tags_are_distinct(self) -> _File:
        for name in ("id", "seq"):
            found = [getattr(tag, name) for tag in self.tags]
            if len(set(found)) != len(found):
                raise ValueError(f"two tags have the same {name}")
        return self


def _require_same_length(columns: BaseModel) -> None:
    lengths = {name: len(getattr(columns, name)) for name in type(columns).model_fields}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise ValueError(f"the columns must have the same number of rows (found {found})")


def _tag(tag: _Tag) -> ImportedTag:
    return ImportedTag(
        id=tag.id,
        seq=tag.seq,
        fields=tag.fields.to_json(),
        photo_sha256=tag.photo_sha256,
        created_by=tag.created_by,
        created_at=tag.created_at,
        edited_by=tag.edited_by,
        edited_at=tag.edited_at,
    )


def _parsed(content: bytes) -> Any:
    """Parse JSON, refusing what other readers would interpret differently.

    Raises:
        InvalidImport: The text is not JSON, repeats a name, or contains NaN or infinity.
    """
    try:
        values = json.loads(
            content.decode("utf-8-sig"),
            parse_constant=_refused_number,
            parse_float=_finite,
            object_pairs_hook=_said_once,
        )
        if _HALF_CHARACTER.search(content):
            json.dumps(values, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        text = error.object[max(error.start - 20, 0) : error.start]
        raise InvalidImport(
            f"The file cannot be imported: a text contains half a character after {text!r}."
        ) from error
    except UnicodeDecodeError as error:
        raise InvalidImport(f"The file is not in UTF-8 (byte {error.start}).") from error
    except json.JSONDecodeError as error:
        raise InvalidImport(
            f"The file is not JSON: {error.msg} in line {error.lineno}, column {error.colno}."
        ) from error
    except (ValueError, RecursionError) as error:
        raise InvalidImport(f"The file cannot be read: {error}.") from error
    return values


def _refused_number(name: str) -> None:
    raise ValueError(f"{name} is no number")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {text[:40]} is too large")
    return value


def _said_once(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        (twice, _), *_ = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"{twice!r:.60} occurs twice in one object")
    return found


def _require_version(values: Any) -> None:
    schema = values.get("schema") if isinstance(values, dict) else None
    found = re.fullmatch(rf"{FAMILY}/([0-9]{{1,9}})", schema) if isinstance(schema, str) else None
    if found is None:
        raise InvalidImport(
            f"The file is no report of Chainage: its schema is not {FAMILY}/{VERSION}."
        )
    version = int(found[1])
    if version < VERSION:
        raise InvalidImport(
            f"The file is of version {version}, which holds no track. Export the inspection again "
            "with this version of Chainage."
        )
    if version > VERSION:
        raise InvalidImport(
            f"The file is of version {version}, and this Chainage reads {VERSION}. Import it with "
            "a newer Chainage."
        )


def _checked(kind: type[Part], values: Any) -> Part:
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        _require([_reason(fault) for fault in error.errors(include_url=False)])
        raise


def _reason(fault: ErrorDetails) -> str:
    # Of a union every branch is reported; its names follow the field's in the path.
    where = ".".join(str(step) for step in fault["loc"]) or "the file"
    found = fault["input"]
    is_short = isinstance(found, str | int | float | bool)
    shown = f" (found {found!r:.60})" if is_short else ""
    return f"{where:.120}: {fault['msg'].removeprefix('Value error, ')}{shown}"


def _require(reasons: Sequence[str]) -> None:
    """Raise InvalidImport if there are any reasons."""
    if not reasons:
        return
    more = len(reasons) - _SHOWN_FAULTS
    shown = [*reasons[:_SHOWN_FAULTS], *([f"and {more} more"] if more > 0 else [])]
    raise InvalidImport(f"The file cannot be imported: {'; '.join(shown)}.")


def _require_few_parts(events: Sequence[_Event]) -> None:
    """Limit the content of events, which has no schema: an empty list of two bytes takes 60 in
    memory.
    """
    parts: list[object] = [it for event in events for it in (event.before, event.after)]
    seen = 0
    while parts:
        part = parts.pop()
        inner = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
        seen += len(inner)
        if seen > _MOST_PARTS:
            raise InvalidImport(
                f"The file cannot be imported: its events contain more than {_MOST_PARTS} things."
            )
        parts.extend(inner)


def _beyond_the_track(file: _File, rows: int) -> list[str]:
    """Report frames of other measurements that lie beyond the track."""
    reasons = [
        f"sightings.{n}.frame: the track has no frame {sighting.frame}"
        for n, sighting in enumerate(file.sightings)
        if sighting.frame >= rows
    ]
    healthy = len(file.health.columns.overlap)
    if healthy > rows:
        reasons.append(f"health.columns: {healthy} rows, but the track has {rows}")
    return reasons


def _outside_the_picture(file: _File, rig: Rig) -> list[str]:
    width, height = rig.camera.width, rig.camera.height
    marks = enumerate(file.corrections.stated.joints.marked)
    pixels = [
        *((f"tags.{n}.fields", tag.fields.pixel) for n, tag in enumerate(file.tags)),
        *((f"corrections.stated.joints.marked.{n}", mark.pixel) for n, mark in marks),
    ]
    return [
        f"{where}.pixel: ({pixel[0]:g}, {pixel[1]:g}) is outside the picture of {width} x {height}"
        for where, pixel in pixels
        if pixel is not None
        and not (-0.5 <= pixel[0] <= width - 0.5 and -0.5 <= pixel[1] <= height - 0.5)
    ]
