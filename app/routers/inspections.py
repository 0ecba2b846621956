"""Inspections: make, list, change, stop, run again, delete; their track and what a pixel shows."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from app.deps import InspectionId, PrincipalDep, ServicesDep
from app.errors import LiveSourceNotAvailable
from app.schemas import (
    InspectionChange,
    InspectionIn,
    InspectionOut,
    InspectionsOut,
    LiveSource,
    WallGridOut,
    WallPointOut,
)

router = APIRouter(prefix="/api/inspections", tags=["inspections"])


@router.post("", status_code=201)
def create(
    body: InspectionIn, response: Response, services: ServicesDep, principal: PrincipalDep
) -> InspectionOut:
    """Make an inspection of a complete upload; tracking starts when its turn comes."""
    if isinstance(body.source, LiveSource):
        raise LiveSourceNotAvailable(
            "Live sources are not built yet; record the video and upload it."
        )
    inspection_id = services.inspections.create_from_upload(
        body.name, body.source.upload_id, body.rig, body.header, principal.name
    )
    response.headers["Location"] = f"/api/inspections/{inspection_id}"
    return InspectionOut.of(services.inspections.get(inspection_id))


@router.get("")
def list_all(services: ServicesDep) -> InspectionsOut:
    """All, the newest first."""
    return InspectionsOut(
        inspections=[InspectionOut.of(view) for view in services.inspections.all()]
    )


@router.get("/{inspection_id}")
def get(inspection_id: InspectionId, services: ServicesDep) -> InspectionOut:
    """One."""
    return InspectionOut.of(services.inspections.get(inspection_id))


@router.patch("/{inspection_id}")
def change(
    inspection_id: InspectionId,
    body: InspectionChange,
    services: ServicesDep,
    principal: PrincipalDep,
) -> InspectionOut:
    """Give another name or another header."""
    view = services.inspections.change(inspection_id, principal.name, body.name, body.header)
    return InspectionOut.of(view)


@router.delete("/{inspection_id}", status_code=204)
def delete(inspection_id: InspectionId, services: ServicesDep, principal: PrincipalDep) -> None:
    """Stop it and remove it with all its files."""
    services.inspections.delete(inspection_id, principal.name)


@router.post("/{inspection_id}/cancel")
def cancel(inspection_id: InspectionId, services: ServicesDep) -> InspectionOut:
    """Stop tracking; the track is kept as far as it is."""
    services.tracking.cancel(inspection_id)
    return InspectionOut.of(services.inspections.get(inspection_id))


@router.post("/{inspection_id}/retry")
def retry(inspection_id: InspectionId, services: ServicesDep) -> InspectionOut:
    """Track again from the first frame."""
    services.tracking.retry(inspection_id)
    return InspectionOut.of(services.inspections.get(inspection_id))


@router.get("/{inspection_id}/track", response_class=Response)
def track(
    inspection_id: InspectionId,
    services: ServicesDep,
    format: Literal["csv", "tum", "json"] = "csv",  # noqa: A002  (the contract's name)
    since: Annotated[int, Query(ge=0, description="Only rows from this frame on.")] = 0,
) -> Response:
    """The track, as far as it is."""
    content, media_type = services.inspections.track_as(inspection_id, format, since)
    return Response(content, media_type=media_type)


@router.get("/{inspection_id}/wall")
def wall(
    inspection_id: InspectionId,
    services: ServicesDep,
    u: Annotated[float, Query(allow_inf_nan=False)],
    v: Annotated[float, Query(allow_inf_nan=False)],
    frame: Annotated[int, Query(ge=0)],
) -> WallPointOut:
    """The wall point under a pixel of a frame."""
    return WallPointOut.of(services.observations.wall_at(inspection_id, frame, (u, v)))


@router.get("/{inspection_id}/wallgrid")
def wall_grid(inspection_id: InspectionId, services: ServicesDep) -> WallGridOut:
    """Wall points of a grid of pixels at pose 0, for the read-out under the cursor."""
    return WallGridOut.of(services.observations.wall_grid(inspection_id))
