"""EN 13508-2 text: the exchange format of Annex B of EN 13508-2:2003+A1:2011.

One reader decodes UTF-8 whatever the file declares, another stops at an empty line, a third
mistakes a missing end node for a lateral. So texts are plain ASCII, and the file is complete,
without empty lines. Names, and the texts of an import, keep their letters: the file then declares
UTF-8.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from app.imports.en13508_fields import explanation_of
from app.reports.content.ascii import one_line, transliterate
from app.reports.exchange import lists
from app.reports.exchange.coordinates import ends_of
from app.reports.exchange.fields import Fields
from app.reports.exchange.losses import left_out
from app.reports.exchange.survey import (
    END,
    START,
    FileNames,
    Names,
    Row,
    day_of,
    film_in_ascii,
    general_remark,
    hours,
    joined,
    names_of,
    plain_number,
    renamed,
    rows_of,
    standard_of,
    unit_length_m,
)
from app.reports.exchange.survey_file import of_one
from app.reports.report import Loss, Report, Written

STANDARD = "EN 13508-2:2003+A1:2011"

_FORMAT = "EN 13508-2"
_FILE = ("#A2=en", "#A3=;", "#A4=.", '#A5="', "#A6=2010")
_NAMES = frozenset({"AAA", "AAB", "AAD", "AAF", "D"})
"""Names by which things are found again keep their letters; D has those of the ends."""
_REMARK, _PLAIN = "ADE", "AAA"
"""The remark, and a field that never needs one to be understood."""
_ALWAYS = (
    "AAA", "AAB", "AAD", "AAF", "AAK", "ABA", "ABC", "ABE", "ABF", "ABG", "ABH", "ABI", "ABM",
    "ABQ", "ABS", "ACA", "ACB", "ACC", "ACD", "ACG", "ACM", "ADA",
)  # fmt: skip
"""Fields of `#B01` that are always written; others only when they are filled."""
_COLUMNS = ("I", "J", "A", "B", "C", "D", "E", "G", "H", "K", "M", "N", "F")


def write(report: Report) -> Written:
    """Write one inspection."""
    return of_one(TextFile(), report)


class TextFile:
    """File header, then `#B01`, `#C`, a row for each entry and `#Z` for each inspection."""

    def __init__(self) -> None:
        self._names = FileNames()
        self._surveys: list[tuple[Survey, list[str]]] = []
        """Each with the lines of its rows."""

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        survey = survey_of(report, _name, self._names)
        stated = [
            survey.header,
            survey.explained,
            *(columns(it, survey.names) for it in survey.rows),
        ]
        written = stated if report.source.kind == "import" else [*map(_in_ascii, stated)]
        header, explained, *rows = written
        lines = [_line(row.get(code, "") for code in _COLUMNS) for row in rows]
        self._surveys.append((replace(survey, header=header, explained=explained), lines))
        return survey.losses if written == stated else (Loss("ascii"), *survey.losses)

    def content(self) -> bytes:
        """Return the text; readers want the same list of fields in every inspection."""
        surveys = [survey for survey, _ in self._surveys]
        filled = {code for it in surveys for code, value in it.header.items() if value}
        fields = in_order({*_ALWAYS, *filled}, {code for it in surveys for code in it.explained})
        lines = [*_FILE]
        for survey, rows in self._surveys:
            lines += [
                f"#B01={';'.join(code for code, _ in fields)}",
                _line(survey.value(code, behind) for code, behind in fields),
                f"#C={';'.join(_COLUMNS)}",
                *rows,
                "#Z",
            ]
        text = "".join(f"{line}\r\n" for line in lines)
        encoding = "ISO-8859-1" if text.isascii() else "UTF-8"
        return f"#A1={encoding}\r\n{text}".encode()


def in_order(codes: Iterable[str], explained: Collection[str]) -> list[tuple[str, str]]:
    """Return the codes in alphabetical order, with a remark behind each that needs words.

    Args:
        codes: Of the header.
        explained: Those whose letter Z has words, which follow it as a remark. The remark of the
            survey then stands behind a field of text, where it cannot be taken for such words.

    Returns:
        The codes, each with the code that it explains, or empty.
    """
    general = (_PLAIN, 1) if explained else (_REMARK, 0)
    placed = [
        *((general if code == _REMARK else (code, 0), (code, "")) for code in codes),
        *(((code, 2), (_REMARK, code)) for code in explained),
    ]
    return [field for _, field in sorted(placed)]


_KEPT = re.compile(r"en13508_([a-z]{3})")
"""Header fields of an imported survey for which Chainage has no field, by their codes."""
_DEFAULTED: Mapping[str, str] = {"ABC": "reference_point", "ABE": "method"}
"""Codes that have a default without their field."""


def _kept_codes(report: Report, fields: Fields, header: Mapping[str, str]) -> dict[str, str]:
    """Return the imported values of these codes that no header field has replaced."""
    kept = {}
    for name in report.header:
        found = _KEPT.fullmatch(str(name))
        code = found[1].upper() if found else ""
        is_free = not header.get(code) or (
            code in _DEFAULTED and not report.header.get(_DEFAULTED[code])
        )
        if found and is_free and (text := fields.text(name)):
            kept[code] = text
    return kept


def explanations(fields: Fields, codes: Iterable[str]) -> dict[str, str]:
    """Return the words that an imported file has of letters for which Chainage has no field."""
    kept = {code: fields.text(explanation_of(code)) for code in codes}
    return {code: words for code, words in kept.items() if words}


@dataclass(frozen=True)
class Survey:
    """One inspection as the text and the XML of the standard hold it."""

    header: dict[str, str]
    """Values by their codes."""
    explained: dict[str, str]
    """Words of letters Z, by their codes."""
    rows: list[Row]
    names: Names
    losses: tuple[Loss, ...]
    """What the format cannot hold."""

    def value(self, code: str, behind: str) -> str:
        """Return the value of a field, or the words of the one behind which it stands."""
        return (self.explained.get(behind) if behind else self.header.get(code)) or ""


def survey_of(report: Report, in_file: Callable[[str], str], taken: FileNames) -> Survey:
    """Collect what a file of the standard says of an inspection.

    Args:
        report: Its report.
        in_file: Converts a name to what the file can hold.
        taken: The names that other inspections have in the file.
    """
    fields = Fields(report.header)
    rows, losses = rows_of(report)
    names, lost = names_of(report, fields, in_file, taken)
    losses += lost
    header, lost = header_fields(report, fields, names, rows)
    losses += lost
    header |= coordinates(fields, names)
    explained = explanations(fields, [code for code, it in header.items() if it == lists.OTHER])
    losses += [*renamed(report, film_in_ascii(report)), left_out(report), *fields.losses(_FORMAT)]
    return Survey(header, explained, rows, names, tuple(losses))


def header_fields(
    report: Report, fields: Fields, names: Names, rows: Sequence[Row]
) -> tuple[dict[str, str], list[Loss]]:
    """Return header values by code, and the losses; RIBX uses the same ones."""
    day, losses = day_of(report, fields)
    losses += standard_of(fields)
    clock = fields.time()
    values = letters(report, fields)
    expected_m = fields.number_within("expected_length_m", 0, 1e6)
    known_m = fields.number_within("known_length_m", 0, 1e6)
    if expected_m is not None and known_m != expected_m:
        fields.leave("known_length_m")
    length_m = known_m if expected_m is None else expected_m
    height_mm = fields.number_within("height_mm", 0, 1e6)
    width_mm = fields.number_within("width_mm", 0, 1e6)
    if width_mm is None and values["ACA"] == "A":
        width_mm = height_mm
    unit_m = unit_length_m(report, fields)
    year = fields.number_within("year", 1, 9999)
    values |= {
        "AAA": names.asset,
        "AAB": names.start,
        "AAD": names.upstream,
        "AAF": names.downstream,
        "AAJ": joined(*map(fields.text, ("location_text", "road"))),
        "AAM": fields.text("client"),
        "ABA": STANDARD,
        "ABF": day or "",
        "ABG": clock[0] if clock else "",
        "ABH": fields.text("operator"),
        "ABI": fields.text("job_ref"),
        "ABJ": fields.text("client_job_ref"),
        "ABM": "A",
        "ABQ": "" if length_m is None else plain_number(length_m, 2),
        "ABS": film_in_ascii(report),
        "ACB": "" if height_mm is None else plain_number(height_mm, 0),
        "ACC": "" if width_mm is None else plain_number(width_mm, 0),
        "ACG": "" if unit_m is None else plain_number(unit_m, 3),
        "ACN": "" if year is None else plain_number(year, 0),
    }
    values = {code: value for code, value in values.items() if value}
    zero = lists.reference_point("inner face of the headwall")
    defaults = {"ABC": zero.en if zero else "", "ABE": lists.METHODS_EN["camera"]}
    values["ADE"] = general_remark(report, fields, rows)
    values = defaults | values
    return values | _kept_codes(report, fields, values), losses


def letters(report: Report, fields: Fields) -> dict[str, str]:
    """Return the letters of fields with a list; details that they lack go to the remark."""
    stated = fields.text
    material, lining = stated("material"), stated("lining_material")
    weather, zero = (
        lists.weather(stated("weather")),
        lists.reference_point(stated("reference_point")),
    )
    control = stated("flow_control")
    cleaned = fields.flag("cleaned")
    degrees = fields.number_within("temperature_c", -100, 100)
    asset_type = fields.choice("asset_type", lists.USES_EN)
    values = {
        "AAK": fields.choice("direction", lists.DIRECTIONS_EN) or "",
        "ABC": _letter(stated("reference_point"), zero.en if zero else None),
        "ABE": fields.choice("method", lists.METHODS_EN) or "",
        "ABP": fields.choice("purpose", lists.PURPOSES_EN) or "",
        "ACA": fields.choice("shape", lists.SHAPES_EN) or "",
        "ACD": _material(material),
        "ACE": _letter(stated("lining_type"), lists.lining(stated("lining_type"))),
        "ACF": _material(lining),
        "ACJ": lists.GRAVITY_EN if asset_type else "",
        "ACK": asset_type or "",
        "ACM": {True: "A", False: "B", None: ""}[cleaned],
        "ADA": weather.en if weather else "",
        "ADB": "" if degrees is None else lists.WARM_EN if degrees > 0 else lists.FROST_EN,
        "ADC": _letter(control, lists.FLOW_CONTROL_EN.get(lists.flow_control(control) or "")),
    }
    for code, name in MADE_OF.items():
        is_said = values[code] != lists.OTHER or stated(name) == "other"
        if not values[code] or not is_said:
            fields.leave(name)
    fields.leave("temperature_c")  # the letter does not state the degrees
    return values


MADE_OF = {
    "ABC": "reference_point", "ABE": "method", "ABP": "purpose", "ACA": "shape", "ACD": "material",
    "ACE": "lining_type", "ACF": "lining_material", "ACK": "asset_type", "ADA": "weather",
    "ADC": "flow_control",
}  # fmt: skip
"""Header fields from which the letters are made."""


def _letter(words: str, letter: str | None) -> str:
    return (letter or lists.OTHER) if words else ""


def _material(words: str) -> str:
    found = lists.material(words)
    return _letter(words, found.en if found else None)


def coordinates(fields: Fields, names: Names) -> dict[str, str]:
    """Return AAE and AAG: latitude and longitude in degrees, of the nodes of AAD and AAF."""
    ends = ends_of(fields)
    if ends is None:
        return {}
    first, second = ends.start, ends.end
    if names.upstream != names.start:
        first, second = second, first
    places = (("AAE", first), ("AAG", second))
    return {code: f"{_degrees(lat)} {_degrees(lon)}" for code, (lon, lat) in places}


def _degrees(value: float) -> str:
    """Format degrees to 0.1 mm on the ground, without needless zeros after the centimetre."""
    text = f"{value:.9f}"
    return text[:-2] + text[-2:].rstrip("0")


def columns(row: Row, names: Names) -> dict[str, str]:
    """Return the values of a row by code, without empty ones."""
    node = {START: names.start, END: names.end}.get(row.code)
    quant1 = "" if row.quant1 is None else plain_number(row.quant1)
    clocks = [str(hour) for hour in row.clocks]
    remark = row.remark
    if node is not None and quant1:
        remark = joined(remark, f"quantity {quant1}")
    values = {
        "I": plain_number(row.distance_m, 2),
        "J": f"{row.stretch[0]}{row.stretch[1]}" if row.stretch else "",
        "A": row.code,
        "B": row.char1,
        "C": row.char2,
        "D": node if node is not None else quant1,
        "E": "" if row.quant2 is None else plain_number(row.quant2),
        "G": clocks[0] if clocks else "",
        "H": clocks[1] if len(clocks) > 1 else "",
        "K": "A" if row.entry.at_joint else "",
        "M": one_line(row.photo or ""),
        "N": "" if row.time_s is None else hours(row.time_s),
        "F": remark,
    }
    return {code: value for code, value in values.items() if value}


def _name(text: str) -> str:
    """Drop a leading #, which begins another line type of the file."""
    return one_line(text).lstrip("# ")


def _in_ascii(values: Mapping[str, str]) -> dict[str, str]:
    """Return values by their codes in ASCII, except for names."""
    return {
        code: value if code in _NAMES else transliterate(value) for code, value in values.items()
    }


def _line(values: Iterable[str]) -> str:
    return ";".join(map(_quoted, values))


def _quoted(value: str) -> str:
    if ";" not in value and '"' not in value:
        return value
    doubled = value.replace('"', '""')
    return f'"{doubled}"'
