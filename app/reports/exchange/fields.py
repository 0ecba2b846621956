"""The header of a report, read by a format; it records which fields were written."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import date
from typing import Any

from app.reports.content.ascii import one_line
from app.reports.report import Loss, Phrase
from app.survey.fields.header import FIELDS, is_empty, number_of
from app.survey.fields.in_words import TECHNICAL, in_words
from app.survey.rounding import decimals

_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")
_TIME = re.compile(r"([01][0-9]|2[0-3]):([0-5][0-9])(:([0-5][0-9]))?")
_NEVER_SAID = frozenset({"standard", "end_condition", "abandon_reason"})
"""Fields that other sentences and the rows cover."""


class Fields:
    """Values of the header by name; a value that was read counts as written."""

    def __init__(self, header: Mapping[str, Any]) -> None:
        self._header = header
        self._written = set(_NEVER_SAID)
        self._rounded: list[Phrase] = []

    def text(self, name: str) -> str:
        """Return a text on one line; empty if missing, or if it is only a number where words are
        expected.
        """
        value = self._header.get(name)
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            return ""
        found = one_line(str(value))
        if found:
            self._written.add(name)
        return found

    def number(self, name: str) -> float | None:
        """Return a finite number, also from text, or None."""
        found = number_of(self._header.get(name))
        if found is not None:
            self._written.add(name)
        return found

    def number_within(self, name: str, least: float, most: float) -> float | None:
        """Return a number within inclusive bounds, or None."""
        found = self.number(name)
        if found is not None and not least <= found <= most:
            self._written.discard(name)
            return None
        return found

    def rounded(self, name: str, digits: int, least: float, most: float) -> str | None:
        """Return a number within inclusive bounds with so many decimals, or None."""
        found = self.number_within(name, least, most)
        self.note_digits(name, digits)
        return None if found is None else decimals(found, digits)

    def note_digits(self, name: str, digits: int) -> None:
        """Note the decimals of a number that was written; `losses` names it if they change it."""
        stated = number_of(self._header.get(name))
        if name not in self._written or stated is None:
            return
        written = decimals(stated, digits)
        if float(written) != stated:
            self._rounded.append(
                Phrase("part.rounded_field", field=field_name(name), stated=stated, written=written)
            )

    def flag(self, name: str) -> bool | None:
        """Return true or false, or None."""
        value = self._header.get(name)
        if not isinstance(value, bool):
            return None
        self._written.add(name)
        return value

    def choice(self, name: str, meanings: Mapping[str, str]) -> str | None:
        """Return the format's value for a choice, or None if it has none."""
        value = self._header.get(name)
        found = meanings.get(value) if isinstance(value, str) else None
        if found is not None:
            self._written.add(name)
        return found

    def day(self) -> str | None:
        """Return the day of the survey, ISO 8601."""
        value = self._header.get("date")
        if not isinstance(value, str) or not _DATE.fullmatch(value):
            return None
        try:
            date.fromisoformat(value)
        except ValueError:
            return None
        self._written.add("date")
        return value

    def time(self) -> tuple[str, str] | None:
        """Return the time of the survey: hh:mm and its seconds."""
        value = self._header.get("time")
        found = _TIME.fullmatch(value) if isinstance(value, str) else None
        if found is None:
            return None
        self._written.add("time")
        return f"{found[1]}:{found[2]}", found[4] or "00"

    def note_written(self, *names: str) -> None:
        """Mark fields as written in another way."""
        self._written.update(names)

    def leave(self, *names: str) -> None:
        """Mark fields that were read as not written after all."""
        self._written.difference_update(names)

    def words(self) -> list[str]:
        """Return stated fields that were not written, for a remark; they then count as written.

        Call it last, after all other fields.
        """
        said = []
        for field in FIELDS:
            value = self._header.get(field.name)
            if field.name in self._written or field.name in TECHNICAL or is_empty(value):
                continue
            self._written.add(field.name)
            said.append(one_line(in_words(field, value)))
        return said

    def losses(self, format_name: str) -> list[Loss]:
        """Return losses that name the rounded fields, and the filled ones that were not written."""
        found = []
        if self._rounded:
            found.append(Loss("rounded_fields", format=format_name, fields=tuple(self._rounded)))
        left = sorted(
            str(name)
            for name, value in self._header.items()
            if name not in self._written and value is not None and value != ""
        )
        if left:
            named = tuple(field_name(name) for name in left)
            found.append(Loss("no_place", format=format_name, fields=named))
        return found


def field_name(name: str) -> Phrase:
    """Return the name of a header field in the language of the report."""
    return Phrase(f"field.{name}", otherwise=one_line(name))
