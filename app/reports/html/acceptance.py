"""The pages by which a client accepts: the sections of a delivery, and the report of each with a
form.  They need no script, and no address in them holds the secret of their own.
"""

from __future__ import annotations

from app.errors import AppError, code_of
from app.reports.content.translator import Translator
from app.reports.html.web_page import TEMPLATES, mark_over, style
from app.storage.records.acceptance import LinkView, SectionView

POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
    "form-action 'self'; frame-ancestors 'none'"
)
"""As that of a report's own page, whose styles are in it."""
_PLACE = b"<!--answer-->"
"""Where the form goes in the page of a report; no text of a report can hold it."""


def overview(link: LinkView, t: Translator) -> str:
    """Return the page of a link: its sections and how they stand."""
    return _page("acceptance.html", t, title=t("acceptance.title"), link=link)


def section(
    report: bytes, link: LinkView, shown: SectionView, t: Translator, form: dict[str, str]
) -> bytes:
    """Return the page of a section: its report with what was said and a form.

    Args:
        report: The report as HTML, for acceptance.
        link, shown: The link and the section.
        t: The words.
        form: What the form holds: its id, what was typed before, and the fault in it.
    """
    answer = TEMPLATES.get_template("answer.html").render(t=t, link=link, shown=shown, form=form)
    return report.replace(_PLACE, answer.encode(), 1)


def failure(error: AppError, t: Translator) -> str:
    """Return the page that says why there is nothing to see."""
    sentence = t.one_of("acceptance_failure", code_of(type(error)), t("acceptance_failure.other"))
    return _page("acceptance.html", t, title=t("acceptance.title"), sentence=sentence, link=None)


def _page(template: str, t: Translator, **values: object) -> str:
    page = TEMPLATES.get_template(template)
    return page.render(t=t, style=style(), mark=mark_over(t), policy=POLICY, **values)
