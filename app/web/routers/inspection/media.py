"""The original video, single frames, the thumbnail, and reports; media types are set here, not by
uploads.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Literal

from fastapi import APIRouter, Path, Request, Response
from starlette.responses import StreamingResponse

from app import errors
from app.inspections.films.filmed import Filmed
from app.inspections.inspections import Inspections
from app.reports.content.translator import Translator
from app.reports.content.words import Language
from app.reports.formats import FORMATS
from app.reports.report import CsvStyle, Extras, Units
from app.reports.reports import Reports
from app.tracking.pictures.clips import Clips
from app.tracking.pictures.thumbnails import Thumbnails
from app.web.deps import InspectionId, Service, viewer
from app.web.downloads import attachment
from app.web.ranges import PRIVATE, blob_response
from app.web.schemas.failures import READING_A_FILM, content, failures
from app.web.schemas.inspection.records import LossesOut
from app.web.schemas.library.bulk import ExchangeKind
from app.web.slow import for_lists, heavy, slow
from app.web.versions import etag

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["media"])


@router.get(
    "/video",
    response_class=StreamingResponse,
    responses=content("video/*", "application/octet-stream")
    | failures(errors.NothingRecorded, errors.StoreUnavailable),
)
@viewer
def video(
    inspection_id: InspectionId,
    inspections: Service[Inspections],
    filmed: Service[Filmed],
    request: Request,
) -> Response:
    """Return the original film, also in ranges."""
    inspection = inspections.row(inspection_id)
    film = filmed.film(inspection)
    return blob_response(request.headers, film, inspection.video["media_type"], PRIVATE)


@router.get(
    "/frames/{frame}.jpg",
    response_class=Response,
    responses=content("image/jpeg")
    | failures(
        *READING_A_FILM,
    ),
)
@viewer
@slow
def frame(
    inspection_id: InspectionId,
    frame: Annotated[int, Path(ge=0, le=2**31)],
    filmed: Service[Filmed],
) -> Response:
    """Return a tracked frame as a picture, for videos that a browser cannot play."""
    jpeg = filmed.picture(inspection_id, frame)
    return Response(jpeg, media_type="image/jpeg", headers=PRIVATE)


@router.get(
    "/thumbnail",
    response_class=Response,
    responses=content("image/jpeg")
    | {304: {"description": "The picture is still the one that `If-None-Match` names."}}
    | failures(errors.PhotoNotFound, *READING_A_FILM),
)
@viewer
@for_lists
def thumbnail(
    inspection_id: InspectionId, thumbnails: Service[Thumbnails], request: Request
) -> Response:
    """Return a small picture: the photo of the worst defect, else a frame of the film."""
    shown = thumbnails.shown(inspection_id)
    headers = PRIVATE | {"ETag": etag(shown.name)}
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return Response(thumbnails.jpeg(shown), media_type="image/jpeg", headers=headers)


ExportKind = Annotated[str, Path(pattern=f"^({'|'.join(FORMATS)})$")]


@router.get(
    "/exports/{kind}",
    response_class=Response,
    responses=content(*sorted({form.media_type.split(";")[0] for form in FORMATS.values()}))
    | failures(errors.ExportNotAvailable, errors.UnreadableKey),
)
@viewer
@heavy
def export(
    inspection_id: InspectionId,
    kind: ExportKind,
    reports: Service[Reports],
    film_clips: Service[Clips],
    lang: Language = "en",
    units: Units = "m",
    burnt_in: bool = False,
    clips: bool = False,
    exchange: ExchangeKind | None = None,
    film: bool = False,
    photos: Literal["embedded"] | None = None,
    csv: CsvStyle = "standard",
) -> Response:
    """Return the report; language and units apply to formats that people read.

    `burnt_in` puts distance and code below each photo of a format that shows photos; `clips` adds
    the seconds around each observation to the bundle. `exchange` is the exchange format of a
    delivery (EN 13508-2 text unless stated), `film` adds the film to it, or to the archive file;
    `POST /api/bulk-exports` makes a delivery with progress. `photos` adds photos and voice notes to
    the JSON report. `csv=german` writes a CSV with semicolons and decimal commas.
    """
    extras = Extras(
        burnt_in=burnt_in,
        clip_of=partial(film_clips.content_of, inspection_id) if clips else None,
        exchange=exchange,
        film=film,
        photos=photos == "embedded",
        csv_style=csv,
    )
    export = reports.export(inspection_id, kind, language=lang, units=units, extras=extras)
    return StreamingResponse(
        export.written.blocks(),
        media_type=export.media_type,
        headers={
            "Content-Disposition": attachment(export.filename),
            "Content-Length": str(export.written.size),
            "Content-Security-Policy": "sandbox",
        },
    )


@router.get("/exports/{kind}/losses", responses=failures(errors.ExportNotAvailable))
@viewer
@heavy
def losses(
    inspection_id: InspectionId,
    kind: ExportKind,
    reports: Service[Reports],
    lang: Language = "en",
    units: Units = "m",
) -> LossesOut:
    """Return what the format cannot hold, to be shown before the file is sent to anybody."""
    losses = reports.losses(inspection_id, kind, language=lang, units=units)
    return LossesOut.of(losses, Translator(lang, units))
