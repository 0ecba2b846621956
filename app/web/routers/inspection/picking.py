"""Finds the frame that shows a place on the wall, and sizes between places."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from app import errors
from app.inspections.observations import Observations
from app.inspections.picking import Picking, WallPlace
from app.survey.places.measure import Measure
from app.web.deps import InspectionId, Service, viewer
from app.web.schemas.failures import failures
from app.web.schemas.inspection.observations import FrameAtOut, MeasuredOut

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["observations"])


@router.get("/frame-at", responses=failures(errors.IncompleteWallPoint))
@viewer
def frame_at(
    inspection_id: InspectionId,
    picking: Service[Picking],
    distance_m: Annotated[float, Query(ge=-1e5, le=1e5, allow_inf_nan=False)],
    clock: Annotated[float | None, Query(ge=0, le=12, description="Clock, in a pipe.")] = None,
    y_mm: Annotated[
        float | None,
        Query(ge=-1e5, le=1e5, description="Distance to the right of the axis, on a floor."),
    ] = None,
    near_frame: Annotated[
        int | None, Query(ge=0, le=2**31, description="Chooses among several passes.")
    ] = None,
) -> FrameAtOut:
    """Return the frame and pixel that show a place best, null if no frame shows it; `distance_m` is
    its chainage.
    """
    place = WallPlace(1000 * distance_m, clock, y_mm)
    seen = picking.frame_at(inspection_id, place, near_frame)
    if seen is None:
        return FrameAtOut(frame=None, pixel=None)
    return FrameAtOut(frame=seen.frame, pixel=list(seen.pixel))


@router.post(
    "/measure",
    responses=failures(errors.FrameNotFound, errors.FrameOutsideVideo, errors.PixelOutsidePicture),
)
@viewer
def measure(
    inspection_id: InspectionId, body: Measure, observations: Service[Observations]
) -> MeasuredOut:
    """Return the size of a measure on the wall, with its interval; nothing is stored."""
    return MeasuredOut.of(observations.measured(inspection_id, body))
