"""The 3D view: its page, and the connection to its viser server.

viser's client runs in its own origin, without cookies: the ticket in its address opens this one
view and nothing else.
"""

from __future__ import annotations

from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Path, Query, Request, Response, WebSocket
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import RedirectResponse

from app.access.access import Access
from app.inspections.inspections import Inspections
from app.viewer.clicks import Click, Clicks
from app.viewer.geometry import WallHit
from app.viewer.pump import pump
from app.viewer.scenes import Scenes
from app.web.deps import PAGE_ID, InspectionId, PrincipalDep, Service, page_of, viewer

router = APIRouter(prefix="/viewer", include_in_schema=False)

Ticket = Annotated[str, Path(pattern=r"^[0-9a-f]{64}\.[0-9a-f]{64}$")]


class ViewerQuery(BaseModel):
    """The parameters allowed for viser's client, which knows more: servers, recordings."""

    model_config = ConfigDict(extra="forbid")

    fixedDpr: float | None = Field(None, gt=0, le=8)  # noqa: N815  (viser's name)
    """Pixels of the picture for each pixel of the page."""


class DoorQuery(ViewerQuery):
    """The parameters with the page that contains the view, whose live socket controls it."""

    page: str | None = Field(None, pattern=PAGE_ID)


@router.get("/{inspection_id}/")
@viewer
def door(
    inspection_id: InspectionId,
    query: Annotated[DoorQuery, Query()],
    request: Request,
    principal: PrincipalDep,
    inspections: Service[Inspections],
    access: Service[Access],
) -> Response:
    """Redirect to the page, with a ticket."""
    inspections.row(inspection_id)  # raises unless it exists
    ticket = access.ticket(principal, inspection_id)
    place = f"{ticket}/{query.page}" if query.page else ticket
    asked = urlencode(query.model_dump(exclude={"page"}, exclude_none=True))
    return RedirectResponse(f"/viewer/{inspection_id}/{place}/{asked and '?'}{asked}", 303)


@router.get("/{inspection_id}/{ticket}/")
@router.get("/{inspection_id}/{ticket}/{page}/")
@viewer
def page(
    inspection_id: InspectionId,
    ticket: Ticket,
    query: Annotated[ViewerQuery, Query()],
    request: Request,
    inspections: Service[Inspections],
) -> Response:
    """Return viser's page with our head and its own policy."""
    from app.viewer.page import ETAG, HEADERS, PAGE  # makes the page, of viser's client

    inspections.row(inspection_id)  # raises unless it exists
    if request.headers.get("if-none-match") == ETAG:
        return Response(status_code=304, headers=HEADERS)
    return Response(PAGE, headers=HEADERS)


# viser's client drops the trailing slash of the page.
@router.websocket("/{inspection_id}/{ticket}")
@router.websocket("/{inspection_id}/{ticket}/{page}")
@viewer
async def connect(
    socket: WebSocket,
    inspection_id: InspectionId,
    ticket: Ticket,
    scenes: Service[Scenes],
    clicks: Service[Clicks],
) -> None:
    """Forward bytes as the role allows; clicks go to the surrounding page."""
    page = page_of(socket)

    async with scenes.use(inspection_id, page) as scene:

        async def on_click(click: Click) -> None:
            if not scene.is_measuring:
                clicks.publish(inspection_id, page, click)
            elif isinstance(click, WallHit):
                await scenes.measure_to(inspection_id, scene, click)

        await pump(socket, scene, socket.state.principal.role, on_click)
