"""What has changed since an earlier survey, and its wall as a ruler."""

from __future__ import annotations

from fastapi import APIRouter

from app import errors
from app.inspections.compared.changes import Changes, Comparison
from app.inspections.compared.defects import Coded, compared_defects
from app.inspections.compared.ruler import WallRuler
from app.inspections.corrections import Corrections
from app.inspections.inspections import Inspections
from app.inspections.observations import Observations
from app.survey.observations.review import DRAFT
from app.web.deps import InspectionId, PrincipalDep, Service, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.inspection.changes import (
    ChangesOut,
    ComparedDefectOut,
    DifferenceOut,
    MapGapOut,
    RulerIn,
    RulerOut,
)
from app.web.schemas.inspection.corrections import CorrectionsOut
from vo_core.errors import InvalidCorrection

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["changes"])


@router.get("/changes/{earlier_id}")
@viewer
def changes(
    inspection_id: InspectionId,
    earlier_id: InspectionId,
    changes: Service[Changes],
    corrections: Service[Corrections],
    inspections: Service[Inspections],
    observations: Service[Observations],
) -> ChangesOut:
    """Return how far the comparison of two walls is, and what it shows."""
    comparison = changes.get(inspection_id, earlier_id)
    found = comparison.map
    aligned = None if found is None else changes.in_metres(inspection_id, earlier_id, found)

    def coded(each: str) -> Coded:
        row, views = inspections.row(each), observations.all(each)
        end = corrections.end(row)
        is_looked_at = bool(views) or row.review_state != DRAFT
        return Coded(
            views,
            str(row.header.get("direction") or ""),
            end[0] / 1000 if end and is_looked_at else None,
        )

    def metres(raw_mm: float) -> float:
        return round(corrections.chainage_mm(inspection_id, raw_mm) / 1000, 4)

    differences = None
    if found is not None:
        differences = changes.differences(inspection_id, earlier_id, found)
    defects = compared_defects(coded(inspection_id), coded(earlier_id), aligned)
    return ChangesOut.of(
        comparison,
        aligned,
        [
            MapGapOut(from_m=metres(gap.from_mm), to_m=metres(gap.to_mm), reason=gap.reason)
            for gap in (found.gaps if found is not None else ())
        ],
        [ComparedDefectOut.read_from(one) for one in defects],
        None if differences is None else [DifferenceOut.read_from(one) for one in differences],
    )


@router.post(
    "/changes/{earlier_id}",
    status_code=202,
    responses=failures(errors.InvalidRequest, errors.StillRunning),
)
@operator
def start(
    inspection_id: InspectionId, earlier_id: InspectionId, changes: Service[Changes]
) -> ChangesOut:
    """Have the walls of two inspections compared; GET says how far it is."""
    return _without_map(changes.ask(inspection_id, earlier_id))


@router.delete("/changes/{earlier_id}", status_code=204, responses=failures(errors.NotRunning))
@operator
def cancel(
    inspection_id: InspectionId, earlier_id: InspectionId, changes: Service[Changes]
) -> None:
    """Give up a comparison that waits or is being made."""
    changes.cancel(inspection_id, earlier_id)


@router.get("/ruler")
@viewer
def ruler(inspection_id: InspectionId, ruler: Service[WallRuler]) -> RulerOut:
    """Return what the newest earlier survey of the asset says about distances.

    Its `state` is that of the comparison with that survey, which is started like any other.
    """
    return RulerOut.of(ruler.offer(inspection_id))


@router.post(
    "/ruler",
    responses=failures(errors.InspectionLocked, InvalidCorrection, errors.NothingToMeasureBy),
)
@operator
def accept(
    inspection_id: InspectionId,
    body: RulerIn,
    ruler: Service[WallRuler],
    principal: PrincipalDep,
) -> CorrectionsOut:
    """State what is offered as corrections, with the person and the reason."""
    corrected = ruler.accept(
        inspection_id, body.earlier_id, body.version, body.remark, principal.name
    )
    return CorrectionsOut.of(corrected)


def _without_map(comparison: Comparison) -> ChangesOut:
    return ChangesOut.of(comparison, None, [], [], None)
