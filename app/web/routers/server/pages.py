"""The shell of the page and its files.

The page consists of some hundred and fifty small files, sent as one script and one style sheet
(`joined_files`). The shell refers to them under a version, a part of the path that changes with any
file. Browsers cache such paths without revalidation, and the server answers from memory.
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
from collections.abc import Iterator
from functools import lru_cache
from html import escape
from mimetypes import guess_type
from pathlib import Path

from fastapi import APIRouter, Request
from starlette.datastructures import Headers
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.staticfiles import NotModifiedResponse, StaticFiles
from starlette.types import Scope

import app
from app.web.deps import PrincipalDep, of_projects, viewer
from app.web.joined_files import script_of, style_of, with_joined_files
from app.web.languages import WORDS, languages_of, with_languages
from app.web.middleware import is_encrypted

router = APIRouter(include_in_schema=False)

_VERSION = re.compile(r"(v[0-9a-f]{16})/")
_KEPT = {"Cache-Control": "private, max-age=31536000, immutable"}
_ASKED = {"Cache-Control": "no-cache"}
_SHELL = "index.html"
_FIRST_MODULE = "main.js"
_SCRIPT, _STYLE = "page.js", "page.css"
"""Names of the two joined files in the folder of static files."""


def static_folder() -> Path:
    """Return the folder of static files: inside an installed package, beside it in a checkout."""
    package = Path(app.__file__).parent
    built = package / "_static"
    return built if built.is_dir() else package.parent / "static"


def version_of(folder: Path) -> str:
    """Return a version that differs after any file is added, removed or changed; takes a few
    milliseconds.
    """
    digest = hashlib.sha256()
    for entry in sorted(_entries(folder), key=lambda entry: entry.path):
        stat = entry.stat()
        digest.update(f"{entry.path} {stat.st_mtime_ns} {stat.st_size}\n".encode())
    return f"v{digest.hexdigest()[:16]}"


def _entries(folder: str | Path) -> Iterator[os.DirEntry[str]]:
    """Everything in a folder and below; twice as fast as `Path.rglob`."""
    with os.scandir(folder) as entries:
        for entry in entries:
            yield entry
            if entry.is_dir():
                yield from _entries(entry.path)


class Assets(StaticFiles):
    """Files that a browser caches under a version, and revalidates each time without one."""

    def get_path(self, scope: Scope) -> str:
        """Return the path without the version."""
        return _VERSION.sub("", super().get_path(scope))

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return the file, or a joined one."""
        folder = static_folder()
        version = version_of(folder)
        full_path, found = self.lookup_path(path)
        if path in (_SCRIPT, _STYLE) and scope["method"] == "GET":
            response = _answer(*_joined(folder, path, version), Headers(scope=scope))
        elif (code := _language(folder, path, version)) and scope["method"] == "GET":
            response = _answer(*_words(folder, code, version), Headers(scope=scope))
        elif found is not None and stat.S_ISREG(found.st_mode) and scope["method"] == "GET":
            content = _content(full_path, found.st_mtime_ns, found.st_size)
            response = _answer(*content, Headers(scope=scope))
        else:
            response = await super().get_response(path, scope)
        asked = _VERSION.match(super().get_path(scope))
        # Another version: the server was upgraded between the shell and this file.
        is_kept = asked is not None and asked[1] == version
        response.headers.update(_KEPT if is_kept else _ASKED)
        return response


def _answer(content: bytes, tag: str, kind: str | None, asked: Headers) -> Response:
    headers = {"ETag": tag}
    if asked.get("if-none-match") == tag:
        return NotModifiedResponse(Headers(headers))
    return Response(content, media_type=kind, headers=headers)


@lru_cache(maxsize=512)
def _content(path: str, _changed_ns: int, _size: int) -> tuple[bytes, str, str | None]:
    """Return bytes, tag and media type of a file; time and size make a changed file another key."""
    return _tagged(Path(path).read_bytes(), path)


@lru_cache(maxsize=4)
def _joined(folder: Path, name: str, _version: str) -> tuple[bytes, str, str | None]:
    """Return bytes, tag and media type of a joined file; a version makes files another key."""
    if name == _SCRIPT:
        return _tagged(script_of(folder, _FIRST_MODULE).encode(), name)
    return _tagged(style_of(folder, (folder / _SHELL).read_text("utf-8")).encode(), name)


def _language(folder: Path, path: str, version: str) -> str | None:
    """Return the code of the language whose words a path names; None for other files."""
    named = WORDS.fullmatch(path)
    return named[1] if named and named[1] in languages_of(folder, version) else None


@lru_cache(maxsize=64)
def _words(folder: Path, code: str, version: str) -> tuple[bytes, str, str | None]:
    """Return bytes, tag and media type of the words of a language."""
    return _tagged(languages_of(folder, version)[code].words, f"{code}.json")


def _tagged(content: bytes, name: str) -> tuple[bytes, str, str | None]:
    return content, f'"{hashlib.sha256(content).hexdigest()[:32]}"', guess_type(name)[0]


def login_page(request: Request) -> Response:
    """Return the log-in page; its few files are public under their plain names."""
    folder = static_folder()
    text = (folder / "login.html").read_text("utf-8")
    page = with_languages(text, languages_of(folder, version_of(folder)))
    return HTMLResponse(_with_facts(page, request), headers=_ASKED)


@router.get("/")
@router.get("/new")
@router.get("/compare")
@router.get("/find")
@router.get("/inspections")
@router.get("/inspections/{part}")
@router.get("/assets")
@router.get("/assets/{part}")
@router.get("/films")
@router.get("/films/{part}")
@router.get("/settings")
@router.get("/settings/{part}")
@viewer
@of_projects
def shell(request: Request, principal: PrincipalDep) -> Response:
    """Return the page; its script reads the address."""
    folder = static_folder()
    text = (folder / _SHELL).read_text("utf-8")
    version = version_of(folder)
    joined = with_joined_files(text, _FIRST_MODULE, script=_SCRIPT, style=_STYLE)
    whole = with_languages(joined, languages_of(folder, version))
    versioned = whole.replace('"/static/', f'"/static/{version}/')
    return HTMLResponse(
        _with_facts(versioned, request, role=principal.role, person=principal.name), headers=_ASKED
    )


@router.get("/service-worker.js")
@viewer
@of_projects
def service_worker() -> Response:
    """Return the worker that opens the page without the server; it stands here because a worker
    answers only for paths below its own.
    """
    script = (static_folder() / "service-worker.js").read_bytes()
    return Response(script, media_type="text/javascript", headers=_ASKED)


def _with_facts(page: str, request: Request, **facts: str) -> str:
    """Add what a page needs before its first paint, as `data-` attributes of its root element."""
    if request.app.state.is_open_to_lan and not is_encrypted(request):
        facts["insecure"] = "yes"
    named = "".join(f' data-{name}="{escape(value)}"' for name, value in facts.items())
    return page.replace("<html", f"<html{named}", 1)


@router.get("/favicon.ico")
def favicon() -> Response:
    """Return the icon, which browsers request here for anything that is not a page of ours."""
    return RedirectResponse("/static/icon.svg", 308)
