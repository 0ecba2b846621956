"""The register of assets: list, edit, delete; import and export as a table."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Path, Query, Response
from pydantic import Field
from starlette.responses import StreamingResponse

from app import errors
from app.inspections.register import Register, version_of_asset
from app.survey.assets.register import LONGEST_ID
from app.survey.assets.register_table import MEDIA_TYPE, MOST_COLUMNS, template
from app.survey.given import LINE
from app.web.deps import PrincipalDep, Service, of_projects, operator, viewer
from app.web.queries import Limit, Offset, Text
from app.web.schemas.failures import content, failures
from app.web.schemas.library.register import (
    AlikeOut,
    AssetIn,
    ProjectIn,
    RegisteredAssetOut,
    RegisterImportOut,
    RegisterOut,
)
from app.web.slow import heavy
from app.web.versions import Replaced, tag_with

router = APIRouter(prefix="/api/register", tags=["register"])

ColumnText = Annotated[str, Field(max_length=40, pattern=LINE)]
AssetId = Annotated[str, Path(min_length=1, max_length=LONGEST_ID, pattern=LINE)]


@router.get("/assets")
@viewer
@of_projects
def page(
    register: Service[Register],
    search: Text = "",
    offset: Offset = 0,
    limit: Limit = 50,
) -> RegisterOut:
    """Return a page of the registered assets, inspected or not, sorted by id."""
    total, rows = register.page(search, offset, limit)
    return RegisterOut(total=total, assets=[RegisteredAssetOut.of(row) for row in rows])


@router.get("/assets.csv", response_class=Response, responses=content(MEDIA_TYPE))
@viewer
@of_projects
def export(register: Service[Register]) -> StreamingResponse:
    """Return the register as a table, which an import takes again."""
    pieces = (piece.encode() for piece in register.table())
    return StreamingResponse(pieces, media_type=MEDIA_TYPE, headers=_named("assets.csv"))


@router.get("/template.csv", response_class=Response, responses=content(MEDIA_TYPE))
@viewer
@of_projects
def template_of_imports() -> Response:
    """Return a table with an example, with all columns that the register has."""
    return Response(template(), media_type=MEDIA_TYPE, headers=_named("assets-template.csv"))


@router.get("/like")
@viewer
@of_projects
def like(
    register: Service[Register],
    asset_id: Annotated[str, Query(max_length=20_000, pattern=LINE)],
) -> AlikeOut:
    """Return the other ways of writing an id, and what the register holds under it."""
    return AlikeOut.model_validate(register.alike(asset_id))


@router.post("/import", responses=failures(errors.InvalidTable))
@operator
@heavy
def import_table(
    content: Annotated[
        bytes, Body(media_type="text/csv", description="The table, in UTF-8 or Windows-1252.")
    ],
    register: Service[Register],
    principal: PrincipalDep,
    dry_run: Annotated[bool, Query(description="Only say what it would do.")] = False,
    columns: Annotated[
        list[ColumnText],
        Query(
            max_length=MOST_COLUMNS,
            description="What each column holds, in order: a field, a field and its unit such as "
            "height_mm:in, or nothing. Without any it is guessed by names and cells.",
        ),
    ] = [],  # noqa: B006
) -> RegisterImportOut:
    """Add and change the assets of a table; rows with a fault are left out and named."""
    if dry_run:
        return RegisterImportOut.of(register.preview(content, columns))
    return RegisterImportOut.of(register.take(content, columns, principal.name))


@router.post("/projects", status_code=204)
@operator
@of_projects
def make_project(body: ProjectIn, register: Service[Register], principal: PrincipalDep) -> None:
    """Make a project, to which nothing belongs yet; one that is known stays as it is."""
    register.make_project(body.name, principal.name)


@router.delete("/projects", status_code=204)
@operator
@of_projects
def delete_project(
    project: Annotated[str, Query(min_length=1, max_length=200, pattern=LINE)],
    register: Service[Register],
    principal: PrincipalDep,
) -> None:
    """Take a project back that was made; what belongs to it keeps its name."""
    register.delete_project(project, principal.name)


@router.get("/assets/{asset_id:path}", responses=failures(errors.AssetNotFound))
@viewer
@of_projects
def get(asset_id: AssetId, register: Service[Register], response: Response) -> RegisteredAssetOut:
    """Return an asset."""
    row = register.get(asset_id)
    tag_with(response, version_of_asset(row))
    return RegisteredAssetOut.of(row)


@router.put("/assets/{asset_id:path}", responses=failures(errors.ChangedMeanwhile))
@operator
@of_projects
def put(
    asset_id: AssetId,
    body: AssetIn,
    register: Service[Register],
    principal: PrincipalDep,
    replaced: Replaced,
    response: Response,
) -> RegisteredAssetOut:
    """Add an asset, or replace the one with this id."""
    row = register.put(body.to_asset(asset_id), principal.name, replaced)
    tag_with(response, version_of_asset(row))
    return RegisteredAssetOut.of(row)


@router.delete(
    "/assets/{asset_id:path}",
    status_code=204,
    responses=failures(errors.AssetNotFound, errors.ChangedMeanwhile),
)
@operator
@of_projects
def delete(
    asset_id: AssetId, register: Service[Register], principal: PrincipalDep, replaced: Replaced
) -> None:
    """Take an asset off the register; its inspections stay."""
    register.delete(asset_id, principal.name, replaced)


def _named(filename: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="{filename}"'}
