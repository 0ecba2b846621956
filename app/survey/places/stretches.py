"""Stretches (continuous defects): A1 starts number 1, C1 changes it, B1 finishes it.

A tag is never refused for a fault of its stretch: a browser that was offline sends its tags late,
in the order of its outbox, so that a B may arrive before its A. The checks before a report name the
faults, and the end of a survey names the stretches that are open.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, cast

from app.survey.observations.records import Observation

Role = Literal["A", "B", "C"]
"""A start, B finish, C change."""


@dataclass
class Stretch:
    """The observations of one number; a valid stretch has one start and one finish."""

    number: int
    starts: list[Observation] = field(default_factory=list)
    changes: list[Observation] = field(default_factory=list)
    finishes: list[Observation] = field(default_factory=list)

    @property
    def is_open(self) -> bool:
        """Whether it is started and not finished."""
        return bool(self.starts) and not self.finishes


def role_and_number(continuous: str) -> tuple[Role, int]:
    """Split a mark: "A12" gives ("A", 12)."""
    return cast(Role, continuous[0]), int(continuous[1:])


def stretches(observations: Iterable[Observation]) -> list[Stretch]:
    """Group the observations into stretches, in the order of their numbers."""
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
    """Return the starts without a finish, such as "A2", in the order of their numbers.

    Args:
        observations: The observations of an inspection that are not deleted, in any order.
    """
    return [f"A{stretch.number}" for stretch in stretches(observations) if stretch.is_open]


def next_stretch_number(marks: Iterable[str]) -> int:
    """Return the first number that was never used.

    Args:
        marks: All marks of an inspection, such as "A1", also of deleted tags: a restored one keeps
        its number.
    """
    return max((role_and_number(mark)[1] for mark in marks), default=0) + 1
