"""Imported code packs: import as CSV, list, delete."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Query, Response

from app import errors
from app.inspections.packs import Packs
from app.survey.given import PackName
from app.web.deps import CodePackId, PrincipalDep, Service, of_projects, viewer
from app.web.schemas.failures import failures
from app.web.schemas.library.catalogue import PackOut, PacksOut

router = APIRouter(prefix="/api/packs", tags=["catalogue"])


@router.get("")
@viewer
@of_projects
def list_all(packs: Service[Packs]) -> PacksOut:
    """Return the imported packs, sorted by name."""
    return PacksOut(packs=[PackOut.of(view) for view in packs.all()])


@router.post("", status_code=201, responses=failures(errors.InvalidPack, errors.PackNameTaken))
def add(
    name: Annotated[PackName, Query(description="Name of the pack, which must be unique.")],
    content: Annotated[bytes, Body(media_type="text/csv", description="The table, in UTF-8.")],
    response: Response,
    packs: Service[Packs],
    principal: PrincipalDep,
) -> PackOut:
    """Import a table of codes, separated by commas or semicolons; it is checked row by row."""
    view = packs.add(name, content, principal.name)
    response.headers["Location"] = f"/api/packs/{view.row.id}"
    return PackOut.of(view)


@router.delete(
    "/{pack_id}", status_code=204, responses=failures(errors.PackNotFound, errors.PackInUse)
)
def delete(pack_id: CodePackId, packs: Service[Packs]) -> None:
    """Delete a pack that no inspection uses."""
    packs.delete(pack_id)
