"""Observations of an inspection, and their photos."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.responses import FileResponse

from app.errors import (
    FrameOutsideVideo,
    InspectionNotFound,
    ObservationNotFound,
    PhotoNotFound,
    PixelOutsidePicture,
)
from app.survey.tag import Tag
from app.web.deps import InspectionId, ObservationId, PrincipalDep, ServicesDep, operator, viewer
from app.web.schemas.failures import content, failures
from app.web.schemas.observations import ObservationOut, ObservationsOut

router = APIRouter(prefix="/api/inspections/{inspection_id}/observations", tags=["observations"])


@router.get("", responses=failures(InspectionNotFound))
@viewer
def list_all(inspection_id: InspectionId, services: ServicesDep) -> ObservationsOut:
    """All that are not deleted, in the order of their numbers."""
    views = services.observations.all(inspection_id)
    return ObservationsOut(
        observations=[ObservationOut.of(view) for view in views],
        next_stretch=services.observations.next_stretch(inspection_id),
    )


@router.put(
    "/{observation_id}",
    responses=failures(InspectionNotFound, FrameOutsideVideo, PixelOutsidePicture),
)
@operator
def put(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    body: Tag,
    services: ServicesDep,
    principal: PrincipalDep,
) -> ObservationOut:
    """Create or replace; answered when it is committed and synced. May be repeated."""
    services.observations.put(inspection_id, observation_id, body, principal.name)
    services.photos.wait_for(inspection_id, observation_id)
    return ObservationOut.of(services.observations.get(inspection_id, observation_id))


@router.get("/{observation_id}", responses=failures(InspectionNotFound, ObservationNotFound))
@viewer
def get(
    inspection_id: InspectionId, observation_id: ObservationId, services: ServicesDep
) -> ObservationOut:
    """One."""
    return ObservationOut.of(services.observations.get(inspection_id, observation_id))


@router.delete(
    "/{observation_id}",
    status_code=204,
    responses=failures(InspectionNotFound, ObservationNotFound),
)
@operator
def delete(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    services: ServicesDep,
    principal: PrincipalDep,
) -> None:
    """Take it out of the list; `restore` undoes it."""
    services.observations.delete(inspection_id, observation_id, principal.name)


@router.post(
    "/{observation_id}/restore", responses=failures(InspectionNotFound, ObservationNotFound)
)
@operator
def restore(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    services: ServicesDep,
    principal: PrincipalDep,
) -> ObservationOut:
    """Undo a delete."""
    services.observations.restore(inspection_id, observation_id, principal.name)
    return ObservationOut.of(services.observations.get(inspection_id, observation_id))


@router.get(
    "/{observation_id}/photo",
    response_class=FileResponse,
    responses=content("image/jpeg")
    | failures(InspectionNotFound, ObservationNotFound, PhotoNotFound),
)
@viewer
def photo(
    inspection_id: InspectionId, observation_id: ObservationId, services: ServicesDep
) -> FileResponse:
    """The original picture of its frame."""
    view = services.observations.get(inspection_id, observation_id)
    return FileResponse(
        services.photos.path(view.row),
        media_type="image/jpeg",
        headers={"Cache-Control": "private, no-cache", "Content-Security-Policy": "sandbox"},
    )
