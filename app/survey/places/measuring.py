"""The figures of measures: sizes on the wall with their interval, from track and rig."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.survey.distances.interval import U95
from app.survey.observations.tag import Tag
from app.survey.places.measure import Figure, Measure, MeasureKind
from app.survey.places.place import Trajectory
from vo_core import Rig
from vo_core.geometry.measure import area_mm2, fill_share, gap_mm, length_mm, step_mm
from vo_core.geometry.wall import (
    Points,
    Poses,
    camera_position,
    cast,
    pixel_rays,
    rotation_robot_camera,
)
from vo_core.types import Matrix

PICKED_PX = 1.0
"""Standard uncertainty of a click, across and down each."""


@dataclass(frozen=True)
class _Sight:
    """Wall points, and where the camera stood that saw each."""

    points_xyz: Points
    camera_xyz: Points
    radius_mm: float | None

    def moved(self, along_mm: Matrix) -> _Sight:
        """Shift each point with its camera along the pipe."""
        by = _along(along_mm)
        return replace(self, points_xyz=self.points_xyz + by, camera_xyz=self.camera_xyz + by)

    def with_point(self, index: int, xyz: Matrix) -> _Sight:
        """Replace one point."""
        points = self.points_xyz.copy()
        points[index] = xyz
        return replace(self, points_xyz=points)


_SIZE: dict[str, Callable[[_Sight], float]] = {
    "length": lambda sight: length_mm(sight.points_xyz, sight.radius_mm),
    "width": lambda sight: length_mm(sight.points_xyz, sight.radius_mm),
    "area": lambda sight: area_mm2(sight.points_xyz, sight.radius_mm),
    "gap": lambda sight: gap_mm(sight.points_xyz),
    "step": lambda sight: step_mm(sight.points_xyz, sight.camera_xyz, sight.radius_mm),
}


_FIGURES_KEPT = 5_000
"""Figures kept for each trajectory, about a kilobyte each with their points."""


def figures_of(trajectory: Trajectory, tag: Tag) -> tuple[Figure | None, ...]:
    """Derive the figures of a stored tag, in its order; known ones are not computed again."""
    stored: Sequence[Mapping[str, Any]] = tag.measures or ()  # type: ignore[assignment]
    return tuple(_known_figure(trajectory, fields) for fields in stored)


def _known_figure(trajectory: Trajectory, fields: Mapping[str, Any]) -> Figure | None:
    key = json.dumps(fields)
    known = trajectory.figures.get(key)
    if known is not None:
        return known
    found = figure_of(trajectory, Measure.model_validate(fields))
    if found is not None:
        if len(trajectory.figures) >= _FIGURES_KEPT:
            trajectory.figures.clear()
        trajectory.figures[key] = found
    return found


def figure_of(trajectory: Trajectory, measure: Measure) -> Figure | None:
    """Derive the figure of a measure.

    Lengths have the scale of the corrected track, in both directions of the wall: what makes a
    track too long, a wrong height or focal length, makes the wall in its pictures too large alike.
    A depth is a share of the diameter that the rig states, which no correction changes.

    Returns:
        None where a frame is not tracked, a pixel shows no wall, or the picture cannot show this:
        a depth on a floor, a step straight below the camera.
    """
    estimates = [trajectory.estimates(point.frame) for point in measure.points]
    tracked = [both for both in estimates if both is not None]
    if len(tracked) < len(estimates) or trajectory.is_unmeasured:
        return None
    raw, corrected = zip(*tracked, strict=True)
    rig, pixels = trajectory.adjusted.rig, np.array([point.pixel for point in measure.points])
    path = _Path(
        rig=rig,
        pixels=pixels,
        rays=pixel_rays(rig.camera, pixels),
        poses=Poses.of([estimate.pose for estimate in raw]),
        distance_mm=np.array([estimate.distance_mm for estimate in corrected]),
        registration_mm=np.array([estimate.sigma_registration_mm for estimate in corrected]),
        scale=trajectory.adjusted.scale,
        scale_sigma=trajectory.adjusted.scale_sigma or 0.0,
    )
    is_corrected = trajectory.adjusted.source != "odometry"
    found = (
        _depth(path)
        if measure.kind == "depth"
        else _size(measure.kind, path, is_corrected=is_corrected)
    )
    if found is None:
        return None
    points = path.sight(rig).points_xyz.tolist()
    return replace(found, points_mm=tuple((x, y, z) for x, y, z in points))


def _size(kind: MeasureKind, path: _Path, *, is_corrected: bool) -> Figure | None:
    size = _SIZE[kind]
    value = size(path.sight(path.rig))
    # The sigma of a corrected scale is that of the whole size, the way between the frames included.
    drifted = path.drifted(scale_sigma=0.0 if is_corrected else path.scale_sigma)
    errors = [*_by_clicks(path, size), size(drifted) - value]
    # A known length sets the scale whatever the rig states; what is left of the rig is its tilt.
    errors += [size(path.sight(other)) - value for other in _tilted(path.rig)]
    if is_corrected:
        errors.append(path.scale_sigma * value * (2 if kind == "area" else 1))
    else:
        errors += [size(path.sight(other)) - value for other in _resized(path.rig)]
    return _figure(kind, value, errors)


def _depth(path: _Path) -> Figure | None:
    rig, radius_mm = path.rig, path.rig.pipe.radius_mm
    if radius_mm is None:
        return None
    diameter_mm = 2 * radius_mm

    def share(sight: _Sight) -> float:
        return fill_share(sight.points_xyz)

    value = share(path.sight(rig))
    by_clicks = list(_by_clicks(path, share))
    others = [(other, share(path.sight(other))) for other in (*_tilted(rig), *_resized(rig))]
    errors = [*by_clicks, *(found - value for _, found in others)]
    percent = _figure("depth", 100 * value, [100 * error for error in errors])
    # Another diameter changes the share and what it is a share of.
    errors_mm = [diameter_mm * error for error in by_clicks] + [
        found * 2 * (other.pipe.radius_mm or radius_mm) - value * diameter_mm
        for other, found in others
    ]
    whole = _figure("depth", value * diameter_mm, errors_mm)
    if percent is None or whole is None:
        return None
    return replace(whole, percent=percent.value, percent_u95=percent.u95)


def _figure(kind: MeasureKind, value: float, errors: Sequence[float]) -> Figure | None:
    u95 = U95 * math.hypot(*errors)
    return Figure(kind, value, u95, None, None) if math.isfinite(value + u95) else None


@dataclass(frozen=True)
class _Path:
    """Clicks, and the poses from which they were seen, one for each click."""

    rig: Rig
    pixels: Points
    """(N, 2)"""
    rays: Points
    """(N, 3) in camera axes: finding them for a fisheye takes longer than all the rest here."""
    poses: Poses
    """Of the raw track, which agree with the rig."""
    distance_mm: Matrix
    """Of the corrected track, one for each click."""
    registration_mm: Matrix
    scale: float
    scale_sigma: float

    def sight(self, rig: Rig) -> _Sight:
        """Return the points as a rig sees them: the stated one, or what it may be instead."""
        same_lens = rig.camera is self.rig.camera
        rays = self.rays if same_lens else pixel_rays(rig.camera, self.pixels)
        return self._cast(rig, rays, np.arange(len(rays)))

    def missed(self) -> Points:
        """(N, 2, 3) points that each click shows if it misses across, or down, by `PICKED_PX`."""
        beside = self.pixels[:, None] + PICKED_PX * np.eye(2)
        rays = pixel_rays(self.rig.camera, beside.reshape(-1, 2))
        points = self._cast(self.rig, rays, np.repeat(np.arange(len(beside)), 2)).points_xyz
        return points.reshape(-1, 2, 3)

    def drifted(self, scale_sigma: float) -> _Sight:
        """What the points are when the camera drove farther between their frames, by one sigma."""
        driven_mm = self.distance_mm - self.distance_mm[0]
        variance = np.abs(self.registration_mm**2 - self.registration_mm[0] ** 2)
        drift_mm = np.sqrt(variance + (scale_sigma * driven_mm) ** 2) * np.sign(driven_mm)
        return self.sight(self.rig).moved(drift_mm)

    def _cast(self, rig: Rig, rays: Points, of: NDArray[np.intp]) -> _Sight:
        """Cast rays in camera axes from the poses with the indices `of`, to the corrected scale."""
        poses = Poses(*(getattr(self.poses, name)[of] for name in Poses.__match_args__))
        wall = cast(rig, poses, rays @ rotation_robot_camera(rig.mount).T)
        camera = camera_position(rig, poses).T
        origin, start = _along(poses.x_mm), _along(self.distance_mm[of])
        radius_mm = rig.pipe.radius_mm and self.scale * rig.pipe.radius_mm
        return _Sight(
            start + self.scale * (wall - origin), start + self.scale * (camera - origin), radius_mm
        )


def _along(x_mm: Matrix) -> Points:
    """(N, 3) vectors along the pipe."""
    return np.column_stack([x_mm, np.zeros((len(x_mm), 2))])


def _by_clicks(path: _Path, size: Callable[[_Sight], float]) -> Iterator[float]:
    """Yield the error by each click, across and down."""
    sight = path.sight(path.rig)
    value = size(sight)
    for index, beside in enumerate(path.missed()):
        for xyz in beside:
            yield size(sight.with_point(index, xyz)) - value


def _tilted(rig: Rig) -> list[Rig]:
    """The rig, pitched or rolled by its tolerance."""
    tilt_deg, mount = rig.tolerance.tilt_deg, rig.mount
    return [
        rig.model_copy(
            update={"mount": mount.model_copy(update={name: getattr(mount, name) + tilt_deg})}
        )
        for name in ("pitch_deg", "roll_deg")
    ]


def _resized(rig: Rig) -> list[Rig]:
    """The rig with another height, focal length or diameter, each by its tolerance."""
    tolerance, camera, mount, pipe = rig.tolerance, rig.camera, rig.mount, rig.pipe
    longer = 1 + tolerance.focal_percent / 100
    height = {"height_mm": mount.height_mm + tolerance.height_mm}
    focal = {"fx": camera.fx * longer, "fy": camera.fy * longer}
    changed = [
        rig.model_copy(update={"mount": mount.model_copy(update=height)}),
        rig.model_copy(update={"camera": camera.model_copy(update=focal)}),
    ]
    if pipe.diameter_mm is not None:
        diameter = {"diameter_mm": pipe.diameter_mm + tolerance.diameter_mm}
        changed.append(rig.model_copy(update={"pipe": pipe.model_copy(update=diameter)}))
    return changed
