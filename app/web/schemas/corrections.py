"""What is stated about distances, what comes out, and how sure it is."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.inspections.corrections import Corrected, reason_of, result_of
from app.survey.adjustment import Stated
from app.survey.makeup import Makeup, PartName
from app.web.schemas.failures import ErrorOut
from app.web.schemas.given import Frame, Given, Metres, Pixel, Remark
from vo_core.scale.correction import TAPE_SIGMA_MM


class ZeroIn(Given):
    """Set zero here."""

    frame: Frame
    offset_m: Annotated[float, Field(ge=-10_000, le=10_000)] = Field(
        0.0, description="From the zero point to the camera in this frame, positive ahead."
    )


class LengthIn(Given):
    """A length that somebody knows."""

    first_frame: Frame
    last_frame: Frame
    length_m: Metres
    sigma_mm: Annotated[float, Field(gt=0, le=100_000)] = Field(
        TAPE_SIGMA_MM, description="One sigma: a tape 5, a drawing 50 or more."
    )
    kind: Literal["tape", "known"] = Field(
        "tape", description="known: of the whole asset, which gives the closure."
    )


class MarkIn(Given):
    """A joint that somebody clicked on."""

    frame: Frame
    pixel: Pixel


class LeftOutIn(Given):
    """A ring that is no joint."""

    frame: Frame


class JointsIn(Given):
    """Which joints count."""

    use: Annotated[
        bool | None,
        Field(description="null: they count by themselves where they can be counted for certain."),
    ] = None
    marked: Annotated[list[MarkIn], Field(max_length=1000)] = Field(default_factory=list)
    left_out: Annotated[list[LeftOutIn], Field(max_length=10_000)] = Field(default_factory=list)


class RigSigmaIn(Given):
    """How well the rig is known, one sigma."""

    height_mm: Annotated[float, Field(gt=0, le=1000)]
    focal_px: Annotated[float, Field(ge=0, le=1000)] = 0.0


class StatedIn(Given):
    """All that is known about the distances of an inspection."""

    zero: ZeroIn | None = None
    lengths: Annotated[list[LengthIn], Field(max_length=100)] = Field(default_factory=list)
    joints: JointsIn = Field(default_factory=JointsIn)
    rig_sigma: RigSigmaIn | None = None
    forced: Remark | None = Field(
        None, description="Why a known length holds although the track contradicts it."
    )

    def to_stated(self) -> Stated:
        """For the service."""
        return Stated.from_json(self.model_dump(include=set(StatedIn.model_fields)))


class CorrectionsIn(StatedIn):
    """The same, to be kept."""

    remark: Remark | None = None


class CorrectionsOut(BaseModel):
    """What was stated, what came out, what is wrong with it."""

    stated: dict[str, Any]
    result: dict[str, Any] | None
    error: ErrorOut | None
    reason: dict[str, Any] | None
    """Code and params of the error, where there is more to say than its sentence."""

    @classmethod
    def of(cls, corrected: Corrected) -> CorrectionsOut:
        """From the service's result."""
        error, refusal = corrected.error, corrected.refusal
        return cls(
            stated=corrected.stated.to_json(),
            result=result_of(corrected),
            error=ErrorOut(**error) if error else None,
            reason=reason_of(refusal) if refusal else None,
        )


class PartOut(BaseModel):
    """One cause of an interval; they add up in quadrature."""

    name: PartName
    u95_m: float


class TapedOut(BaseModel):
    """What one more taped length would make of it."""

    length_m: float
    u95_m: float


class MakeupOut(BaseModel):
    """What the interval of the distance of a frame is made of, the largest part first."""

    frame: int
    distance_m: float
    distance_u95_m: float
    parts: list[PartOut]
    taped: TapedOut | None
    """None if a tape would not help much."""

    @classmethod
    def of(cls, makeup: Makeup) -> MakeupOut:
        """From the service's."""
        taped = makeup.taped
        return cls(
            frame=makeup.frame,
            distance_m=makeup.distance_m,
            distance_u95_m=makeup.half_width_m,
            parts=[PartOut(name=part.name, u95_m=part.half_width_m) for part in makeup.parts],
            taped=TapedOut(length_m=taped.length_m, u95_m=taped.half_width_m) if taped else None,
        )


class IntervalOut(BaseModel):
    """The interval of a frame; null where nobody knows it."""

    interval: MakeupOut | None
