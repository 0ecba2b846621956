"""What has changed since an earlier survey, and what its wall says about distances."""

from __future__ import annotations

from pydantic import BaseModel, Field

from app.inspections.compared.changes import Comparison, Failure, State
from app.inspections.compared.differences import Mark
from app.inspections.compared.ruler import Offer
from app.survey.assets.aligned import AlignedSurveys
from app.survey.assets.asset_history import Change
from app.survey.distances.stated import Length, Zero
from app.survey.given import Given, Remark
from app.web.schemas.out import Hundredths, Out, Thousandths, metres
from vo_core.alignment.wall_map import Direction, Reason


class MapPointOut(BaseModel):
    """A place of the wall that was recognised in both surveys."""

    distance_m: float
    earlier_distance_m: float
    sigma_mm: Hundredths
    roll_deg: Hundredths | None
    """Angle around the pipe that is added to the later wall (with `opposite` to its negative) to
    get the earlier one, in the direction of the arc; null on a floor."""
    axial_mm: Hundredths
    """Raw coordinate on the tiles of the later wall; `earlier_axial_mm` on those of the earlier
    one."""
    earlier_axial_mm: Hundredths
    arc_mm: Hundredths
    """`roll_deg` in mm of arc."""
    stretch: int
    """The map holds between neighbours of one stretch, and not between stretches."""


class MapGapOut(BaseModel):
    """A part of the later survey for which the map does not hold."""

    from_m: float
    to_m: float
    reason: Reason


class ComparedDefectOut(Out):
    """A defect of one or both surveys."""

    observation: str | None
    earlier_observation: str | None
    change: Change
    offset_m: Thousandths | None
    """Distance in the later survey minus where the earlier one has the place."""
    offset_u95_m: Thousandths | None


class DifferenceOut(Out):
    """A finding that is new or has grown since the earlier survey, or is gone: ids of findings."""

    mark: Mark
    finding: str | None
    earlier_finding: str | None


class ChangesOut(BaseModel):
    """How far a comparison is, and what it shows."""

    state: State
    share: Hundredths | None
    """Share of the work that is done, while it is working."""
    code: Failure | None
    """Why it failed; `detail` says it in English."""
    detail: str | None
    direction: Direction | None
    map: list[MapPointOut]
    gaps: list[MapGapOut]
    matched: list[ComparedDefectOut]
    differences: list[DifferenceOut] | None
    """Null unless the same detector has searched both walls."""

    @classmethod
    def of(
        cls,
        comparison: Comparison,
        aligned: AlignedSurveys | None,
        gaps: list[MapGapOut],
        defects: list[ComparedDefectOut],
        differences: list[DifferenceOut] | None,
    ) -> ChangesOut:
        """Convert the service's results."""
        found = comparison.map
        points = []
        if found is not None and aligned is not None:
            for number, (nodes, ties) in enumerate(
                zip(found.stretches, aligned.stretches, strict=True)
            ):
                points += [
                    MapPointOut(
                        distance_m=round(tie.distance_m, 4),
                        earlier_distance_m=round(tie.earlier_m, 4),
                        sigma_mm=node.sigma_mm,
                        roll_deg=found.girth_mm and 360 * node.arc_mm / found.girth_mm,
                        axial_mm=node.axial_mm,
                        earlier_axial_mm=node.earlier_mm,
                        arc_mm=node.arc_mm,
                        stretch=number,
                    )
                    for node, tie in zip(nodes, ties, strict=True)
                ]
        return cls(
            state=comparison.state,
            share=comparison.share,
            code=comparison.code,
            detail=comparison.detail,
            direction=found.direction if points and found is not None else None,
            map=points,
            gaps=gaps,
            matched=defects,
            differences=differences,
        )


class KnownFrameOut(BaseModel):
    """A frame that was recognised on the earlier wall."""

    frame: int
    earlier_m: float | None
    u95_m: float
    distance_m: float | None
    """As this inspection has it now."""


class RulerOut(BaseModel):
    """What the wall of the newest earlier survey of the asset says about distances."""

    earlier_id: str | None
    state: State
    code: Failure | None
    detail: str | None
    version: str | None
    """To be sent when it is accepted."""
    direction: Direction | None
    known: list[KnownFrameOut]
    zero: Zero | None
    """Null if the surveys count from different ends and neither header states the length."""
    lengths: list[Length]

    @classmethod
    def of(cls, offer: Offer) -> RulerOut:
        """Convert the service's offer."""
        comparison = offer.comparison
        return cls(
            earlier_id=offer.earlier_id,
            state=comparison.state,
            code=comparison.code,
            detail=comparison.detail,
            version=comparison.version,
            direction=comparison.map.direction if comparison.map and offer.known else None,
            known=[
                KnownFrameOut(
                    frame=each.frame,
                    earlier_m=metres(1000 * each.earlier_m),
                    u95_m=each.u95_m,
                    distance_m=metres(1000 * each.distance_m),
                )
                for each in offer.known
            ],
            zero=offer.zero,
            lengths=list(offer.lengths),
        )


class RulerIn(Given):
    """Accepts an offer."""

    earlier_id: str = Field(pattern=r"^[0-9a-f]{32}$")
    version: str = Field(max_length=64, description="Of the offer that the person saw.")
    remark: Remark
