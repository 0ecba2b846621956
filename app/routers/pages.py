"""The shell of the page and its files.

The page is some hundred and forty small files.  A browser that asked for each of them again would
need a second before the page can be used, so the shell names them under their version, a part of
the path that changes with any of them; there they are kept without asking.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from fastapi import APIRouter, Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

import app
from app.deps import PrincipalDep, viewer

router = APIRouter(include_in_schema=False)

_VERSION = re.compile(r"v[0-9a-f]{16}/")
_KEPT = {"Cache-Control": "private, max-age=31536000, immutable"}
_ASKED = {"Cache-Control": "no-cache"}


def static_folder() -> Path:
    """Inside the package when it was built, beside it in a checkout."""
    package = Path(app.__file__).parent
    built = package / "_static"
    return built if built.is_dir() else package.parent / "static"


def version_of(folder: Path) -> str:
    """Another one whenever a file is added, removed or changed; some milliseconds."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        stat = path.stat()
        digest.update(f"{path} {stat.st_mtime_ns} {stat.st_size}\n".encode())
    return f"v{digest.hexdigest()[:16]}"


class Assets(StaticFiles):
    """Files that a browser keeps under a version, and asks for again each time without one."""

    def get_path(self, scope: Scope) -> str:
        """Where it lies, without the version."""
        return _VERSION.sub("", super().get_path(scope))

    async def get_response(self, path: str, scope: Scope) -> Response:
        """As it is."""
        response = await super().get_response(path, scope)
        is_versioned = _VERSION.match(super().get_path(scope)) is not None
        response.headers.update(_KEPT if is_versioned else _ASKED)
        return response


def login_page(request: Request) -> Response:
    """The log-in page; its few files are public under their plain names."""
    text = (static_folder() / "login.html").read_text("utf-8")
    return HTMLResponse(_told(text, request), headers=_ASKED)


@router.get("/")
@router.get("/new")
@router.get("/compare")
@router.get("/inspections/{inspection_id}")
@viewer
def shell(request: Request, principal: PrincipalDep) -> Response:
    """One page for all: the script reads the address."""
    folder = static_folder()
    text = (folder / "index.html").read_text("utf-8")
    versioned = text.replace('"/static/', f'"/static/{version_of(folder)}/')
    return HTMLResponse(_told(versioned, request, role=principal.role), headers=_ASKED)


def _told(page: str, request: Request, **facts: str) -> str:
    """What a page has to know before its first paint, as `data-` of its root."""
    if request.app.state.is_insecure:
        facts["insecure"] = "yes"
    named = "".join(f' data-{name}="{value}"' for name, value in facts.items())
    return page.replace("<html", f"<html{named}", 1)


@router.get("/favicon.ico")
def favicon() -> Response:
    """Browsers ask here when they show something that is no page of ours."""
    return RedirectResponse("/static/icon.svg", 308)
