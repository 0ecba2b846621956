"""Losses of exchange formats: what they hold less precisely, or not at all.

A loss is listed only if this report contains what it names.
"""

from __future__ import annotations

from collections.abc import Iterable

from app.reports.report import Loss, Phrase, Report
from app.reports.text.ascii import one_line
from app.survey.distances.stated import Stated
from app.survey.fields.observation import codes_of
from app.survey.observations.tag import StatedTag
from app.survey.rounding import decimals

ONE_LINE = Loss("one_line")
NO_GEOMETRY = Loss("no_geometry")
_WITHOUT_COLUMN = tuple(
    name
    for name in StatedTag.model_fields
    if name not in codes_of("en") and name not in ("frame", "pixel", "severity")
)
"""Fields of a tag that no exchange format holds, beside its place and what stands in words."""


def only_json_holds(report: Report, *, is_named: bool = False) -> Loss:
    """Return what no exchange format can hold.

    Args:
        report: The report to be written.
        is_named: Whether the file contains the name of the inspection.
    """
    entries = report.entries
    there = {
        "part.id": True,
        "part.name": not is_named and report.name != report.asset,
        "part.film_checksum": report.source.sha256,
        "part.numbers": entries,
        "part.basis": any(entry.source for entry in entries),
        "part.raw": any(entry.raw_m is not None for entry in entries),
        "part.to_go": any(entry.to_go_m is not None for entry in entries),
        "part.wall_points": any(entry.x_m is not None for entry in entries),
        "part.places": any(entry.lon is not None for entry in entries),
        "part.photo_checksums": any(entry.photo and entry.photo.sha256 for entry in entries),
        **{
            f"part.{name}": any(getattr(entry.tag, name) is not None for entry in entries)
            for name in _WITHOUT_COLUMN
        },
        "part.joints": report.joints,
        "part.corrections": report.corrected.stated != Stated(),
        "part.rig_and_track": True,
        "part.history": report.events,
    }
    named = tuple(Phrase(key) for key, is_so in there.items() if is_so)
    return Loss("only_json", named=named)


def only_bundle_holds(report: Report) -> list[Loss]:
    """Return what only the bundle has of an entry, beside its main photo."""
    if any(entry.more_photos or entry.voice_notes for entry in report.entries):
        return [Loss("only_bundle")]
    return []


def rounded_figures(report: Report, digits: int) -> list[Loss]:
    """Return figures that are rounded, and texts that are joined to one line.

    Args:
        report: The report to be written.
        digits: Decimals of a distance in metres.
    """
    entries = [entry for entry in report.entries if entry.distance_m is not None]
    steps = []
    if any(_is_rounded(entry.distance_m, digits) for entry in entries):
        steps.append(Phrase("part.rounded_distances", step=10 ** (3 - digits)))
    if any(_is_rounded(entry.u95_m, 2) for entry in entries):
        steps.append(Phrase("part.rounded_intervals"))
    if any(entry.time_s and entry.time_s % 1 for entry in entries):
        steps.append(Phrase("part.rounded_times"))
    losses = [Loss("rounded", steps=tuple(steps))] if steps else []
    if any(one_line(text) != text for text in _texts(report)):
        losses.append(ONE_LINE)
    return losses


def _is_rounded(value_m: float | None, digits: int) -> bool:
    return value_m is not None and float(decimals(value_m, digits)) != float(decimals(value_m, 3))


def _texts(report: Report) -> Iterable[str]:
    yield from (entry.tag.remark for entry in report.entries if entry.tag.remark)
    yield from (value for value in report.header.values() if isinstance(value, str))
