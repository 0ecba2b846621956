"""Compares findings with what is on a wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.lab.findings.painting import Truth
from vo_core.findings.finding import Finding
from vo_core.types import Matrix

ON_LINE_MM = 5.0
"""A finding lies on a crack within this."""

BESIDE_MM = 15.0
"""A finding lies on an area within this of its box."""

FOUND = 0.5
"""Share of a crack on which findings lie if it is found."""


@dataclass(frozen=True)
class Case:
    """One defect and the finding that shows most of it, if any does."""

    truth: Truth
    finding: Finding | None


@dataclass(frozen=True)
class Score:
    """One wall, or several added up."""

    metres: float
    cases: tuple[Case, ...]
    false: tuple[Finding, ...]
    """Findings that lie on no defect, of whatever kind."""

    def __add__(self, other: Score) -> Score:
        return Score(self.metres + other.metres, self.cases + other.cases, self.false + other.false)


NOTHING = Score(0.0, (), ())


def score(metres: float, truth: Sequence[Truth], found: Sequence[Finding]) -> Score:
    """Compare the findings of a wall with its defects."""
    touched: set[int] = set()
    cases = []
    for each in truth:
        shares = np.array([_share(each, finding) for finding in found])
        on_it = np.flatnonzero(shares > 0)
        touched.update(on_it.tolist())
        if not each.is_visible:
            continue
        is_found = bool(shares.sum() >= (FOUND if each.kind == "crack" else 1.0))
        cases.append(Case(each, found[int(shares.argmax())] if is_found else None))
    false = tuple(finding for k, finding in enumerate(found) if k not in touched)
    return Score(metres, tuple(cases), false)


def _share(truth: Truth, finding: Finding) -> float:
    """Share of a crack on which a finding lies; 1 if it lies in the box of an area, or 0."""
    outline = finding.outline_mm
    if truth.kind == "crack" and truth.is_line:
        away = _distances(truth.outline_mm, outline).min(axis=1)
        return float(np.mean(away < ON_LINE_MM))
    low, high = truth.outline_mm.min(axis=0) - BESIDE_MM, truth.outline_mm.max(axis=0) + BESIDE_MM
    inside = ((outline >= low) & (outline <= high)).all(axis=1)
    return float(inside.mean() > FOUND)


def _distances(points: Matrix, others: Matrix) -> Matrix:
    return np.asarray(np.hypot(*(points[:, None] - others[None]).transpose(2, 0, 1)))
