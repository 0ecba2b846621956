"""What people state about distances: as it is stored, as requests send it, and as it is used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from app.survey.given import Coordinate, Frame, Given, Metres, Remark
from vo_core.scale.evidence import TAPE_SIGMA_MM

_OF_JSON = Field(strict=False)
"""Of a tuple, which JSON has as a list."""


class Zero(Given):
    """The frame in which the camera is `offset_m` past the zero point."""

    frame: Frame
    offset_m: Annotated[
        float,
        Field(
            ge=-10_000,
            le=10_000,
            description="Distance from the zero to the camera in this frame, positive ahead.",
        ),
    ] = 0.0


class Length(Given):
    """A known length between the camera positions of two frames."""

    first_frame: Frame
    last_frame: Frame
    length_m: Metres
    sigma_mm: Annotated[
        float,
        Field(gt=0, le=100_000, description="One sigma: a tape 5, a drawing 50 or more."),
    ] = TAPE_SIGMA_MM
    kind: Annotated[
        Literal["tape", "known"],
        Field(description="known: length of the whole asset, which gives the closure."),
    ] = "tape"


class Mark(Given):
    """A joint that a person clicked."""

    frame: Frame
    pixel: Annotated[tuple[Coordinate, Coordinate], _OF_JSON]


class LeftOut(Given):
    """The frame of sightings that are not joints."""

    frame: Frame


class Joints(Given):
    """Whether joints count, and which do not."""

    use: Annotated[
        bool | None,
        Field(
            description="null: they count automatically where they can be counted with certainty."
        ),
    ] = None
    marked: Annotated[tuple[Mark, ...], Field(max_length=1000), _OF_JSON] = ()
    left_out: Annotated[tuple[LeftOut, ...], Field(max_length=10_000), _OF_JSON] = ()


class Typed(Given):
    """The distance of the camera in a frame, as a person says where the film does not."""

    frame: Frame
    distance_m: Annotated[
        float, Field(ge=-10_000, le=10_000, description="From the zero to the camera.")
    ]


class RigSigma(Given):
    """Tolerances of the rig, one sigma."""

    height_mm: Annotated[float, Field(gt=0, le=1000)]
    focal_px: Annotated[float, Field(ge=0, le=1000)] = 0.0


class Stated(Given):
    """Everything stated about the distances of an inspection."""

    zero: Zero | None = None
    lengths: Annotated[tuple[Length, ...], Field(max_length=100), _OF_JSON] = ()
    joints: Joints = Joints()
    rig_sigma: RigSigma | None = None
    typed: Annotated[
        tuple[Typed, ...],
        Field(
            max_length=10_000,
            description="They carry the distance; between two of them it follows the camera where "
            "it measures, and time where it does not.",
        ),
        _OF_JSON,
    ] = ()
    forced: Annotated[
        Remark | None,
        Field(description="Why a known length holds although the track contradicts it."),
    ] = None

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Stated:
        """Convert from JSON as stored; a missing field is not stated."""
        return cls.model_validate(fields)

    def to_json(self) -> dict[str, Any]:
        """Convert to JSON as stored and sent."""
        return self.model_dump(mode="json")

    def within(self, rows: int) -> Stated:
        """Return what can be used while the track has only `rows` rows."""
        joints, zero = self.joints, self.zero
        return self.model_copy(
            update={
                "zero": zero if zero and zero.frame < rows else None,
                "typed": tuple(typed for typed in self.typed if typed.frame < rows),
                "lengths": tuple(
                    length
                    for length in self.lengths
                    if max(length.first_frame, length.last_frame) < rows
                ),
                "joints": joints.model_copy(
                    update={"marked": tuple(m for m in joints.marked if m.frame < rows)}
                ),
            }
        )

    def unadjusted(self) -> Stated:
        """Return only what cannot contradict the track."""
        return Stated(
            zero=self.zero,
            rig_sigma=self.rig_sigma,
            typed=self.typed,
            joints=Joints(use=False),
        )
