"""What differs between two walls in register: the findings that only one of them shows.

Both walls were searched by the same detector. Its findings are compared and not the grey levels,
because light and dirt differ everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot
from typing import Literal

import numpy as np

from app.survey.distances.interval import U95
from app.survey.findings.matching import Places
from app.survey.findings.records import Finding, Point, Size
from vo_core.alignment.wall_map import WallMap
from vo_core.mosaic.layout import SWAY, Layout

Mark = Literal["new", "grown", "gone"]


@dataclass(frozen=True)
class Difference:
    """A finding that is new or has grown since the earlier survey, or that is gone."""

    mark: Mark
    finding: str | None
    """Id of the finding in the later survey."""
    earlier_finding: str | None


@dataclass(frozen=True)
class Searched:
    """The findings on one wall, and its raster."""

    findings: Sequence[Finding]
    layout: Layout

    def shows(self, arc_mm: float, girth_mm: float | None) -> bool:
        """Whether the camera saw the wall around this arc, beyond the margin of its raster."""
        low_mm, high_mm = self.layout.arc_from_mm, self.layout.arc_to_mm
        if girth_mm is not None and high_mm - low_mm > girth_mm * (1 - 1e-6):
            return True
        margin_mm = SWAY / (1 + 2 * SWAY) * (high_mm - low_mm)
        return low_mm + margin_mm <= arc_mm <= high_mm - margin_mm


def differences_of(later: Searched, earlier: Searched, found: WallMap) -> list[Difference]:
    """Compare the findings of two walls; where the map does not hold nothing is said."""
    moved = {each.id: _moved(each, found) for each in earlier.findings}
    known = Places(
        turned for each in moved.values() if each is not None for turned in _turns(each, found)
    )
    was = {each.id: each for each in earlier.findings}
    differences, matched = [], set[str]()
    for each in later.findings:
        before = known.of(each)
        if before is not None:
            matched.add(before.id)
        if each.state == "rejected":
            continue
        if before is None:
            there = found.earlier(*each.middle_mm)
            if there is not None and earlier.shows(there.arc_mm, found.girth_mm):
                differences.append(Difference("new", each.id, None))
        elif _has_grown(was[before.id], each):
            differences.append(Difference("grown", each.id, before.id))
    for each in earlier.findings:
        now = moved[each.id]
        is_gone = now is not None and each.id not in matched and each.state != "rejected"
        if now is not None and is_gone and later.shows(now.middle_mm[1], found.girth_mm):
            differences.append(Difference("gone", None, each.id))
    return differences


def _has_grown(before: Finding, after: Finding) -> bool:
    return _is_larger(before.width, after.width) or _is_larger(before.length, after.length)


def _is_larger(before: Size | None, after: Size | None) -> bool:
    if before is None or after is None:
        return False
    return after.mm - before.mm > U95 * hypot(before.sigma_mm, after.sigma_mm)


def _moved(finding: Finding, found: WallMap) -> Finding | None:
    """Return an earlier finding on the later wall; None where the map does not hold."""
    places = [found.later(*point) for point in finding.outline_mm]
    arcs = np.array([place.arc_mm for place in places if place is not None])
    if len(arcs) < len(places):
        return None
    if found.girth_mm is not None:
        arcs = np.unwrap(arcs, period=found.girth_mm)
    outline: tuple[Point, ...] = tuple(
        (place.axial_mm, float(arc))
        for place, arc in zip(places, arcs, strict=True)
        if place is not None
    )
    return replace(finding, outline_mm=outline)


def _turns(finding: Finding, found: WallMap) -> list[Finding]:
    """Return a finding as it may lie before and beyond the seam of a ring."""
    if found.girth_mm is None:
        return [finding]
    return [finding.moved(0.0, turn * found.girth_mm) for turn in (-1, 0, 1)]
