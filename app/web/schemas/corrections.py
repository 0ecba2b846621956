"""What is stated about distances, what comes out, and how sure it is."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from app.survey.corrected import Corrected, reason_of, result_of
from app.survey.given import Remark
from app.survey.makeup import Makeup, PartName
from app.survey.stated import StatedIn
from app.web.schemas.failures import ErrorOut


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
    version: str
    """Of what was stated: the `If-Match` of a change, in quotation marks."""

    @classmethod
    def of(cls, corrected: Corrected) -> CorrectionsOut:
        """From the service's result."""
        error, refusal = corrected.error, corrected.refusal
        return cls(
            stated=corrected.stated.to_json(),
            result=result_of(corrected),
            error=ErrorOut(**error) if error else None,
            reason=reason_of(refusal) if refusal else None,
            version=corrected.version,
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
