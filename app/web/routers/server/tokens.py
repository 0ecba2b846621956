"""The tokens of people and programs; for admins."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path

from app import errors
from app.access.holders import Holders
from app.web.deps import PrincipalDep, Service
from app.web.schemas.access import RoleIn, TokenIn, TokenMadeOut, TokensOut
from app.web.schemas.failures import failures

router = APIRouter(prefix="/api/tokens", tags=["access"])

TokenName = Annotated[str, Path(max_length=100)]


@router.get("")
def list_all(holders: Service[Holders]) -> TokensOut:
    """Return all tokens without their secrets, including revoked ones."""
    return TokensOut.model_validate({"tokens": holders.all()})


@router.post("", status_code=201, responses=failures(errors.TokenNameTaken))
def create(body: TokenIn, holders: Service[Holders], principal: PrincipalDep) -> TokenMadeOut:
    """Make a token; the answer is the only place where its secret is shown."""
    secret = holders.create(body.name, body.to_role(), body.to_projects(), principal.name)
    return TokenMadeOut(secret=secret)


@router.put("/{name:path}/role", status_code=204, responses=failures(errors.TokenNotFound))
def change_role(
    name: TokenName, body: RoleIn, holders: Service[Holders], principal: PrincipalDep
) -> None:
    """Give the valid token of this name another role."""
    holders.change_role(name, body.to_role(), principal.name)


@router.delete("/{name:path}", status_code=204, responses=failures(errors.TokenNotFound))
def revoke(name: TokenName, holders: Service[Holders], principal: PrincipalDep) -> None:
    """End the valid token of this name and all of its sessions."""
    holders.revoke(name, principal.name)
