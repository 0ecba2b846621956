"""Observations: anchored to a frame and a pixel, everything else derived when they are read."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import (
    FrameNotFound,
    FrameOutsideVideo,
    ObservationNotFound,
    PixelOutsidePicture,
)
from app.services.live import Live
from app.services.tracks import Tracks, estimate_at
from app.storage.inspections import InspectionStore
from app.storage.observations import ObservationStore
from app.storage.tables import Event, Inspection, Observation
from vo_core import Pose, Rig, Track, wall_point
from vo_core.wall import camera_position, cast, clock_of, develop, pixel_rays, to_robot

logger = logging.getLogger(__name__)

NEAR_JOINT_MM = 200.0
"""At a joint means this near to one: the rule of one coding family, 8 inches."""
U95 = 1.96
"""Standard deviations in the half-width of a 95 % interval."""


@dataclass(frozen=True)
class Place:
    """Where an observation is: derived from frame, pixel, track and rig."""

    distance_mm: float
    """Axial coordinate of the wall point under the pixel; of the camera if there is no pixel."""
    u95_mm: float
    time_s: float
    wall: WallUnder | None
    """The wall point, if there is a pixel that shows one."""
    joint_no: int | None
    """Number of the joint within 200 mm; the first after the zero is 1."""


@dataclass(frozen=True)
class ObservationView:
    """An observation with its place, None until its frame is tracked."""

    row: Observation
    place: Place | None

    @property
    def clock(self) -> int | None:
        """Whole hour: what was entered, else what the pixel says."""
        entered = self.row.fields.get("clock_from")
        if entered is not None:
            return int(entered)
        if self.place is None or self.place.wall is None or self.place.wall.clock_h is None:
            return None
        return round(self.place.wall.clock_h) % 12 or 12


class Observations:
    """Put, list, delete, restore."""

    def __init__(
        self, inspections: InspectionStore, store: ObservationStore, tracks: Tracks, live: Live
    ) -> None:
        self._inspections = inspections
        self._store = store
        self._tracks = tracks
        self._live = live

    def put(
        self, inspection_id: str, observation_id: str, fields: Mapping[str, Any], who: str
    ) -> None:
        """Create or replace an observation; it is committed and synced when this returns.

        The same fields again change nothing; a deleted observation comes back with these fields.

        Raises:
            InspectionNotFound: There is no such inspection.
            FrameOutsideVideo, PixelOutsidePicture: It cannot be anchored there.
        """
        inspection = self._inspections.get(inspection_id)
        _check_anchor(inspection, len(self._tracks.get(inspection_id)), fields)
        kept = {name: value for name, value in fields.items() if value is not None}
        if self._store.put(inspection_id, observation_id, kept, who):
            self._live.observations_changed(inspection_id)

    def delete(self, inspection_id: str, observation_id: str, who: str) -> None:
        """Take it out of the list; it can be restored.

        Raises:
            ObservationNotFound: There never was one.
        """
        if self._store.delete(inspection_id, observation_id, who):
            self._live.observations_changed(inspection_id)

    def restore(self, inspection_id: str, observation_id: str, who: str) -> None:
        """Undo a delete.

        Raises:
            ObservationNotFound: There never was one.
        """
        if self._store.restore(inspection_id, observation_id, who):
            self._live.observations_changed(inspection_id)

    def all(self, inspection_id: str) -> list[ObservationView]:
        """In the order of their numbers."""
        rig = rig_of(self._inspections.get(inspection_id))
        rows, track = self._store.listed(inspection_id), self._tracks.get(inspection_id)
        return [ObservationView(row, _place(rig, track, row)) for row in rows]

    def get(self, inspection_id: str, observation_id: str) -> ObservationView:
        """One that is not deleted."""
        rig = rig_of(self._inspections.get(inspection_id))
        row = self._store.get(inspection_id, observation_id)
        if row.deleted_at is not None:
            raise ObservationNotFound("This observation was deleted; it can be restored.")
        return ObservationView(row, _place(rig, self._tracks.get(inspection_id), row))

    def wall_at(self, inspection_id: str, frame: int, pixel: tuple[float, float]) -> WallUnder:
        """What a pixel of a tracked frame looks at.

        Raises:
            PixelOutsidePicture: The picture has no such pixel.
            FrameNotFound: The frame is not tracked, or no wall is seen there.
        """
        inspection = self._inspections.get(inspection_id)
        check_pixel(inspection, *pixel)
        found = wall_under(rig_of(inspection), self._tracks.get(inspection_id), frame, pixel)
        if found is None:
            raise FrameNotFound(
                f"Frame {frame} is not tracked yet, or shows no wall at this pixel."
            )
        return found

    def wall_grid(self, inspection_id: str) -> WallGrid:
        """Wall points of a grid of pixels over the picture, at pose 0."""
        return wall_grid(rig_of(self._inspections.get(inspection_id)))

    def events(self, inspection_id: str) -> list[Event]:
        """Everything that was done to the inspection and its observations, oldest first."""
        return self._inspections.events(inspection_id)


def rig_of(inspection: Inspection) -> Rig:
    """The rig of an inspection, as an object."""
    return _parsed_rig(Rig.model_validate(inspection.rig).model_dump_json())


@lru_cache(maxsize=32)
def _parsed_rig(text: str) -> Rig:
    return Rig.model_validate_json(text)


@dataclass(frozen=True)
class WallUnder:
    """The wall point that a pixel of a frame shows."""

    distance_mm: float
    """Chainage."""
    clock_h: float | None
    """Clock position in (0, 12]; None on a floor."""
    lateral_mm: float
    """World Y: to the right of the axis."""


def wall_under(rig: Rig, track: Track, frame: int, pixel: tuple[float, float]) -> WallUnder | None:
    """By exact ray casting from the pose of the frame; None if not tracked or no wall is seen."""
    estimate = estimate_at(track, frame)
    if estimate is None:
        return None
    point = wall_point(rig, pixel, estimate.x_mm, estimate.y_mm, estimate.yaw_deg)
    if point is None:
        return None
    lateral_mm = point.arc_mm
    if rig.pipe.diameter_mm is not None:
        radius_mm = rig.pipe.diameter_mm / 2
        lateral_mm = radius_mm * math.sin(point.arc_mm / radius_mm)
    # A distance may be corrected where the pose is not: what the pixel adds to it stays the same.
    distance_mm = estimate.distance_mm + (point.distance_mm - estimate.x_mm)
    return WallUnder(distance_mm, point.clock_h, lateral_mm)


@dataclass(frozen=True)
class WallGrid:
    """Wall points of a grid of pixels at pose 0, from the camera; nan where none is seen."""

    u_px: list[float]
    v_px: list[float]
    axial_mm: NDArray[np.float64]
    """(rows, cols), as are the others."""
    right_mm: NDArray[np.float64]
    clock_h: NDArray[np.float64] | None
    """None on a floor."""


def wall_grid(rig: Rig, cols: int = 33, rows: int = 25) -> WallGrid:
    """By exact ray casting."""
    u_px = np.linspace(0, rig.camera.width - 1, cols)
    v_px = np.linspace(0, rig.camera.height - 1, rows)
    pixels = np.stack(np.meshgrid(u_px, v_px), axis=-1).reshape(-1, 2)
    points = cast(rig, Pose(), to_robot(rig.mount, pixel_rays(rig.camera, pixels)))
    clock_h = None
    if rig.pipe.diameter_mm is not None:
        phis_rad = develop(rig, points)[:, 1] / (rig.pipe.diameter_mm / 2)
        clock_h = np.array([clock_of(phi) for phi in phis_rad]).reshape(rows, cols)
    right_mm = points[:, 1] - camera_position(rig, Pose())[1]
    return WallGrid(
        u_px.tolist(),
        v_px.tolist(),
        points[:, 0].reshape(rows, cols),
        right_mm.reshape(rows, cols),
        clock_h,
    )


def check_pixel(inspection: Inspection, u: float, v: float) -> None:
    """Raise PixelOutsidePicture unless the picture has it; pixel centres are at integers."""
    width, height = inspection.video["width"], inspection.video["height"]
    if not (-0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5):
        raise PixelOutsidePicture(
            f"The pixel ({u:g}, {v:g}) is outside the picture of {width} x {height} px."
        )


def _check_anchor(inspection: Inspection, tracked: int, fields: Mapping[str, Any]) -> None:
    frame, pixel = fields["frame"], fields.get("pixel")
    total = inspection.video.get("frames")
    if inspection.status == "done":
        limit = tracked
    elif total:
        # Before the end the number of frames is only what the container states: leave some room.
        limit = max(tracked, round(1.1 * total) + 100)
    else:
        limit = frame + 1
    if frame >= limit:
        raise FrameOutsideVideo(f"The video has no frame {frame}; its last one is {limit - 1}.")
    if pixel is not None:
        check_pixel(inspection, *pixel)


def _place(rig: Rig, track: Track, row: Observation) -> Place | None:
    estimate = estimate_at(track, row.frame)
    if estimate is None:
        return None
    pixel = row.fields.get("pixel")
    wall = wall_under(rig, track, row.frame, (pixel[0], pixel[1])) if pixel else None
    distance_mm = wall.distance_mm if wall else estimate.distance_mm
    return Place(
        distance_mm=distance_mm,
        u95_mm=U95 * estimate.sigma_distance_mm,
        time_s=estimate.time_s,
        wall=wall,
        joint_no=_joint_near(rig, distance_mm),
    )


def _joint_near(rig: Rig, distance_mm: float) -> int | None:
    """Joints lie whole segments from the zero; the start itself is none."""
    segment_mm = rig.pipe.segment_length_mm
    if segment_mm is None:
        return None
    number = round(distance_mm / segment_mm)
    is_near = abs(distance_mm - number * segment_mm) <= NEAR_JOINT_MM
    return number if number >= 1 and is_near else None
