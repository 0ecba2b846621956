"""Dependencies of the routers, and the roles of endpoints."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from fastapi import Depends, Path, Request
from starlette.requests import HTTPConnection

from app.access.access import Principal
from app.errors import Forbidden
from app.services import Kind, Services
from app.storage.folder.tokens import Role
from app.web.middleware import is_public, require_seen

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])

_NEEDED: dict[Callable[..., Any], Role] = {}
"""The role that each endpoint declares."""
_OF_PROJECTS: set[Callable[..., Any]] = set()
"""Endpoints for tokens limited to projects, besides those that name an inspection."""


def viewer(endpoint: Endpoint) -> Endpoint:
    """Declare that viewers may call the endpoint: it only reads."""
    _NEEDED[endpoint] = Role.VIEWER
    return endpoint


def operator(endpoint: Endpoint) -> Endpoint:
    """Declare that operators may call the endpoint: it belongs to inspection work."""
    _NEEDED[endpoint] = Role.OPERATOR
    return endpoint


def of_projects(endpoint: Endpoint) -> Endpoint:
    """Declare that tokens limited to projects may call an endpoint that names no inspection.

    It may: what belongs to projects it reads from the database and writes there, where
    `app.storage.database.limits` shows such a token its own ones only; or it asks `limits` itself.
    """
    _OF_PROJECTS.add(endpoint)
    return endpoint


async def enforce_role(connection: HTTPConnection) -> None:
    """Check role and projects for every endpoint; one that declares no role is for admins.

    Raises:
        Forbidden: The role is not sufficient, or the token is limited to projects and the endpoint
            does not declare `of_projects`.
        InspectionNotFound: The inspection belongs to none of the projects of the token: it cannot
            be told from one that does not exist.
    """
    if is_public(connection.scope["path"]):
        return
    principal: Principal = connection.state.principal
    endpoint = connection.scope["endpoint"]
    principal.require(_NEEDED.get(endpoint, Role.ADMIN))
    if principal.projects is None:
        return
    if "inspection_id" in connection.path_params:
        await require_seen(connection)
    elif endpoint not in _OF_PROJECTS:
        raise Forbidden(
            f"The token {principal.name!r} is limited to projects, and what this does concerns all "
            "of them."
        )


if TYPE_CHECKING:
    Service = Annotated[Kind, None]
else:

    class Service:
        """`Service[Reviews]` is the dependency on the running service of this class."""

        def __class_getitem__(cls, kind: type[Kind]) -> Any:
            def running(connection: HTTPConnection) -> Kind:
                services: Services = connection.app.state.services
                return services[kind]

            return Annotated[kind, Depends(running)]


def _principal(request: Request) -> Principal:
    """Return the principal set by `middleware.Guard`, which admits nobody else."""
    principal: Principal = request.state.principal
    return principal


def browser_of(connection: HTTPConnection) -> str:
    """Return what identifies the user's browser: its session, or a program's token.

    Several people may share a token, but each of them gets only their own clicks.
    """
    principal: Principal = connection.state.principal
    return principal.credential


def page_of(connection: HTTPConnection) -> str:
    """Return what a page shares with the 3D view in it, and with no other page.

    It combines the user's browser and a random number made by the page. A program without a number
    has one view for each inspection.
    """
    page = connection.path_params.get("page") or connection.query_params.get("page", "")
    return f"{browser_of(connection)} {page}"


PrincipalDep = Annotated[Principal, Depends(_principal)]

CodePackId = Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")]
PAGE_ID = r"^[0-9a-f]{32}$"
InspectionId = Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")]
OBSERVATION_ID = r"^[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}$"
ObservationId = Annotated[str, Path(pattern=OBSERVATION_ID)]
AttachmentId = Annotated[str, Path(pattern=OBSERVATION_ID)]
LibraryRigId = Annotated[str, Path(pattern=OBSERVATION_ID)]
