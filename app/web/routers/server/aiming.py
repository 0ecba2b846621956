"""The first picture of an upload, what a rig makes of it, and the counter."""

from __future__ import annotations

from fastapi import APIRouter, Response

from app import errors
from app.inspections.films.aiming import Aiming
from app.inspections.films.lenses import Lenses
from app.web.deps import Service, operator
from app.web.schemas.aiming import AimIn, AimOut, FirstPictureOut
from app.web.schemas.failures import content, failures
from app.web.schemas.inspection.counter import CounterFoundOut
from app.web.schemas.rig_view import AdviceOut, BoardIn, CalibratedOut, RigIn, RulingOut
from app.web.slow import slow
from vo_core.errors import InvalidRig, UnreadableVideo

router = APIRouter(prefix="/api", tags=["uploads"])

_FAILURES = failures(
    errors.UploadNotFound,
    errors.UploadIncomplete,
    errors.UploadBusy,
    UnreadableVideo,
    errors.MediaFailed,
    errors.MediaTimeout,
)


@router.get(
    "/uploads/{upload_id}/picture",
    response_class=Response,
    responses=content("image/jpeg") | _FAILURES,
)
@operator
@slow
def picture(upload_id: str, aiming: Service[Aiming]) -> Response:
    """Return the first picture of a complete upload."""
    return Response(aiming.first_picture(upload_id).jpeg, media_type="image/jpeg")


@router.get("/uploads/{upload_id}/axis", responses=_FAILURES)
@operator
@slow
def axis(upload_id: str, aiming: Service[Aiming]) -> FirstPictureOut:
    """Find the axis of the pipe in the first picture of a complete upload."""
    return FirstPictureOut.of(aiming.first_picture(upload_id))


@router.get("/uploads/{upload_id}/counter", responses=_FAILURES)
@operator
@slow
def counter(upload_id: str, aiming: Service[Aiming]) -> CounterFoundOut:
    """Find the burnt-in distance counter of a complete upload; it takes some seconds."""
    return CounterFoundOut.of(aiming.counter(upload_id))


@router.post("/aim", responses=failures(InvalidRig, errors.PixelOutsidePicture))
@operator
def aim(body: AimIn, aiming: Service[Aiming]) -> AimOut:
    """Aim a rig's camera by the pixel of the pipe's axis; nothing is stored."""
    u, v = body.axis
    return AimOut.of(aiming.aim(body.rig, (u, v)))


@router.post("/rig/ruling", responses=failures(InvalidRig))
@operator
def ruling(body: RigIn, aiming: Service[Aiming]) -> RulingOut:
    """Rule the wall in the picture of a rig's camera; nothing is stored."""
    return RulingOut.of(aiming.ruling(body.rig))


@router.post("/rig/advice", responses=failures(InvalidRig))
@operator
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
@slow
def lens(upload_id: str, body: BoardIn, lenses: Service[Lenses]) -> CalibratedOut:
    """Measure the camera by a complete upload that is the film of a board; takes up to a minute."""
    return CalibratedOut.model_validate(lenses.calibrate(upload_id, body.filmed()))
