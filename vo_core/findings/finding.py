"""What a detector says about the wall, and the contract of every detector."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from vo_core.findings.patches import WallPatch
from vo_core.types import Matrix

KINDS = (
    "crack",
    "joint_open",
    "joint_displaced",
    "hole",
    "spall",
    "deposit",
    "roots",
    "water",
    "stain",
)
"""Kinds of the classical detector; a user's model has the names of its own classes."""

AREAS = frozenset(KINDS[KINDS.index("hole") :])
"""Kinds that are areas of the wall."""

Direction = Literal["along", "across", "oblique"]
"""Along the pipe (axial), across it (around the wall), or neither."""


@dataclass(frozen=True)
class Size:
    """A measured length with its standard uncertainty (68 %)."""

    mm: float
    sigma_mm: float


@dataclass(frozen=True)
class Finding:
    """A place on the wall that a person should look at; a proposal, not an observation."""

    kind: str
    """One of `KINDS`, or the class name of a user's model."""
    outline_mm: Matrix
    """(n, 2) raw axial and arc: the centre line of a crack, otherwise a closed polygon (without
    its first point again). Where the wall is a ring, its middle lies within the ring; a finding
    that crosses the seam goes on beyond it."""
    length: Size | None
    """Of a crack along its centre line, of a joint around the pipe, otherwise along the pipe."""
    width: Size | None
    """Of a crack across its centre line, of a joint along the pipe, otherwise around the pipe."""
    direction: Direction | None
    """Direction of a crack; None for what has none."""
    score: float
    """In [0, 1]; a larger one is surer. It orders the findings of one detector."""

    @property
    def axial_range_mm(self) -> tuple[float, float]:
        """First and last raw axial coordinate."""
        axial = self.outline_mm[:, 0]
        return float(axial.min()), float(axial.max())

    @property
    def middle_mm(self) -> tuple[float, float]:
        """Axial and arc of a point of it: of a crack the middle of its line, otherwise the mean."""
        if self.kind == "crack":
            axial, arc = self.outline_mm[len(self.outline_mm) // 2].tolist()
        else:
            axial, arc = np.mean(self.outline_mm, axis=0).tolist()
        return axial, arc


class Detector(Protocol):
    """Looks at one patch of the wall; `Search` joins what it says about overlapping patches."""

    def propose(self, patch: WallPatch) -> list[Finding]:
        """Find what is on a patch; it changes nothing, and an unseen patch gives nothing."""
        ...
