"""Live sources found by the server: USB cameras, growing files, pipes."""

from fastapi import APIRouter

from app.tracking.cameras import Sources
from app.web.deps import Service, viewer
from app.web.schemas.sources import SourcesOut

router = APIRouter(prefix="/api/sources", tags=["sources"])


@router.get("")
@viewer
def sources(sources: Service[Sources]) -> SourcesOut:
    """Return the sources that can be opened besides network cameras."""
    return SourcesOut.model_validate({"sources": sources.listed()})
