"""An observation, made of the texts that a file has in its columns."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from app.imports.cells import clean, clock, number, quantity, severity_of, stretch, video_time_s
from app.imports.survey import ImportedObservation, Notes
from app.survey.fields.declaration import Family
from app.survey.fields.observation import codes_of
from app.survey.tag import LONGEST_IMPORTED_REMARK

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
    parse = _Cells(texts, notes, line)
    quantities = [parse.quantity(name) for name in ("quant1", "quant2")]
    clocks = [parse.clock(name) for name in ("clock_from", "clock_to")]
    continuous = parse.stretch("continuous")
    time_s = parse.time_s("film_time_s", is_counter=is_counter)
    said = [remark, *parse.words, *more]
    letters = [
        parse.letters(name, pattern, said)
        for name, pattern in (("code", _CODE), ("char1", _LETTER), ("char2", _LETTER))
    ]
    remark = ", ".join(part for part in said if part)
    if len(remark) > LONGEST_IMPORTED_REMARK:
        notes.add("long_remark", line, length=len(remark), most=LONGEST_IMPORTED_REMARK)
    photo = texts["photo_name"]
    if len(photo) > LONGEST_PHOTO_NAME:
        notes.add("long_photo_name", most=LONGEST_PHOTO_NAME)
    return ImportedObservation(
        distance_m=distance_m,
        code=letters[0],
        char1=letters[1],
        char2=letters[2],
        quant1=quantities[0],
        quant2=quantities[1],
        clock_from=clocks[0],
        clock_to=clocks[1],
        severity=severity,
        stretch=continuous,
        at_joint=texts["at_joint"].upper() not in _NO,
        remark=remark[:LONGEST_IMPORTED_REMARK],
        photo=photo[:LONGEST_PHOTO_NAME] or None,
        time_s=time_s,
        line=line,
    )


@dataclass
class _Cells:
    """Parses the cells of a row; what cannot be parsed becomes words of its remark."""

    texts: Mapping[str, str]
    notes: Notes
    line: int | None
    words: list[str] = field(default_factory=list)

    def quantity(self, name: str) -> float | None:
        text = self.texts[name]
        found = quantity(text)
        if text and found is None:
            self.words.append(f"quantity {text}")
        return found

    def clock(self, name: str) -> int | None:
        text = self.texts[name]
        found = clock(text)
        if found is None and text.strip("0"):
            self.notes.add("no_hour", self.line, text=f"{text!r:.20}")
            self.words.append(f"clock {text}")
        return found

    def stretch(self, name: str) -> str | None:
        text = self.texts[name]
        found = stretch(text)
        if text and found is None:
            self.notes.add("no_stretch", self.line, text=f"{text!r:.20}")
            self.words.append(f"stretch {text}")
        return found

    def time_s(self, name: str, *, is_counter: bool) -> float | None:
        text = self.texts[name]
        found = None if is_counter else video_time_s(text)
        if text and found is None:
            self.notes.add("no_video_time", self.line, text=f"{text!r:.40}")
            self.words.append(f"video {text}")
        return found

    def letters(self, name: str, pattern: re.Pattern[str], said: list[str]) -> str | None:
        value = clean(self.texts[name], 40).upper()
        if not value or pattern.fullmatch(value):
            return value or None
        self.notes.add("invalid_code", self.line, field=name, value=repr(value))
        said.append(f"{name} {value}")
        return None
