"""Losses of exchange formats: what they hold less precisely, or not at all.

A loss is listed only if this report contains what it names.
"""

from __future__ import annotations

from collections.abc import Iterable

from app.reports.exchange.ascii import one_line
from app.reports.report import Loss, Report
from app.survey.rounding import decimals
from app.survey.stated import Stated

ONE_LINE = (
    "Texts stand on one line: line ends and runs of blanks become one, control characters go."
)


def left_out(report: Report, *, is_named: bool = False) -> Loss:
    """Return what no exchange format can hold.

    Args:
        report: The report to be written.
        is_named: Whether the file contains the name of the inspection.
    """
    entries = report.entries
    there = {
        "the id of the inspection": True,
        "its name": not is_named and report.name != report.asset,
        "the size and the checksum of the film": report.source.sha256,
        "the numbers and frames of the observations, who tagged them and when": entries,
        "the basis of their distances": any(entry.source for entry in entries),
        "distances before corrections": any(entry.raw_m is not None for entry in entries),
        "distances to the far end": any(entry.to_go_m is not None for entry in entries),
        "points on the wall": any(entry.x_m is not None for entry in entries),
        "places on the map": any(entry.lon is not None for entry in entries),
        "checksums of photos": any(entry.photo and entry.photo.sha256 for entry in entries),
        "the joints": report.joints,
        "the corrections": report.corrected.stated != Stated(),
        "the rig and the track": True,
        "the history": report.events,
    }
    named = ", ".join(what for what, is_so in there.items() if is_so)
    return Loss(f"Only the JSON report has {named}.")


def attached(report: Report) -> list[Loss]:
    """Return what only the bundle has of an entry, beside its main photo."""
    if any(entry.more_photos or entry.voice_notes for entry in report.entries):
        return [Loss("Further photos and voice notes of a defect are in the evidence bundle only.")]
    return []


def coarser(report: Report) -> list[Loss]:
    """Return figures that are rounded, and texts that are joined to one line."""
    entries = [entry for entry in report.entries if entry.distance_m is not None]
    steps = []
    if any(_is_rounded(entry.distance_m) for entry in entries):
        steps.append("distances to 10 mm")
    if any(_is_rounded(entry.u95_m) for entry in entries):
        steps.append("intervals up to 10 mm")
    if any(entry.time_s and entry.time_s % 1 for entry in entries):
        steps.append("times in the film down to seconds")
    losses = [Loss(f"The file has {', '.join(steps)}.")] if steps else []
    if any(one_line(text) != text for text in _texts(report)):
        losses.append(Loss(ONE_LINE))
    return losses


def transliterated(report: Report) -> list[Loss]:
    """Return losses of an ASCII file where the report has other characters."""
    names = [report.source.filename, *(e.photo.name for e in report.entries if e.photo)]
    if all(text.isascii() for text in (*names, *_texts(report))):
        return []
    return [Loss("The file is plain ASCII: other letters are transliterated.")]


def _is_rounded(value_m: float | None) -> bool:
    return value_m is not None and decimals(value_m, 2) + "0" != decimals(value_m, 3)


def _texts(report: Report) -> Iterable[str]:
    yield from (entry.tag.remark for entry in report.entries if entry.tag.remark)
    yield from (value for value in report.header.values() if isinstance(value, str))
