"""Which place of an earlier wall is which place of a later one, where that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vo_core.types import Matrix

Reason = Literal["unlike", "unseen", "short"]
"""Why a map does not hold: the walls show different things there, one of them shows nothing there,
or the wall is too short to be recognised."""

Direction = Literal["same", "opposite"]


@dataclass(frozen=True)
class Node:
    """A place of the later wall that was recognised on the earlier one."""

    axial_mm: float
    """Raw axial coordinate on the later wall."""
    earlier_mm: float
    """On the earlier wall."""
    arc_mm: float
    """What is added to the arc of the later wall, for `opposite` to its negative, to get that of
    the earlier one."""
    sigma_mm: float
    """Standard uncertainty of `earlier_mm`."""


@dataclass(frozen=True)
class Gap:
    """A part of the later wall for which the map does not hold."""

    from_mm: float
    to_mm: float
    reason: Reason


@dataclass(frozen=True)
class Place:
    """Where a place of one wall lies on the other one."""

    axial_mm: float
    arc_mm: float
    sigma_mm: float


@dataclass(frozen=True)
class WallMap:
    """Way from the raw coordinates of a later wall to those of an earlier one."""

    direction: Direction
    """Whether the later camera drove the same way; see `Raster.turned`."""
    stretches: Sequence[Sequence[Node]]
    """Nodes in the order of the later wall; the map holds along each stretch and not between."""
    gaps: Sequence[Gap]
    reach_mm: float
    """How far it holds beyond the first and the last node of a stretch: half a patch."""
    girth_mm: float | None

    @property
    def nodes(self) -> list[Node]:
        """All nodes, in the order of the later wall."""
        return [node for stretch in self.stretches for node in stretch]

    def earlier(self, axial_mm: float, arc_mm: float = 0.0) -> Place | None:
        """Return the place on the earlier wall; None where the map does not hold."""
        for stretch in self.stretches:
            at_mm = [node.axial_mm for node in stretch]
            if at_mm[0] - self.reach_mm <= axial_mm <= at_mm[-1] + self.reach_mm:
                place_mm, offset_mm, sigma_mm = _interpolated(
                    axial_mm,
                    at_mm,
                    [(node.earlier_mm, node.arc_mm, node.sigma_mm) for node in stretch],
                    self._sign,
                )
                turned_mm = self._sign * arc_mm + offset_mm
                return Place(place_mm, self._wrapped(turned_mm), sigma_mm)
        return None

    def later(self, earlier_mm: float, arc_mm: float = 0.0) -> Place | None:
        """Return the place on the later wall; None where the map does not hold."""
        for stretch in self.stretches:
            ordered = sorted(stretch, key=lambda node: node.earlier_mm)
            at_mm = [node.earlier_mm for node in ordered]
            if at_mm[0] - self.reach_mm <= earlier_mm <= at_mm[-1] + self.reach_mm:
                place_mm, offset_mm, sigma_mm = _interpolated(
                    earlier_mm,
                    at_mm,
                    [(node.axial_mm, node.arc_mm, node.sigma_mm) for node in ordered],
                    self._sign,
                )
                turned_mm = self._sign * (arc_mm - offset_mm)
                return Place(place_mm, self._wrapped(turned_mm), sigma_mm)
        return None

    @property
    def _sign(self) -> float:
        return 1.0 if self.direction == "same" else -1.0

    def _wrapped(self, arc_mm: float) -> float:
        if self.girth_mm is None:
            return arc_mm
        return arc_mm - self.girth_mm * float(np.rint(arc_mm / self.girth_mm))


_STRETCH = 0.01
"""Relative error of a way that no node checks, one sigma."""


def _interpolated(
    at_mm: float, nodes_mm: Sequence[float], values: Sequence[tuple[float, ...]], slope: float
) -> tuple[float, float, float]:
    """Place, offset and sigma between nodes; beyond the ends the place goes on by `slope`."""
    table: Matrix = np.array(values)
    inside_mm = float(np.clip(at_mm, nodes_mm[0], nodes_mm[-1]))
    place, offset, sigma = (float(np.interp(inside_mm, nodes_mm, row)) for row in table.T)
    place += slope * (at_mm - inside_mm)
    away_mm = float(np.abs(np.array(nodes_mm) - at_mm).min())
    return place, offset, float(np.hypot(sigma, _STRETCH * away_mm))
