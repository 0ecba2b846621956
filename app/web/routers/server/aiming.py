"""Pictures of a film, what a rig makes of them, and the counter."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from app import errors
from app.inspections.diagnosis import Diagnosis
from app.inspections.films.aiming import Aiming, Film
from app.inspections.films.glances import Glances
from app.inspections.films.lenses import Lenses
from app.web.deps import InspectionId, Service, of_projects, operator, viewer
from app.web.ranges import PRIVATE
from app.web.schemas.aiming import AimIn, AimOut, AxisOut, DiagnosisOut, GlanceIn
from app.web.schemas.failures import READING_A_FILM, content, failures
from app.web.schemas.inspection.counter import CounterFoundOut
from app.web.schemas.rig_view import AdviceOut, BoardIn, CalibratedOut, RigIn, RulingOut
from app.web.slow import slow
from vo_core.errors import InvalidRig, NoWallInView, UnreadableVideo

router = APIRouter(prefix="/api", tags=["uploads"])

_FAILURES = failures(
    errors.UploadNotFound,
    errors.UploadIncomplete,
    errors.UploadBusy,
    UnreadableVideo,
    errors.MediaFailed,
    errors.MediaTimeout,
)

TimeS = Annotated[float | None, Query(ge=0, le=1e6, description="Presentation time of the frame.")]


@router.get(
    "/uploads/{upload_id}/picture",
    response_class=Response,
    responses=content("image/jpeg") | _FAILURES,
)
@operator
@of_projects
@slow
def picture(upload_id: str, aiming: Service[Aiming], time_s: TimeS = None) -> Response:
    """Return a picture of a complete upload, by default its first one."""
    return Response(aiming.picture(Film("upload", upload_id), time_s), media_type="image/jpeg")


@router.get("/uploads/{upload_id}/axis", responses=_FAILURES)
@operator
@of_projects
@slow
def axis(upload_id: str, aiming: Service[Aiming], time_s: TimeS = None) -> AxisOut:
    """Find the axis of the pipe in a complete upload, by default where it shows best."""
    return AxisOut.of(aiming.axis(Film("upload", upload_id), time_s))


@router.get(
    "/inspections/{inspection_id}/picture",
    response_class=Response,
    responses=content("image/jpeg") | failures(*READING_A_FILM),
)
@viewer
@slow
def film_picture(
    inspection_id: InspectionId, aiming: Service[Aiming], time_s: TimeS = None
) -> Response:
    """Return a picture of the film, tracked or not; by default its first one."""
    film = Film("inspection", inspection_id)
    return Response(aiming.picture(film, time_s), media_type="image/jpeg", headers=PRIVATE)


@router.get("/inspections/{inspection_id}/diagnosis")
@viewer
@slow
def diagnosed(inspection_id: InspectionId, diagnosis: Service[Diagnosis]) -> DiagnosisOut:
    """Say why its distances are of no use, and what repairs that; it may look at the film."""
    return DiagnosisOut.of(diagnosis.of(inspection_id))


@router.get("/inspections/{inspection_id}/axis", responses=failures(*READING_A_FILM))
@viewer
@slow
def film_axis(
    inspection_id: InspectionId, aiming: Service[Aiming], time_s: TimeS = None
) -> AxisOut:
    """Find the axis of the pipe in the film, by default where it shows best."""
    return AxisOut.of(aiming.axis(Film("inspection", inspection_id), time_s))


@router.get("/uploads/{upload_id}/counter", responses=_FAILURES)
@operator
@of_projects
@slow
def counter(upload_id: str, aiming: Service[Aiming]) -> CounterFoundOut:
    """Find the burnt-in distance counter of a complete upload; it takes some seconds."""
    return CounterFoundOut.of(aiming.counter(upload_id))


@router.post(
    "/sources/picture",
    response_class=Response,
    responses=content("image/jpeg")
    | failures(errors.LiveSourceRefused, errors.CameraUnreachable, errors.Busy),
)
@operator
@of_projects
@slow
def glance(body: GlanceIn, glances: Service[Glances]) -> Response:
    """Return a picture of a camera, to be looked at before it is recorded; nothing is stored."""
    jpeg = glances.picture(body.url, (body.width, body.height))
    return Response(jpeg, media_type="image/jpeg", headers=PRIVATE)


@router.post("/aim", responses=failures(InvalidRig, errors.PixelOutsidePicture))
@operator
@of_projects
def aim(body: AimIn, aiming: Service[Aiming]) -> AimOut:
    """Aim a rig's camera by the pixel of the pipe's axis; nothing is stored."""
    axis_uv = None if body.axis is None else (body.axis[0], body.axis[1])
    return AimOut.of(aiming.aim(body.rig, axis_uv))


@router.post("/rig/ruling", responses=failures(InvalidRig, NoWallInView))
@operator
@of_projects
def ruling(body: RigIn, aiming: Service[Aiming]) -> RulingOut:
    """Rule the wall in the picture of a rig's camera; nothing is stored."""
    return RulingOut.of(aiming.ruling(body.rig))


@router.post("/rig/advice", responses=failures(InvalidRig, NoWallInView))
@operator
@of_projects
@slow
def advice(body: RigIn, aiming: Service[Aiming]) -> AdviceOut:
    """Judge a rig before any drive, as `chainage advise` does; nothing is stored."""
    return AdviceOut.of(aiming.advice(body.rig))


@router.post(
    "/uploads/{upload_id}/lens",
    responses=failures(
        errors.UploadNotFound,
        errors.UploadIncomplete,
        errors.UploadBusy,
        errors.InvalidCalibration,
        errors.MediaFailed,
        errors.MediaTimeout,
        errors.Busy,
    ),
)
@operator
@of_projects
@slow
def lens(upload_id: str, body: BoardIn, lenses: Service[Lenses]) -> CalibratedOut:
    """Measure the camera by a complete upload that is the film of a board; takes up to a minute."""
    return CalibratedOut.model_validate(lenses.calibrate(upload_id, body.filmed()))
