"""Reads EN 13508-2 text (Annex B): any separator, comma decimals, any order of fields.

An unreadable block or row is reported with its line; the others are read.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from app.errors import InvalidImport
from app.imports.survey import (
    MOST_OBSERVATIONS,
    MOST_OF_FILE,
    MOST_SURVEYS,
    Caveat,
    ImportedFile,
    ImportedObservation,
    ImportedSurvey,
    Notes,
    clean,
    clock,
    coded,
    fitting_header,
    iso_date,
    number,
    quantity,
    stretch,
    time_of_day,
    too_many,
    video_time_s,
)

_MARK = re.compile(r"^[ \t]{0,20}#(?:A1|B01|B1)[ \t]*=", re.MULTILINE)
_LIST = re.compile(r"#B0*([0-9]{1,2})=")
_LONGEST_LINE = 100_000
"""Longer lines are cut; the CSV reader accepts cells of 131 072 characters."""
_START, _END, _ABANDONED = "BCD", "BCE", "BDC"
_OTHER = "Z"

_TEXTS: Mapping[str, str] = {
    "AAA": "asset_id", "AAB": "start_node", "AAJ": "location_text", "AAM": "client",
    "ABA": "standard", "ABH": "operator", "ABI": "job_ref", "ABJ": "client_job_ref",
    "ABS": "video_files", "ADE": "remarks",
}  # fmt: skip
_NUMBERS: Mapping[str, str] = {
    "ABQ": "expected_length_m", "ACB": "height_mm", "ACC": "width_mm", "ACG": "unit_length_m",
    "ACN": "year", "ADB": "temperature_c",
}  # fmt: skip
_MATERIALS: Mapping[str, str] = {
    "AA": "asbestos cement", "AD": "brick", "AE": "clay", "AG": "concrete",
    "AH": "reinforced concrete", "AI": "sprayed concrete", "AJ": "concrete segments",
    "AK": "fibre cement", "AL": "fibre plastics", "AM": "cast iron", "AN": "grey cast iron",
    "AO": "ductile iron", "AP": "steel", "AR": "masonry", "AS": "masonry",
    "AV": "polyethylene", "AW": "polypropylene", "AX": "PVC-U", "AZ": "unknown",
    "Z": "other",
}  # fmt: skip
"""Materials of ACD and ACF."""
_LETTERS: Mapping[str, tuple[str, Mapping[str, str | bool]]] = {
    "AAK": ("direction", {"A": "with_flow", "B": "against_flow", "C": "unknown"}),
    "ABE": ("method", {"A": "walk_through", "B": "camera", "C": "from_end_only"}),
    "ABP": (
        "purpose",
        {"A": "acceptance", "B": "end_of_warranty", "C": "routine", "G": "after_repair"},
    ),
    "ABC": (
        "reference_point",
        {
            "A": "inner face of the wall at the start", "B": "crown of the pipe at the start",
            "C": "centre of the start manhole", "D": "half way along the channel at the start",
        },
    ),
    "ACA": (
        "shape",
        {
            "A": "circular", "B": "rectangular", "C": "egg", "D": "u_shaped", "E": "arch",
            "F": "oval", "Z": "other",
        },
    ),
    "ACD": ("material", _MATERIALS),
    "ACE": (
        "lining_type",
        {
            "A": "factory made", "B": "sprayed", "C": "cured in place", "D": "segments",
            "E": "discrete pipes", "F": "continuous pipe", "G": "close fit", "H": "spiral wound",
        },
    ),
    "ACF": ("lining_material", _MATERIALS),
    "ACK": ("asset_type", {"A": "foul", "B": "storm", "C": "combined", "E": "culvert"}),
    "ACM": ("cleaned", {"A": True, "B": False}),
    "ADA": ("weather", {"A": "dry", "B": "rain", "C": "snow or ice melting"}),
    "ADC": ("flow_control", {"A": "none", "B": "blocked upstream", "C": "partly blocked"}),
}  # fmt: skip
_NOT_KEPT = frozenset({"ABM"})
"""The format of the video times, which the rows themselves show."""
_COLUMNS = frozenset("ABCDEFGHIJKLMN")


@dataclass
class _Block:
    """The lines of one inspection, with their numbers."""

    line: int
    lists: list[tuple[int, str, str | None]] = field(default_factory=list)
    """Lists such as `#B01`: the line number, the codes, the values in the next line."""
    columns: str | None = None
    columns_line: int = 0
    rows: list[tuple[int, str]] = field(default_factory=list)


@dataclass(frozen=True)
class _Form:
    """The cell separators of the file."""

    separator: str = ";"
    quote: str | None = '"'

    def cells(self, line: str) -> list[str]:
        """Split a line; an unclosed quote ends with it."""
        line = line[:_LONGEST_LINE]
        if self.quote is None or self.quote not in line:
            return line.split(self.separator)
        reader = csv.reader([line], delimiter=self.separator, quotechar=self.quote)
        return next(reader, [])


def looks_like(content: bytes) -> bool:
    """Return whether some line is one that begins such a file."""
    return bool(_MARK.search(_decoded(content[: 2**16])))


def read(content: bytes) -> ImportedFile:
    """Read all readable inspections of the file.

    Raises:
        InvalidImport: None can be read; the text says why, with the line.
    """
    lines = _decoded(content).splitlines()
    form = _form(lines)
    surveys: list[ImportedSurvey] = []
    warnings: list[Caveat] = []
    room = MOST_OF_FILE
    for block in _blocks(lines):
        if len(surveys) == MOST_SURVEYS:
            warnings.append(Caveat(f"Only {MOST_SURVEYS} surveys of a file are read.", block.line))
            break
        try:
            surveys.append(_survey(block, form, min(room, MOST_OBSERVATIONS)))
            room -= len(surveys[-1].observations)
        except _BadBlock as bad:
            warnings.append(Caveat(f"This inspection is left out: {bad}.", bad.line))
    if not surveys:
        why = f" {warnings[0]}" if warnings else ""
        raise InvalidImport(f"The file has no inspection in EN 13508-2 that can be read.{why}")
    return ImportedFile(tuple(surveys), tuple(warnings))


class _BadBlock(Exception):
    """The fault, without a full stop, and its line."""

    def __init__(self, line: int, what: str) -> None:
        super().__init__(what)
        self.line = line


def _decoded(content: bytes) -> str:
    """Decode as UTF-8 if it is valid, whatever #A1 says; else as Latin letters of one byte each."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", "replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def _form(lines: Sequence[str]) -> _Form:
    stated = {line[:4]: line[4:] for line in lines if line[:2] == "#A" and line[3:4] == "="}
    # The separator may be a blank or a tab, so it is not stripped.
    separator = stated.get("#A3=", ";")[:1] or ";"
    quote = stated.get("#A5=", '"')[:1] or None
    return _Form(separator, None if quote == separator else quote)


