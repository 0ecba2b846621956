"""Where an observation is: derived from its frame and pixel, from the track and from the rig."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, MutableMapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from app.survey.adjustment.adjusted_track import Adjusted, Source
from app.survey.adjustment.joints import NearJoint
from app.survey.distances.interval import half_width_m
from app.survey.distances.track_rows import estimate_at, is_unmeasured
from app.survey.observations.records import Observation
from app.survey.observations.tag import Tag
from app.survey.places.measure import Figure
from vo_core import Estimate, Pose, Rig, Track
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.geometry.wall import (
    Poses,
    WallPoint,
    camera_position,
    robot_rays,
    wall_points,
)

Anchor = tuple[int, tuple[float, ...] | None]
"""Frame and pixel of a tag: with the trajectory, they determine its place."""


_UNPROVEN = 0.25
"""Standard uncertainty of the way from a camera that measured nothing to the wall that it shows, as
a share: its lens and axis are as somebody stated them."""

_PLACES_KEPT = 20_000
"""Places kept for each trajectory, some 400 bytes each."""


@dataclass(frozen=True)
class Place:
    """Where an observation is: derived from frame, pixel, track and rig."""

    distance_mm: float
    """Corrected distance of the wall point under the pixel; of the camera if there is no pixel."""
    raw_mm: float
    """The same distance in the raw track."""
    u95_m: float | None
    """Half of the 95 % interval; None where it is unknown: another program measured the
    distance.
    """
    source: Source
    """What the distance is based on."""
    time_s: float
    wall: WallUnder | None
    """The wall point under the pixel, if there is one."""
    joint: NearJoint | None
    """The joint within 200 mm, if there is one."""

    @property
    def joint_no(self) -> int | None:
        """Number of the joint; the first after the zero is 1."""
        return self.joint.number if self.joint else None


@dataclass(frozen=True)
class ObservationView:
    """An observation with its place, which is None until its frame is tracked."""

    row: Observation
    place: Place | None
    figures: tuple[Figure | None, ...] = ()
    """Of its measures, in their order; None where nothing can be said."""

    @property
    def at_joint(self) -> bool:
        """Whether it is at a joint: as the imported survey states, else by the joints that were
        seen.
        """
        return bool(self.row.tag.at_joint) or (
            self.place is not None and self.place.joint is not None
        )

    @property
    def clock(self) -> int | None:
        """Clock position in whole hours: as entered, else from the pixel."""
        if self.row.tag.clock_from is not None:
            return self.row.tag.clock_from
        if self.place is None or self.place.wall is None or self.place.wall.clock_h is None:
            return None
        return round(self.place.wall.clock_h) % 12 or 12


@dataclass(frozen=True)
class WallUnder:
    """The wall point that a pixel of a frame shows."""

    distance_mm: float
    """Corrected chainage."""
    raw_mm: float
    """Distance in the raw track."""
    clock_h: float | None
    """Clock position in (0, 12]; None on a floor."""
    lateral_mm: float
    """World Y: to the right of the axis."""


@dataclass(frozen=True)
class Trajectory:
    """The path of the camera: the raw track and its correction."""

    adjusted: Adjusted
    raw: Track
    places: MutableMapping[Anchor, Place] = field(default_factory=dict)
    """Places derived before with the same correction and initial pose of the same run."""
    initial_pose: InitialPose = AS_STATED
    """Pose of the camera in the pipe at the first frame."""
    figures: MutableMapping[str, Figure] = field(default_factory=dict)
    """Figures of measures, kept like the places."""

    @cached_property
    def is_unmeasured(self) -> bool:
        """Whether the uncertainty of the distances is unknown."""
        return is_unmeasured(self.raw)

    def estimates(self, frame: int) -> tuple[Estimate, Estimate] | None:
        """Return the raw estimate of a frame, with its pose in the pipe, and the corrected one.

        None until the frame is tracked.
        """
        raw = estimate_at(self.raw, frame)
        return (
            None if raw is None else (self.initial_pose.added_to(raw), self.adjusted.estimate(raw))
        )


def wall_under(trajectory: Trajectory, frame: int, pixel: tuple[float, float]) -> WallUnder | None:
    """Find the wall point under a pixel, by ray casting from the pose of the frame.

    Rays are cast from the poses of the raw track, which agree with the rig. The wall points have
    the scale of the raw track, so they are corrected like its distances.

    Returns:
        None if the frame is not tracked or no wall is seen.
    """
    estimates = trajectory.estimates(frame)
    if estimates is None:
        return None
    (seen,) = wall_points(trajectory.adjusted.rig, [pixel], estimates[0].pose)
    return _wall_under(trajectory, estimates, seen)


def _wall_under(
    trajectory: Trajectory, estimates: tuple[Estimate, Estimate], seen: WallPoint | None
) -> WallUnder | None:
    """Find and correct the wall point under a pixel, from the pose of its raw estimate."""
    if seen is None:
        return None
    (raw, corrected), radius_mm = estimates, trajectory.adjusted.rig.pipe.radius_mm
    if radius_mm is None:
        lateral_mm = trajectory.adjusted.scale * seen.arc_mm
    else:
        lateral_mm = radius_mm * math.sin(seen.arc_mm / radius_mm)
    ahead_mm = seen.distance_mm - raw.x_mm
    return WallUnder(
        distance_mm=corrected.distance_mm + trajectory.adjusted.scale * ahead_mm,
        raw_mm=raw.distance_mm + ahead_mm,
        clock_h=seen.clock_h,
        lateral_mm=lateral_mm,
    )


@dataclass(frozen=True)
class WallGrid:
    """What a page needs to cast rays: those of a grid of pixels, the pipe, and pose 0."""

    u_px: list[float]
    v_px: list[float]
    rays: NDArray[np.float64]
    """(rows, cols, 3) unit rays in robot axes; nan outside the lens."""
    radius_mm: float | None
    """None on a floor."""
    start: Pose
    """Pose of the camera in the first frame: from the pipe's axis, or from the floor."""
    scale: float
    """True length over the length of the raw track."""


