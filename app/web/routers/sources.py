"""Live sources that the server has found: USB cameras, growing files, pipes."""

from fastapi import APIRouter

from app.web.deps import ServicesDep, viewer
from app.web.schemas.sources import SourcesOut

router = APIRouter(prefix="/api/sources", tags=["sources"])


@router.get("")
@viewer
def sources(services: ServicesDep) -> SourcesOut:
    """What can be opened besides a network camera."""
    return SourcesOut.of(services.sources.listed())
