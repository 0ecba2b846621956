"""Imported code packs: import as CSV or XLSX with a preview, list, delete; the template."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Query, Response

from app import errors
from app.inspections.brought_in.pack_files import PackFiles
from app.inspections.packs import Packs
from app.reports.tables.pack_template import MEDIA_TYPE, pack_template
from app.survey.given import LINE, PackName
from app.web.deps import CodePackId, PrincipalDep, Service, of_projects, viewer
from app.web.schemas.failures import content as answers_with
from app.web.schemas.failures import failures
from app.web.schemas.library.catalogue import CodeOut, PackOut, PackPreviewOut, PacksOut
from app.web.slow import heavy

router = APIRouter(prefix="/api/packs", tags=["catalogue"])

_MOST_FAULTS, _SAMPLE = 200, 8
Title = Annotated[
    PackName, Query(description="Title of the pack; one that is there gets its next version.")
]
Project = Annotated[
    str | None,
    Query(min_length=1, max_length=200, pattern=LINE, description="Offer it to this project only."),
]
Table = Annotated[
    bytes, Body(media_type="text/csv", description="The table: CSV in UTF-8, or a workbook (XLSX).")
]


@router.get("")
@viewer
@of_projects
def list_all(packs: Service[Packs]) -> PacksOut:
    """Return the imported packs, sorted by title, the newest version first."""
    return PacksOut(packs=[PackOut.of(view) for view in packs.all()])


@router.get("/template.xlsx", response_class=Response, responses=answers_with(MEDIA_TYPE))
@viewer
@of_projects
def template() -> Response:
    """Return a workbook with a made-up pack, to be overwritten, and an explanation of each
    column.
    """
    named = {"Content-Disposition": 'attachment; filename="code-pack-template.xlsx"'}
    return Response(pack_template(), media_type=MEDIA_TYPE, headers=named)


@router.post("/preview", responses=failures(errors.Busy))
@heavy
def preview(name: Title, content: Table, files: Service[PackFiles]) -> PackPreviewOut:
    """Say what an import would add, or all that prevents it; nothing is kept."""
    found = files.preview(name, content)
    rows = found.table.rows if found.table else ()
    return PackPreviewOut(
        faults=[*found.faults[:_MOST_FAULTS]],
        codes=[CodeOut.model_validate(code) for code in rows[:_SAMPLE]],
        count=len(rows),
        ratings=[rating.label for rating in found.table.ratings] if found.table else [],
    )


@router.post(
    "", status_code=201, responses=failures(errors.InvalidPack, errors.PackNameTaken, errors.Busy)
)
@heavy
def add(
    name: Title,
    content: Table,
    response: Response,
    files: Service[PackFiles],
    principal: PrincipalDep,
    project: Project = None,
) -> PackOut:
    """Import a table of codes, which is checked row by row, or the next version of it."""
    view = files.add(name, content, project, principal.name)
    response.headers["Location"] = f"/api/packs/{view.row.id}"
    return PackOut.of(view)


@router.delete(
    "/{pack_id}", status_code=204, responses=failures(errors.PackNotFound, errors.PackInUse)
)
def delete(pack_id: CodePackId, packs: Service[Packs]) -> None:
    """Delete a version of a pack that no inspection uses."""
    packs.delete(pack_id)
