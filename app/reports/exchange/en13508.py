"""EN 13508-2 text: the exchange format of Annex B of EN 13508-2:2003+A1:2011.

One reader decodes UTF-8 whatever the file declares, another stops at an empty line, a third
mistakes a missing end node for a lateral. So texts are plain ASCII, and the file is complete,
without empty lines. Names, and the texts of an import, keep their letters: the file then declares
UTF-8.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from app.reports.exchange.coordinates import ends_of
from app.reports.exchange.header import Header
from app.reports.exchange.losses import only_json_holds
from app.reports.exchange.names import FileNames, Names, film_in_ascii, film_renaming
from app.reports.exchange.rows import (
    END,
    START,
    Row,
    general_remark,
    in_columns,
    joined,
    rows_of,
    texts_of,
)
from app.reports.report import Loss, Report
from app.reports.text.ascii import one_line, transliterate
from app.survey.fields.declaration import OTHER, explanation_of

STANDARD = "EN 13508-2:2003+A1:2011"

_FORMAT = "EN 13508-2"
_FILE = ("#A2=en", "#A3=;", "#A4=.", '#A5="', "#A6=2010")
_NAMES = frozenset({"AAA", "AAB", "AAD", "AAF", "D"})
"""Names by which things are found again keep their letters; D has those of the ends."""
_REMARK, _PLAIN = "ADE", "AAA"
"""The remark, and a field that never needs one to be understood."""
_BY_TIME, _GRAVITY = "A", "A"
"""ABM: positions in the film are times. ACJ: all uses that the header knows run by gravity."""
_WARM, _FROST = "A", "B"
"""ADB: above freezing or not; the list cannot hold the degrees."""
_ALWAYS = (
    "AAA", "AAB", "AAD", "AAF", "AAK", "ABA", "ABC", "ABE", "ABF", "ABG", "ABH", "ABI", "ABM",
    "ABQ", "ABS", "ACA", "ACB", "ACC", "ACD", "ACG", "ACM", "ADA",
)  # fmt: skip
"""Fields of `#B01` that are always written; others only when they are filled."""
_COLUMNS = ("I", "J", "A", "B", "C", "D", "E", "G", "H", "K", "M", "N", "F")
_KEPT = re.compile(r"en13508_([a-z]{3})")
"""Header fields of an imported survey for which Chainage has no field, by their codes."""


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


class TextFile:
    """File header, then `#B01`, `#C`, a row for each entry and `#Z` for each inspection."""

    def __init__(self) -> None:
        # A leading # begins another line type of the file.
        self._names = FileNames(lambda text: one_line(text).lstrip("# "))
        self._surveys: list[tuple[Survey, list[str]]] = []
        """Each with the lines of its rows."""

    def add(self, report: Report) -> tuple[Loss, ...]:
        """Add an inspection."""
        survey = survey_of(report, self._names)
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
        fields = order_codes({*_ALWAYS, *filled}, {code for it in surveys for code in it.explained})
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


def order_codes(codes: Iterable[str], explained: Collection[str]) -> list[tuple[str, str]]:
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


def survey_of(report: Report, in_file: FileNames) -> Survey:
    """Collect what the text or the XML of the standard says of an inspection."""
    header = Header(report, "en", _FORMAT)
    rows, losses = rows_of(report)
    names, lost = in_file.add(report, header)
    values = header_values(report, header, names, rows)
    values["ABG"] = values.get("ABG", "")[:5]
    values |= _coordinates(header, names)
    explained = explanations(header, [code for code, it in values.items() if it == OTHER])
    losses += [
        *lost,
        *film_renaming(report, film_in_ascii(report)),
        only_json_holds(report),
        *header.losses(),
    ]
    return Survey(values, explained, rows, names, tuple(losses))


def header_values(
    report: Report, header: Header, names: Names, rows: Sequence[Row]
) -> dict[str, str]:
    """Return the filled values of the header by their codes."""
    known_m, expected_m = header.number("known_length_m"), header.number("expected_length_m")
    if expected_m is not None and expected_m != known_m:
        header.leave("known_length_m")
    values = header.columns(expected_length_m=known_m)
    degrees = header.number("temperature_c")
    header.leave("temperature_c")  # the letter does not state the degrees
    values |= {
        "AAA": names.asset,
        "AAB": names.start,
        "AAD": names.upstream,
        "AAF": names.downstream,
        "ABA": STANDARD,
        "ABM": _BY_TIME,
        "ABS": film_in_ascii(report),
        "ACJ": _GRAVITY if report.header.get("asset_type") else "",
        "ADB": "" if degrees is None else _WARM if degrees > 0 else _FROST,
        "ADE": general_remark(report, header, rows),
    }
    for name in report.header:
        found = _KEPT.fullmatch(str(name))
        if found and not values.get(found[1].upper()) and (text := header.text(name)):
            values[found[1].upper()] = text
    return {code: value for code, value in values.items() if value}


def explanations(header: Header, codes: Iterable[str]) -> dict[str, str]:
    """Return the words that an imported file has of letters for which Chainage has no field."""
    kept = {code: header.text(explanation_of(code)) for code in codes}
    return {code: words for code, words in kept.items() if words}


def _coordinates(header: Header, names: Names) -> dict[str, str]:
    """Return AAE and AAG: latitude and longitude in degrees, of the nodes of AAD and AAF."""
    ends = ends_of(header)
    if ends is None:
        return {}
    places = zip(("AAE", "AAG"), ends.along(names), strict=True)
    return {code: f"{_degrees(lat)} {_degrees(lon)}" for code, (lon, lat) in places}


def _degrees(value: float) -> str:
    """Format degrees to 0.1 mm on the ground, without needless zeros after the centimetre."""
    text = f"{value:.9f}"
    return text[:-2] + text[-2:].rstrip("0")


def columns(row: Row, names: Names) -> dict[str, str]:
    """Return the filled values of a row by their letters."""
    texts = texts_of(row)
    if "." in texts["distance_m"]:
        texts["distance_m"] = texts["distance_m"].rstrip("0").rstrip(".")
    for clock in ("clock_from", "clock_to"):
        texts[clock] = texts[clock].lstrip("0")
    node = {START: names.start, END: names.end}.get(row.code)
    if node is not None:
        if texts["quant1"]:
            texts["remark"] = joined(row.remark, f"quantity {texts['quant1']}")
        texts["quant1"] = node
    return in_columns(texts, "en")


def _in_ascii(values: Mapping[str, str]) -> dict[str, str]:
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
