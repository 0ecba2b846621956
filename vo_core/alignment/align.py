"""Aligns two walls of one pipe: anchors are found anywhere, then followed along the pipe.

1. Both walls are brought to one raster without light, rings and streaks (`raster`). Rings are
   removed because those of another pipe with the same segments would fit as well.
2. An anchor, a patch of most of a metre, is looked for on the whole earlier wall, in both
   directions and around the pipe, on coarser pixels. It counts only against the number of places
   that it could have had, and against its second best place.
3. From an anchor short patches are followed both ways on fine pixels. Each is looked for near the
   place to which its neighbours lead, so that a wrong anchor finds no neighbours.
4. A stretch counts if several neighbours agree with its anchor. What no stretch covers is a gap,
   and so is a part of one in which nothing was recognised for a metre.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import floor

import numpy as np

from vo_core.alignment.matching import Match, match
from vo_core.alignment.raster import Raster, Wall, rasters
from vo_core.alignment.wall_map import Direction, Gap, Node, Reason, WallMap

PATCH_MM = 300.0
"""Length of a patch that is followed."""
STEP_MM = 150.0
"""Way from patch to patch."""

ANCHOR_MM = 800.0
"""Length of an anchor; its texture must be that of one place among millions."""
_ANCHOR_FACTOR = 2
"""How much coarser its pixels are."""
_SCALES = (1.0, 0.985, 1.015)
"""Scales at which an anchor is looked for: rigs are off by a percent, seldom by two."""
MOST_ANCHORS = 48
_LEAST_ANCHORS = 8
_BLOCK_MM = 12_000.0
_MOST_BLOCKS = 600
"""An anchor on a wall of 500 m takes seconds, so there are fewer of them on long walls: so many
times a block of wall is searched for one."""

SURE = 12.0
"""Least log odds of an anchor: once in a hundred thousand searches one is found by chance; then
its neighbours are missing."""
LIKELY = 5.0
"""Least log odds of a patch beside a known place."""
LEAD = 3.0
"""Least log odds of either against its second best place."""

LEAST_NODES = 4
"""Patches that must agree: a false anchor has one neighbour by chance in e^5, four in e^20."""

_GIVES_UP_MM = 3000.0
"""A stretch ends where no patch is recognised for so long; another anchor may go on."""
_BRIDGED_MM = 1000.0
"""Over this way between two nodes the map still holds."""
_SLACK_MM = 6.0
"""How far a patch may lie from where its neighbours lead, and around the pipe likewise."""
_DRIFT = 0.015
"""What is added to that over a way without patches."""
_OFF = 4.0
"""A node that is off its neighbours by more than this many sigmas is dropped."""
_FLOOR_MM = 0.15
"""Part of sigma that pixels and the mosaics' own seams cause."""


@dataclass(frozen=True)
class _Found:
    """A patch that was recognised; places in mm of the rasters."""

    at_mm: float
    """Middle of the patch on the later wall, which may be turned."""
    earlier_mm: float
    arc_mm: float
    """What the arc of the later wall lacks."""
    sigma_mm: float
    odds: float


def align(
    earlier: Wall, later: Wall, on_progress: Callable[[float], None] = lambda share: None
) -> WallMap:
    """Align two walls.

    Args:
        earlier: The wall that the map leads to.
        later: The wall that it comes from.
        on_progress: Called with the share of the later wall that was looked at.
    Raises:
        InvalidRig: The pipes have different shapes or diameters.
    """
    one, other = rasters(earlier, later)
    coarse = one.coarser(_ANCHOR_FACTOR)
    ways = [_Way("same", other), _Way("opposite", other.turned())]
    length_mm = other.end_mm - other.axial_mm
    blocks = (one.end_mm - one.axial_mm) / _BLOCK_MM
    most = round(min(max(_MOST_BLOCKS / blocks, _LEAST_ANCHORS), MOST_ANCHORS))
    every_mm = max(ANCHOR_MM, length_mm / most)
    count = max(1, floor((length_mm - ANCHOR_MM) / every_mm) + 1)
    for number in range(count):
        on_progress(number / count)
        for way in ways:
            way.look_at(one, coarse, number * every_mm)
        ways = next(([way] for way in ways if way.stretches), ways)
    return _map_of(ways[0], other, earlier.girth_mm)


class _Way:
    """The later wall in one direction, and what was recognised of it."""

    def __init__(self, direction: Direction, other: Raster) -> None:
        self.direction: Direction = direction
        self.stretches: list[list[_Found]] = []
        self._other, self._rough = other, other.coarser(_ANCHOR_FACTOR)

    def look_at(self, one: Raster, coarse: Raster, way_mm: float) -> None:
        """Look for an anchor `way_mm` from the beginning, unless it is known; follow it."""
        other, known = self._other, self.stretches
        from_mm = other.axial_mm + way_mm
        middle_mm = from_mm + ANCHOR_MM / 2
        if any(stretch[0].at_mm <= middle_mm <= stretch[-1].at_mm for stretch in known):
            return
        anchor = _anchored(coarse, self._rough, from_mm, min(from_mm + ANCHOR_MM, other.end_mm))
        if anchor is None:
            return
        stretch = [
            *_followed(one, other, anchor, -STEP_MM)[::-1],
            *_followed(one, other, anchor, STEP_MM)[1:],
        ]
        if len(stretch) >= LEAST_NODES:
            stretch = _apart(stretch, known)
            if len(stretch) >= LEAST_NODES:
                known.append(stretch)


