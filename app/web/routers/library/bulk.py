"""Reports of many inspections as one archive: order it, follow it, read it, cancel it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response
from starlette.responses import StreamingResponse

from app import errors
from app.reports.bulk import BulkExports
from app.web.deps import PrincipalDep, Service, of_projects, viewer
from app.web.downloads import attachment
from app.web.schemas.failures import content, failures
from app.web.schemas.library.bulk import BulkExportIn, BulkExportOut

router = APIRouter(prefix="/api/bulk-exports", tags=["media"])

MEDIA_TYPES = ("application/zip", "application/pdf")
BulkExportId = Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")]


@router.post("", status_code=202, responses=failures(errors.Busy))
@viewer
@of_projects
def order(
    body: BulkExportIn, bulk_exports: Service[BulkExports], principal: PrincipalDep
) -> BulkExportOut:
    """Have an archive made, with a folder for each inspection; its progress has its own address.

    `document` adds one PDF over all inspections: list with grades, statistics, plan sketch and
    every report. With `delivery` among the formats the archive is a delivery: one exchange file
    with all inspections, photos and films beside it, checksums and a signature. An order for the
    document alone is that PDF, one for the delivery of one inspection is that delivery. `photos`
    and `csv` are as for one inspection.

    An inspection that lacks what a format needs is listed as `not_made` and in `inspections.csv`
    of the archive; all others are in it.
    """
    return BulkExportOut.of(bulk_exports.order(body.wanted(), principal.name))


@router.get("/{order_id}", responses=failures(errors.BulkExportNotFound))
@viewer
@of_projects
def progress(order_id: BulkExportId, bulk_exports: Service[BulkExports]) -> BulkExportOut:
    """Return how far it is."""
    return BulkExportOut.of(bulk_exports.find(order_id))


@router.get(
    "/{order_id}/archive",
    response_class=Response,
    responses=content(*MEDIA_TYPES) | failures(errors.BulkExportNotFound),
)
@viewer
@of_projects
def archive(order_id: BulkExportId, bulk_exports: Service[BulkExports]) -> StreamingResponse:
    """Return the archive; the PDF itself where nothing but a document was ordered."""
    blocks, size, made = bulk_exports.archive(order_id)
    headers = {
        "Content-Disposition": attachment(made.filename),
        "Content-Length": str(size),
    }
    return StreamingResponse(blocks, media_type=made.media_type, headers=headers)


@router.delete("/{order_id}", status_code=204, responses=failures(errors.BulkExportNotFound))
@viewer
@of_projects
def cancel(order_id: BulkExportId, bulk_exports: Service[BulkExports]) -> None:
    """Stop it, and delete the archive."""
    bulk_exports.cancel(order_id)
