"""The common rows of exchange formats: the entries in order, each converted to a row.

Nothing is dropped silently: content without a column goes to the remark, and content that cannot be
written is reported as a loss.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from app.reports.exchange.header import Header, plain_number
from app.reports.exchange.losses import only_bundle_holds, rounded_figures
from app.reports.exchange.names import film, film_name, film_names
from app.reports.report import Entry, Loss, Report, says_source
from app.reports.text.ascii import one_line, transliterate
from app.survey.catalogue import built_in
from app.survey.distances.interval import half_width_text
from app.survey.fields.declaration import Family
from app.survey.fields.observation import codes_of
from app.survey.rounding import decimals

START = "BCD"
END = "BCE"
ABANDONED = "BDC"
REMARK = "BDB"
"""General remark, for entries without a code of the standard."""

CODES = re.compile(r"(?:B[A-D]|D[A-D])[A-Z]|AE[A-G]")
"""Main codes of EN 13508-2: of pipes, of manholes, and of what changes along a pipe."""
_LETTERS = {"start": "A", "change": "C", "finish": "B"}
_SOURCES = {"counter": "by counter", "bridged": "by counter and camera", "typed": "typed"}
_MAX_H = 100
"""Hours that hh:mm:ss can no longer hold."""


@dataclass(frozen=True)
class Row:
    """An entry as a row of a format; missing values are empty or None."""

    entry: Entry
    distance_m: float
    """Never below zero."""
    code: str
    char1: str
    char2: str
    quant1: float | None
    quant2: float | None
    clock_from: int | None
    clock_to: int | None
    stretch: tuple[str, int] | None
    """A, C or B, and the number."""
    remark: str
    """Remark on one line."""
    time_s: int | None
    """Time in the film."""
    photo: str | None

    def because(self, reason: str) -> Row:
        """Return the row with the header's reason before its remark, unless it is there."""
        if not reason or reason in self.remark:
            return self
        own = one_line(self.entry.tag.remark or "")
        rest = self.remark.removeprefix(own) if reason.startswith(own) else f", {self.remark}"
        return replace(self, remark=joined(reason, rest.lstrip(", ")))


def general_remark(report: Report, header: Header, rows: Sequence[Row], *said: str) -> str:
    """Join the remarks of the header and, once each, what a format cannot hold elsewhere."""
    named = film_names(str(report.header.get("video_files") or ""))
    if [*map(film_name, named)] in ([], [film_name(film(report))]):
        header.note_written("video_files")
    if "2011" in str(report.header.get("edition")):
        header.note_written("edition")
    remark = header.text("remarks")
    for more in (*said, _abandoned_in_words(report, rows), *header.words()):
        if not any(f", {form}, " in f", {remark}, " for form in (more, transliterate(more))):
            remark = joined(remark, more)
    return remark


def _abandoned_in_words(report: Report, rows: Sequence[Row]) -> str:
    """Return words for a general remark, where no row says that the survey was abandoned."""
    is_said = any(row.code == ABANDONED for row in rows)
    if is_said or report.header.get("end_condition") != "abandoned":
        return ""
    return ": ".join(filter(None, ("survey abandoned", _abandon_reason(report))))


def _abandon_reason(report: Report) -> str:
    if report.header.get("end_condition") != "abandoned":
        return ""
    return one_line(str(report.header.get("abandon_reason") or ""))


def joined(*parts: str) -> str:
    """Join non-empty parts with commas."""
    return ", ".join(part for part in parts if part)


def rows_of(
    report: Report, codes: re.Pattern[str] = CODES, *, digits: int = 2
) -> tuple[list[Row], list[Loss]]:
    """Sort by written distance, then by time; the start code comes first, the code of the end last.

    Args:
        report: The report.
        codes: Those that the format knows.
        digits: Decimals of its distances in metres.

    Returns:
        The rows, and their losses.
    """
    has_times = bool(film(report)) or report.source.kind == "import"
    rows: list[Row] = []
    losses: list[Loss] = []
    for entry in report.entries:
        if entry.distance_m is None:
            losses.append(Loss("untracked", entry))
            continue
        row, lost = _row(entry, entry.distance_m, codes, has_times=has_times)
        rows.append(row)
        losses += lost
    losses += rounded_figures(report, digits)
    losses += only_bundle_holds(report)
    rows.sort(key=_as_written)
    ends = [index for index, row in enumerate(rows) if row.code == ABANDONED]
    if ends:
        rows[ends[-1]] = rows[ends[-1]].because(_abandon_reason(report))
    return _start_first_end_last(rows, losses), losses


def _as_written(row: Row) -> tuple[float, int, int]:
    """Return the sort key: written distance and second, so that a reader sorts the same way."""
    return float(decimals(row.distance_m, 2)), row.time_s or 0, row.entry.seq


