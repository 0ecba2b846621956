"""The page behind a link for acceptance: its secret in the address is all that admits, and to
nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Annotated, Any
from uuid import uuid4

from fastapi import APIRouter, Body, Depends, Path, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from starlette.responses import HTMLResponse, RedirectResponse

from app.errors import AppError, InspectionNotFound, LinkNotFound
from app.inspections.acceptance import Acceptance, LinkView, SectionView
from app.reports.content.translator import Translator
from app.reports.content.words import LANGUAGES
from app.reports.html import acceptance as pages
from app.reports.report import Extras
from app.reports.reports import Export, Reports
from app.web.answers import answer as answer_to
from app.web.deps import Service
from app.web.downloads import attachment
from app.web.middleware import address_of
from app.web.schemas.library.acceptance import AnswerIn, fields_of
from app.web.slow import heavy

_HEADERS = {"Content-Security-Policy": pages.POLICY, "X-Robots-Tag": "noindex"}
_EXTRAS = Extras(for_acceptance=True)


class _Page(APIRoute):
    """A route that answers a failure with a page for a person."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the handler."""
        handler = super().get_route_handler()

        async def handle(request: Request) -> Response:
            try:
                return await handler(request)
            except AppError as error:
                found = error
            except RequestValidationError:
                found = LinkNotFound()
            refusal = answer_to(found)
            page = HTMLResponse(pages.failure(found, _words(request)), refusal.status_code)
            if wait := refusal.headers.get("Retry-After"):
                page.headers["Retry-After"] = wait
            page.headers.update(_HEADERS)
            return page

        return handle


router = APIRouter(prefix="/accept/{secret}", route_class=_Page, include_in_schema=False)


def _words(request: Request) -> Translator:
    """Return the words in the first language of the browser that reports have."""
    wanted = request.headers.get("accept-language", "").lower().split(",")
    known = [code for each in wanted if (code := each.strip()[:2]) in LANGUAGES]
    return Translator(known[0] if known else LANGUAGES[0], "m")


def _link(
    request: Request,
    acceptance: Service[Acceptance],
    secret: Annotated[str, Path(max_length=200)],
) -> LinkView:
    return acceptance.opened(secret, address_of(request))


Words = Annotated[Translator, Depends(_words)]
Link = Annotated[LinkView, Depends(_link)]


def _section(link: Link, place: int) -> SectionView:
    found = next((section for section in link.sections if section.place == place), None)
    if found is None:
        raise LinkNotFound
    if found.is_deleted:
        raise InspectionNotFound
    return found


Section = Annotated[SectionView, Depends(_section)]


@router.get("/")
def overview(link: Link, t: Words, acceptance: Service[Acceptance]) -> HTMLResponse:
    """Return the sections of a delivery, and how they stand."""
    acceptance.count(link)
    return HTMLResponse(pages.overview(link, t), headers=_HEADERS)


@router.get("/{place}")
@heavy
def section(link: Link, shown: Section, t: Words, reports: Service[Reports]) -> HTMLResponse:
    """Return the report of a section, with the form for the answer."""
    return _page(link, shown, t, reports, {"person": "", "text": "", "fault": ""})


@router.post("/{place}")
@heavy
def say(
    link: Link,
    shown: Section,
    t: Words,
    reports: Service[Reports],
    acceptance: Service[Acceptance],
    body: Annotated[bytes, Body(media_type="application/x-www-form-urlencoded")] = b"",
) -> Response:
    """Store what a client says; one that is sent again is the same answer."""
    form = fields_of(body)
    said, fault = AnswerIn.read(form)
    if said is None:
        typed = {"person": form.get("person", "")[:100], "text": form.get("text", "")[:4000]}
        return _page(link, shown, t, reports, typed | {"fault": t(f"acceptance.{fault}")}, 422)
    acceptance.answer(link, shown, said)
    # Relative: no address that is sent names the secret.
    return RedirectResponse(f"{shown.place}#answer", 303, _HEADERS)


@router.get("/{place}/report.pdf")
@heavy
def report(shown: Section, t: Words, reports: Service[Reports]) -> Response:
    """Return the report of a section as PDF, marked on every page and picture."""
    made = _export(reports, shown, "pdf", t)
    named = {"Content-Disposition": attachment(made.filename)}
    return Response(made.written.content, media_type=made.media_type, headers=_HEADERS | named)


def _page(
    link: LinkView,
    shown: SectionView,
    t: Translator,
    reports: Reports,
    form: dict[str, str],
    status: int = 200,
) -> HTMLResponse:
    page = _export(reports, shown, "html", t).written.content
    form = form | {"id": str(uuid4())}
    return HTMLResponse(pages.section(page, link, shown, t, form), status, _HEADERS)


def _export(reports: Reports, shown: SectionView, kind: str, t: Translator) -> Export:
    return reports.export(
        shown.inspection_id, kind, language=t.language, units=t.units, extras=_EXTRAS
    )