def _map_of(way: _Way, other: Raster, girth_mm: float | None) -> WallMap:
    sign = 1.0 if way.direction == "same" else -1.0
    nodes = sorted(
        (
            _nodes(part, sign)
            for stretch in way.stretches
            for part in _parts(_without_outliers(stretch))
        ),
        key=lambda stretch: stretch[0].axial_mm,
    )
    return WallMap(way.direction, nodes, _gaps(other, nodes), PATCH_MM / 2, girth_mm)


def _apart(stretch: list[_Found], others: list[list[_Found]]) -> list[_Found]:
    """Leave out what other stretches hold already."""
    return [
        found
        for found in stretch
        if not any(other[0].at_mm <= found.at_mm <= other[-1].at_mm for other in others)
    ]


def _anchored(coarse: Raster, rough: Raster, from_mm: float, to_mm: float) -> _Found | None:
    """Look for a part of the later wall on the whole earlier one."""
    for scale in _SCALES:
        patch = rough.part(from_mm, to_mm, scale)
        if patch[1].mean() < _LEAST_SEEN:
            return None
        best = _everywhere(coarse, rough, patch)
        if best is None:
            continue
        (along_mm, arc_mm), found = best
        if found.odds > SURE and found.lead > SURE:
            middle_mm = (from_mm + to_mm) / 2
            half_mm = patch[0].shape[1] * coarse.mm_per_px / 2
            return _Found(middle_mm, along_mm + half_mm, arc_mm, coarse.mm_per_px, found.odds)
    return None


_LEAST_SEEN = 0.3
"""Share of a patch that must have been seen."""


def _everywhere(
    coarse: Raster, rough: Raster, patch: tuple[np.ndarray, np.ndarray]
) -> tuple[tuple[float, float], Match] | None:
    """Best place of a patch on the wall, block by block, judged against those of all blocks."""
    width_mm = patch[0].shape[1] * coarse.mm_per_px
    hits: list[tuple[tuple[float, float], Match]] = []
    begin_mm = coarse.axial_mm - width_mm / 2
    blocks = 0
    while begin_mm < coarse.end_mm - width_mm / 2:
        end_mm = min(begin_mm + _BLOCK_MM, coarse.end_mm - width_mm / 2)
        found = _near(coarse, rough, patch, (begin_mm, end_mm), None)
        blocks += 1
        if found is not None:
            hits.append(found)
        begin_mm = end_mm
    if not hits:
        return None
    hits.sort(key=lambda hit: hit[1].odds, reverse=True)
    place, best = hits[0]
    away = [hit for hit in hits[1:] if abs(hit[0][0] - place[0]) > 2 * _SLACK_MM]
    lead = min([best.lead, *(best.odds - hit[1].odds for hit in away)])
    return place, replace(best, odds=best.odds - float(np.log(blocks)), lead=lead)


def _near(
    one: Raster,
    other: Raster,
    patch: tuple[np.ndarray, np.ndarray],
    along_mm: tuple[float, float],
    around_mm: tuple[float, float] | None,
) -> tuple[tuple[float, float], Match] | None:
    """Look for a patch whose first column lies between two places of a wall.

    Args:
        one: The wall.
        other: Where the patch comes from.
        patch: Its texture, and where it was seen.
        along_mm: The two places.
        around_mm: Bounds of what is added to the patch's arc; None: anywhere around.
    """
    width = patch[0].shape[1]
    low_mm, high_mm = along_mm
    wall = one.part(low_mm, high_mm + width * one.mm_per_px)
    lag = other.arc_mm / other.row_mm - one.arc_mm / one.row_mm
    if around_mm is not None:
        rows = tuple(round(lag + each / one.row_mm) for each in around_mm)
    elif one.is_ring:
        rows = (0, wall[0].shape[0] - 1)
    else:
        rows = (-patch[0].shape[0] + 1, wall[0].shape[0] - 1)
    columns = (0, round((high_mm - low_mm) / one.mm_per_px))
    found = match(wall, patch, columns=columns, rows=(rows[0], rows[1]), is_ring=one.is_ring)
    if found is None:
        return None
    arc_mm = (found.around_px - lag) * one.row_mm
    return (low_mm + found.along_px * one.mm_per_px, arc_mm), found


