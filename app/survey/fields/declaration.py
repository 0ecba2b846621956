"""How a field is declared.

Exchange formats come in families that share their codes: `en` is EN 13508-2 as text, as XML and as
RIBX, `isybau` is ISYBAU XML of any edition, `m150` is DWA-M 150, `wincan` is WinCan's database.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

Family = Literal["en", "isybau", "m150", "wincan"]
Group = Literal["required", "auto", "more"]
Kind = Literal["text", "number", "choice", "date", "time", "bool"]
Value = str | int | float | bool | None

OTHER = "Z"
"""In EN 13508-2 the letter of any other value, which needs words."""
_ROUGHLY = "~"
AS_IT_IS = "\0"
"""In place of `Column.other`: words that the list does not know are written themselves."""


@dataclass(frozen=True)
class Meaning:
    """A value of a list and its codes: the first of a family is written, all are read."""

    value: str | bool
    en: str = ""
    """Codes apart by blanks, empty where the family has none. One behind ~ is written, and read as
    another value, for which it stands too."""
    isybau: str = ""
    m150: str = ""
    pattern: str = ""
    """Finds the words that mean it, in small letters; without one they are only read."""
    wincan: str = ""

    def codes(self, family: Family) -> tuple[str, ...]:
        """Return its codes in a family of formats."""
        return tuple(str(getattr(self, family)).split())


class ValueList:
    """The values of a field that formats write as codes."""

    def __init__(self, *meanings: Meaning) -> None:
        self.meanings = meanings

    def has(self, family: Family) -> bool:
        """Return whether a family of formats has codes for the values."""
        return any(meaning.codes(family) for meaning in self.meanings)

    def meaning_of(self, value: object) -> Meaning | None:
        """Return the row of a value, or the first whose pattern is in a text."""
        for meaning in self.meanings:
            if meaning.value == value:
                return meaning
            if meaning.pattern and re.search(meaning.pattern, str(value).lower()):
                return meaning
        return None

    def code(self, family: Family, value: object) -> str:
        """Return the code to be written; empty if the family has none."""
        found = self.meaning_of(value)
        codes = found.codes(family) if found else ()
        return codes[0].removeprefix(_ROUGHLY) if codes else ""

    def value(self, family: Family, code: str) -> str | bool | None:
        """Return what a code means, or None."""
        return self._values[family].get(code.upper())

    @cached_property
    def _values(self) -> Mapping[Family, Mapping[str, str | bool]]:
        families: tuple[Family, ...] = ("en", "isybau", "m150", "wincan")
        return {
            family: {
                code.upper(): meaning.value
                for meaning in self.meanings
                for code in meaning.codes(family)
                if not code.startswith(_ROUGHLY)
            }
            for family in families
        }


@dataclass(frozen=True)
class Column:
    """Where a family of formats holds a field, and how it writes it."""

    code: str
    """Code, element or column; several apart by blanks, of which the first that is filled is read.
    Fields of one code are joined in writing, and read into the first of them."""
    digits: int | None = None
    """Most decimals of a number."""
    is_fixed: bool = False
    """Whether a number has all its decimals, zeros too."""
    least: float | None = None
    """Smallest number that the format holds, if that is not the field's; `most` is the largest."""
    most: float | None = None
    longest: int | None = None
    """Most letters of a text."""
    default: str = ""
    """Code that stands where nothing is stated."""
    other: str = ""
    """Code of a stated value that is not in the list."""

    @property
    def codes(self) -> tuple[str, ...]:
        """All its codes."""
        return tuple(self.code.split())


def kept_name(family: Family, code: str) -> str:
    """Name the header field that keeps a code of an imported file that no list has."""
    prefix = "en13508" if family == "en" else family
    return f"{prefix}_{re.sub(r'[^a-z0-9]', '_', code.lower())[:40]}"


def explanation_of(code: str) -> str:
    """Name the header field that holds what a letter Z stands for, where no field of ours does."""
    return f"ribx_{code.lower()[:20]}"


def at(**places: str | Column) -> Mapping[str, Column]:
    """Return the columns of a field, by the family of formats."""
    return {
        family: Column(place) if isinstance(place, str) else place
        for family, place in places.items()
    }


@dataclass(frozen=True)
class HeldIn:
    """Where families of formats hold a field that a model declares: metadata of its annotation."""

    columns: Mapping[str, Column]


def held_in(**places: str | Column) -> HeldIn:
    """Return the columns of a field of a model, by the family of formats."""
    return HeldIn(at(**places))


@dataclass(frozen=True)
class Field:
    """A field, as everything that enumerates fields takes it from here."""

    name: str
    kind: Kind
    columns: Mapping[str, Column] = field(default_factory=dict)
    """By the family of formats; a family that is not here has no place for the field."""
    values: ValueList | None = None
    """Its values, where formats have codes for them."""
    unit: str | None = None
    """Unit of a number: mm, m, %, °C or °."""
    minimum: float | None = None
    """Smallest allowed number; `maximum` is the largest."""
    maximum: float | None = None

    @property
    def choices(self) -> tuple[str, ...]:
        """Allowed values of a choice."""
        if self.values is None or self.kind != "choice":
            return ()
        return tuple(dict.fromkeys(str(meaning.value) for meaning in self.values.meanings))

    def listed(self, family: Family) -> ValueList | None:
        """Return its list of values, if the column of the family holds their codes."""
        if self.values is None or family not in self.columns or not self.values.has(family):
            return None
        return self.values
