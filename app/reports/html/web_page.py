"""The report as one HTML file that opens from the disk, without a network.

It contains photos as data URIs, and the 3D view as a page within the page that is drawn on demand.
The policy in its head forbids every request; all text is escaped.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from app.reports.content.condition import ACT_NOW, CLEANED_AWAY, condition_of
from app.reports.content.text import legible
from app.reports.content.translator import NOTHING, Translator
from app.reports.html.pipe_strip import pipe_strip
from app.reports.pdf.cover import cover_rows, warnings_of
from app.reports.pdf.header_sheet import GROUPS, header_row
from app.reports.pdf.measurement import (
    correction_rows,
    joint_table,
    result_rows,
    rig_rows,
    video_rows,
)
from app.reports.pdf.observations import reference_of
from app.reports.pdf.pictures import jpeg_of
from app.reports.pdf.sign_off import action_of
from app.reports.pdf.summary import opening
from app.reports.report import Entry, Loss, Report, Written
from app.reports.tables.table import iso
from app.survey.catalogue.header import FIELDS, is_empty, required_to_issue
from vo_core.errors import ChainageError

ENOUGH_PX = 1280
"""Longer side of a photo; one that is twice as large is reduced."""

_POLICY = (
    "default-src 'none'",
    "style-src 'unsafe-inline'",
    "img-src data: blob:",
    "base-uri 'none'",
    "form-action 'none'",
)
_SCENE_POLICY = (
    # A nested page inherits the policy of the outer one; viser's own is unpacked by inline scripts,
    # so that hashes cannot name them.
    "script-src 'unsafe-inline' 'wasm-unsafe-eval' blob: data:",
    "font-src data:",
    "worker-src blob: data:",
    "connect-src data: blob:",
    "frame-src 'self'",
)

Rows = Sequence[tuple[str, str]]


@dataclass(frozen=True)
class _Section:
    id: str
    title: str
    body: str


def write(report: Report) -> Written:
    """Write the report in its language and units."""
    t = Translator.of(report)
    scene, losses = _scene(report)
    sections = [
        _Section("summary", t("summary.title"), _summary(report, t)),
        _Section("graphic", t("graphic.title"), pipe_strip(report, t)),
        _Section("observations", t("observations.title"), _observations(report, t)),
        _Section("photos", t("photos.title"), _photos(report, t)),
        _Section("scene", t("web.scene"), _scene_body(scene, t)),
        _Section("header", t("header.title"), _header(report, t)),
        _Section("condition", t("condition.title"), _condition(report, t)),
        _Section("measurement", t("measurement.title"), _measurement(report, t)),
        _Section("checks", t("sign.title"), _checks(report, t)),
    ]
    policy = "; ".join(_POLICY if scene is None else (*_POLICY, *_SCENE_POLICY))
    title = f"{t('cover.title')}: {report.asset}"
    links = "".join(f'<li><a href="#{s.id}">{_e(s.title)}</a></li>' for s in sections)
    parts = "\n".join(
        f'<section id="{s.id}" aria-labelledby="{s.id}-title">'
        f'<h2 id="{s.id}-title">{_e(s.title)}</h2>\n{s.body}\n</section>'
        for s in sections
    )
    page = f"""<!doctype html>