def _row(
    entry: Entry, distance_m: float, codes: re.Pattern[str], *, has_times: bool
) -> tuple[Row, list[Loss]]:
    tag = entry.tag
    said: list[str] = [one_line(tag.remark or "")]
    losses: list[Loss] = []
    own = [one_line(part or "") for part in (tag.code, tag.char1, tag.char2)]
    code, char1, char2 = (entry.kind and entry.kind.en13508) or own
    coded = " ".join(part for part in ("coded", *own) if part)
    quantities = (tag.quant1, tag.quant2)
    if [code, char1, char2] != own:
        said.append(coded)
        quantities = _held(quantities, code, char1, char2)
    if not code:
        said.append("tag without a code")
        losses.append(Loss("no_code", entry, code=REMARK))
    elif not codes.fullmatch(code):
        said.append(coded)
        losses.append(Loss("foreign_code", entry, code=code, written=REMARK))
    if not codes.fullmatch(code):
        code, char1, char2 = REMARK, "", ""
    if code == REMARK:
        quantities = (None, None)
    if quantities != (tag.quant1, tag.quant2):
        said += _quantities(entry)
    stretch = None
    if entry.cont_id is not None and entry.cont_role is not None:
        stretch = (_LETTERS[entry.cont_role], entry.cont_id)
    if entry.joint_no is not None:
        said.append(f"joint {entry.joint_no}")
    if distance_m <= -0.005:  # a value that rounds to 0.00 is not below zero
        said.append(f"at {decimals(distance_m, 2)} m")
        losses.append(Loss("before_zero", entry))
    if entry.u95_m is not None:
        said.append(f"+/-{half_width_text(entry.u95_m)} m")
    if says_source(entry):
        said.append(f"distance {_SOURCES[entry.source or 'typed']}")
    if entry.tag.severity is not None:
        said.append(f"severity {entry.tag.severity}")
    time_s = None if entry.time_s is None else math.floor(entry.time_s + 0.0005)
    if time_s is not None and not (has_times and 0 <= time_s < 3600 * _MAX_H):
        losses.append(Loss("no_time", entry))
        time_s = None
    if entry.clock_from is None and entry.tag.clock_to is not None:
        losses.append(Loss("half_sector", entry))
    row = Row(
        entry=entry,
        distance_m=max(0.0, distance_m),
        code=code,
        char1=char1,
        char2=char2,
        quant1=quantities[0],
        quant2=quantities[1],
        clock_from=entry.clock_from if entry.clock_from is not None else entry.tag.clock_to,
        clock_to=entry.tag.clock_to if entry.clock_from is not None else None,
        stretch=stretch,
        remark=joined(*said),
        time_s=time_s,
        photo=entry.photo.name if entry.photo else None,
    )
    return row, losses


def _held(
    quantities: tuple[float | None, float | None], *code: str
) -> tuple[float | None, float | None]:
    """Return the quantities of a pack's code that the code written for it has, too."""
    row = built_in().find(*code)
    first, second = quantities
    return (
        first if row and row.unit_q1 else None,
        second if row and row.unit_q2 else None,
    )


def _quantities(entry: Entry) -> Iterable[str]:
    for value, unit in ((entry.tag.quant1, entry.unit1), (entry.tag.quant2, entry.unit2)):
        if value is not None:
            yield f"{plain_number(value)} {unit or ''}".strip()


def _start_first_end_last(rows: list[Row], losses: list[Loss]) -> list[Row]:
    start = next((row for row in rows if row.code == START), None)
    end = next((row for row in reversed(rows) if row.code in (END, ABANDONED)), None)
    if start is None:
        losses.append(Loss("no_start", code=START))
    if end is None:
        losses.append(Loss("no_end", code=END, abandoned=ABANDONED))
    between = [row for row in rows if row is not start and row is not end]
    for row in between:
        if start is not None and row.distance_m < start.distance_m:
            losses.append(Loss("before_start", row.entry))
        if end is not None and row.distance_m > end.distance_m:
            losses.append(Loss("beyond_end", row.entry))
    return [*([start] if start else []), *between, *([end] if end else [])]


def texts_of(row: Row) -> dict[str, str]:
    """Return the values of a row by the names of `app.survey.fields.observation`, empty where there
    is none.
    """
    hours = [hour for hour in (row.clock_from, row.clock_to) if hour is not None]
    clock_from, clock_to = ([f"{hour:02d}" for hour in hours] + ["", ""])[:2]
    return {
        "distance_m": decimals(row.distance_m, 2),
        "film_time_s": "" if row.time_s is None else clock_time(row.time_s),
        "code": row.code,
        "char1": row.char1,
        "char2": row.char2,
        "at_joint": "A" if row.entry.at_joint else "",
        "quant1": "" if row.quant1 is None else plain_number(row.quant1),
        "quant2": "" if row.quant2 is None else plain_number(row.quant2),
        "continuous": f"{row.stretch[0]}{row.stretch[1]}" if row.stretch else "",
        "clock_from": clock_from,
        "clock_to": clock_to,
        "photo_name": one_line(row.photo or ""),
        "remark": row.remark,
    }


def in_columns(texts: Mapping[str, str], family: Family) -> dict[str, str]:
    """Return the filled texts by the columns of a family of formats."""
    return {
        codes[0]: texts[name] for name, codes in codes_of(family).items() if codes and texts[name]
    }


def clock_time(time_s: int) -> str:
    """Format hh:mm:ss."""
    return f"{time_s // 3600:02d}:{time_s // 60 % 60:02d}:{time_s % 60:02d}"
