"""Findings on the unrolled wall: what a detector proposes, and what people decide."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Request, Response

from app import errors
from app.inspections.corrections import Corrections
from app.inspections.findings.findings import Findings
from app.inspections.findings.pictures import FindingPictures
from app.inspections.findings.search import FindingSearch
from app.tracking.pictures.photos import Photos
from app.web.deps import OBSERVATION_ID, InspectionId, PrincipalDep, Service, operator, viewer
from app.web.ranges import PRIVATE
from app.web.schemas.failures import content, failures
from app.web.schemas.inspection.findings import (
    AcceptIn,
    FindingOut,
    FindingSearchIn,
    FindingSearchOut,
    FindingsOut,
    findings_json,
)
from app.web.schemas.inspection.observations import ObservationOut
from app.web.slow import slow
from app.web.versions import etag

router = APIRouter(prefix="/api/inspections/{inspection_id}/findings", tags=["findings"])

FindingId = Annotated[str, Path(pattern=OBSERVATION_ID)]


@router.get("", response_model=FindingsOut)
@viewer
@slow
def list_all(
    inspection_id: InspectionId,
    findings: Service[Findings],
    search: Service[FindingSearch],
    corrections: Service[Corrections],
) -> Response:
    """Return all findings along the pipe, decided or not, and how far their search is."""
    status = _searched(inspection_id, search, corrections)
    found = findings_json(findings.all(inspection_id), status)
    return Response(found, media_type="application/json")


@router.post("/search", responses=failures(errors.InspectionLocked, errors.DetectorNotFound))
@operator
def begin_search(
    inspection_id: InspectionId,
    body: FindingSearchIn,
    search: Service[FindingSearch],
    corrections: Service[Corrections],
) -> FindingSearchOut:
    """Search the wall soon; while it is tracked, what is complete of it. What was decided stays."""
    search.ask(inspection_id, body.detector)
    return _searched(inspection_id, search, corrections)


@router.delete("/search", responses=failures(errors.InspectionLocked, errors.NotRunning))
@operator
def cancel_search(
    inspection_id: InspectionId,
    search: Service[FindingSearch],
    corrections: Service[Corrections],
    principal: PrincipalDep,
) -> FindingSearchOut:
    """Stop the search; what was found before stays."""
    search.cancel(inspection_id, principal.name)
    return _searched(inspection_id, search, corrections)


@router.post(
    "/{finding_id}/accept",
    responses=failures(
        errors.FindingNotFound,
        errors.FindingDecided,
        errors.InspectionLocked,
        errors.FrameNotFound,
        errors.FrameOutsideVideo,
        errors.PixelOutsidePicture,
        errors.ObservationNotFound,
    ),
)
@operator
def accept(
    inspection_id: InspectionId,
    finding_id: FindingId,
    body: AcceptIn,
    findings: Service[Findings],
    photos: Service[Photos],
    principal: PrincipalDep,
) -> ObservationOut:
    """Make an observation of the finding; the answer comes when it is synced. May be repeated."""
    view = findings.accept(
        inspection_id, finding_id, body.observation_id, body.stated(), principal.name
    )
    photos.wait_for(inspection_id, body.observation_id)
    return ObservationOut.of(view)


@router.post(
    "/{finding_id}/reject",
    responses=failures(errors.FindingNotFound, errors.FindingDecided, errors.InspectionLocked),
)
@operator
def reject(
    inspection_id: InspectionId,
    finding_id: FindingId,
    findings: Service[Findings],
    principal: PrincipalDep,
) -> FindingOut:
    """Reject the finding; it is not offered again. May be repeated."""
    return FindingOut.of(findings.reject(inspection_id, finding_id, principal.name))


@router.post(
    "/{finding_id}/reopen",
    responses=failures(errors.FindingNotFound, errors.InspectionLocked),
)
@operator
def reopen(
    inspection_id: InspectionId,
    finding_id: FindingId,
    findings: Service[Findings],
    principal: PrincipalDep,
) -> FindingOut:
    """Undo the decision; the observation of an accepted finding is deleted. May be repeated."""
    return FindingOut.of(findings.reopen(inspection_id, finding_id, principal.name))


@router.get(
    "/{finding_id}/picture.jpg",
    response_class=Response,
    responses=content("image/jpeg")
    | {304: {"description": "The picture is still the one that `If-None-Match` names."}}
    | failures(
        errors.FindingNotFound, errors.TileNotFound, errors.MediaFailed, errors.MediaTimeout
    ),
)
@viewer
@slow
def picture(
    inspection_id: InspectionId,
    finding_id: FindingId,
    pictures: Service[FindingPictures],
    request: Request,
) -> Response:
    """Return the unrolled wall around the finding, with its outline; columns run with the
    distance.
    """
    found = pictures.of(inspection_id, finding_id)
    headers = PRIVATE | {"ETag": etag(found.version)}
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return Response(found.jpeg(), media_type="image/jpeg", headers=headers)


def _searched(
    inspection_id: str, search: FindingSearch, corrections: Corrections
) -> FindingSearchOut:
    status = search.status(inspection_id)
    raw_mm = status.searched_to_mm
    end_mm = None if raw_mm is None else corrections.chainage_mm(inspection_id, raw_mm)
    return FindingSearchOut.of(status, end_mm)
