"""Stretches (continuous defects): A1 starts number 1, C1 changes it, B1 finishes it.

A tag is never refused for what is wrong with its stretch: a browser sends its tags again after a
while without a net, in the order of its outbox, so that for a time a B is there before its A.  What
is wrong is named by the checks before a report is issued, and what is open when a survey ends.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, cast

from app.survey.records import Observation

Role = Literal["A", "B", "C"]
"""A start, B finish, C change."""


@dataclass
class Stretch:
    """The observations of one number; in good order there is one start and one finish."""

    number: int
    starts: list[Observation] = field(default_factory=list)
    changes: list[Observation] = field(default_factory=list)
    finishes: list[Observation] = field(default_factory=list)

    @property
    def is_open(self) -> bool:
        """Started and not finished."""
        return bool(self.starts) and not self.finishes


def role_and_number(continuous: str) -> tuple[Role, int]:
    """Of "A12": ("A", 12)."""
    return cast(Role, continuous[0]), int(continuous[1:])


def stretches(observations: Iterable[Observation]) -> list[Stretch]:
    """Those that the observations belong to, in the order of their numbers."""
    found: dict[int, Stretch] = {}
    for row in observations:
        continuous = row.tag.continuous
        if continuous is None:
            continue
        role, number = role_and_number(continuous)
        stretch = found.setdefault(number, Stretch(number))
        {"A": stretch.starts, "B": stretch.finishes, "C": stretch.changes}[role].append(row)
    return [found[number] for number in sorted(found)]


def open_stretches(observations: Iterable[Observation]) -> list[str]:
    """The starts without a finish, such as "A2", in the order of their numbers.

    Args:
        observations: Those of an inspection that are not deleted, in any order.
    """
    return [f"A{stretch.number}" for stretch in stretches(observations) if stretch.is_open]


def next_stretch_number(marks: Iterable[str]) -> int:
    """The first number that was never used.

    Args:
        marks: Such as "A1", of an inspection, of its deleted tags too: a restored one keeps its
            number.
    """
    return max((role_and_number(mark)[1] for mark in marks), default=0) + 1
