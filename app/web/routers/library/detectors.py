"""Models of users that find defects on the wall: upload, list, delete."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response

from app import errors
from app.inspections.findings.detectors import Detectors
from app.web.deps import PrincipalDep, Service, of_projects, viewer
from app.web.schemas.failures import failures
from app.web.schemas.library.detectors import DetectorIn, DetectorOut, DetectorsOut
from app.web.slow import slow

router = APIRouter(prefix="/api/detectors", tags=["catalogue"])


@router.get("")
@viewer
@of_projects
def list_all(detectors: Service[Detectors]) -> DetectorsOut:
    """Return the models, sorted by name; `classical` is always there beside them."""
    return DetectorsOut(detectors=[DetectorOut.of(view) for view in detectors.all()])


@router.post(
    "",
    status_code=201,
    responses=failures(
        errors.UploadNotFound,
        errors.UploadIncomplete,
        errors.UploadBusy,
        errors.InvalidDetector,
        errors.DetectorNameTaken,
    ),
)
@slow
def add(
    body: DetectorIn, detectors: Service[Detectors], principal: PrincipalDep, response: Response
) -> DetectorOut:
    """Check a model by its declaration, in a process with limits, and keep it."""
    view = detectors.add(body.upload_id, body.declaration, principal.name)
    response.headers["Location"] = f"/api/detectors/{view.row.id}"
    return DetectorOut.of(view)


@router.delete("/{detector_id}", status_code=204, responses=failures(errors.DetectorNotFound))
def delete(
    detector_id: Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")], detectors: Service[Detectors]
) -> None:
    """Delete a model; what it has found stays."""
    detectors.delete(detector_id)
