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
    low_mm, high_mm = in_view_mm(rig)
    near = np.flatnonzero((ahead_mm > low_mm) & (ahead_mm < high_mm))
    in_pipe = trajectory.initial_pose.added_to(raw)
    arc_mm = np.full(len(near), _raw_arc_mm(rig, place, scale))
    pixels = pixels_of(rig, in_pipe, near, ahead_mm[near], arc_mm)
    inside = are_inside(rig, pixels)
    frames, pixels = near[inside], pixels[inside]
    if not len(frames):
        return None
    ranks = ranks_of(raw, frames)
    wanted = ranks == ranks.min()
    if near_frame is not None:
        wanted &= _of_nearest_pass(frames, wanted, near_frame)
    misses = misses_of(rig, ahead_mm[frames], pixels)
    best = int(np.where(wanted, misses, np.inf).argmin())
    u, v = pixels[best]
    return SeenAt(int(frames[best]), (float(u), float(v)))


def pixels_of(
    rig: Rig,
    track: Track,
    frames: NDArray[np.intp],
    ahead_mm: NDArray[np.float64],
    arc_mm: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the (N, 2) pixels of N places, each in its frame, inside the picture or not."""
    poses = Poses(
        x_mm=np.zeros(len(frames)),
        y_mm=track.y_mm[frames],
        yaw_rad=np.radians(track.yaw_deg[frames]),
        z_mm=track.z_mm[frames],
        pitch_rad=np.radians(track.pitch_deg[frames]),
        roll_rad=np.radians(track.roll_deg[frames]),
    )
    wall = enclose(rig, np.column_stack([ahead_mm, arc_mm]))
    return np.asarray(robot_pixels(rig, sight(rig, poses, wall)))


def are_inside(rig: Rig, pixels: NDArray[np.float64]) -> Flags:
    """Return which of (..., 2) pixels the picture has."""
    ends = [rig.camera.width - 0.5, rig.camera.height - 0.5]
    with np.errstate(invalid="ignore"):
        return np.asarray(((pixels > -0.5) & (pixels < ends)).all(-1))


def ranks_of(raw: Track, frames: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return how well each frame was measured: 0 is best."""
    status = raw.status[frames]
    return np.asarray(np.select([status == "ok", status == "weak"], [0, 1], 2))


def misses_of(
    rig: Rig, ahead_mm: NDArray[np.float64], pixels: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return by how much each frame shows its place elsewhere than at its best."""
    if rig.mount.view == "forward":
        return np.asarray(np.abs(ahead_mm - sum(in_view_mm(rig)) / 2))
    middle = np.array([rig.camera.width - 1, rig.camera.height - 1]) / 2
    return np.asarray(np.linalg.norm(pixels - middle, axis=-1))


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


def in_view_mm(rig: Rig) -> tuple[float, float]:
    """Return the range of wall before the camera, mm, that its picture shows well, with a margin
    on either side.
    """
    low_mm, high_mm = _well_seen_of(rig.model_dump_json())
    margin_mm = _MARGIN * (high_mm - low_mm)
    return low_mm - margin_mm, high_mm + margin_mm


@lru_cache(maxsize=32)
def _well_seen_of(rig: str) -> tuple[float, float]:
    grid = Rectifier(Rig.model_validate_json(rig)).grid
    return grid.axial_mm, grid.axial_mm + (grid.shape[1] - 1) * grid.mm_per_px
