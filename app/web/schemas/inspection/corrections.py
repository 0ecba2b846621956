"""Statements about distances, their result, and its uncertainty."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Field

from app.survey.distances.corrected import Corrected, reason_of, result_of
from app.survey.distances.stated import Stated
from app.survey.distances.uncertainty_budget import PartName
from app.survey.given import Remark
from app.web.schemas.failures import ErrorOut
from app.web.schemas.out import Out


class CorrectionsIn(Stated):
    """Statements to be stored."""

    remark: Remark | None = None

    def stated(self) -> Stated:
        """Return them without the remark."""
        return Stated(**{name: getattr(self, name) for name in Stated.model_fields})


class CorrectionsOut(BaseModel):
    """What was stated, the result, and what is wrong with it."""

    stated: dict[str, Any]
    result: dict[str, Any] | None
    error: ErrorOut | None
    reason: dict[str, Any] | None
    """Code and params of the error, where they exist."""
    version: str
    """Version of the statements: the `If-Match` of a change, in quotation marks."""

    @classmethod
    def of(cls, corrected: Corrected) -> CorrectionsOut:
        """Convert the service's result."""
        error, refusal = corrected.error, corrected.refusal
        return cls(
            stated=corrected.stated.to_json(),
            result=result_of(corrected),
            error=ErrorOut(**error) if error else None,
            reason=reason_of(refusal) if refusal else None,
            version=corrected.version,
        )


class PartOut(Out):
    """One source of an interval; they add up in quadrature."""

    name: PartName
    u95_m: float = Field(validation_alias="half_width_m")


class TapedOut(Out):
    """The effect of one more taped length."""

    length_m: float
    u95_m: float = Field(validation_alias="half_width_m")


class UncertaintyBudgetOut(Out):
    """The sources of the interval of a frame, the largest first."""

    frame: int
    distance_m: float
    distance_u95_m: float = Field(validation_alias="half_width_m")
    parts: list[PartOut]
    taped: TapedOut | None
    """None if a tape would not help much."""


class IntervalOut(BaseModel):
    """The interval of a frame; null where it is unknown."""

    interval: UncertaintyBudgetOut | None