def _followed(one: Raster, other: Raster, anchor: _Found, step_mm: float) -> list[_Found]:
    """Follow the wall from an anchor, whose place is found once more on fine pixels."""
    known: list[_Found] = []
    at_mm, last = anchor.at_mm, anchor
    while abs(at_mm - last.at_mm) <= _GIVES_UP_MM:
        if not other.axial_mm <= at_mm - PATCH_MM / 2 <= at_mm + PATCH_MM / 2 <= other.end_mm:
            break
        found = _step(one, other, known, last, at_mm)
        if found is not None:
            known.append(found)
            last = found
        elif not known:  # the anchor itself is not confirmed
            break
        at_mm += step_mm
    return known


def _step(
    one: Raster, other: Raster, known: list[_Found], last: _Found, at_mm: float
) -> _Found | None:
    slope = _slope(known)
    way_mm = at_mm - last.at_mm
    expected_mm = last.earlier_mm + slope * way_mm
    slack_mm = _SLACK_MM + _DRIFT * abs(way_mm)
    if not known:
        slack_mm = _SLACK_MM + _DRIFT * ANCHOR_MM
    patch = other.part(at_mm - PATCH_MM / 2, at_mm + PATCH_MM / 2, slope)
    if patch[1].mean() < _LEAST_SEEN:
        return None
    half_mm = patch[0].shape[1] * one.mm_per_px / 2
    first_mm = expected_mm - half_mm
    around = (last.arc_mm - slack_mm, last.arc_mm + slack_mm)
    found = _near(one, other, patch, (first_mm - slack_mm, first_mm + slack_mm), around)
    if found is None:
        return None
    (along_mm, arc_mm), best = found
    if best.odds < LIKELY or best.lead < LEAD:
        return None
    if abs(along_mm - first_mm) > slack_mm - one.mm_per_px:  # a peak at the border is none
        return None
    sigma_mm = float(np.hypot(best.sigma_px[0] * one.mm_per_px, _FLOOR_MM))
    return _Found(at_mm, along_mm + half_mm, arc_mm, sigma_mm, best.odds)


_SLOPE_NODES = 8
"""Patches from which the local scale is taken."""
_SLOPE_PRIOR_MM = 400.0
"""Way over which the scale is taken as 1 as long as little is known."""


def _slope(known: list[_Found]) -> float:
    """Local scale of the earlier wall against the later one, drawn to 1 over short ways."""
    if len(known) < 2:
        return 1.0
    few = known[-_SLOPE_NODES:]
    at_mm = np.array([found.at_mm for found in few])
    off_mm = np.array([found.earlier_mm - found.at_mm for found in few])
    at_mm -= at_mm.mean()
    return 1 + float((at_mm * off_mm).sum() / ((at_mm * at_mm).sum() + _SLOPE_PRIOR_MM**2))


def _without_outliers(stretch: list[_Found]) -> list[_Found]:
    """Drop what is off the line through its neighbours by more than chance."""
    kept = [stretch[0]]
    for before, found, after in zip(stretch, stretch[1:], stretch[2:], strict=False):
        share = (found.at_mm - before.at_mm) / (after.at_mm - before.at_mm)
        line_mm = before.earlier_mm + share * (after.earlier_mm - before.earlier_mm)
        sigma_mm = float(np.hypot(found.sigma_mm, np.hypot(before.sigma_mm, after.sigma_mm)))
        bend_mm = 0.005 * (after.at_mm - before.at_mm)
        if abs(found.earlier_mm - line_mm) <= _OFF * sigma_mm + bend_mm:
            kept.append(found)
    return [*kept, stretch[-1]]


def _parts(stretch: list[_Found]) -> list[list[_Found]]:
    """Divide a stretch where nothing was recognised for too long."""
    parts = [[stretch[0]]]
    for before, found in pairwise(stretch):
        if found.at_mm - before.at_mm > _BRIDGED_MM:
            parts.append([])
        parts[-1].append(found)
    return parts


def _nodes(stretch: list[_Found], sign: float) -> list[Node]:
    """Nodes of the later wall as it is, in its order."""
    nodes = [
        Node(sign * found.at_mm, found.earlier_mm, found.arc_mm, found.sigma_mm)
        for found in stretch
    ]
    return nodes if sign > 0 else nodes[::-1]


def _gaps(other: Raster, stretches: list[list[Node]]) -> list[Gap]:
    """What no stretch covers, with the reason."""
    ends_mm = [other.axial_mm]
    for stretch in stretches:
        ends_mm += [stretch[0].axial_mm - PATCH_MM / 2, stretch[-1].axial_mm + PATCH_MM / 2]
    ends_mm.append(other.end_mm)
    gaps = []
    for from_mm, to_mm in zip(ends_mm[::2], ends_mm[1::2], strict=True):
        if to_mm - from_mm > STEP_MM:
            gaps.append(Gap(from_mm, to_mm, _reason(other, from_mm, to_mm)))
    return gaps


def _reason(other: Raster, from_mm: float, to_mm: float) -> Reason:
    if other.end_mm - other.axial_mm < ANCHOR_MM:
        return "short"
    _, seen = other.part(from_mm, to_mm)
    return "unseen" if seen.mean() < _LEAST_SEEN else "unlike"
