"""Dependencies of the routers, and the roles of endpoints."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from fastapi import Depends, Path, Request
from starlette.requests import HTTPConnection

from app.access.access import Principal
from app.services import Kind, Services
from app.storage.folder.tokens import Role
from app.web.middleware import is_public

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])

_NEEDED: dict[Callable[..., Any], Role] = {}
"""The role that each endpoint declares."""


def viewer(endpoint: Endpoint) -> Endpoint:
    """Declare that viewers may call the endpoint: it only reads."""
    _NEEDED[endpoint] = Role.VIEWER
    return endpoint


def operator(endpoint: Endpoint) -> Endpoint:
    """Declare that operators may call the endpoint: it belongs to inspection work."""
    _NEEDED[endpoint] = Role.OPERATOR
    return endpoint


async def enforce_role(connection: HTTPConnection) -> None:
    """Check the role for every endpoint; one that declares none is for admins.

    Raises:
        Forbidden: The role is not sufficient.
    """
    if not is_public(connection.scope["path"]):
        principal: Principal = connection.state.principal
        principal.require(_NEEDED.get(connection.scope["endpoint"], Role.ADMIN))


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