<html lang="{report.language}">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_e(policy)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="Chainage">
<title>{_e(title)}</title>
<style>
{_asset("web_page.css")}</style>
</head>
<body>
<a class="skip" href="#observations">{_e(t("web.skip"))}</a>
<header>
<p class="kicker">{_e(t("cover.title"))}</p>
<h1>{_e(report.asset)}</h1>
{_bands(report, t)}
{_pairs(cover_rows(report, t))}
</header>
<nav aria-label="{_e(t("web.contents"))}"><ul>{links}</ul></nav>
<main>
{parts}
</main>
<footer><p>{_e(_foot(report, t))}</p></footer>
{_scene_script(scene)}</body>
</html>
"""
    return Written(page.encode(), losses)


def _e(text: object) -> str:
    """Escape text for markup and attribute values."""
    return html.escape(legible(str(text)))


def _asset(name: str) -> str:
    return resources.files("app.reports.html").joinpath(name).read_text("utf-8")


def _foot(report: Report, t: Translator) -> str:
    return t(
        "page.foot",
        asset=report.asset,
        date=str(report.header.get("date") or NOTHING),
        report=report.id,
        revision=report.revision,
    )


def _pairs(rows: Rows) -> str:
    items = "".join(f"<div><dt>{_e(name)}</dt><dd>{_e(value)}</dd></div>" for name, value in rows)
    return f'<dl class="pairs">{items}</dl>'


def _table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], kind: str) -> str:
    """Build a table with a caption, in a scrolling box where it is too wide.

    Args:
        caption: Its text.
        heads: Texts of the head row.
        rows: Cells as markup; the first cell of each row is its head.
        kind: Class of the table.
    """
    head = "".join(f'<th scope="col">{_e(name)}</th>' for name in heads)
    body = "\n".join(
        f'<tr><th scope="row">{first}</th>' + "".join(f"<td>{c}</td>" for c in cells) + "</tr>"
        for first, *cells in rows
    )
    return (
        f'<div class="wide" role="group" tabindex="0" aria-label="{_e(caption)}">'
        f'<table class="{kind}"><caption>{_e(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>"
    )


def _bands(report: Report, t: Translator) -> str:
    return "\n".join(
        f'<p class="{"band alarm" if warned.is_alarm else "band"}">{_e(warned.text)}</p>'
        for warned in warnings_of(report, t)
    )


def _summary(report: Report, t: Translator) -> str:
    found = condition_of(report)
    met = report.adjusted.distance_class() if report.adjusted else None
    share = found.stretch_percent
    percent = NOTHING
    if met is not None:
        percent = t("summary.not_met") if met.percent is None else f"{met.percent:g} %"
    figures = [
        (t("summary.surveyed"), t.length(report.distance_m)),
        (t("summary.observations"), str(len(report.defects))),
        (t("summary.act_now"), str(found.counts[ACT_NOW])),
        (t("summary.overall"), t(f"overall.{int(found.overall)}")),
        (t("summary.distance_class"), percent),
        (t("summary.stretches"), NOTHING if share is None else f"{share:.0f} %"),
    ]
    items = "".join(
        f"<div><dt>{_e(name)}</dt><dd>{_e(value)}</dd></div>" for name, value in figures
    )
    lead = "".join(f'<p class="lead">{_e(text)}</p>' for text in opening(report, t))
    return f'{lead}<dl class="figures">{items}</dl>'


def _observations(report: Report, t: Translator) -> str:
    if not report.entries:
        return f"<p>{_e(t('observations.none'))}</p>"
    heads = [
        t(f"entry.{name}")
        for name in ("no", "distance", "joint", "code", "what_and_remark", "clock_long",
                     "quantity", "stretch_short", "severity_short", "time")
    ]  # fmt: skip
    text = t("observations.help", reference=reference_of(report, t), pack=report.pack)
    return f"<p>{_e(text)}</p>" + _table(
        t("observations.title"),
        heads,
        (_observation(entry, t) for entry in report.entries),
        "observations",
    )


def _observation(entry: Entry, t: Translator) -> Sequence[str]:
    number = f'<span id="no-{entry.seq}">{entry.seq}</span>'
    if entry.photo and entry.photo.path:
        number = f'<a id="no-{entry.seq}" href="#photo-{entry.seq}">{entry.seq}</a>'
    remark = "" if not entry.tag.remark else f'<p class="remark">{_e(entry.tag.remark)}</p>'
    return (
        number,
        _e(t.short_place(entry)),
        "" if entry.joint_no is None else str(entry.joint_no),
        _e(t.code(entry)),
        f"{_e(t.label(entry))}{remark}",
        _e(t.clock(entry)),
        "<br>".join(map(_e, t.quantities(entry))),
        _e(t.stretch(entry)),
        _severity(entry, t),
        _e(t.time(entry.time_s)),
    )


def _severity(entry: Entry, t: Translator) -> str:
    """Show figure and word: colour is never the only sign."""
    if entry.tag.severity is None:
        return f'<span class="unrated">{_e(t.severity(None))}</span>'
    return (
        f'<span class="severity s{entry.tag.severity}">{entry.tag.severity}</span> '
        f"{_e(t.severity(entry.tag.severity))}"
    )


def _photos(report: Report, t: Translator) -> str:
    shown = [
        _photo(entry, entry.photo.name, entry.photo.path, t)
        for entry in report.entries
        if entry.photo and entry.photo.path
    ]
    if not shown:
        return f"<p>{_e(t('photos.none'))}</p>"
    return '<div class="photos">' + "\n".join(shown) + "</div>"


def _photo(entry: Entry, name: str, path: Path, t: Translator) -> str:
    caption = t("photos.caption", seq=entry.seq, place=t.place(entry), code=t.code(entry))
    jpeg = jpeg_of(path, ENOUGH_PX)
    if jpeg is None:
        picture = f"<p>{_e(t('photos.missing', name=name))}</p>"
    else:
        data = base64.b64encode(jpeg.content).decode()
        alt = t("web.photo", seq=entry.seq, label=t.label(entry), place=t.place(entry))
        picture = f'<img src="data:image/jpeg;base64,{data}" alt="{_e(alt)}">'
    return (
        f'<figure id="photo-{entry.seq}">{picture}<figcaption>'
        f'<a href="#no-{entry.seq}">{_e(caption)}</a> {_e(t.label(entry))}</figcaption></figure>'
    )


def _header(report: Report, t: Translator) -> str:
    missing = set(required_to_issue(dict(report.header)))
    known = {field.name for field in FIELDS}
    parts = []
    for group, names in GROUPS:
        rows = [row for name in names if (row := header_row(report, t, name, name in missing))]
        if rows:
            parts.append(f"<h3>{_e(t(f'header.{group}'))}</h3>{_pairs(rows)}")
    others = [
        (t.field(name), t.value(name, value))
        for name, value in report.header.items()
        if name not in known and not is_empty(value)
    ]
    if others:
        parts.append(f"<h3>{_e(t('header.others'))}</h3>{_pairs(others)}")
    return "\n".join(parts) or f"<p>{_e(t('header.empty'))}</p>"


def _condition(report: Report, t: Translator) -> str:
    found = condition_of(report)
    deciding = NOTHING
    if found.deciding is not None:
        entry = found.deciding
        deciding = f"{t.number_of(entry)}, {t.label(entry)}, {t.place(entry)}"
    rows = [
        (t("condition.overall"), t(f"overall.{int(found.overall)}")),
        (t("condition.deciding"), deciding),
    ]
    counts = [
        (f'<span class="severity s{n}">{n}</span> {_e(t.severity(n))}', str(found.counts[n]))
        for n in sorted(found.counts, reverse=True)
    ]
    counts.append((_e(t.severity(None)), str(found.unrated)))
    texts = [
        t("condition.rule", codes=", ".join(CLEANED_AWAY)),
        t("condition.not_a_grade"),
        t("condition.who"),
    ]
    if found.stretch_percent is not None:
        texts.append(t("condition.stretches", percent=f"{found.stretch_percent:.0f}"))
    if report.header.get("end_condition") == "abandoned":
        texts.append(t("condition.abandoned"))
    return (
        _pairs(rows)
        + _table(
            t("condition.title"),
            [t("web.severity"), t("summary.observations")],
            counts,
            "counts",
        )
        + "".join(f"<p>{_e(text)}</p>" for text in texts)
    )


def _measurement(report: Report, t: Translator) -> str:
    parts = [f"<p>{_e(t('measurement.method'))}</p>"]
    for name, rows in (
        ("result", result_rows(report, t)),
        ("corrections", correction_rows(report, t)),
        ("rig", rig_rows(report, t)),
        ("video", video_rows(report, t)),
    ):
        parts.append(f"<h3>{_e(t(f'measurement.{name}'))}</h3>{_pairs(rows)}")
    if report.joint_evidence:
        heads, cells = joint_table(report.joint_evidence, t)
        joints = [[_e(cell) for cell in row] for row in cells]
        parts.append(_table(t("measurement.joints"), heads, joints, "joints"))
    return "\n".join(parts)


def _checks(report: Report, t: Translator) -> str:
    parts = [f"<h3>{_e(t('sign.checks'))}</h3>"]
    entries = {entry.id: entry for entry in report.entries}
    if report.issues:
        rows = [
            (_e(t(f"sign.{issue.level}")), _e(t.issue(issue, entries))) for issue in report.issues
        ]
        heads = [t("sign.level"), t("sign.issue")]
        parts.append(_table(t("sign.checks"), heads, rows, "checks"))
    else:
        parts.append(f"<p>{_e(t('sign.nothing'))}</p>")
    parts.append(f"<h3>{_e(t('sign.history'))}</h3>")
    if report.events:
        log = [
            (
                f'<time datetime="{iso(event.at)}">{_e(t.instant(event.at))}</time>',
                _e(event.who),
                _e(t.one_of("action", action_of(event))),
                _e(event.remark or ""),
            )
            for event in report.events
        ]
        heads = [t("web.when"), t("sign.who"), t("sign.what"), t("web.why")]
        parts.append(_table(t("sign.history"), heads, log, "history"))
    else:
        parts.append(f"<p>{_e(t('sign.no_history'))}</p>")
    return "\n".join(parts)


def _scene(report: Report) -> tuple[str | None, tuple[Loss, ...]]:
    """Return the page of the 3D view, or the loss that says why there is none."""
    if report.draw_scene is None:
        return None, ()
    try:
        return report.draw_scene(report), ()
    except ChainageError as error:
        return None, (Loss(f"The 3D view is not in it: {error}"),)


def _scene_body(scene: str | None, t: Translator) -> str:
    if scene is None:
        return f"<p>{_e(t('web.no_scene'))}</p>"
    return (
        f"<p>{_e(t('web.scene_help'))}</p>"
        f'<p><button type="button" id="scene-open">{_e(t("web.scene_open"))}</button></p>'
        f'<div id="scene-place" data-title="{_e(t("web.scene"))}"></div>'
    )


def _scene_script(scene: str | None) -> str:
    """Embed the scene in base64, which cannot end the element that contains it."""
    if scene is None:
        return ""
    page = base64.b64encode(scene.encode()).decode()
    return (
        f'<script type="text/plain" id="scene-page">{page}</script>\n'
        f"<script>\n{_asset('web_page.js')}</script>\n"
    )
