"""A table of codes: the built-in pack, and imported ones (`read_table` reads them)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import resources
from typing import Literal

from app.survey.catalogue.ratings import Rating

Need = Literal["yes", "no", "opt"]

LABEL_LANGUAGES = tuple(
    sorted(
        found[1]
        for file in resources.files("app.survey.catalogue").iterdir()
        if (found := re.fullmatch(r"labels_([a-z]{2})\.csv", file.name))
    )
)
"""Languages of labels beside English, by the files that translate the built-in ones."""


Bounds = tuple[float | None, float | None]
UNBOUNDED: Bounds = (None, None)


@dataclass(frozen=True)
class Code:
    """One row: a main code with its characterisation."""

    code: str
    char1: str
    """Empty where the code has none or leaves it open; the same holds for `char2`."""
    char2: str
    label: str
    group: str
    """S structure, O operation, C inventory, M other."""
    needs_clock: Need
    needs_q1: Need
    needs_q2: Need
    unit_q1: str | None
    """mm, %, deg, ppm or count."""
    unit_q2: str | None
    continuous_allowed: bool
    grade_s: float | None = None
    """Structural grade set by the owner of the pack; `grade_o` is the one for operation."""
    grade_o: float | None = None
    hotkey: str | None = None
    icon: str | None = None
    labels: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Labels in other languages, as far as the pack has them."""
    bounds: tuple[Bounds, Bounds] = (UNBOUNDED, UNBOUNDED)
    """Least and greatest value of the two quantities, ends included."""
    grade_by: Literal["q1", "q2"] | None = None
    """The quantity that grades a defect; None where `grade_s` and `grade_o` do."""
    grades: tuple[float | None, ...] = ()
    """From which value on it has grade 1, 2, 3, 4, 5; None where the pack leaves a grade out."""
    en13508: tuple[str, str, str] | None = None
    """Code and characters of EN 13508-2 that stand for it in exchange files."""
    finding: str | None = None
    """Kind of an automatic finding that begins as this code."""

    def label_in(self, language: str) -> str:
        """Return the label in a language, else in that of the pack."""
        return self.labels.get(language, self.label)

    @property
    def label_ms(self) -> str:
        """The label in Malay, as programs know it."""
        return self.label_in("ms")

    @property
    def key(self) -> tuple[str, str, str]:
        """The key that identifies a row in its table."""
        return self.code, self.char1, self.char2

    def without_characters(self) -> Code:
        """Return the main code: what the characters decide is not known of it."""
        labels = {language: title_of(label) for language, label in self.labels.items()}
        return replace(
            self,
            char1="",
            char2="",
            label=title_of(self.label),
            labels=labels,
            bounds=(UNBOUNDED, UNBOUNDED),
            grade_s=None,
            grade_o=None,
            grade_by=None,
            grades=(),
            en13508=None,
        )


@dataclass(frozen=True)
class CodeTable:
    """The codes of an inspection."""

    name: str
    rows: tuple[Code, ...]
    """Rows in the order of the file."""
    ratings: tuple[Rating, ...] = ()
    """How a section is graded; the grade of the last one is that of the asset."""

    def find(self, code: str | None, char1: str | None, char2: str | None) -> Code | None:
        """Return the best row: with both characters, else with the first, else the main code."""
        keys = ((char1 or "", char2 or ""), (char1 or "", ""), ("", ""))
        found = (self._by_key.get((code or "", *chars)) for chars in keys)
        return next((row for row in found if row is not None), None)

    def named(self, code: str | None, char1: str | None, char2: str | None) -> Code | None:
        """Return the row that names a code, by the rule of the page (core/defects/codes.js).

        A tag without characters yet, or with characters that the table lacks, takes the name of the
        main code: "Broken wall".

        Returns:
            The row of the full code, else the first of its main code with the common part of the
            labels; None for a code that is not in the table.
        """
        exact = self._by_key.get((code or "", char1 or "", char2 or ""))
        if exact is not None:
            return exact
        first = next((row for row in self.rows if row.code == code), None)
        return None if first is None else first.without_characters()

    def of_finding(self, kind: str, where: str | None = None) -> Code | None:
        """Return the code with which a kind of automatic finding begins, if the pack names one: for
        where it lies or its direction, else for the kind.
        """
        return self._by_finding.get(f"{kind} {where}") or self._by_finding.get(kind)

    @cached_property
    def _by_finding(self) -> Mapping[str, Code]:
        return {row.finding: row for row in reversed(self.rows) if row.finding}

    @cached_property
    def _by_key(self) -> Mapping[tuple[str, str, str], Code]:
        return {row.key: row for row in self.rows}


def title_of(label: str) -> str:
    """Return the part of a label that the main code has in common."""
    return label.partition(":")[0]
