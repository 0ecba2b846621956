"""The unrolled wall, and the picture health of its frames."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Path, Query, Response

from app.errors import InspectionNotFound, TileNotFound
from app.inspections.observations import rig_of
from app.web import columns
from app.web.deps import InspectionId, ServicesDep, viewer
from app.web.schemas.failures import content, failures
from app.web.schemas.frames import health_columns
from app.web.schemas.live import HealthOut
from app.web.schemas.wall import UnrolledOut

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["unrolled"])

_KEPT = {"Cache-Control": "private, max-age=31536000, immutable"}
_ASKED_AGAIN = {"Cache-Control": "private, no-cache"}


@router.get("/unrolled", responses=failures(InspectionNotFound))
@viewer
def unrolled(inspection_id: InspectionId, services: ServicesDep) -> UnrolledOut:
    """Return the tiles so far, at their corrected distances."""
    layout = services.unrolled.layout(rig_of(services.inspections.row(inspection_id)))

    def chainage_mm(raw_mm: float) -> float:
        return services.corrections.chainage_mm(inspection_id, raw_mm)

    return UnrolledOut.of(layout, services.unrolled.tiles(inspection_id), chainage_mm)


@router.get(
    "/unrolled/{index}.jpg",
    response_class=Response,
    responses=content("image/jpeg") | failures(InspectionNotFound, TileNotFound),
)
@viewer
def tile(
    inspection_id: InspectionId,
    index: Annotated[int, Path(ge=-(2**31), le=2**31)],
    services: ServicesDep,
    v: Annotated[
        int | None, Query(description="Revision of the tile, with which the answer may be cached.")
    ] = None,
) -> Response:
    """Return the picture of a tile; its columns run with the distance."""
    services.inspections.row(inspection_id)
    jpeg = services.unrolled.picture(inspection_id, index)
    headers = _ASKED_AGAIN if v is None else _KEPT
    return Response(jpeg, media_type="image/jpeg", headers=headers)


@router.get(
    "/health",
    response_model=HealthOut,
    responses=content(columns.MEDIA_TYPE) | failures(InspectionNotFound),
)
@viewer
def health(
    inspection_id: InspectionId,
    services: ServicesDep,
    since: Annotated[int, Query(ge=0, description="Only frames from this one on.")] = 0,
    format: Literal["json", "columns"] = "json",  # noqa: A002  (as that of the track)
) -> HealthOut | Response:
    """How good each picture was to measure on; row i is frame i, from `since` on."""
    services.inspections.row(inspection_id)
    run = services.tracks.run_id(inspection_id)  # before the rows, as for the track
    found = services.tracks.health(inspection_id)
    if format == "columns":
        shown = health_columns(found.columns(), since)
        packed = columns.packed(shown, run=run, total=len(found))
        return Response(packed, media_type=columns.MEDIA_TYPE)
    return HealthOut.of(found, since)
