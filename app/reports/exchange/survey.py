"""The common rows of exchange formats: the entries in order, each converted to a row.

Nothing is dropped silently: content without a column goes to the remark, and content that cannot be
written is reported as a loss.
"""

from __future__ import annotations

import hashlib
import math
import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath

from app.reports.content.ascii import one_line, transliterate
from app.reports.content.naming import ascii_file_name
from app.reports.exchange.fields import Fields
from app.reports.exchange.losses import attached, coarser
from app.reports.report import Entry, Loss, Report
from app.survey.interval import half_width_text
from app.survey.rounding import decimals

START = "BCD"
END = "BCE"
ABANDONED = "BDC"
REMARK = "BDB"
"""General remark, for entries without a code of the standard."""

CODES = re.compile(r"(?:B[A-D]|D[A-D])[A-Z]|AE[A-G]")
"""Main codes of EN 13508-2: of pipes, of manholes, and of what changes along a pipe."""
_LETTERS = {"start": "A", "change": "C", "finish": "B"}
_CHECKSUM = 6
"""Characters of the checksum after a shortened name."""
_MAX_H = 100
"""Hours that hh:mm:ss can no longer hold."""

Clean = Callable[[str], str]


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

    @property
    def clocks(self) -> tuple[int, ...]:
        """One position, or both ends of a sector."""
        return tuple(hour for hour in (self.clock_from, self.clock_to) if hour is not None)

    def because(self, reason: str) -> Row:
        """Return the row with the header's reason before its remark, unless it is there."""
        if not reason or reason in self.remark:
            return self
        own = one_line(self.entry.tag.remark or "")
        rest = self.remark.removeprefix(own) if reason.startswith(own) else f", {self.remark}"
        return replace(self, remark=joined(reason, rest.lstrip(", ")))


def abandon_reason(report: Report) -> str:
    """Return why the survey was abandoned; empty if it was not, or no reason is given."""
    if report.header.get("end_condition") != "abandoned":
        return ""
    return one_line(str(report.header.get("abandon_reason") or ""))


def abandoned_in_words(report: Report, rows: Sequence[Row]) -> str:
    """Return words for a general remark, where no row says that the survey was abandoned."""
    is_said = any(row.code == ABANDONED for row in rows)
    if is_said or report.header.get("end_condition") != "abandoned":
        return ""
    reason = abandon_reason(report)
    return f"survey abandoned: {reason}" if reason else "survey abandoned"


def general_remark(report: Report, fields: Fields, rows: Sequence[Row], *said: str) -> str:
    """Join the remarks of the header and, once each, what a format cannot hold elsewhere."""
    _note_film_and_edition(report, fields)
    remark = fields.text("remarks")
    for more in (*said, abandoned_in_words(report, rows), *fields.words()):
        if not any(f", {form}, " in f", {remark}, " for form in (more, transliterate(more))):
            remark = joined(remark, more)
    return remark


def _note_film_and_edition(report: Report, fields: Fields) -> None:
    """Mark film name and edition as written where the file states them anyway."""
    names = _film_names(str(report.header.get("video_files") or ""))
    if [*map(_film_name, names)] in ([], [_film_name(film(report))]):
        fields.note_written("video_files")
    if "2011" in str(report.header.get("edition")):
        fields.note_written("edition")


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
    losses += coarser(report, digits)
    losses += attached(report)
    rows.sort(key=_as_written)
    ends = [index for index, row in enumerate(rows) if row.code == ABANDONED]
    if ends:
        rows[ends[-1]] = rows[ends[-1]].because(abandon_reason(report))
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
    code, char1, char2 = (one_line(part or "") for part in (tag.code, tag.char1, tag.char2))
    if not code:
        said.append("tag without a code")
        losses.append(Loss("no_code", entry, code=REMARK))
    elif not codes.fullmatch(code):
        said.append(" ".join(part for part in ("coded", code, char1, char2) if part))
        losses.append(Loss("foreign_code", entry, code=code, written=REMARK))
    if not codes.fullmatch(code):
        code, char1, char2 = REMARK, "", ""
    if code == REMARK:
        said += _quantities(entry)
    quantities = (None, None) if code == REMARK else (entry.tag.quant1, entry.tag.quant2)
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


