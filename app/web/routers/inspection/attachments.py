"""Attachments of observations: further photos, drawings on a copy of one, voice notes."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Header, Query, Request, Response
from starlette.responses import StreamingResponse

from app import errors
from app.inspections.attachments import Attachments
from app.reports.content.words import Language
from app.reports.report import Units
from app.reports.reports import Reports
from app.survey.observations.attachments import LONGEST_VOICE_S, VOICE_SUFFIXES, Picture
from app.tracking.pictures.photos import Photos
from app.web.deps import (
    AttachmentId,
    InspectionId,
    ObservationId,
    PrincipalDep,
    Service,
    operator,
    viewer,
)
from app.web.ranges import PRIVATE, blob_response
from app.web.schemas.failures import content, failures
from app.web.schemas.inspection.attachments import AttachmentOut, AttachmentsOut
from app.web.slow import heavy

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["attachments"])

_ONE = "/observations/{observation_id}/attachments/{attachment_id}"


@router.get("/attachments")
@viewer
def list_all(inspection_id: InspectionId, attachments: Service[Attachments]) -> AttachmentsOut:
    """Return the attachments that are not deleted, those of deleted observations too."""
    found = attachments.all(inspection_id)
    return AttachmentsOut(attachments=[AttachmentOut.of(one) for one in found])


@router.put(
    _ONE,
    responses=failures(
        errors.InspectionLocked,
        errors.ObservationNotFound,
        errors.FrameNotFound,
        errors.FrameOutsideVideo,
        errors.TooManyAttachments,
    ),
)
@operator
def put(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    attachment_id: AttachmentId,
    body: Picture,
    attachments: Service[Attachments],
    photos: Service[Photos],
    principal: PrincipalDep,
) -> AttachmentOut:
    """Add a photo or a drawing, or change its place and strokes; synced. May be repeated."""
    attachments.put_picture(inspection_id, observation_id, attachment_id, body, principal.name)
    photos.wait_for_attached(inspection_id, attachment_id)
    return _out(attachments, inspection_id, observation_id, attachment_id)


@router.put(
    f"{_ONE}/voice",
    responses=failures(
        errors.InspectionLocked,
        errors.ObservationNotFound,
        errors.WrongContentType,
        errors.TooManyAttachments,
    ),
)
@operator
def put_voice(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    attachment_id: AttachmentId,
    duration_s: Annotated[float, Query(gt=0, le=LONGEST_VOICE_S)],
    content_type: Annotated[str, Header()],
    sound: Annotated[
        bytes,
        Body(
            media_type="application/octet-stream",
            description=f"The recording: {', '.join(VOICE_SUFFIXES)}, at most 1 MiB.",
        ),
    ],
    attachments: Service[Attachments],
    principal: PrincipalDep,
) -> AttachmentOut:
    """Add a voice note; the answer comes when it is synced. May be repeated."""
    attachments.put_voice(
        inspection_id,
        observation_id,
        attachment_id,
        sound,
        content_type,
        duration_s,
        principal.name,
    )
    return _out(attachments, inspection_id, observation_id, attachment_id)


@router.delete(
    _ONE,
    status_code=204,
    responses=failures(errors.InspectionLocked, errors.AttachmentNotFound),
)
@operator
def delete(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    attachment_id: AttachmentId,
    attachments: Service[Attachments],
    principal: PrincipalDep,
) -> None:
    """Delete the attachment; `restore` undoes it. May be repeated."""
    attachments.delete(inspection_id, observation_id, attachment_id, principal.name)


@router.post(
    f"{_ONE}/restore",
    responses=failures(errors.InspectionLocked, errors.AttachmentNotFound),
)
@operator
def restore(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    attachment_id: AttachmentId,
    attachments: Service[Attachments],
    principal: PrincipalDep,
) -> AttachmentOut:
    """Undo a deletion."""
    attachments.restore(inspection_id, observation_id, attachment_id, principal.name)
    return _out(attachments, inspection_id, observation_id, attachment_id)


@router.get(
    f"{_ONE}/voice",
    response_class=StreamingResponse,
    responses=content(*VOICE_SUFFIXES) | failures(errors.AttachmentNotFound),
)
@viewer
def voice(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    attachment_id: AttachmentId,
    attachments: Service[Attachments],
    request: Request,
) -> Response:
    """Return the voice note, also in ranges."""
    note = attachments.get(inspection_id, observation_id, attachment_id)
    sound = attachments.voice(note)
    return blob_response(request.headers, sound, note.media_type or "", PRIVATE)


@router.get(
    f"{_ONE}/photo",
    response_class=Response,
    responses=content("image/jpeg") | failures(errors.AttachmentNotFound, errors.PhotoNotFound),
)
@viewer
def photo(
    inspection_id: InspectionId,
    observation_id: ObservationId,
    attachment_id: AttachmentId,
    attachments: Service[Attachments],
    photos: Service[Photos],
) -> Response:
    """Return the photo as it was taken; the strokes of a drawing are beside it, not in it."""
    found = attachments.get(inspection_id, observation_id, attachment_id)
    return Response(photos.jpeg(found), media_type="image/jpeg", headers=PRIVATE)


@router.get(
    "/photos/{photo_of}",
    response_class=Response,
    responses=content("image/jpeg") | failures(errors.PhotoNotFound),
)
@viewer
@heavy
def shown_photo(
    inspection_id: InspectionId,
    photo_of: AttachmentId,
    reports: Service[Reports],
    lang: Language = "en",
    units: Units = "m",
    burnt_in: bool = False,
) -> Response:
    """Return the photo of an observation or an attachment as reports show it, to be kept.

    A drawing is in it; `burnt_in` adds distance and code below the picture.
    """
    name, jpeg = reports.photo(
        inspection_id, photo_of, language=lang, units=units, burnt_in=burnt_in
    )
    headers = PRIVATE | {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(jpeg, media_type="image/jpeg", headers=headers)


def _out(
    attachments: Attachments, inspection_id: str, observation_id: str, attachment_id: str
) -> AttachmentOut:
    return AttachmentOut.of(attachments.get(inspection_id, observation_id, attachment_id))
