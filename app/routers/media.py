"""The original video, single frames of it, and reports; types are ours, never the upload's."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Path, Response
from starlette.responses import FileResponse

from app.deps import InspectionId, ServicesDep, viewer
from app.errors import (
    ExportNotAvailable,
    FrameNotFound,
    InspectionNotFound,
    MediaFailed,
    MediaTimeout,
    NothingRecorded,
)
from app.schemas import content, failures
from vo_core.errors import UnreadableVideo

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["media"])

_HEADERS = {"Cache-Control": "private, no-cache", "Content-Security-Policy": "sandbox"}


@router.get(
    "/video",
    response_class=FileResponse,
    responses=content("video/*", "application/octet-stream")
    | failures(InspectionNotFound, NothingRecorded),
)
@viewer
def video(inspection_id: InspectionId, services: ServicesDep) -> FileResponse:
    """The original file, also in ranges."""
    inspection = services.inspections.row(inspection_id)
    return FileResponse(
        services.inspections.video_path(inspection),
        media_type=inspection.video["media_type"],
        headers=_HEADERS,
    )


@router.get(
    "/frames/{frame}.jpg",
    response_class=Response,
    responses=content("image/jpeg")
    | failures(
        InspectionNotFound,
        FrameNotFound,
        NothingRecorded,
        UnreadableVideo,
        MediaFailed,
        MediaTimeout,
    ),
)
@viewer
def frame(
    inspection_id: InspectionId,
    frame: Annotated[int, Path(ge=0, le=2**31)],
    services: ServicesDep,
) -> Response:
    """One tracked frame as a picture, for videos that a browser cannot play."""
    jpeg = services.inspections.picture(inspection_id, frame)
    return Response(jpeg, media_type="image/jpeg", headers=_HEADERS)


@router.get(
    "/exports/{kind}",
    response_class=Response,
    responses=content("text/csv", "application/json")
    | failures(InspectionNotFound, ExportNotAvailable),
)
@viewer
def export(
    inspection_id: InspectionId,
    kind: Annotated[
        str, Path(pattern="^(csv|json|xlsx|pdf|en13508|isybau|m150|ribx|geojson|zip)$")
    ],
    services: ServicesDep,
) -> Response:
    """The defect location report."""
    name, media_type, content = services.exports.report(inspection_id, kind)
    disposition = f"attachment; filename=\"{name}\"; filename*=UTF-8''{quote(name)}"
    return Response(
        content,
        media_type=media_type,
        headers={"Content-Disposition": disposition, "Content-Security-Policy": "sandbox"},
    )