@dataclass(frozen=True)
class Names:
    """Names of the culvert and of its ends in a file."""

    asset: str
    start: str
    end: str
    upstream: str
    """Node of the start, or of the end in a survey against the flow."""
    downstream: str

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes, the upstream one first, each once."""
        return tuple(dict.fromkeys((self.upstream, self.downstream)))


class FileNames:
    """The names that stand in a file so far: those of its further inspections are told apart."""

    def __init__(self) -> None:
        self.inspections = 0
        self.assets: dict[str, str] = {}
        """Each as it is written; the same holds for the nodes."""
        self.nodes: dict[str, str] = {}

    def made_up(self, name: str) -> str:
        """Return a stand-in for a missing name, with the number of a further inspection: two
        culverts do not meet because nobody named their ends.
        """
        return name if self.inspections < 2 else f"{name}-{self.inspections}"


def names_of(
    report: Report,
    fields: Fields,
    clean: Clean,
    known: FileNames,
    *,
    longest_asset: int | None = None,
    longest_node: int | None = None,
) -> tuple[Names, list[Loss]]:
    """Make distinct names that the format can hold.

    Args:
        report: The report.
        fields: Its header.
        clean: Converts a text for the format.
        known: The names of the file, to which those of this inspection are added.
        longest_asset: Most characters; None for any number. The same holds for `longest_node`.

    Returns:
        The names, and losses for those that were shortened or invented.
    """
    losses = []
    known.inspections += 1
    stated = {name: fields.text(name) for name in ("start_node", "end_node")}
    made_up = {"start_node": known.made_up("START"), "end_node": known.made_up("END")}
    for name, standing_in in made_up.items():
        if not clean(stated[name]):
            losses.append(Loss(f"no_{name}", written=standing_in))
            stated[name] = standing_in
    asset = fields.text("asset_id") or report.asset
    if not clean(asset):
        asset = known.made_up("ASSET")
        losses.append(Loss("no_asset_name", written=asset))
    nodes = _fitting(list(stated.values()), longest_node, clean, known.nodes)
    assets = _fitting([asset], longest_asset, clean, known.assets)
    for name, short in (nodes | assets).items():
        if short != name:
            losses.append(Loss("renamed", name=one_line(name), written=short))
    start, end = nodes[stated["start_node"]], nodes[stated["end_node"]]
    is_against = fields.choice("direction", {"against_flow": "yes"}) is not None
    up, down = (end, start) if is_against else (start, end)
    for name, own in (("upstream_node", up), ("downstream_node", down)):
        if nodes.get(str(report.header.get(name))) == own:
            fields.note_written(name)  # the direction shows which is which
    return Names(assets[asset], start, end, up, down), losses


def _fitting(
    names: Sequence[str], longest: int | None, clean: Clean, known: dict[str, str]
) -> dict[str, str]:
    """Fit each name to the format; a shortened or ambiguous one ends with its checksum."""
    for name in dict.fromkeys(names):
        if name in known:
            continue
        short = clean(name)
        if (longest is not None and len(short) > longest) or short in known.values():
            digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()
            room = None if longest is None else longest - _CHECKSUM - 1
            short = f"{short[:room]}-{digest[:_CHECKSUM]}"
        known[name] = short
    return {name: known[name] for name in names}


def day_of(report: Report, fields: Fields) -> tuple[str | None, list[Loss]]:
    """Return the day of the survey; without one, that of the film, which is reported."""
    day = fields.day()
    if day is not None or report.source.kind == "import":
        return day, []
    day = report.created_at.date().isoformat()
    return day, [Loss("no_date", day=day)]


def standard_of(fields: Fields) -> list[Loss]:
    """Return the loss where the survey follows another standard than the file."""
    standard = fields.text("standard")
    if not standard or "13508" in standard:
        return []
    return [Loss("other_standard", standard=standard)]


def film(report: Report) -> str:
    """Return the name of the film without a folder, of an import as its file has it; empty if
    there is none.
    """
    if report.extras.film_called is not None:
        return report.extras.film_called
    if report.source.kind == "import":
        names = _film_names(str(report.header.get("video_files") or ""))
        return names[0] if names else ""
    if report.source.kind == "upload":
        return _film_name(report.source.filename)
    return _film_name(f"{report.asset}.mkv") if report.source.sha256 else ""


def film_in_ascii(report: Report) -> str:
    """Return the name of the film in Latin letters; of an import, whose film is elsewhere, as it
    is.
    """
    name = film(report)
    return ascii_file_name(name) if name and report.source.kind != "import" else name


def renamed(report: Report, name: str) -> list[Loss]:
    """Return the loss where the file gives the film another name."""
    stated = {
        "upload": report.source.filename,
        "import": str(report.header.get("video_files") or ""),
    }.get(report.source.kind, "")
    own = one_line(_without_folder(stated))
    if not name or own in ("", name):
        return []
    return [Loss("film_renamed", name=own, written=name)]


def _film_names(stated: str) -> list[str]:
    parts = (one_line(_without_folder(part)) for part in re.split(r"[,;|]", stated))
    return [name for name in parts if name]


def _without_folder(path: str) -> str:
    return PurePath(path.replace("\\", "/")).name


def _film_name(path: str) -> str:
    name = unicodedata.normalize("NFC", _without_folder(path))
    safe = re.sub(r"[^\w.-]+", "_", one_line(name)).strip("._")
    return safe if re.search(r"\.[A-Za-z0-9]{1,5}$", safe) else f"{safe}.mp4" if safe else ""


def length_m(report: Report, fields: Fields, most_m: float = math.inf) -> float | None:
    """Return the length of the culvert: known and not above `most_m`, else the surveyed one."""
    known_m = fields.number_within("known_length_m", 0.001, most_m)
    return report.distance_m if known_m is None else known_m


def unit_length_m(report: Report, fields: Fields, most_m: float = math.inf) -> float | None:
    """Return the length of one pipe: from the header and not above `most_m`, else from the rig."""
    stated_m = fields.number_within("unit_length_m", 0.001, most_m)
    segment_mm = report.rig.pipe.segment_length_mm
    return stated_m if stated_m is not None else segment_mm / 1000 if segment_mm else None


def plain_number(value: float, digits: int = 6) -> str:
    """Format a number without trailing zeros."""
    text = decimals(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text else text


def hours(time_s: int) -> str:
    """Format hh:mm:ss."""
    return f"{time_s // 3600:02d}:{time_s // 60 % 60:02d}:{time_s % 60:02d}"
