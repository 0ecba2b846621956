"""Links by which clients accept inspections."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query

from app import errors
from app.inspections.acceptance import Acceptance
from app.web.deps import PrincipalDep, Service, of_projects, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.library.acceptance import LinkIn, LinkMadeOut, LinkOut, LinksOut

router = APIRouter(prefix="/api/acceptance-links", tags=["acceptance"])


@router.post(
    "", status_code=201, responses=failures(errors.InspectionNotFound, errors.StillRunning)
)
@operator
@of_projects
def make(body: LinkIn, acceptance: Service[Acceptance], principal: PrincipalDep) -> LinkMadeOut:
    """Make a link to inspections for a client without an account; the answer is the only place
    where its address is shown.
    """
    ids = list(dict.fromkeys(body.inspections))
    link, secret = acceptance.make(body.note, ids, body.days, principal.name)
    return LinkMadeOut(link=LinkOut.of(link), path=f"/accept/{secret}/")


@router.get("")
@viewer
@of_projects
def links(
    acceptance: Service[Acceptance],
    inspection: Annotated[str | None, Query(pattern=r"^[0-9a-f]{32}$")] = None,
) -> LinksOut:
    """Return the newest links, at most 500, valid or not, with how their sections stand."""
    return LinksOut(links=[LinkOut.of(link) for link in acceptance.links(inspection)])


@router.delete("/{link_id}", status_code=204, responses=failures(errors.LinkNotFound))
@operator
@of_projects
def revoke(
    link_id: Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")],
    acceptance: Service[Acceptance],
    principal: PrincipalDep,
) -> None:
    """End a link at once; what was said by it stays. May be repeated."""
    acceptance.revoke(link_id, principal.name)
