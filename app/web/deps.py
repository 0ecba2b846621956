"""What routers ask for: fetched, or raised."""

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Path, Request
from starlette.requests import HTTPConnection

from app.access.access import Principal
from app.container import Services
from app.storage.tokens import Role
from app.web.middleware import PUBLIC

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])

_NEEDED: dict[Callable[..., Any], Role] = {}
"""The role that each endpoint declares."""


def viewer(endpoint: Endpoint) -> Endpoint:
    """Declare that a viewer may: it reads."""
    _NEEDED[endpoint] = Role.VIEWER
    return endpoint


def operator(endpoint: Endpoint) -> Endpoint:
    """Declare that an operator may: it belongs to the work of an inspection."""
    _NEEDED[endpoint] = Role.OPERATOR
    return endpoint


async def enforce_role(connection: HTTPConnection) -> None:
    """Around every endpoint: what declares no role is for an admin.

    Raises:
        Forbidden: The role of whoever asks is not enough.
    """
    if connection.scope["path"] not in PUBLIC:
        principal: Principal = connection.state.principal
        principal.require(_NEEDED.get(connection.scope["endpoint"], Role.ADMIN))


def _services(connection: HTTPConnection) -> Services:
    services: Services = connection.app.state.services
    return services


def _principal(request: Request) -> Principal:
    """Put there by `middleware.Guard`, which lets nobody else in."""
    principal: Principal = request.state.principal
    return principal


def browser_of(connection: HTTPConnection) -> str:
    """What distinguishes the user's browser: its session, or a program's token.

    Several people may share a token, and what one of them clicks is not for the others.
    """
    principal: Principal = connection.state.principal
    return principal.credential


def page_of(connection: HTTPConnection) -> str:
    """What a page has in common with the 3D view in it, and with no other page.

    It is the user's browser and a random number that the page has made.  A program that names no
    number has one view an inspection.
    """
    page = connection.path_params.get("page") or connection.query_params.get("page", "")
    return f"{browser_of(connection)} {page}"


ServicesDep = Annotated[Services, Depends(_services)]
PrincipalDep = Annotated[Principal, Depends(_principal)]

CodePackId = Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")]
PAGE_ID = r"^[0-9a-f]{32}$"
InspectionId = Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")]
OBSERVATION_ID = r"^[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}$"
ObservationId = Annotated[str, Path(pattern=OBSERVATION_ID)]
