"""An observation, made of the texts that a file has in its columns."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from app.imports.surveys.cells import (
    clean,
    clock,
    number,
    quantity,
    severity_of,
    stretch,
    video_time_s,
)
from app.imports.surveys.survey import ImportedObservation, Notes
from app.survey.fields.declaration import Family
from app.survey.fields.observation import codes_of
from app.survey.observations.tag import LONGEST_IMPORTED_REMARK

LONGEST_PHOTO_NAME = 255
_CODE = re.compile(r"[A-Z][A-Z0-9]{0,7}")
_LETTER = re.compile(r"[A-Z][A-Z0-9]{0,3}")
_NO = frozenset({"", "0", "FALSE", "N"})


def texts_of(family: Family, value_of: Callable[[str], str]) -> dict[str, str]:
    """Return the texts of a row by the names of the fields, empty where there is none.

    Args:
        family: Of the format.
        value_of: Returns the text of a column, or an empty one.
    """
    return {
        name: next((text for code in codes if (text := value_of(code))), "")
        for name, codes in codes_of(family).items()
    }


def observation_of(
    texts: Mapping[str, str],
    notes: Notes,
    line: int | None = None,
    *,
    more: Iterable[str] = (),
    is_counter: bool = False,
) -> ImportedObservation | None:
    """Return an observation; None, with a warning, for one without a distance.

    What cannot be parsed, or stored, becomes words of the remark.

    Args:
        texts: By the names of the fields.
        notes: For warnings.
        line: Of the row.
        more: What stands behind the remark.
        is_counter: Whether the position in the film is that of a counter, and so no time.
    """
    distance_m = number(texts["distance_m"])
    if distance_m is None:
        notes.add("no_distance", line, text=f"{texts['distance_m']!r:.40}")
        return None
    remark, severity = severity_of(texts["remark"])
    parsed = _Parsed(texts, notes, line, [remark])
    video_time_of = _no_time if is_counter else video_time_s
    values: dict[str, Any] = {
        "quant1": parsed.value("quant1", quantity, "quantity"),
        "quant2": parsed.value("quant2", quantity, "quantity"),
        "clock_from": parsed.value("clock_from", clock, "clock", "no_hour"),
        "clock_to": parsed.value("clock_to", clock, "clock", "no_hour"),
        "stretch": parsed.value("continuous", stretch, "stretch", "no_stretch"),
        "time_s": parsed.value("film_time_s", video_time_of, "video", "no_video_time"),
    }
    parsed.said.extend(more)
    for name, pattern in (("code", _CODE), ("char1", _LETTER), ("char2", _LETTER)):
        values[name] = parsed.letters(name, pattern)
    remark = ", ".join(part for part in parsed.said if part)
    if len(remark) > LONGEST_IMPORTED_REMARK:
        notes.add("long_remark", line, length=len(remark), most=LONGEST_IMPORTED_REMARK)
    photo = texts["photo_name"]
    if len(photo) > LONGEST_PHOTO_NAME:
        notes.add("long_photo_name", most=LONGEST_PHOTO_NAME)
    return ImportedObservation(
        distance_m=distance_m,
        **values,
        severity=severity,
        at_joint=texts["at_joint"].upper() not in _NO,
        remark=remark[:LONGEST_IMPORTED_REMARK],
        photo=photo[:LONGEST_PHOTO_NAME] or None,
        line=line,
    )


def _no_time(_text: str) -> None:
    return None


@dataclass(frozen=True)
class _Parsed:
    """Parses the texts of a row; what cannot be parsed becomes words of its remark."""

    texts: Mapping[str, str]
    notes: Notes
    line: int | None
    said: list[str]

    def value(
        self, name: str, parse: Callable[[str], object], word: str, warning: str = ""
    ) -> object:
        text = self.texts[name]
        found = parse(text)
        is_stated = text.strip("0") if parse is clock else text  # hours 0 and 00 mean none
        if found is None and is_stated:
            self.said.append(f"{word} {text}")
            if warning:
                self.notes.add(warning, self.line, text=f"{text!r:.40}")
        return found

    def letters(self, name: str, pattern: re.Pattern[str]) -> str | None:
        value = clean(self.texts[name], 40).upper()
        if not value or pattern.fullmatch(value):
            return value or None
        self.notes.add("invalid_code", self.line, field=name, value=repr(value))
        self.said.append(f"{name} {value}")
        return None
