"""What routers ask for: fetched, or raised."""

from typing import Annotated

from fastapi import Depends, Path, Request
from starlette.requests import HTTPConnection

from app.services.access import Principal
from app.services.container import Services


def _services(connection: HTTPConnection) -> Services:
    services: Services = connection.app.state.services
    return services


def _principal(request: Request) -> Principal:
    """Put there by `middleware.Guard`, which lets nobody else in."""
    principal: Principal = request.state.principal
    return principal


ServicesDep = Annotated[Services, Depends(_services)]
PrincipalDep = Annotated[Principal, Depends(_principal)]

InspectionId = Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")]
ObservationId = Annotated[
    str,
    Path(pattern=r"^[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}$"),
]
