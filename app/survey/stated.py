"""What people state about distances: as it is stored and as requests send it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, cast

import msgspec
from pydantic import Field

from app.survey.given import Frame, Given, Metres, Pixel, Remark
from vo_core.scale.evidence import TAPE_SIGMA_MM


class Zero(msgspec.Struct, frozen=True):
    """The frame in which the camera is `offset_m` past the zero point."""

    frame: int
    offset_m: float


class Length(msgspec.Struct, frozen=True):
    """A length between the camera positions of two frames."""

    first_frame: int
    last_frame: int
    length_m: float
    sigma_mm: float
    kind: Literal["tape", "known"]
    """"known" is the length of the whole asset; its residual is the closure."""


class Mark(msgspec.Struct, frozen=True):
    """A joint that a person clicked."""

    frame: int
    pixel: tuple[float, float]


class LeftOut(msgspec.Struct, frozen=True):
    """The frame of sightings that are not joints."""

    frame: int


class Joints(msgspec.Struct, frozen=True):
    """Whether joints count, and which do not."""

    use: bool | None = None
    """None: nobody decided; joints count where their segments can be counted with certainty."""
    marked: tuple[Mark, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


class RigSigma(msgspec.Struct, frozen=True):
    """Tolerances of the rig, one sigma."""

    height_mm: float
    focal_px: float


class Stated(msgspec.Struct, frozen=True):
    """Everything stated about the distances of an inspection."""

    zero: Zero | None = None
    lengths: tuple[Length, ...] = ()
    joints: Joints = Joints()
    rig_sigma: RigSigma | None = None
    forced: str | None = None
    """Reason why a known length is used although the track contradicts it."""

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Stated:
        """Convert from JSON as stored and sent; a missing field is not stated."""
        return msgspec.convert(fields, cls)

    def to_json(self) -> dict[str, Any]:
        """Convert to JSON as stored and sent."""
        return cast(dict[str, Any], msgspec.json.decode(msgspec.json.encode(self)))

    def within(self, rows: int) -> Stated:
        """Return what can be used while the track has only `rows` rows."""
        return msgspec.structs.replace(
            self,
            zero=self.zero if self.zero and self.zero.frame < rows else None,
            lengths=tuple(
                length
                for length in self.lengths
                if max(length.first_frame, length.last_frame) < rows
            ),
            joints=msgspec.structs.replace(
                self.joints, marked=tuple(m for m in self.joints.marked if m.frame < rows)
            ),
        )

    def unadjusted(self) -> Stated:
        """Return only what cannot contradict the track."""
        return Stated(zero=self.zero, rig_sigma=self.rig_sigma, joints=Joints(use=False))


class ZeroIn(Given):
    """Request to set the zero at a frame."""

    frame: Frame
    offset_m: Annotated[float, Field(ge=-10_000, le=10_000)] = Field(
        0.0, description="Distance from the zero to the camera in this frame, positive ahead."
    )


class LengthIn(Given):
    """Request to state a known length."""

    first_frame: Frame
    last_frame: Frame
    length_m: Metres
    sigma_mm: Annotated[float, Field(gt=0, le=100_000)] = Field(
        TAPE_SIGMA_MM, description="One sigma: a tape 5, a drawing 50 or more."
    )
    kind: Literal["tape", "known"] = Field(
        "tape", description="known: length of the whole asset, which gives the closure."
    )


class MarkIn(Given):
    """Request to mark a joint."""

    frame: Frame
    pixel: Pixel


class LeftOutIn(Given):
    """Request to leave out a ring that is not a joint."""

    frame: Frame


class JointsIn(Given):
    """Request that says which joints count."""

    use: Annotated[
        bool | None,
        Field(
            description="null: they count automatically where they can be counted with certainty."
        ),
    ] = None
    marked: Annotated[list[MarkIn], Field(max_length=1000)] = Field(default_factory=list)
    left_out: Annotated[list[LeftOutIn], Field(max_length=10_000)] = Field(default_factory=list)


class RigSigmaIn(Given):
    """Request to state the tolerances of the rig, one sigma."""

    height_mm: Annotated[float, Field(gt=0, le=1000)]
    focal_px: Annotated[float, Field(ge=0, le=1000)] = 0.0


class StatedIn(Given):
    """Request with everything known about the distances of an inspection."""

    zero: ZeroIn | None = None
    lengths: Annotated[list[LengthIn], Field(max_length=100)] = Field(default_factory=list)
    joints: JointsIn = Field(default_factory=JointsIn)
    rig_sigma: RigSigmaIn | None = None
    forced: Remark | None = Field(
        None, description="Why a known length holds although the track contradicts it."
    )

    def to_stated(self) -> Stated:
        """Convert to the stored form."""
        return Stated.from_json(self.model_dump(include=set(StatedIn.model_fields)))
