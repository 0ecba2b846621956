"""The shell of the page and its files."""

from __future__ import annotations

from pathlib import Path

from fastapi import APIRouter
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles

import app

router = APIRouter(include_in_schema=False)


def static_folder() -> Path:
    """Inside the package when it was built, beside it in a checkout."""
    package = Path(app.__file__).parent
    built = package / "_static"
    return built if built.is_dir() else package.parent / "static"


class Assets(StaticFiles):
    """Files that a browser asks for again each time (a 304 if they are the same)."""

    def file_response(self, *args: object, **kwargs: object) -> Response:
        """As it is, to be revalidated."""
        response = super().file_response(*args, **kwargs)  # type: ignore[arg-type]
        response.headers["Cache-Control"] = "no-cache"
        return response


def login_page() -> Response:
    """The log-in page."""
    return _page("login.html")


@router.get("/")
@router.get("/new")
@router.get("/inspections/{inspection_id}")
def shell() -> Response:
    """One page for all three: the script reads the address."""
    return _page("index.html")


@router.get("/favicon.ico")
def favicon() -> Response:
    """Browsers ask here when they show something that is no page of ours."""
    return RedirectResponse("/static/icon.svg", 308)


def _page(name: str) -> Response:
    return FileResponse(
        static_folder() / name, media_type="text/html", headers={"Cache-Control": "no-cache"}
    )
