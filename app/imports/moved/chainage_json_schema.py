"""The schema of the report in JSON: its parts, with the columns of measurements.

Columns follow from the dataclasses that they become; their bounds from their names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, fields
from itertools import pairwise
from types import GenericAlias
from typing import Annotated, Any, Literal, Self

from pydantic import Field, create_model, field_validator, model_validator

from app.imports.moved.whole_inspection import (
    MediaPath,
    MovedAttachment,
    MovedEvent,
    MovedFinding,
    MovedInspection,
    MovedRemark,
    MovedReview,
    MovedTag,
    Part,
)
from app.survey.distances.stated import Stated
from app.survey.given import Frame, PackName
from vo_core import Track
from vo_core.geometry.initial_pose import InitialPose
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting

_MOST_ROWS = 400_000
"""Most rows of a track: 3.7 hours at 30 Hz, some 64 MB of JSON."""
_MOST_TAGS = 20_000
_MOST_EVENTS = 100_000
"""Most events: 2000 defects that are each changed 50 times."""
_MOST_SIGHTINGS = 200_000
_NEWER = ("z_mm", "pitch_deg", "roll_deg", "looking_around")
_SHARES = {"quality", "looking_around", *(field.name for field in fields(Health))}


def _type_of(name: str) -> Any:
    """Return the type of a measurement, with bounds that its name implies."""
    if name == "frame":
        return Frame
    if name == "status":
        return Literal["ok", "weak", "lost"]
    if name in _SHARES:
        return Annotated[float, Field(ge=0, le=1)]
    is_positive = name == "time_s" or "sigma" in name
    return Annotated[float, Field(ge=0 if is_positive else -1e9, le=1e9)]


def _row_of(kind: type) -> Any:
    types: dict[str, Any] = {
        field.name: (_type_of(field.name), ... if field.default is MISSING else field.default)
        for field in fields(kind)
    }
    return create_model(kind.__name__, __base__=Part, **types)


class _Columns(Part):
    """Columns of equal length."""

    @model_validator(mode="after")
    def _have_the_same_length(self) -> Self:
        lengths = {name: len(getattr(self, name)) for name in type(self).model_fields}
        if len(set(lengths.values())) > 1:
            found = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise ValueError(f"the columns must have the same number of rows (found {found})")
        return self

    def in_order(self) -> Sequence[Sequence[Any]]:
        """Return the columns in the order of the fields that they become."""
        return [getattr(self, name) for name in type(self).model_fields]


class _TrackRules(_Columns):
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
    def _rows_are_frames(self) -> Self:
        frame, time_s, *_ = self.in_order()
        if any(number != row for row, number in enumerate(frame)):
            raise ValueError("the frames must be 0, 1, 2, ... without a gap")
        if any(later < earlier for earlier, later in pairwise(time_s)):
            raise ValueError("time_s must not fall")
        return self


def _list_of(item: Any, most: int) -> Any:
    return GenericAlias(list, (item,)), Field(max_length=most)


def _columns_of(kind: type, base: type[_Columns]) -> Any:
    types: dict[str, Any] = {
        field.name: _list_of(_type_of(field.name), _MOST_ROWS) for field in fields(kind)
    }
    columns = create_model(f"{kind.__name__}Columns", __base__=base, **types)
    return create_model(f"{kind.__name__}Part", __base__=Part, columns=(columns, ...)), ...


class _Corrections(Part):
    stated: Stated

    @field_validator("stated", mode="before")
    @classmethod
    def _with_joints(cls, stated: Any) -> Any:
        """Files that do not say it are older than joints that count without a person."""
        if not isinstance(stated, dict):
            return stated
        joints = stated.get("joints", {})
        return {**stated, "joints": {"use": False} | joints if isinstance(joints, dict) else joints}


class Parts(Part):
    """The parts of a file; older exports lack what has a default."""

    inspection: MovedInspection
    corrections: _Corrections
    events: Annotated[list[MovedEvent], Field(max_length=_MOST_EVENTS)]
    tags: Annotated[list[MovedTag], Field(max_length=_MOST_TAGS)]
    track: Any
    health: Any
    sightings: Any
    mount_tilt: Any = None
    stance: Any = None
    attachments: Annotated[
        list[MovedAttachment], Field(max_length=_MOST_TAGS, default_factory=list)
    ]
    remarks: Annotated[list[MovedRemark], Field(max_length=_MOST_EVENTS, default_factory=list)]
    review: MovedReview = MovedReview()
    findings: Annotated[list[MovedFinding], Field(max_length=_MOST_TAGS, default_factory=list)]
    code_pack: PackName | None = None
    report_template: dict[str, Any] | None = None
    """How its reports look, which `app.reports.template` checks."""
    media: dict[MediaPath, str] = Field(default_factory=dict)
    """Photos and voice notes in base64."""

    @model_validator(mode="after")
    def _rows_are_distinct(self) -> Self:
        for kind in ("tags", "attachments", "remarks", "findings"):
            for name in ("id", "seq") if kind == "tags" else ("id",):
                found = [getattr(row, name) for row in getattr(self, kind)]
                if len(set(found)) != len(found):
                    raise ValueError(f"two {kind} have the same {name}")
        return self

    @model_validator(mode="after")
    def _rows_belong_to_tags(self) -> Self:
        belonging = {row.observation_id for row in self.attachments}
        belonging |= {row.observation_id for row in self.remarks}
        if lost := sorted(belonging - {tag.id for tag in self.tags}):
            raise ValueError(f"there is no tag {lost[0]}")
        return self


_WHOLE: dict[str, Any] = {
    "track": _columns_of(Track, _TrackRules),
    "health": _columns_of(Health, _Columns),
    "sightings": _list_of(_row_of(Sighting), _MOST_SIGHTINGS),
    "mount_tilt": (_row_of(MountTilt) | None, None),
    "stance": (_row_of(InitialPose) | None, None),
}
File = create_model("File", __base__=Parts, **_WHOLE)
"""The whole file."""
