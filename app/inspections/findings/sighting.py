"""Where findings are: the frames that show them best, and what follows from these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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
from app.survey.observations.tag import StatedTag, Tag
from app.survey.places.place import Place, Trajectory, WallUnder, places_of
from vo_core.geometry.wall import clock_of

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
        half = U95 * size.sigma_mm
        return cls(*(scale * mm for mm in (size.mm, max(size.mm - half, 0.0), size.mm + half)))


@dataclass(frozen=True)
class FindingView:
    """A finding with what derives from the present trajectory."""

    finding: Finding
    distance_mm: float
    """Corrected distance of its middle, and of its ends."""
    from_mm: float
    to_mm: float
    place: Place | None
    """None where no frame shows it."""
    seen: SeenAt | None
    sector: Sector | None
    """None on a floor."""
    lateral_mm: float
    """To the right of the axis."""
    length: Figure | None
    width: Figure | None
    suggested: dict[str, Any]
    """Fields of the tag to start from, without frame and pixel."""


def views_of(
    trajectory: Trajectory, findings: Sequence[Finding], table: CodeTable
) -> list[FindingView]:
    """Derive where findings are, in their order along the pipe."""
    seen = seen_best_of(trajectory, findings)
    tags = [_tag(each.frame, each.pixel) for each in seen if each is not None]
    places = iter(places_of(trajectory, tags))
    views = [
        _view(trajectory, finding, at, None if at is None else next(places), table)
        for finding, at in zip(findings, seen, strict=True)
    ]
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
    wall_mm = np.array([trajectory.adjusted.chainage_mm(axial) for axial in middles[:, 0]])
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
    tags = {
        each.id: _tag(each.frame, each.pixel)
        for each in findings
        if each.frame is not None and each.pixel is not None
    }
    return {
        finding_id: (place.wall.raw_mm, _arc_mm(trajectory, place.wall))
        for finding_id, place in zip(tags, places_of(trajectory, list(tags.values())), strict=True)
        if place is not None and place.wall is not None
    }


def _arc_mm(trajectory: Trajectory, wall: WallUnder) -> float:
    radius_mm = trajectory.adjusted.rig.pipe.radius_mm
    if wall.clock_h is None or radius_mm is None:
        return wall.lateral_mm / trajectory.adjusted.scale
    return float(radius_mm * np.radians(180 - 30 * wall.clock_h))


def _tag(frame: int, pixel: Point) -> Tag:
    return StatedTag.kept({"frame": frame, "pixel": list(pixel)})


def _view(
    trajectory: Trajectory,
    finding: Finding,
    seen: SeenAt | None,
    place: Place | None,
    table: CodeTable,
) -> FindingView:
    adjusted = trajectory.adjusted
    radius_mm, scale = adjusted.rig.pipe.radius_mm, adjusted.scale
    first_mm, _, last_mm, _ = finding.box_mm
    arc_mm = finding.middle_mm[1]
    sector = _sector(finding, radius_mm)
    width = Figure.of(finding.width, scale)
    middle_mm = adjusted.chainage_mm(finding.middle_mm[0])
    return FindingView(
        finding,
        place.distance_mm if place else middle_mm,
        adjusted.chainage_mm(first_mm),
        adjusted.chainage_mm(last_mm),
        place,
        seen,
        sector,
        scale * arc_mm if radius_mm is None else radius_mm * float(np.sin(arc_mm / radius_mm)),
        Figure.of(finding.length, scale),
        width,
        suggested(finding, width.value if width else None, sector, table),
    )


def _sector(finding: Finding, radius_mm: float | None) -> Sector | None:
    """Return the hours of a finding; along the arc they fall, from 6 at the invert to 3 right."""
    if radius_mm is None:
        return None
    _, first_mm, _, last_mm = finding.box_mm
    if (last_mm - first_mm) / radius_mm * 6 / np.pi > _ALL_ROUND_H:
        return Sector(12, 12)
    begin, end = (round(clock_of(arc_mm / radius_mm)) % 12 or 12 for arc_mm in (last_mm, first_mm))
    return Sector(begin, None if begin == end else end)
