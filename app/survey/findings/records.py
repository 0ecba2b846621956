"""A finding: what a detector proposes on the wall, and what a person decided about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, Literal, Self, get_args

FindingState = Literal["offered", "accepted", "rejected"]
STATES: tuple[FindingState, ...] = get_args(FindingState)
SearchState = Literal["none", "waiting", "searching", "done", "failed"]
Direction = Literal["along", "across", "oblique"]
CLASSICAL = "classical"
"""Names the built-in detector; others are models of users."""

ACCEPTED, REJECTED, REOPENED = "finding_accepted", "finding_rejected", "finding_reopened"
"""Actions of the events of a decision."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Size:
    """A length on the wall of the raw track, with its standard uncertainty."""

    mm: float
    sigma_mm: float


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """What a detector says, in raw coordinates of the wall."""

    kind: str
    outline_mm: tuple[Point, ...]
    """Axial and arc: the centre line of a crack, otherwise a closed polygon."""
    length: Size | None
    width: Size | None
    direction: Direction | None
    score: float
    """In [0, 1]; a larger one is surer."""
    code: Mapping[str, Any] | None = None
    """Code and characters by the declaration of a user's model."""

    @property
    def middle_mm(self) -> Point:
        """A point of it: of a crack the middle of its line, otherwise the mean of its corners."""
        if self.kind == "crack":
            return self.outline_mm[len(self.outline_mm) // 2]
        axial, arc = zip(*self.outline_mm, strict=True)
        return sum(axial) / len(axial), sum(arc) / len(arc)

    @property
    def box_mm(self) -> tuple[float, float, float, float]:
        """First axial and arc, last axial and arc."""
        axial, arc = zip(*self.outline_mm, strict=True)
        return min(axial), min(arc), max(axial), max(arc)

    def moved(self, axial_mm: float, arc_mm: float) -> Self:
        """Return it elsewhere on the wall."""
        outline = tuple((x + axial_mm, y + arc_mm) for x, y in self.outline_mm)
        return replace(self, outline_mm=outline)


@dataclass(frozen=True, kw_only=True)
class Finding(Proposal):
    """A proposal that is kept, with what a person decided."""

    inspection_id: str
    id: str
    detector: str
    """Name of what found it: `CLASSICAL`, or that of a user's model."""
    version: str
    """Of the detector; of a model the beginning of its digest."""
    frame: int | None
    """The frame that showed it best when it was found, and the pixel: by these it is found again
    when the film is tracked anew. None if no frame showed it."""
    pixel: Point | None
    found_at: datetime
    state: FindingState = "offered"
    decided_by: str | None = None
    decided_at: datetime | None = None
    observation_id: str | None = None
    """The observation that was made of it."""

    @property
    def found_by(self) -> str:
        """The detector as people read it."""
        return f"{self.detector} {self.version}"


@dataclass(frozen=True)
class SearchStatus:
    """How far the search of an inspection's wall is."""

    state: SearchState = "none"
    detector: str | None = None
    """`CLASSICAL`, or the id of a model."""
    detail: str | None = None
    """A sentence that says why it failed, or who stopped it."""
    searched_to_mm: float | None = None
    """Raw axial coordinate up to which the wall was searched."""


@dataclass(frozen=True)
class DetectorCount:
    """What became of the proposals of one detector."""

    detector: str
    offered: int
    """Those that nobody has decided about."""
    accepted: int
    rejected: int

    @property
    def total(self) -> int:
        """All that were offered, decided or not."""
        return self.offered + self.accepted + self.rejected
