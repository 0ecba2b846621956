"""The unrolled wall, and the picture health of its frames."""

from __future__ import annotations

import hashlib
from typing import Annotated, Literal

from fastapi import APIRouter, Path, Query, Request, Response

from app import errors
from app.inspections.corrections import Corrections
from app.inspections.inspections import Inspections
from app.inspections.observations import rig_of
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled
from app.web import columns
from app.web.deps import InspectionId, Service, viewer
from app.web.ranges import PRIVATE
from app.web.schemas.failures import content, failures
from app.web.schemas.inspection.frames import health_columns
from app.web.schemas.inspection.live import HealthOut
from app.web.schemas.inspection.wall import UnrolledOut
from app.web.versions import etag

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["unrolled"])


@router.get("/unrolled")
@viewer
def unrolled(
    inspection_id: InspectionId,
    unrolled: Service[Unrolled],
    corrections: Service[Corrections],
    inspections: Service[Inspections],
) -> UnrolledOut:
    """Return the tiles so far, at their corrected distances."""
    layout = unrolled.layout(rig_of(inspections.row(inspection_id)))

    def chainage_mm(raw_mm: float) -> float:
        return corrections.chainage_mm(inspection_id, raw_mm)

    return UnrolledOut.of(layout, unrolled.tiles(inspection_id), chainage_mm)


@router.get(
    "/unrolled/{index}.jpg",
    response_class=Response,
    responses=content("image/jpeg")
    | {304: {"description": "The picture is still the one that `If-None-Match` names."}}
    | failures(errors.TileNotFound),
)
@viewer
def tile(
    inspection_id: InspectionId,
    index: Annotated[int, Path(ge=-(2**31), le=2**31)],
    inspections: Service[Inspections],
    unrolled: Service[Unrolled],
    request: Request,
    v: Annotated[
        int | None, Query(description="Revision of the tile; a page asks anew for another one.")
    ] = None,
) -> Response:
    """Return the picture of a tile; its columns run with the distance."""
    inspections.row(inspection_id)
    jpeg = unrolled.picture(inspection_id, index)
    # A browser keeps the picture, and shows it to nobody whom the server does not let in.
    headers = PRIVATE | {"ETag": etag(hashlib.sha256(jpeg).hexdigest())}
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return Response(jpeg, media_type="image/jpeg", headers=headers)


@router.get(
    "/health",
    response_model=HealthOut,
    responses=content(columns.MEDIA_TYPE),
)
@viewer
def health(
    inspection_id: InspectionId,
    inspections: Service[Inspections],
    tracks: Service[Tracks],
    since: Annotated[int, Query(ge=0, description="Only frames from this one on.")] = 0,
    format: Literal["json", "columns"] = "json",  # noqa: A002  (as that of the track)
) -> HealthOut | Response:
    """How good each picture was to measure on; row i is frame i, from `since` on."""
    inspections.row(inspection_id)
    run = tracks.run_id(inspection_id)  # before the rows, as for the track
    found = tracks.health(inspection_id)
    if format == "columns":
        shown = health_columns(found.columns(), since)
        packed = columns.packed(shown, run=run, total=len(found))
        return Response(packed, media_type=columns.MEDIA_TYPE)
    return HealthOut.of(found, since)
