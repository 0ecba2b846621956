"""Finds the frame that shows a point of the wall, for clicks on maps of the wall."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app.errors import IncompleteWallPoint
from app.inspections.corrections import Corrections
from app.storage.records.inspections import InspectionStore
from app.survey.places.measure import Figure, Measure, MeasurePoint
from app.survey.places.measuring import figure_of
from app.survey.places.place import Trajectory
from app.tracking.tracks import Tracks
from vo_core import Rig, Track
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.wall import Poses, enclose, robot_pixels, sight

_STATUS_RANK = {"ok": 0, "weak": 1, "lost": 2}
_MARGIN = 0.25
"""Margin around what a picture shows well: a robot that has turned sees a little further."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class WallPlace:
    """A point of the wall, in the terms that people use."""

    distance_mm: float
    """Distance along the pipe."""
    clock_h: float | None
    """Clock position in a pipe."""
    lateral_mm: float | None
    """Distance to the right of the axis, on a floor."""


@dataclass(frozen=True)
class SeenAt:
    """The frame and pixel that show a point of the wall best."""

    frame: int
    pixel: tuple[float, float]


@dataclass(frozen=True)
class Picking:
    """Finds frames by the part of the wall that they show."""

    inspections: InspectionStore
    tracks: Tracks
    corrections: Corrections

    def frame_at(
        self, inspection_id: str, place: WallPlace, near_frame: int | None
    ) -> SeenAt | None:
        """Return the tracked frame that shows the place best, of several passes the one at
        `near_frame`; None if no frame shows it.

        Raises:
            InspectionNotFound: No inspection has this id.
            IncompleteWallPoint: A pipe needs a clock position, a floor a lateral one.
        """
        return seen_best(self._trajectory(inspection_id), place, near_frame)

    def length_between(self, inspection_id: str, start: WallPlace, end: WallPlace) -> Figure | None:
        """Return the length of the line between two places; None where it cannot be measured.

        Raises:
            InspectionNotFound: No inspection has this id.
            IncompleteWallPoint: A pipe needs clock positions, a floor lateral ones.
        """
        return length_between(self._trajectory(inspection_id), start, end)

    def _trajectory(self, inspection_id: str) -> Trajectory:
        self.inspections.get(inspection_id)
        return Trajectory(
            self.corrections.adjusted(inspection_id),
            self.tracks.get(inspection_id),
            initial_pose=self.tracks.initial_pose(inspection_id),
        )


def length_between(trajectory: Trajectory, start: WallPlace, end: WallPlace) -> Figure | None:
    """Return the length of the shortest line on the wall between two places, by the same rules as
    if they had been clicked in the frames that show them best.

    Returns:
        None where no frame shows one of them, or nothing is known about the distances.

    Raises:
        IncompleteWallPoint: A pipe needs clock positions, a floor lateral ones.
    """
    first = seen_best(trajectory, start, None)
    last = None if first is None else seen_best(trajectory, end, first.frame)
    if first is None or last is None:
        return None
    points = [MeasurePoint(frame=seen.frame, pixel=list(seen.pixel)) for seen in (first, last)]
    return figure_of(trajectory, Measure(kind="length", points=points))


def seen_best(trajectory: Trajectory, place: WallPlace, near_frame: int | None) -> SeenAt | None:
    """Return the frame and pixel that show the place best; None if none does.

    Frames with status ok are preferred to weak ones, and those to lost ones. Then the pass nearest
    `near_frame` counts; a pass is a sequence of frames that show the place. Within it, a camera
    that looks down shows the place best nearest to the middle of the picture. One that looks along
    the pipe shows distant wall there, so the middle of the wall that it shows well counts instead.

    Raises:
        IncompleteWallPoint: A pipe needs a clock position, a floor a lateral one.
    """
    # The inverse of `observations.wall_under`: rays belong to the raw track and its scale.
    rig, raw, scale = trajectory.adjusted.rig, trajectory.raw, trajectory.adjusted.scale
    corrected = trajectory.adjusted.extended(raw)
    ahead_mm = (place.distance_mm - corrected.distance_mm) / scale
    low_mm, high_mm = _well_seen_mm(rig)
    margin_mm = _MARGIN * (high_mm - low_mm)
    near = np.flatnonzero((ahead_mm > low_mm - margin_mm) & (ahead_mm < high_mm + margin_mm))
    in_pipe = trajectory.initial_pose.added_to(raw)
    pixels = _pixels(rig, in_pipe, near, ahead_mm[near], _raw_arc_mm(rig, place, scale))
    camera = rig.camera
    with np.errstate(invalid="ignore"):
        inside = ((pixels > -0.5) & (pixels < [camera.width - 0.5, camera.height - 0.5])).all(1)
    frames, pixels = near[inside], pixels[inside]
    if not len(frames):
        return None
    ranks = np.array([_STATUS_RANK[status] for status in raw.status[frames]])
    wanted = ranks == ranks.min()
    if near_frame is not None:
        wanted &= _of_nearest_pass(frames, wanted, near_frame)
    if rig.mount.view == "forward":
        misses = np.abs(ahead_mm[frames] - (low_mm + high_mm) / 2)
    else:
        middle = np.array([camera.width - 1, camera.height - 1]) / 2
        misses = np.linalg.norm(pixels - middle, axis=1)
    best = int(np.where(wanted, misses, np.inf).argmin())
    u, v = pixels[best]
    return SeenAt(int(frames[best]), (float(u), float(v)))


def _pixels(
    rig: Rig,
    track: Track,
    frames: NDArray[np.intp],
    ahead_mm: NDArray[np.float64],
    arc_mm: float,
) -> NDArray[np.float64]:
    """Return the (N, 2) pixels of the place in the frames, inside the picture or not."""
    poses = Poses(
        x_mm=np.zeros(len(frames)),
        y_mm=track.y_mm[frames],
        yaw_rad=np.radians(track.yaw_deg[frames]),
        z_mm=track.z_mm[frames],
        pitch_rad=np.radians(track.pitch_deg[frames]),
        roll_rad=np.radians(track.roll_deg[frames]),
    )
    wall = enclose(rig, np.column_stack([ahead_mm, np.full(len(frames), arc_mm)]))
    return np.asarray(robot_pixels(rig, sight(rig, poses, wall)))


def _raw_arc_mm(rig: Rig, place: WallPlace, scale: float) -> float:
    if rig.pipe.radius_mm is None:
        if place.lateral_mm is None:
            raise IncompleteWallPoint("A place on a floor needs y_mm, its distance from the axis.")
        return place.lateral_mm / scale
    if place.clock_h is None:
        raise IncompleteWallPoint("A place in a pipe needs a clock position, clock.")
    return float(rig.pipe.radius_mm * np.radians(180 - 30 * place.clock_h))


def _of_nearest_pass(frames: NDArray[np.intp], wanted: Flags, near_frame: int) -> Flags:
    """Return which frames belong to the pass of the wanted frame nearest `near_frame`."""
    passes = np.cumsum(np.diff(frames, prepend=frames[0]) > 1)
    nearest = np.where(wanted, np.abs(frames - near_frame), np.inf).argmin()
    return np.asarray(passes == passes[nearest])


def _well_seen_mm(rig: Rig) -> tuple[float, float]:
    """Return the range of wall before the camera, mm, that its picture shows well."""
    return _well_seen_of(rig.model_dump_json())


@lru_cache(maxsize=32)
def _well_seen_of(rig: str) -> tuple[float, float]:
    grid = Rectifier(Rig.model_validate_json(rig)).grid
    return grid.axial_mm, grid.axial_mm + (grid.shape[1] - 1) * grid.mm_per_px
