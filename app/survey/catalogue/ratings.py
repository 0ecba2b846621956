"""Grades that a code pack declares: of a defect by its quantity, and of a section by a rule.

Which thresholds, rules and names there are is the pack's; nothing of a certified code set is here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

GROUPS = ("S", "O")
"""Groups of codes that are graded: structure and operation."""
GRADES = range(1, 6)
QUICK = "quick"


@dataclass(frozen=True)
class Rating:
    """One rule by which a section is graded."""

    name: str
    label: str
    of: tuple[str, ...]
    """Groups of defects, or names of ratings above this one."""
    rule: str
    """One of RULES."""
    grades: tuple[float | None, ...] = ()
    """From which value on the section has grade 1, 2, 3, 4, 5; empty: the value is the grade."""
    labels: Mapping[str, str] = field(default_factory=dict, hash=False)

    def label_in(self, language: str) -> str:
        """Return the label in a language, else in that of the pack."""
        return self.labels.get(language, self.label)


@dataclass(frozen=True)
class Rated:
    """What a rule makes of a section."""

    rating: Rating
    value: float | None
    """None without anything to rate."""
    quick: str = ""
    """The two highest grades with how many there are of each: `5×1 3×4`."""
    grade: int | None = None
    """1 to 5; 0 where nothing is bad enough; None where the rule gives no grade."""


def grade_from(value: float, grades: Sequence[float | None]) -> int:
    """Return the highest grade whose threshold a value reaches; 0 below all of them."""
    reached = (
        grade
        for grade, from_value in zip(GRADES, grades, strict=True)
        if from_value is not None and value >= from_value
    )
    return max(reached, default=0)


def _mean(values: Sequence[float], _length_m: float | None) -> float | None:
    return sum(values) / len(values)


def _per_m(values: Sequence[float], length_m: float | None) -> float | None:
    return sum(values) / length_m if length_m else None


RULES: Mapping[str, Callable[[Sequence[float], float | None], float | None]] = {
    "peak": lambda values, _: max(values),
    "mean": _mean,
    "sum": lambda values, _: sum(values),
    "per_m": _per_m,
    "count": lambda values, _: len(values),
    QUICK: lambda values, _: max(values),
}
"""What a rule makes of the grades, given at least one, and of the inspected length in metres."""
_ITS_OWN_GRADE = ("peak", "mean", QUICK)
"""Rules whose value is a grade without thresholds."""


def rate(
    ratings: Sequence[Rating], grades: Mapping[str, Sequence[float]], length_m: float | None
) -> list[Rated]:
    """Grade a section by each rule, in their order.

    Args:
        ratings: Each refers to groups, or to ratings before it.
        grades: Of the defects of each group; those of grade 0 are left out.
        length_m: Inspected length.
    """
    done: dict[str, Rated] = {}
    for rating in ratings:
        values: list[float] = []
        for name in rating.of:
            if name in done:
                before = done[name].grade
                values += [] if before is None else [float(before)]
            else:
                values += [grade for grade in grades.get(name, ()) if grade > 0]
        done[rating.name] = _rated(rating, values, length_m)
    return [*done.values()]


def _rated(rating: Rating, values: Sequence[float], length_m: float | None) -> Rated:
    if not values:
        return Rated(rating, None)
    value = RULES[rating.rule](values, length_m)
    if value is None:
        return Rated(rating, None)
    grade = None
    if rating.grades:
        grade = grade_from(value, rating.grades)
    elif rating.rule in _ITS_OWN_GRADE:
        grade = min(int(value + 0.5), GRADES[-1])
    return Rated(rating, value, _quick(values) if rating.rule == QUICK else "", grade)


def _quick(values: Sequence[float]) -> str:
    counts = Counter(values)
    highest = sorted(counts, reverse=True)[:2]
    return " ".join(f"{grade:g}×{counts[grade]}" for grade in highest)
