"""The 3D view: its page, and the way to its viser server."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response, WebSocket

from app.deps import InspectionId, ServicesDep, browser_of, viewer
from app.services.clicks import Click
from app.viewer.page import ETAG, HEADERS, PAGE
from app.viewer.pump import pump

router = APIRouter(prefix="/viewer", include_in_schema=False)


@router.get("/{inspection_id}/")
@viewer
def page(inspection_id: InspectionId, request: Request, services: ServicesDep) -> Response:
    """viser's page with our head and its own policy."""
    services.inspections.row(inspection_id)  # raises unless it exists
    if request.headers.get("if-none-match") == ETAG:
        return Response(status_code=304, headers=HEADERS)
    return Response(PAGE, headers=HEADERS)


@router.websocket("/{inspection_id}")  # viser's client drops the trailing slash of the page
@viewer
async def connect(socket: WebSocket, inspection_id: InspectionId, services: ServicesDep) -> None:
    """Bytes through, by the rights of the role; clicks go to the page around."""
    browser = browser_of(socket)

    async def on_click(click: Click) -> None:
        services.clicks.tell(inspection_id, browser, click)

    async with services.scenes.use(inspection_id) as feed:
        await pump(socket, feed.scene, socket.state.principal.role, on_click)