def wall_grid(
    rig: Rig, initial_pose: InitialPose, scale: float = 1.0, cols: int = 33, rows: int = 25
) -> WallGrid:
    """Compute the rays of a grid of pixels, with the pose of the first frame."""
    u_px = np.linspace(0, rig.camera.width - 1, cols)
    v_px = np.linspace(0, rig.camera.height - 1, rows)
    pixels = np.stack(np.meshgrid(u_px, v_px), axis=-1).reshape(-1, 2)
    _, y_mm, z_mm = camera_position(rig, initial_pose.pose).tolist()
    return WallGrid(
        u_px.tolist(),
        v_px.tolist(),
        robot_rays(rig, pixels).reshape(rows, cols, 3),
        rig.pipe.radius_mm,
        replace(initial_pose.pose, y_mm=y_mm, z_mm=z_mm),
        scale,
    )


def place_of(trajectory: Trajectory, tag: Tag) -> Place | None:
    """Derive the place of a tag; None until its frame is tracked."""
    (place,) = places_of(trajectory, [tag])
    return place


def places_of(trajectory: Trajectory, tags: Sequence[Tag]) -> list[Place | None]:
    """Derive the places of many tags together."""
    return places_at(
        trajectory, [(tag.frame, tuple(tag.pixel) if tag.pixel else None) for tag in tags]
    )


def places_at(trajectory: Trajectory, anchors: Sequence[Anchor]) -> list[Place | None]:
    """Derive the places of many frames and pixels together; those that the trajectory knows are not
    computed again.
    """
    # Other requests may clear the shared places at any time.
    known = {anchor: place for anchor in anchors if (place := trajectory.places.get(anchor))}
    new = dict(_derived(trajectory, [anchor for anchor in anchors if anchor not in known]))
    if len(trajectory.places) + len(new) > _PLACES_KEPT:
        trajectory.places.clear()
    trajectory.places.update(new)
    found = known | new
    return [found.get(anchor) for anchor in anchors]


def _derived(trajectory: Trajectory, anchors: Iterable[Anchor]) -> Iterator[tuple[Anchor, Place]]:
    tracked = [
        (anchor, estimates)
        for anchor in dict.fromkeys(anchors)
        if (estimates := trajectory.estimates(anchor[0])) is not None
    ]
    with_pixel = [(pixel, raw.pose) for (_, pixel), (raw, _) in tracked if pixel is not None]
    seen = iter(
        wall_points(
            trajectory.adjusted.rig,
            np.reshape([pixel for pixel, _ in with_pixel], (-1, 2)),
            Poses.of([pose for _, pose in with_pixel]),
        )
    )
    for anchor, estimates in tracked:
        wall = _wall_under(trajectory, estimates, next(seen)) if anchor[1] is not None else None
        yield anchor, _place(trajectory, estimates, wall)


def _place(
    trajectory: Trajectory, estimates: tuple[Estimate, Estimate], wall: WallUnder | None
) -> Place:
    raw, corrected = estimates
    distance_mm = wall.distance_mm if wall else corrected.distance_mm
    adjusted, sigma_mm = trajectory.adjusted, corrected.sigma_distance_mm
    if adjusted.is_read:
        sigma_mm = math.hypot(sigma_mm, _UNPROVEN * (distance_mm - corrected.distance_mm))
    return Place(
        distance_mm=distance_mm,
        raw_mm=wall.raw_mm if wall else raw.distance_mm,
        u95_m=None if trajectory.is_unmeasured else half_width_m(sigma_mm),
        source=adjusted.source_at(raw.frame),
        time_s=raw.time_s,
        wall=wall,
        joint=None if trajectory.is_unmeasured else trajectory.adjusted.joint_near(distance_mm),
    )
