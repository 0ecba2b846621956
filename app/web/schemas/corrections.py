"""Statements about distances, their result, and its uncertainty."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from app.survey.corrected import Corrected, reason_of, result_of
from app.survey.given import Remark
from app.survey.stated import StatedIn
from app.survey.uncertainty_budget import PartName, UncertaintyBudget
from app.web.schemas.failures import ErrorOut


class CorrectionsIn(StatedIn):
    """Statements to be stored."""

    remark: Remark | None = None


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


class PartOut(BaseModel):
    """One source of an interval; they add up in quadrature."""

    name: PartName
    u95_m: float


class TapedOut(BaseModel):
    """The effect of one more taped length."""

    length_m: float
    u95_m: float


class UncertaintyBudgetOut(BaseModel):
    """The sources of the interval of a frame, the largest first."""

    frame: int
    distance_m: float
    distance_u95_m: float
    parts: list[PartOut]
    taped: TapedOut | None
    """None if a tape would not help much."""

    @classmethod
    def of(cls, budget: UncertaintyBudget) -> UncertaintyBudgetOut:
        """Convert the service's result."""
        taped = budget.taped
        return cls(
            frame=budget.frame,
            distance_m=budget.distance_m,
            distance_u95_m=budget.half_width_m,
            parts=[PartOut(name=part.name, u95_m=part.half_width_m) for part in budget.parts],
            taped=TapedOut(length_m=taped.length_m, u95_m=taped.half_width_m) if taped else None,
        )


class IntervalOut(BaseModel):
    """The interval of a frame; null where it is unknown."""

    interval: UncertaintyBudgetOut | None
