"""The code pack: EN 13508-2:2003+A1:2011 pipe codes BAA..BDG with labels of our own.

The letters are facts from KWB-R/kwb.en13508.2 (MIT); no sentence of the standard is copied.  The
flags guide a form; none of them may stop an import.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Literal, cast

CODE_PACK = "EN 13508-2:2003+A1:2011"

Need = Literal["yes", "no", "opt"]


@dataclass(frozen=True)
class Code:
    """One row of the pack: a main code with its characterisation."""

    code: str
    char1: str
    """Empty where the code has none or leaves it open; so is `char2`."""
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


@cache
def codes() -> tuple[Code, ...]:
    """Every row, in the order of the standard."""
    text = resources.files(__name__).joinpath("en13508_2_2003.csv").read_text("utf-8")
    return tuple(
        Code(
            code=row["code"],
            char1=row["char1"],
            char2=row["char2"],
            label=row["label"],
            group=row["group"],
            needs_clock=cast(Need, row["needs_clock"]),
            needs_q1=cast(Need, row["needs_q1"]),
            needs_q2=cast(Need, row["needs_q2"]),
            unit_q1=row["unit_q1"] or None,
            unit_q2=row["unit_q2"] or None,
            continuous_allowed=row["continuous_allowed"] == "yes",
        )
        for row in csv.DictReader(text.splitlines())
    )


def find(code: str | None, char1: str | None, char2: str | None) -> Code | None:
    """The row that fits best: with both characters, else with the first, else the main code."""
    by_key = _by_key()
    keys = ((code, char1 or "", char2 or ""), (code, char1 or "", ""), (code, "", ""))
    return next((by_key[key] for key in keys if key in by_key), None)


@cache
def _by_key() -> dict[tuple[str | None, str, str], Code]:
    return {(row.code, row.char1, row.char2): row for row in codes()}
