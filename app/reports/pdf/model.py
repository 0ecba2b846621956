"""What templates read of a report: plain data, in the words, the numbers and the units of its
language.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from app.reports.content.condition import SEVERITIES, condition_of, worst_first
from app.reports.content.cover import cover_rows, warnings_of
from app.reports.content.header import header_groups
from app.reports.content.measurement import (
    correction_rows,
    counter_rows,
    joint_table,
    result_rows,
    rig_rows,
    video_rows,
)
from app.reports.content.pictures import logo_of
from app.reports.content.sections import checks, condition, order_of
from app.reports.content.shown_photos import photos_by_entry, shown_photos
from app.reports.content.summary import MOST_WORST, key_figures, opening
from app.reports.content.translator import Translator
from app.reports.drawings.along import along_the_run
from app.reports.drawings.bars import bars
from app.reports.drawings.glance import pipe_at_a_glance
from app.reports.drawings.pipe_graphic import legend, pipe_sheets
from app.reports.drawings.seen_wall import remarks_on, wall_of
from app.reports.drawings.survey_plan import survey_plan
from app.reports.drawings.unrolled_wall import MOST_PAGES, SCALES, wall_scale, wall_strips
from app.reports.pdf.photos import photo_data
from app.reports.pdf.typesetter import About, Workshop
from app.reports.report import Company, Entry, Report
from app.reports.template import Section
from app.reports.text.typesetting import one_line

Data = dict[str, Any]

_LOGO_PX = 700
_MOST_ADDRESS_LINES = 12
_LONG, _SHOWN_OF_LONG = 500, 250
"""A remark with more characters is printed in full after the table, which shows its beginning."""
_SHORT_REMARK = 90
"""Characters of a remark in the list of the worst."""


def report_data(report: Report, t: Translator, shop: Workshop, *, title: str = "") -> Data:
    """Return what the templates read of a report; its pictures go into the workshop.

    Args:
        report: The report.
        t: Its words.
        shop: Where the document is made.
        title: Title on its cover where it is one report of many, which has no links between rows
            and photos; empty for a document of its own.
    """
    sections = [section for section in report.template.sections if section in _SECTIONS]
    shown = shown_photos(report) if "photos" in sections else []
    by_entry = photos_by_entry(shown)
    return {
        "has_links": not title,
        "accent": report.template.accent,
        "running": running(report, t, t("cover.title")),
        "company": company_data(report.company, report.template.accent, t, shop),
        "title": title or t("cover.title"),
        "asset": report.asset[:200],
        "where": _where(report),
        "warnings": [
            {"text": one_line(warned.text), "is_alarm": warned.is_alarm}
            for warned in warnings_of(report, t)
        ],
        "facts": cover_rows(report, t),
        "introduction": report.template.introduction,
        "closing": report.template.closing,
        "sections": sections,
        "entries": [
            entry_data(entry, n, [photo.number for photo in by_entry.get(entry.id, ())], t)
            for n, entry in enumerate(report.entries)
        ],
        "photos": [photo_data(report, photo, t, shop) for photo in shown],
        **{
            section: make(report, t, shop)
            for section in sections
            if (make := _SECTIONS[section]) is not None
        },
    }


def about(report: Report, title: str) -> About:
    """Return what the file of a report states about itself."""
    return About(
        title=one_line(f"{title} · {report.asset}"),
        author=one_line(report.company.name or "") or "Chainage",
        subject=one_line(f"{report.name} · {report.id}"),
        language=report.language,
        made_at=report.made_at,
    )


def running(report: Report, t: Translator, title: str) -> Data:
    """Return what stands at the head and the foot of pages."""
    foot = t(
        "page.foot",
        asset=report.asset,
        date=t.date(report.date),
        report=report.id,
        revision=report.revision,
    )
    mark = t("acceptance.mark") if report.extras.for_acceptance else ""
    return running_data(report.company, f"{title} · {report.asset}", foot, mark)


def running_data(company: Company, title: str, foot: str, mark: str = "") -> Data:
    """Return head and foot of pages that are of no single report, and what is written across."""
    return {
        "company": one_line(company.name or "")[:200],
        "title": one_line(title)[:200],
        "foot": one_line(foot)[:300],
        "mark": mark,
    }


def company_data(company: Company, accent: str, t: Translator, shop: Workshop) -> Data:
    """Return the letterhead."""
    logo = logo_of(company.logo, _LOGO_PX)
    alt = t("web.logo", company=company.name or "")
    return {
        "name": company.name or "",
        "address": "\n".join(company.address.splitlines()[:_MOST_ADDRESS_LINES]),
        "logo": logo and {"file": shop.add_photo(logo), "alt": alt},
        "accent": accent,
    }


def entry_data(entry: Entry, n: int, photos: Sequence[int], t: Translator) -> Data:
    """Return an observation as tables show it."""
    remark = entry.tag.remark or ""
    is_long = len(remark) > _LONG
    shown = (
        t("observations.goes_on", start=one_line(remark[:_SHOWN_OF_LONG])) if is_long else remark
    )
    short = one_line(remark)
    return {
        "id": n,
        "no": str(entry.number),
        "heading": f"{t.number_of(entry)} · {t.place(entry)} · {t.code(entry)}",
        "place": t.short_place(entry),
        "joint": "" if entry.joint_no is None else str(entry.joint_no),
        "code": t.code(entry),
        "label": t.label(entry),
        "sizes": t.sizes(entry),
        "clock": t.clock(entry),
        "quantities": t.quantities(entry),
        "stretch": t.stretch(entry),
        "severity": entry.tag.severity,
        "time": t.time(entry.time_s),
        "remark": remark,
        "shown_remark": shown,
        "short_remark": short if len(short) <= _SHORT_REMARK else f"{short[:_SHORT_REMARK]}…",
        "photos": photos,
    }


def _where(report: Report) -> str:
    names = ("road", "road_chainage", "location_text")
    parts = (one_line(str(report.header.get(name) or ""))[:300] for name in names)
    return " · ".join(part for part in parts if part)


def _summary(report: Report, t: Translator, shop: Workshop) -> Data:
    worst, order = worst_first(report), order_of(report)
    return {
        "opening": opening(report, t),
        "figures": [(value, name) for name, value in key_figures(report, t)],
        "glance": shop.add_drawing(pipe_at_a_glance(report, t)),
        "worst": [order[entry.id] for entry in worst[:MOST_WORST]],
        "more": t("summary.more", n=len(worst) - MOST_WORST) if len(worst) > MOST_WORST else "",
    }


def _header(report: Report, t: Translator, shop: Workshop) -> Data:
    return {
        "plan": shop.add_drawing(survey_plan(report, t)),
        "groups": [{"title": title, "rows": rows} for title, rows in header_groups(report, t)],
    }


def _observations(report: Report, t: Translator, _: Workshop) -> Data:
    return {"help": t("observations.help", reference=t.reference(report), pack=report.pack)}


def _condition(report: Report, t: Translator, shop: Workshop) -> Data:
    return {"counts": _counts(report, t, shop), **condition(report, t)}


def _measurement(report: Report, t: Translator, shop: Workshop) -> Data:
    if report.is_unmeasured:
        return {"imported": t("measurement.imported", filename=report.source.filename)}
    charts = along_the_run(report, t)
    heads, rows = joint_table(report.joint_evidence, t)
    return {
        "imported": "",
        "result": result_rows(report, t),
        "charts": charts and shop.add_drawing(charts),
        "corrections": correction_rows(report, t),
        "joints": {"heads": heads, "rows": rows},
        "counter": counter_rows(report, t),
        "rig": rig_rows(report, t),
        "video": video_rows(report, t),
    }


def _graphic(report: Report, t: Translator, shop: Workshop) -> Data:
    sheets = [shop.add_drawing(sheet) for sheet in pipe_sheets(report, t)]
    return {"legend": legend(report, t), "sheets": sheets}


def _wall(report: Report, t: Translator, shop: Workshop) -> Data:
    wall = wall_of(report)
    if wall is None:
        return {"note": t("wall.none"), "strips": []}
    scale = wall_scale(report, wall)
    notes = [t("wall.help", scale=scale)]
    if scale > SCALES[0]:
        notes.append(t("wall.coarser", pages=MOST_PAGES))
    strips = [shop.add_drawing(strip) for strip in wall_strips(report, t, wall)]
    return {"note": " ".join([*notes, *remarks_on(report, wall, t)]), "strips": strips}


def _counts(report: Report, t: Translator, shop: Workshop) -> Data:
    """Return a bar for each severity, the severest first."""
    found = condition_of(report)
    counts: list[tuple[int | None, int]] = [
        *((severity, found.counts[severity]) for severity in reversed(SEVERITIES)),
        (None, found.unrated),
    ]
    said = ", ".join(f"{t.severity(severity)} {count}" for severity, count in counts)
    rows = [(t.severity(severity), count, severity) for severity, count in counts]
    return shop.add_drawing(bars(rows, t("condition.counts", counts=said), has_badges=True))


_SECTIONS: Mapping[Section, Callable[[Report, Translator, Workshop], Any] | None] = {
    "summary": _summary,
    "header": _header,
    "graphic": _graphic,
    "observations": _observations,
    "photos": None,  # which all sections name
    "wall": _wall,
    "condition": _condition,
    "measurement": _measurement,
    "checks": lambda report, t, _: checks(report, t),
}
"""What may follow the cover."""
