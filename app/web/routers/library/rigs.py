"""The library of rigs: list, keep, rename, delete."""

from __future__ import annotations

from fastapi import APIRouter

from app import errors
from app.inspections.rigs import Rigs
from app.web.deps import LibraryRigId, PrincipalDep, Service, of_projects, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.library.rigs import LibraryOut, LibraryRigIn, LibraryRigOut
from vo_core.errors import InvalidRig, NoWallInView

router = APIRouter(prefix="/api/rigs", tags=["catalogue"])


@router.get("")
@viewer
@of_projects
def list_all(rigs: Service[Rigs]) -> LibraryOut:
    """Return the rigs by name, each with the inspections whose header names it."""
    return LibraryOut(rigs=[LibraryRigOut.of(*each) for each in rigs.all()])


@router.put(
    "/{rig_id}", status_code=204, responses=failures(InvalidRig, NoWallInView, errors.RigNameTaken)
)
@operator
def put(
    rig_id: LibraryRigId, body: LibraryRigIn, rigs: Service[Rigs], principal: PrincipalDep
) -> None:
    """Keep a rig under a name, or change or rename the one with this id."""
    rigs.put(rig_id, body.name, body.rig, principal.name)


@router.delete("/{rig_id}", status_code=204, responses=failures(errors.RigNotFound))
@operator
def delete(rig_id: LibraryRigId, rigs: Service[Rigs]) -> None:
    """Take a rig off the library; inspections keep their own copies."""
    rigs.delete(rig_id)
