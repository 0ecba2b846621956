"""Log-in and log-out."""

from __future__ import annotations

import re
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse

from app import errors
from app.access.access import SESSION_LIFETIME, Access
from app.inspections.preferences import Preferences
from app.web.deps import PrincipalDep, Service, of_projects, viewer
from app.web.middleware import address_of, cookie_name, cookie_of, is_encrypted
from app.web.routers.server.pages import login_page
from app.web.schemas.access import LoginIn, MeOut, PreferencesIn, SessionOut
from app.web.schemas.failures import failures

router = APIRouter(tags=["access"])
person = APIRouter(prefix="/api/me", tags=["access"])

_OUR_PAGES = re.compile(
    r"/((new|compare|find|(inspections|assets|films|settings)(/[a-z]+)?)|inspections/[0-9a-f]{32})?"
    r"(\?[\w=&.:%+-]*)?",
    re.ASCII,
)
"""Pages to which a log-in may lead, never another site."""


@router.post("/api/login", status_code=204, responses=failures(errors.TooManyAttempts))
def log_in(body: LoginIn, request: Request, response: Response, access: Service[Access]) -> None:
    """Exchange the access token for a session cookie."""
    _set_cookie(request, response, access.log_in(body.token, address_of(request)))


@router.get("/login", include_in_schema=False)
async def log_in_page(
    request: Request,
    access: Service[Access],
    token: Annotated[str | None, Query(max_length=500)] = None,
    next_page: Annotated[str, Query(alias="next", max_length=500)] = "/",
) -> Response:
    """Show the log-in page, or redirect to `next` if already logged in.

    With `?token=`, as in the address that the server prints, log in and redirect to `next`. A link
    from another site, or one that would replace another person's session, shows the page, which
    asks first.
    """
    onward = RedirectResponse(next_page if _OUR_PAGES.fullmatch(next_page) else "/", 303)
    cookie, address = cookie_of(request), address_of(request)
    current = None if cookie is None else await run_in_threadpool(access.by_cookie, cookie)
    if token is None:
        return login_page(request) if current is None else onward
    if current is not None:
        holder = await run_in_threadpool(access.by_token, token, address)
        is_same = holder is not None and holder.name == current.name
        return onward if is_same else login_page(request)
    if not _is_own_wish(request):
        return login_page(request)
    _set_cookie(request, onward, await run_in_threadpool(access.log_in, token, address))
    return onward


def _is_own_wish(request: Request) -> bool:
    """Return whether no other site's page led here.

    Over plain HTTP a browser states neither the origin of a link nor, for a link from another site,
    its session; programs do not request pages.
    """
    site = request.headers.get("sec-fetch-site")
    if site is None:
        return "text/html" not in request.headers.get("accept", "")
    return site in ("none", "same-origin")


@router.post("/api/logout", status_code=204)
@viewer
@of_projects
def log_out(request: Request, response: Response, access: Service[Access]) -> None:
    """End the session of the cookie, if there is one."""
    cookie = cookie_of(request)
    if cookie is not None:
        access.log_out(cookie)
    response.delete_cookie(
        cookie_name(request), secure=is_encrypted(request), httponly=True, samesite="strict"
    )
    # What the browser has kept of answers; service worker and page remove what they have kept.
    response.headers["Clear-Site-Data"] = '"cache"'


@router.get("/api/session")
@viewer
@of_projects
def session(principal: PrincipalDep) -> SessionOut:
    """Return who is logged in."""
    return SessionOut(name=principal.name, role=principal.role)


def _set_cookie(request: Request, response: Response, value: str) -> None:
    response.set_cookie(
        cookie_name(request),
        value,
        max_age=int(SESSION_LIFETIME.total_seconds()),
        secure=is_encrypted(request),
        httponly=True,
        samesite="strict",
    )


@person.get("")
@viewer
@of_projects
def me(preferences: Service[Preferences], principal: PrincipalDep) -> MeOut:
    """Return name, role and preferences; people are distinguished by the names of their tokens."""
    chosen = PreferencesIn.model_validate(preferences.of(principal.name))
    return MeOut(name=principal.name, role=principal.role, preferences=chosen)


@person.put("/preferences", responses=failures(errors.PackNotFound))
@viewer
@of_projects
def choose(
    body: PreferencesIn, preferences: Service[Preferences], principal: PrincipalDep
) -> PreferencesIn:
    """Replace all preferences."""
    preferences.replace(principal.name, body.model_dump())
    return body
