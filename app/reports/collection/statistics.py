"""Counts over many inspections: by code, material, road and year."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from app.reports.collection.collected import Collected, Found

By = Literal["material", "road", "built", "inspected"]

GROUPINGS: Mapping[By, Callable[[Collected], str]] = {
    "material": lambda one: one.material,
    "road": lambda one: one.road,
    "built": lambda one: one.built,
    "inspected": lambda one: one.inspected,
}
"""What inspections are grouped by; an empty text means that it is not stated."""


@dataclass(frozen=True)
class Group:
    """Inspections that have something in common."""

    name: str
    """What they have in common; empty if that is not stated."""
    inspections: int
    length_m: float
    """Surveyed length of those that are tracked."""
    defects: int
    measured_defects: int
    """Defects of the inspections that have a length."""
    worst: int | None
    grades: tuple[tuple[str, int], ...]
    """Keys of the words for grades and how often each occurs, by key."""

    @property
    def per_100_m(self) -> float | None:
        """Defects on 100 m; None without a length."""
        return 100 * self.measured_defects / self.length_m if self.length_m > 0 else None


@dataclass(frozen=True)
class CodeCount:
    """The defects of one main code in all inspections."""

    code: str
    label: str
    defects: int
    inspections: int
    stretches_m: float
    worst: int | None


def grouped(inspections: Iterable[Collected], by: By) -> list[Group]:
    """Group the inspections; in the order of their names, those without one last.

    Names that differ only in capitals and blanks are one; the most frequent spelling stands for it.
    """
    found: dict[str, list[tuple[str, Collected]]] = defaultdict(list)
    for one in inspections:
        name = " ".join(GROUPINGS[by](one).split())
        found[name.casefold()].append((name, one))
    groups = []
    for key in sorted(found, key=lambda key: (not key, key)):
        spellings = Counter(name for name, _ in found[key])
        most = min(spellings, key=lambda name: (-spellings[name], name))
        groups.append(total([one for _, one in found[key]], most))
    return groups


def total(inspections: Sequence[Collected], name: str = "") -> Group:
    """Sum up inspections."""
    measured = [one for one in inspections if one.length_m is not None]
    grades = Counter(one.grade for one in inspections if one.grade is not None)
    return Group(
        name=name,
        inspections=len(inspections),
        length_m=sum(one.length_m or 0.0 for one in measured),
        defects=sum(one.defects for one in inspections),
        measured_defects=sum(one.defects for one in measured),
        worst=max((one.worst for one in inspections if one.worst is not None), default=None),
        grades=tuple(sorted(grades.items())),
    )


def by_code(inspections: Iterable[Collected]) -> list[CodeCount]:
    """Count the defects of each main code, the most frequent first."""
    found: dict[str, list[Found]] = defaultdict(list)
    for one in inspections:
        for code, counted in one.codes.items():
            found[code].append(counted)
    counts = [
        CodeCount(
            code=code,
            label=next((one.label for one in some if one.label), ""),
            defects=sum(one.count for one in some),
            inspections=len(some),
            stretches_m=sum(one.stretches_m for one in some),
            worst=max((one.worst for one in some if one.worst is not None), default=None),
        )
        for code, some in found.items()
    ]
    return sorted(counts, key=lambda one: (-one.defects, one.code))
