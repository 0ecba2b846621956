"""The shell of the page and its files.

The page is some hundred and forty small files.  A browser that asked for each of them again would
need a second before the page can be used, so the shell names them under their version, a part of
the path that changes with any of them; there they are kept without asking.  At the first visit they
are named all at once, so that no module waits until the one that imports it has been read, and the
server answers from memory.
"""

from __future__ import annotations

import hashlib
import posixpath
import re
import stat
from functools import lru_cache
from mimetypes import guess_type
from pathlib import Path

from fastapi import APIRouter, Request
from starlette.datastructures import Headers
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.staticfiles import NotModifiedResponse, StaticFiles
from starlette.types import Scope

import app
from app.web.deps import PrincipalDep, viewer

router = APIRouter(include_in_schema=False)

_VERSION = re.compile(r"v[0-9a-f]{16}/")
_IMPORT = re.compile(r"^(?:import|.* from) '(\.[^']+)';$", re.MULTILINE)
"""What a module names at its top, relative to itself."""
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
        full_path, found = self.lookup_path(path)
        if found is not None and stat.S_ISREG(found.st_mode) and scope["method"] == "GET":
            response = _answer(full_path, found.st_mtime_ns, found.st_size, Headers(scope=scope))
        else:
            response = await super().get_response(path, scope)
        is_versioned = _VERSION.match(super().get_path(scope)) is not None
        response.headers.update(_KEPT if is_versioned else _ASKED)
        return response


def _answer(path: str, changed_ns: int, size: int, asked: Headers) -> Response:
    content, tag, kind = _content(path, changed_ns, size)
    headers = {"ETag": tag}
    if asked.get("if-none-match") == tag:
        return NotModifiedResponse(Headers(headers))
    return Response(content, media_type=kind, headers=headers)


@lru_cache(maxsize=512)
def _content(path: str, _changed_ns: int, _size: int) -> tuple[bytes, str, str | None]:
    """Of a file as it was at that time: its bytes, their tag and their media type."""
    content = Path(path).read_bytes()
    return content, f'"{hashlib.sha256(content).hexdigest()[:32]}"', guess_type(path)[0]


@lru_cache(maxsize=4)
def modules_of(folder: Path, first: str, _version: str) -> tuple[str, ...]:
    """The modules that `first` needs, below the folder, itself included, each once.

    Those that are imported while the page runs are not among them.
    """
    found = [first]
    for name in found:  # it grows meanwhile
        for imported in _IMPORT.findall((folder / name).read_text("utf-8")):
            path = posixpath.normpath(posixpath.join(posixpath.dirname(name), imported))
            if path not in found:
                found.append(path)
    return tuple(found)


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
    version = version_of(folder)
    modules = "".join(
        f'<link rel="modulepreload" href="/static/{name}" />'
        for name in modules_of(folder, "main.js", version)
    )
    whole = text.replace("</head>", f"{modules}</head>", 1)
    versioned = whole.replace('"/static/', f'"/static/{version}/')
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
