"""Joins the findings of overlapping patches: each defect is one finding."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from vo_core.findings.finding import AREAS, Finding, Size
from vo_core.findings.patches import OVERLAP_MM, WallPatch
from vo_core.types import ByteImage, Matrix

CELL_MM = 2.0
"""Cell of the raster on which two findings are compared."""

LINE_CELLS = 5
"""Thickness of a crack on that raster: two searches see its line within half of it."""

SAME = 0.3
"""Share of the smaller of two findings that lies on the other if they are one."""

APART_MM = 10.0
"""By so much each of two findings goes on farther than the other if the one is cut, and not only
seen a little differently."""

LONGEST_MM = 10_000.0
"""A finding that goes on for longer is told in parts, so that a crew need not wait for its end."""


@dataclass(frozen=True)
class Span:
    """Stretch of wall along the pipe."""

    from_mm: float
    to_mm: float

    @classmethod
    def of(cls, patch: WallPatch) -> Span:
        """Stretch of a patch."""
        from_mm = patch.axial_from_mm
        return cls(from_mm, from_mm + patch.image.shape[1] * patch.mm_per_px)

    def touches(self, other: Span) -> bool:
        """Whether the two have wall in common."""
        return self.from_mm < other.to_mm and other.from_mm < self.to_mm

    def with_(self, other: Span) -> Span:
        """Stretch of both."""
        return Span(min(self.from_mm, other.from_mm), max(self.to_mm, other.to_mm))


class Joined:
    """Findings that may go on in the next patch; patches may come in either direction."""

    def __init__(self) -> None:
        self._searched: Span | None = None
        self._waiting: list[Finding] = []

    def add(self, patch: WallPatch, found: list[Finding]) -> list[Finding]:
        """Join the findings of a patch with those before, and return what is complete."""
        span = Span.of(patch)
        gone: list[Finding] = []
        if self._searched is not None and not self._searched.touches(span):
            gone, self._searched = self.finish(), None
        border_mm = self._border_mm(span)
        waiting = self._waiting
        for finding in found:
            others = []
            for each in waiting:
                near = turned(finding, patch.girth_mm, each.middle_mm[1])
                if is_same(each, near):
                    finding = joined(each, near, border_mm)
                else:
                    others.append(each)
            waiting = [*others, turned(finding, patch.girth_mm, 0.0)]
        self._searched = span if self._searched is None else self._searched.with_(span)
        complete = [_is_complete(each, self._searched) for each in waiting]
        self._waiting = [each for each, is_one in zip(waiting, complete, strict=True) if not is_one]
        return gone + [each for each, is_one in zip(waiting, complete, strict=True) if is_one]

    def finish(self) -> list[Finding]:
        """Return what is left."""
        left, self._waiting = self._waiting, []
        return left

    def _border_mm(self, span: Span) -> float | None:
        """Border of the blocks of which one is new, None for the first."""
        if self._searched is None:
            return None
        ahead = span.to_mm > self._searched.to_mm
        return (span.from_mm if ahead else span.to_mm - 2 * OVERLAP_MM) + OVERLAP_MM


def _is_complete(finding: Finding, searched: Span) -> bool:
    """Whether it lies out of reach of every patch that is still to come, or is long enough."""
    from_mm, to_mm = finding.axial_range_mm
    reach_mm = 2 * OVERLAP_MM
    is_inside = from_mm > searched.from_mm + reach_mm and to_mm < searched.to_mm - reach_mm
    return is_inside or to_mm - from_mm > LONGEST_MM


def turned(finding: Finding, girth_mm: float | None, arc_mm: float) -> Finding:
    """Shift a finding on a ring by whole turns, so that its middle is as near as can be to an arc.

    On a wall that is no ring (no `girth_mm`) it stays where it is.
    """
    if girth_mm is None:
        return finding
    turns = round((finding.middle_mm[1] - arc_mm) / girth_mm)
    return replace(finding, outline_mm=finding.outline_mm - [0.0, turns * girth_mm])


def is_same(one: Finding, other: Finding) -> bool:
    """Whether two findings lie on each other that are of one kind, or areas that a person would
    not tell apart where the end of a patch cuts one of them.
    """
    if one.kind != other.kind and not {one.kind, other.kind} <= AREAS:
        return False
    low = np.maximum(one.outline_mm.min(0), other.outline_mm.min(0)) - LINE_CELLS * CELL_MM
    high = np.minimum(one.outline_mm.max(0), other.outline_mm.max(0)) + LINE_CELLS * CELL_MM
    if (low >= high).any():
        return False
    size = np.ceil((high - low) / CELL_MM).astype(int) + 1
    masks = [_drawn(each, low, size) for each in (one, other)]
    smaller = min(int(mask.sum()) for mask in masks)
    return smaller > 0 and int((masks[0] & masks[1]).sum()) >= SAME * smaller


def joined(one: Finding, other: Finding, border_mm: float | None) -> Finding:
    """Make one finding of two that are the same.

    Args:
        one, other: Seen in two patches, or twice in one of them.
        border_mm: Axial coordinate beyond which the one or the other was seen with its
            surroundings; None if both lie in one patch.
    """
    longer = max(one, other, key=_reach_mm)
    left, right = sorted((one, other), key=lambda each: each.axial_range_mm)
    (left_from, left_to), (right_from, right_to) = left.axial_range_mm, right.axial_range_mm
    tells_more = right_from - left_from > APART_MM and right_to - left_to > APART_MM
    if border_mm is None or not (tells_more and right_from < border_mm < left_to):
        return replace(longer, score=max(one.score, other.score))
    outline = _line_over(left, right, border_mm) if one.kind == "crack" else _area_over(left, right)
    whole = replace(longer, outline_mm=outline, score=max(one.score, other.score))
    whole_mm = _reach_mm(whole)
    return replace(whole, length=_longer(longer.length, whole_mm - _reach_mm(longer)))


def _reach_mm(finding: Finding) -> float:
    """Length of a line, extent of an area along the pipe."""
    if finding.kind == "crack":
        return float(np.hypot(*np.diff(finding.outline_mm, axis=0).T).sum())
    from_mm, to_mm = finding.axial_range_mm
    return to_mm - from_mm


def _longer(size: Size | None, by_mm: float) -> Size | None:
    return None if size is None else Size(size.mm + by_mm, size.sigma_mm)


def _line_over(left: Finding, right: Finding, border_mm: float) -> Matrix:
    """Line of `left` up to the border, and of `right` from the place that is nearest to there."""
    before, beyond = (
        line if line[0, 0] <= line[-1, 0] else line[::-1]
        for line in (left.outline_mm, right.outline_mm)
    )
    before = before[: int(np.argmax(before[:, 0] >= border_mm)) + 1]
    nearest = int(np.hypot(*(beyond - before[-1]).T).argmin())
    return np.vstack([before, beyond[nearest + 1 :]])


def _area_over(left: Finding, right: Finding) -> Matrix:
    """Outline of both areas together."""
    both = np.vstack([left.outline_mm, right.outline_mm])
    low = both.min(0) - 2 * CELL_MM
    size = np.ceil((both.max(0) - low) / CELL_MM).astype(int) + 3
    mask = _drawn(left, low, size) | _drawn(right, low, size)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    largest = max(contours, key=cv2.contourArea)
    return np.asarray(low + CELL_MM * largest[:, 0].astype(np.float64))


def _drawn(finding: Finding, low: Matrix, size: Matrix) -> ByteImage:
    """Draw a finding onto a raster of `size` (columns, rows) that begins at `low` (mm)."""
    mask = np.zeros((size[1], size[0]), np.uint8)
    points = np.rint((finding.outline_mm - low) / CELL_MM).astype(np.int32)
    if finding.kind == "crack":
        cv2.polylines(mask, [points], False, 1, LINE_CELLS)
    else:
        cv2.fillPoly(mask, [points], 1)
    return mask
