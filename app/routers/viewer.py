"""The 3D view: its page, and the way to its viser server."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response, WebSocket

from app.deps import InspectionId, PageId, ServicesDep, page_of, viewer
from app.services.clicks import Click
from app.services.container import Services
from app.viewer.page import ETAG, HEADERS, PAGE
from app.viewer.pump import pump

router = APIRouter(prefix="/viewer", include_in_schema=False)


@router.get("/{inspection_id}/")
@viewer
def page_alone(inspection_id: InspectionId, request: Request, services: ServicesDep) -> Response:
    """viser's page with our head and its own policy."""
    services.inspections.row(inspection_id)  # raises unless it exists
    if request.headers.get("if-none-match") == ETAG:
        return Response(status_code=304, headers=HEADERS)
    return Response(PAGE, headers=HEADERS)


@router.get("/{inspection_id}/{page}/")
@viewer
def page_in_page(
    inspection_id: InspectionId, page: PageId, request: Request, services: ServicesDep
) -> Response:
    """The same in a page whose live socket names the same number: its commands move this view."""
    return page_alone(inspection_id, request, services)


@router.websocket("/{inspection_id}")  # viser's client drops the trailing slash of the page
@viewer
async def connect(socket: WebSocket, inspection_id: InspectionId, services: ServicesDep) -> None:
    """Bytes through, by the rights of the role; clicks go to the page around."""
    await _connect(socket, inspection_id, services)


@router.websocket("/{inspection_id}/{page}")
@viewer
async def connect_in_page(
    socket: WebSocket, inspection_id: InspectionId, page: PageId, services: ServicesDep
) -> None:
    """The same for the view of one page."""
    await _connect(socket, inspection_id, services)


async def _connect(socket: WebSocket, inspection_id: str, services: Services) -> None:
    page = page_of(socket)

    async def on_click(click: Click) -> None:
        services.clicks.tell(inspection_id, page, click)

    async with services.scenes.use(inspection_id, page) as scene:
        await pump(socket, scene, socket.state.principal.role, on_click)
