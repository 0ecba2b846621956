"""Every format of the report, by its name in the API and on the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from app.reports.format import Format, SurveyFile
from app.reports.report import Loss, Report, Written


def _in(module: str, name: str = "write") -> Callable[..., Any]:
    """Return a function of a module that its first call loads: formats need large libraries."""

    def call(*arguments: object) -> Any:
        return getattr(import_module(f"app.reports.{module}"), name)(*arguments)

    return call


def _exchange(
    stem: str, suffix: str, module: str, name: str, media_type: str = "application/xml"
) -> Format:
    begin: Callable[[], SurveyFile] = _in(f"exchange.{module}", name)

    def write(report: Report) -> Written:
        file = begin()
        losses = file.add(report)
        return Written(file.content(), losses)

    return Format(stem, suffix, media_type, write, begin)


_FORMS: Mapping[str, Format] = {
    "pdf": Format(
        "report",
        ".pdf",
        "application/pdf",
        _in("pdf"),
        losses_of=_in("pdf.characters", "missing_glyphs"),
    ),
    "html": Format(
        "report",
        ".html",
        "text/html; charset=utf-8",
        _in("html.web_page"),
        losses_of=_in("html.web_page", "losses"),
    ),
    "emergency": Format("act-now", ".pdf", "application/pdf", _in("pdf.emergency")),
    "csv": Format("defects", ".csv", "text/csv; charset=utf-8", _in("tables.table")),
    "json": Format("defects", ".json", "application/json", _in("exchange.chainage_json")),
    "xlsx": Format(
        "defects",
        ".xlsx",
        "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
        _in("tables.spreadsheet"),
    ),
    "en13508": _exchange("en13508", ".txt", "en13508", "TextFile", "text/plain; charset=us-ascii"),
    "en13508xml": _exchange("en13508", ".xml", "en13508_xml", "XmlFile"),
    "ribx": _exchange("ribx", ".ribx", "ribx", "RibxFile"),
    "isybau": _exchange("isybau", ".xml", "isybau", "file_of_2017"),
    "isybau2024": _exchange("isybau2024", ".xml", "isybau", "file_of_2024"),
    "m150": _exchange("m150", ".xml", "m150", "M150File"),
    "geojson": Format("map", ".geojson", "application/geo+json", _in("exchange.geojson")),
}
_IN_BUNDLE = ("pdf", "html", "csv", "xlsx", "json")
EXCHANGE = ("en13508", "en13508xml", "ribx", "isybau", "isybau2024", "m150")
"""Formats of other programs that name photos and film."""


def _bundle(report: Report) -> Written:
    from app.reports.bundle import bundle

    once = [kind for kind in EXCHANGE if kind != "isybau2024"]  # 2017 is what more programs read
    exchange = {kind: _FORMS[kind] for kind in (*once, "geojson")}
    return bundle.write(report, {kind: _FORMS[kind] for kind in _IN_BUNDLE}, exchange)


def _delivery(report: Report) -> Written:
    from app.reports.bundle import delivery

    return delivery.write(report, _FORMS)


def _delivery_losses(report: Report) -> tuple[Loss, ...]:
    from app.reports.bundle import delivery

    return delivery.losses(report, _FORMS)


FORMATS: Mapping[str, Format] = {
    **_FORMS,
    "archive": Format("archive", ".chainage.zip", "application/zip", _in("bundle.archive_file")),
    "zip": Format("evidence", ".zip", "application/zip", _bundle),
    "delivery": Format(
        "delivery", ".zip", "application/zip", _delivery, losses_of=_delivery_losses
    ),
}
