"""Links within the page: only to sections that its template has."""

from __future__ import annotations

from markupsafe import Markup

from app.reports.content.text import legible
from app.reports.html.svg import escaped
from app.reports.report import Entry, Report


def to_row(report: Report, entry: Entry, content: str, *, label: str = "") -> Markup:
    """Return content that leads to the row of an entry in the table of observations.

    Args:
        report: The report of the page.
        entry: The entry.
        content: Markup or, as text, what is escaped.
        label: What a screen reader says instead of the content; empty: the content itself.
    """
    shown = content if isinstance(content, Markup) else Markup(escaped(content))  # noqa: S704
    if "observations" not in report.template.sections:
        return shown
    named = Markup(' aria-label="{}"').format(legible(label)) if label else ""
    return Markup('<a href="#no-{}"{}>{}</a>').format(entry.seq, named, shown)
