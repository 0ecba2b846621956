"""Observations of an inspection, and their photos."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from starlette.responses import StreamingResponse

from app import errors
from app.inspections.observations import Observations
from app.survey.observations.tag import Tag
from app.tracking.pictures.clips import Clips
from app.tracking.pictures.photos import Photos
from app.web.deps import InspectionId, ObservationId, PrincipalDep, Service, operator, viewer
from app.web.ranges import PRIVATE, blob_response
from app.web.schemas.failures import READING_A_FILM, content, failures
from app.web.schemas.inspection.observations import ObservationOut, ObservationsOut
from app.web.slow import slow
from app.web.versions import Replaced, tag_with

router = APIRouter(prefix="/api/inspections/{inspection_id}/observations", tags=["observations"])


@router.get("")
@viewer
def list_all(inspection_id: InspectionId, observations: Service[Observations]) -> ObservationsOut:
    """Return the observations that are not deleted, in the order of their numbers."""
    views = observations.all(inspection_id)
    return ObservationsOut(
        observations=[ObservationOut.of(view) for view in views],
        next_stretch=observations.next_stretch(inspection_id),
    )


@router.put(
    "/{observation_id}",
    responses=failures(
        errors.InspectionLocked,
        errors.FrameOutsideVideo,
        errors.PixelOutsidePicture,
        errors.ChangedMeanwhile,
    ),
)
@operator
def put(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    body: Tag,
    observations: Service[Observations],
    photos: Service[Photos],
    principal: PrincipalDep,
    replaced: Replaced,
    response: Response,
) -> ObservationOut:
    """Create or replace the observation; the answer comes when it is synced. May be repeated."""
    observations.put(inspection_id, observation_id, body, principal.name, replaced=replaced)
    photos.wait_for(inspection_id, observation_id)
    return _tagged(observations, inspection_id, observation_id, response)


@router.get("/{observation_id}", responses=failures(errors.ObservationNotFound))
@viewer
def get(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    observations: Service[Observations],
    response: Response,
) -> ObservationOut:
    """Return the observation."""
    return _tagged(observations, inspection_id, observation_id, response)


@router.delete(
    "/{observation_id}",
    status_code=204,
    responses=failures(
        errors.ObservationNotFound, errors.InspectionLocked, errors.ChangedMeanwhile
    ),
)
@operator
def delete(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    observations: Service[Observations],
    principal: PrincipalDep,
    replaced: Replaced,
) -> None:
    """Delete the observation; `restore` undoes it. May be repeated."""
    observations.delete(inspection_id, observation_id, principal.name, replaced=replaced)


@router.post(
    "/{observation_id}/restore",
    responses=failures(errors.ObservationNotFound, errors.InspectionLocked),
)
@operator
def restore(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    observations: Service[Observations],
    principal: PrincipalDep,
    response: Response,
) -> ObservationOut:
    """Undo a deletion."""
    observations.restore(inspection_id, observation_id, principal.name)
    return _tagged(observations, inspection_id, observation_id, response)


def _tagged(
    observations: Observations, inspection_id: str, observation_id: str, response: Response
) -> ObservationOut:
    view = observations.get(inspection_id, observation_id)
    tag_with(response, view.row.version)
    return ObservationOut.of(view)


@router.get(
    "/{observation_id}/photo",
    response_class=Response,
    responses=content("image/jpeg") | failures(errors.ObservationNotFound, errors.PhotoNotFound),
)
@viewer
def photo(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    observations: Service[Observations],
    photos: Service[Photos],
) -> Response:
    """Return the photo: the original picture of the observation's frame."""
    view = observations.get(inspection_id, observation_id)
    return Response(photos.jpeg(view.row), media_type="image/jpeg", headers=PRIVATE)


@router.get(
    "/{observation_id}/clip",
    response_class=StreamingResponse,
    responses=content("video/mp4")
    | failures(
        errors.ObservationNotFound,
        *READING_A_FILM,
    ),
)
@viewer
@slow
def clip(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    clips: Service[Clips],
    request: Request,
) -> Response:
    """Return the seconds of film around the observation as MP4, also in ranges."""
    found = clips.clip(inspection_id, observation_id)
    return blob_response(request.headers, found, "video/mp4", PRIVATE)
