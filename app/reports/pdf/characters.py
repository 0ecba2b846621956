"""Characters that a PDF cannot show because no font has them."""

from __future__ import annotations

from collections.abc import Iterator

from app.reports.report import Loss, Phrase, Report
from app.reports.text.typesetting import without_glyph

_NAMED = 20


def missing_glyphs(report: Report) -> tuple[Loss, ...]:
    """Return one loss that names the characters written as numbers, if there are any."""
    found = without_glyph(_texts(report))
    if not found:
        return ()
    named: list[str | Phrase] = [*found[:_NAMED]]
    if len(found) > _NAMED:
        named.append(Phrase("part.more", n=len(found) - _NAMED))
    return (Loss("no_glyph", named=tuple(named)),)


def _texts(report: Report) -> Iterator[str]:
    """Yield the texts that people have entered."""
    yield from (report.name, report.source.filename, report.reviewed_by or "")
    yield from (report.company.name or "", report.company.address)
    yield from (report.template.introduction, report.template.closing)
    yield from (value for value in report.header.values() if isinstance(value, str))
    for entry in report.entries:
        yield from (entry.tag.remark or "", entry.tag.recommendation or "")
        yield from (entry.label(report.language) or "", entry.tagged_by, entry.edited_by or "")
    for event in report.events:
        yield from (event.who, event.remark or "")