def _blocks(lines: Sequence[str]) -> Iterator[_Block]:
    """Yield the blocks; each ends with #Z, with the next #B01, or with the file."""
    block: _Block | None = None
    wants_values = False
    for count, line in enumerate(lines, 1):
        if not line.strip():
            continue
        found = _LIST.match(line)
        if found:
            if int(found[1]) == 1 or block is None:
                if block is not None:
                    yield block
                block = _Block(count)
            block.lists.append((count, line[found.end() :], None))
            wants_values = True
        elif line.startswith("#Z"):
            if block is not None:
                yield block
            block, wants_values = None, False
        elif block is None or line.startswith("#A"):
            continue
        elif line.startswith("#C="):
            block.columns, block.columns_line = line[3:], count
            wants_values = False
        elif wants_values:
            at, codes, _ = block.lists[-1]
            block.lists[-1] = (at, codes, line)
            wants_values = False
        elif block.columns is not None:
            block.rows.append((count, line))
    if block is not None:
        yield block


def _survey(block: _Block, form: _Form, room: int) -> ImportedSurvey:
    notes = Notes()
    stated = _stated(block, form, notes)
    header = _header(stated, notes)
    observations = tuple(_observations(block, form, header, notes, room))
    codes = {observation.code for observation in observations}
    if codes & {_END, _ABANDONED}:
        header["end_condition"] = "complete" if _END in codes else "abandoned"
    abandoned = [it.remark for it in observations if it.code == _ABANDONED]
    said = abandoned[-1] if abandoned else ""
    if header.get("end_condition") == "abandoned" and said:
        header["abandon_reason"] = said
    asset = str(header.get("asset_id") or "")
    name = " ".join(part for part in (asset, str(header.get("date") or "")) if part)
    return ImportedSurvey(
        name or f"Inspection of line {block.line}",
        fitting_header(header, notes),
        observations,
        tuple(notes.said),
    )


def _stated(block: _Block, form: _Form, notes: Notes) -> dict[str, str]:
    """Return the values of the header by their codes."""
    stated: dict[str, str] = {}
    for line, codes, values in block.lists:
        if values is None:
            raise _BadBlock(line, "there is no line of values below its list of fields")
        names = [name.strip().upper() for name in form.cells(codes)]
        cells = form.cells(values)
        if len(cells) != len(names):
            notes.add(f"{len(cells)} values for {len(names)} fields.", line + 1)
        stated |= {
            name: clean(cell, len(cell))
            for name, cell in zip(names, cells, strict=False)
            if clean(cell, len(cell))
        }
    if not stated:
        raise _BadBlock(block.line, "its header is empty")
    return stated


