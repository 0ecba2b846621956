"""The act-now sheet: one page for the person who must close the road tonight."""

from __future__ import annotations

import io

from app.reports.content.condition import urgent
from app.reports.content.translator import NOTHING, Translator
from app.reports.pdf.characters import missing_glyphs
from app.reports.pdf.model import Data, about, running
from app.reports.pdf.photos import photo_alt, picture_of
from app.reports.pdf.typesetter import Workshop, workshop
from app.reports.report import Entry, Report, Written
from app.reports.text.typesetting import one_line

_LIST = 4
_REMARK = 700
"""Characters of the remark that have room."""


def write(report: Report) -> Written:
    """Write one page about every entry of severity 5: the first with photo, the others listed."""
    t, entries, out = Translator.of(report), urgent(report), io.BytesIO()
    title = t("emergency.title" if entries else "emergency.calm")
    with workshop(report.scratch) as shop:
        shop.write_data("sheet", _sheet(report, entries, title, t, shop))
        shop.set_document("emergency", about(report, title), out)
    return Written(out.getvalue(), missing_glyphs(report))


def _sheet(report: Report, entries: list[Entry], title: str, t: Translator, shop: Workshop) -> Data:
    header = report.header
    nodes = [str(header.get(name) or NOTHING) for name in ("start_node", "end_node")]
    road = " · ".join(
        str(header[name]) for name in ("road", "road_chainage", "location_text") if header.get(name)
    )
    return {
        "title": title,
        "made": t("emergency.made", at=t.instant(report.made_at)),
        "running": running(report, t, title),
        "where": _lines(
            (t("emergency.asset"), report.asset),
            (t("emergency.road"), road or NOTHING),
            (t("cover.nodes"), t("cover.from_to", start=nodes[0], end=nodes[1])),
            (t("cover.client"), str(header.get("client") or NOTHING)),
        ),
        "first": _first(report, entries[0], t, shop) if entries else None,
        "others": [
            {
                "severity": entry.tag.severity,
                "place": f"{t.place(entry)} · {t.code(entry)}",
                "label": " · ".join(p for p in (t.label(entry), t.clock_in_words(entry)) if p),
            }
            for entry in entries[1 : _LIST + 1]
        ],
        "more": t("emergency.more", n=len(entries) - 1 - _LIST) if len(entries) > _LIST + 1 else "",
        "from": one_line(t("emergency.from", who=header.get("operator") or NOTHING)),
        "company": one_line(report.company.name or ""),
    }


def _first(report: Report, entry: Entry, t: Translator, shop: Workshop) -> Data:
    """Return the worst entry with all that is known."""
    coordinates = NOTHING if entry.lat is None else f"{entry.lat:.6f}, {entry.lon:.6f}"
    rows = [
        (t("entry.no"), str(entry.number)),
        (t("entry.joint"), NOTHING if entry.joint_no is None else str(entry.joint_no)),
        (t("entry.clock_long"), t.clock_in_words(entry) or NOTHING),
        (t("entry.quantity"), ", ".join(t.quantities(entry)) or NOTHING),
        *((t("entry.measured"), size) for size in t.sizes(entry)),
        (t("emergency.coordinates"), coordinates),
        (t("emergency.to_go"), t.length(entry.to_go_m)),
        (t("emergency.tagged_by"), entry.tagged_by),
        (t("emergency.tagged_at"), t.instant(entry.tagged_at)),
        (t("entry.time"), t.time(entry.time_s) or NOTHING),
    ]
    if entry.photo and entry.photo.taken:
        rows.append((t("sheet.photo"), t.place_in_photo(entry, entry.photo.taken)))
    advice = entry.tag.recommendation
    remark = "\n".join(
        text
        for text in (entry.tag.remark, advice and f"{t('sheet.recommendation')}: {advice}")
        if text
    )
    return {
        "severity": entry.tag.severity,
        "title": one_line(f"{t.label(entry)} ({t.code(entry)})"),
        "place": t.place(entry),
        "facts": _lines(*rows),
        "alt": photo_alt(entry, entry.photo, t),
        **picture_of(entry.photo, t, shop),
        "remark": remark[:_REMARK],
        "goes_on": t("emergency.remark_goes_on") if len(remark) > _REMARK else "",
    }


def _lines(*rows: tuple[str, str]) -> list[tuple[str, str]]:
    """Return names and values, each in one line."""
    return [(one_line(name), one_line(value)) for name, value in rows]
