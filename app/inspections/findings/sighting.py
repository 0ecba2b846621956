"""Where findings are: the frames that show them best, and what follows from these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from app.inspections.picking import (
    SeenAt,
    are_inside,
    in_view_mm,
    misses_of,
    pixels_of,
    ranks_of,
)
from app.survey.catalogue.table import CodeTable
from app.survey.distances.interval import U95
from app.survey.findings.records import Finding, Point, Proposal, Size
from app.survey.findings.suggestions import Sector, suggested
from app.survey.places.place import Place, Trajectory, WallUnder, places_at

_LOOKS = 24
"""Frames of those that pass a place that are compared, evenly spread: one of them shows it within
a twentieth of the view of the best."""
_WORSE_PX = 1e6
"""A frame that was measured badly is taken only if no better one shows the place."""
_ALL_ROUND_H = 11.0


@dataclass(frozen=True)
class Figure:
    """A size with its 95 % interval, corrected, mm."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, size: Size | None, scale: float) -> Figure | None:
        """Correct a raw size by the scale of the track."""
        if size is None:
            return None
        mm, half = scale * size.mm, scale * U95 * size.sigma_mm
        return cls(mm, max(mm - half, 0.0), mm + half)


@dataclass(frozen=True)
class Where:
    """The part of the wall that a finding covers."""

    distance_mm: float
    """Corrected distance of its middle, and of its ends."""
    from_mm: float
    to_mm: float
    sector: Sector | None
    """None on a floor."""
    lateral_mm: float
    """To the right of the axis."""


@dataclass(frozen=True)
class FindingView:
    """A finding with what derives from the present trajectory."""

    finding: Finding
    where: Where
    place: Place | None
    """As that of its observation will be; None where no frame shows it."""
    seen: SeenAt | None
    length: Figure | None
    width: Figure | None
    suggested: dict[str, Any]
    """Fields of the tag to start from, without frame and pixel."""

    @property
    def distance_mm(self) -> float:
        """Corrected distance of its middle."""
        return self.place.distance_mm if self.place else self.where.distance_mm


def views_of(
    trajectory: Trajectory, findings: Sequence[Finding], table: CodeTable
) -> list[FindingView]:
    """Derive where findings are, in their order along the pipe."""
    if not findings:
        return []
    seen = seen_best_of(trajectory, findings)
    anchors = [(each.frame, each.pixel) for each in seen if each is not None]
    places = iter(places_at(trajectory, anchors))
    named, scale = cache(table.named), trajectory.adjusted.scale
    views = []
    for finding, at, where in zip(findings, seen, _wheres(trajectory, findings), strict=True):
        place = None if at is None else next(places)
        width = Figure.of(finding.width, scale)
        width_mm = width.value if width else None
        fields = suggested(finding, width_mm, where.sector, table, named)
        length = Figure.of(finding.length, scale)
        views.append(FindingView(finding, where, place, at, length, width, fields))
    return sorted(views, key=lambda view: (view.distance_mm, view.finding.id))


def seen_best_of(trajectory: Trajectory, found: Sequence[Proposal]) -> list[SeenAt | None]:
    """Return the frame and pixel that show the middle of each best; None where no frame does.

    It is `picking.seen_best` for thousands of places at once.
    """
    rig, raw = trajectory.adjusted.rig, trajectory.raw
    if not (found and len(raw)):
        return [None] * len(found)
    corrected = trajectory.adjusted.extended(raw)
    order = np.argsort(corrected.distance_mm, kind="stable")
    camera_mm = corrected.distance_mm[order]
    middles = np.array([each.middle_mm for each in found])
    wall_mm = trajectory.adjusted.chainages_mm(middles[:, 0])
    scale, (low_mm, high_mm) = trajectory.adjusted.scale, in_view_mm(rig)
    first = np.searchsorted(camera_mm, wall_mm - scale * high_mm)
    last = np.searchsorted(camera_mm, wall_mm - scale * low_mm, side="right") - 1
    spread = first[:, None] + (last - first)[:, None] * np.linspace(0, 1, _LOOKS)
    frames = order[np.clip(np.rint(spread).astype(np.intp), 0, len(raw) - 1)]
    ahead_mm = (wall_mm[:, None] - corrected.distance_mm[frames]) / scale
    arc_mm = np.broadcast_to(middles[:, 1:], frames.shape)
    in_pipe = trajectory.initial_pose.added_to(raw)
    pixels = pixels_of(
        rig, in_pipe, frames.ravel(), ahead_mm.ravel(), np.ascontiguousarray(arc_mm).ravel()
    ).reshape(*frames.shape, 2)
    ranks = ranks_of(raw, frames.ravel()).reshape(frames.shape)
    misses = misses_of(rig, ahead_mm, pixels) + _WORSE_PX * ranks
    misses[~are_inside(rig, pixels) | (last < first)[:, None]] = np.inf
    best = misses.argmin(axis=1)
    return [
        SeenAt(int(frames[n, k]), (float(pixels[n, k, 0]), float(pixels[n, k, 1])))
        if np.isfinite(misses[n, k])
        else None
        for n, k in enumerate(best)
    ]


def places_on_track(trajectory: Trajectory, findings: Sequence[Finding]) -> dict[str, Point]:
    """Return where known findings are on the present track, raw, by the frame and pixel that showed
    them when they were found; without those that no tracked frame shows.
    """
    anchors = {
        each.id: (each.frame, each.pixel)
        for each in findings
        if each.frame is not None and each.pixel is not None
    }
    places = places_at(trajectory, list(anchors.values()))
    return {
        finding_id: (place.wall.raw_mm, _arc_mm(trajectory, place.wall))
        for finding_id, place in zip(anchors, places, strict=True)
        if place is not None and place.wall is not None
    }


def _arc_mm(trajectory: Trajectory, wall: WallUnder) -> float:
    radius_mm = trajectory.adjusted.rig.pipe.radius_mm
    if wall.clock_h is None or radius_mm is None:
        return wall.lateral_mm / trajectory.adjusted.scale
    return float(radius_mm * np.radians(180 - 30 * wall.clock_h))


def _wheres(trajectory: Trajectory, findings: Sequence[Finding]) -> list[Where]:
    radius_mm, scale = trajectory.adjusted.rig.pipe.radius_mm, trajectory.adjusted.scale
    boxes = np.array([each.box_mm for each in findings])
    middles = np.array([each.middle_mm for each in findings])
    along = np.column_stack([middles[:, 0], boxes[:, 0], boxes[:, 2]])
    distances = trajectory.adjusted.chainages_mm(along.ravel()).reshape(-1, 3)
    arc_mm = middles[:, 1]
    if radius_mm is None:
        sectors: list[Sector | None] = [None] * len(findings)
        lateral_mm = scale * arc_mm
    else:
        # Along the arc the hours fall: from 6 at the invert to 3 on the right.
        hours = 6 - boxes[:, [3, 1]] / radius_mm * 6 / np.pi
        is_round = hours[:, 1] - hours[:, 0] > _ALL_ROUND_H
        whole = ((np.rint(hours).astype(np.int64) - 1) % 12 + 1).tolist()
        sectors = [
            Sector(12, 12) if all_round else Sector(begin, None if begin == end else end)
            for (begin, end), all_round in zip(whole, is_round.tolist(), strict=True)
        ]
        lateral_mm = radius_mm * np.sin(arc_mm / radius_mm)
    return [
        Where(middle, first, last, sector, lateral)
        for (middle, first, last), sector, lateral in zip(
            distances.tolist(), sectors, lateral_mm.tolist(), strict=True
        )
    ]