def _header(stated: Mapping[str, str], notes: Notes) -> dict[str, str | float | bool]:
    header: dict[str, str | float | bool] = {}
    for code, value in stated.items():
        if code in _TEXTS:
            header[_TEXTS[code]] = value
        elif code in _NUMBERS:
            found = number(value)
            header[_NUMBERS[code] if found is not None else _own(code)] = (
                value if found is None else found
            )
        elif code in _LETTERS:
            name, meanings = _LETTERS[code]
            meaning = meanings.get(value.upper())
            if meaning is None:
                if value.upper() != _OTHER:  # the remarks explain it
                    notes.add(f"{code} {value!r:.40} is not known; it is kept as {_own(code)}.")
                header[_own(code)] = value
            else:
                header[name] = meaning
        elif code == "ABF":
            header["date"] = iso_date(value) or value
        elif code == "ABG":
            header["time"] = time_of_day(value) or value
        elif code not in ("AAD", "AAF") and code not in _NOT_KEPT:
            header[_own(code)] = value
    ends = [stated[code] for code in ("AAD", "AAF") if code in stated]
    start = stated.get("AAB")
    header["start_node"] = start or (ends[0] if ends else "")
    others = [end for end in ends if end != header["start_node"]]
    header["end_node"] = others[0] if others else (ends[-1] if len(ends) > 1 else "")
    return header


def _own(code: str) -> str:
    """Name a header field that has no counterpart here."""
    return f"en13508_{re.sub(r'[^a-z0-9]', '_', code.lower())[:40]}"


def _observations(
    block: _Block, form: _Form, header: Mapping[str, object], notes: Notes, room: int
) -> Iterator[ImportedObservation]:
    if block.columns is None:
        notes.add("There is no list of columns (#C), so there are no observations.", block.line)
        return
    columns = [name.strip().upper() for name in form.cells(block.columns)]
    for needed in ("I", "A"):
        if needed not in columns:
            raise _BadBlock(block.columns_line, f"its observations have no column {needed}")
    for name in columns:
        if name and name not in _COLUMNS:
            notes.add(f"The column {name:.20} is unknown and is left out.", block.columns_line)
    nodes = {str(header.get(name)) for name in ("start_node", "end_node")}
    for count, (line, text) in enumerate(block.rows):
        if count == room:
            notes.add(too_many(), line)
            return
        cells = form.cells(text)
        if len(cells) != len(columns):
            notes.add(f"{len(cells)} values for {len(columns)} columns.", line)
        if len(text) > _LONGEST_LINE:
            notes.add(f"Only {_LONGEST_LINE} characters of this line are read.", line)
        row = {name: clean(cell, len(cell)) for name, cell in zip(columns, cells, strict=False)}
        observation = _observation(row, nodes, line, notes)
        if observation is not None:
            yield observation


def _observation(
    row: Mapping[str, str], nodes: set[str], line: int, notes: Notes
) -> ImportedObservation | None:
    distance_m = number(row.get("I", ""))
    if distance_m is None:
        notes.add(f"No distance can be read from {row.get('I', '')!r:.40}; it is left out.", line)
        return None
    said = [row.get("F", "")]
    quantities: dict[str, float | None] = {"D": None, "E": None}
    for column in quantities:
        cell = row.get(column, "")
        quantities[column] = quantity(cell)
        if cell and (quantities[column] is None or _is_node(row, column, cell, nodes)):
            quantities[column] = None
            if not _is_node(row, column, cell, nodes):
                said.append(f"quantity {cell}")
    clocks = [clock(row.get(column, "")) for column in ("G", "H")]
    for column, hour in zip(("G", "H"), clocks, strict=True):
        cell = row.get(column, "")
        if hour is None and cell.strip("0"):
            notes.add(f"Clock {cell!r:.20} is not a whole hour; it is kept in the remark.", line)
            said.append(f"clock {cell}")
    continuous = stretch(row.get("J", ""))
    if row.get("J") and continuous is None:
        notes.add(f"{row['J']!r:.20} is not a stretch such as A1; it is kept in the remark.", line)
        said.append(f"stretch {row['J']}")
    time_s = video_time_s(row.get("N", ""))
    if row.get("N") and time_s is None:
        said.append(f"video {row['N']}")
    if row.get("L"):
        said.append(row["L"])
    observation = ImportedObservation(
        distance_m=distance_m,
        code=row.get("A"),
        char1=row.get("B"),
        char2=row.get("C"),
        quant1=quantities["D"],
        quant2=quantities["E"],
        clock_from=clocks[0],
        clock_to=clocks[1],
        stretch=continuous,
        at_joint=bool(row.get("K")),
        remark=", ".join(part for part in said if part),
        photo=row.get("M") or None,
        time_s=time_s,
        line=line,
    )
    return coded(observation, notes)


def _is_node(row: Mapping[str, str], column: str, cell: str, nodes: set[str]) -> bool:
    """Return whether the cell is the name of a node, as the first quantity at start and end is."""
    return column == "D" and row.get("A") in (_START, _END) and cell in nodes
