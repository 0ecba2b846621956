"""Observations: anchored to a frame and a pixel, everything else derived when they are read."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import (
    FrameNotFound,
    FrameOutsideVideo,
    ObservationNotFound,
    PixelOutsidePicture,
)
from app.inspections.corrections import Corrections
from app.storage.inspections import InspectionStore
from app.storage.observations import ObservationStore
from app.storage.tables import IMPORTED, Event, Inspection, Observation
from app.survey.adjustment import Adjusted, NearJoint, Source
from app.survey.interval import half_width_m
from app.survey.stretches import next_stretch_number
from app.tracking.live import Live
from app.tracking.tracks import Tracks, estimate_at, is_unmeasured, wall_point_of
from app.tracking.videos import NO_FILM
from vo_core import Estimate, Pose, Rig, Track
from vo_core.geometry.wall import camera_position, cast, clock_of, develop, robot_rays

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Place:
    """Where an observation is: derived from frame, pixel, track and rig."""

    distance_mm: float
    """Corrected, of the wall point under the pixel; of the camera if there is no pixel."""
    raw_mm: float
    """The same as it was measured."""
    u95_m: float | None
    """Half of the 95 % interval; None where nobody knows: another program has measured it."""
    source: Source
    """What the distance rests on."""
    time_s: float
    wall: WallUnder | None
    """The wall point, if there is a pixel that shows one."""
    joint: NearJoint | None
    """Within 200 mm."""

    @property
    def joint_no(self) -> int | None:
        """Number of the joint; the first after the zero is 1."""
        return self.joint.number if self.joint else None


@dataclass(frozen=True)
class ObservationView:
    """An observation with its place, None until its frame is tracked."""

    row: Observation
    place: Place | None

    @property
    def at_joint(self) -> bool:
        """As the file of an imported survey states, else by the joints that were seen."""
        stated = bool(self.row.fields.get("at_joint"))
        return stated or (self.place is not None and self.place.joint is not None)

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
        self,
        inspections: InspectionStore,
        store: ObservationStore,
        tracks: Tracks,
        corrections: Corrections,
        live: Live,
    ) -> None:
        self._inspections = inspections
        self._store = store
        self._tracks = tracks
        self._corrections = corrections
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
        track = self._tracks.get(inspection_id)
        _check_anchor(inspection, len(track), fields)
        if fields.get("pixel") and inspection.source_kind == IMPORTED and is_unmeasured(track):
            raise PixelOutsidePicture(f"{NO_FILM} Tag it without a pixel.")
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
        self._inspections.get(inspection_id)
        rows, course = self._store.listed(inspection_id), self._course(inspection_id)
        return [ObservationView(row, _place(course, row)) for row in rows]

    def get(self, inspection_id: str, observation_id: str) -> ObservationView:
        """One that is not deleted."""
        row = self._store.get(inspection_id, observation_id)
        if row.deleted_at is not None:
            raise ObservationNotFound("This observation was deleted; it can be restored.")
        return ObservationView(row, _place(self._course(inspection_id), row))

    def wall_at(self, inspection_id: str, frame: int, pixel: tuple[float, float]) -> WallUnder:
        """What a pixel of a tracked frame looks at.

        Raises:
            PixelOutsidePicture: The picture has no such pixel.
            FrameNotFound: The frame is not tracked, or no wall is seen there.
        """
        inspection = self._inspections.get(inspection_id)
        check_pixel(inspection, *pixel)
        found = wall_under(self._course(inspection_id), frame, pixel)
        if found is None:
            raise FrameNotFound(
                f"Frame {frame} is not tracked yet, or shows no wall at this pixel."
            )
        return found

    def wall_grid(self, inspection_id: str) -> WallGrid:
        """Wall points of a grid of pixels over the picture, at pose 0."""
        return wall_grid(rig_of(self._inspections.get(inspection_id)))

    def next_stretch(self, inspection_id: str) -> int:
        """The first number of a stretch that was never used."""
        return next_stretch_number(self._store.listed_with_deleted(inspection_id))

    def events(self, inspection_id: str, observation_id: str | None = None) -> list[Event]:
        """Everything that was done to the inspection or to one observation, oldest first.

        Raises:
            InspectionNotFound: There is no such inspection.
        """
        self._inspections.get(inspection_id)
        return self._inspections.events(inspection_id, observation_id)

    def _course(self, inspection_id: str) -> Course:
        """Everything that places are derived from, as it is now."""
        adjusted = self._corrections.adjusted(inspection_id)
        return Course(adjusted, self._tracks.get(inspection_id))


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
    """Corrected chainage."""
    raw_mm: float
    """As it was measured."""
    clock_h: float | None
    """Clock position in (0, 12]; None on a floor."""
    lateral_mm: float
    """World Y: to the right of the axis."""


@dataclass(frozen=True)
class Course:
    """The way of the camera: as it was measured, and how that is corrected."""

    adjusted: Adjusted
    raw: Track

    @cached_property
    def is_unmeasured(self) -> bool:
        """Whether nobody knows how sure the distances are."""
        return is_unmeasured(self.raw)

    def estimates(self, frame: int) -> tuple[Estimate, Estimate] | None:
        """Of a frame, the raw one and the corrected one; None where the track has not arrived."""
        raw = estimate_at(self.raw, frame)
        return None if raw is None else (raw, self.adjusted.estimate(raw))


def wall_under(course: Course, frame: int, pixel: tuple[float, float]) -> WallUnder | None:
    """By exact ray casting from the pose of the frame; None if not tracked or no wall is seen.

    Rays are cast in the raw track, which is true to the rig that it was made with; what comes out
    has its scale, and is corrected as the way is.
    """
    estimates, rig = course.estimates(frame), course.adjusted.rig
    if estimates is None:
        return None
    raw, corrected = estimates
    point = wall_point_of(rig, pixel, raw)
    if point is None:
        return None
    if rig.pipe.diameter_mm is None:
        lateral_mm = course.adjusted.scale * point.arc_mm
    else:
        radius_mm = rig.pipe.diameter_mm / 2
        lateral_mm = radius_mm * math.sin(point.arc_mm / radius_mm)
    ahead_mm = point.distance_mm - raw.x_mm
    return WallUnder(
        distance_mm=corrected.distance_mm + course.adjusted.scale * ahead_mm,
        raw_mm=raw.distance_mm + ahead_mm,
        clock_h=point.clock_h,
        lateral_mm=lateral_mm,
    )


@dataclass(frozen=True)
class WallGrid:
    """Wall points of a grid of pixels at pose 0, from the camera; nan where none is seen."""

    u_px: list[float]
    v_px: list[float]
    axial_mm: NDArray[np.float64]
    """(rows, cols), as are the others."""
    right_mm: NDArray[np.float64]
    down_mm: NDArray[np.float64]
    clock_h: NDArray[np.float64] | None
    """None on a floor."""


def wall_grid(rig: Rig, cols: int = 33, rows: int = 25) -> WallGrid:
    """By exact ray casting."""
    u_px = np.linspace(0, rig.camera.width - 1, cols)
    v_px = np.linspace(0, rig.camera.height - 1, rows)
    pixels = np.stack(np.meshgrid(u_px, v_px), axis=-1).reshape(-1, 2)
    points = cast(rig, Pose(), robot_rays(rig, pixels))
    clock_h = None
    if rig.pipe.diameter_mm is not None:
        phis_rad = develop(rig, points)[:, 1] / (rig.pipe.diameter_mm / 2)
        clock_h = np.array([clock_of(phi) for phi in phis_rad]).reshape(rows, cols)
    beside_mm = points - camera_position(rig, Pose())
    return WallGrid(
        u_px.tolist(),
        v_px.tolist(),
        points[:, 0].reshape(rows, cols),
        beside_mm[:, 1].reshape(rows, cols),
        beside_mm[:, 2].reshape(rows, cols),
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


def _place(course: Course, row: Observation) -> Place | None:
    estimates = course.estimates(row.frame)
    if estimates is None:
        return None
    raw, corrected = estimates
    pixel = row.fields.get("pixel")
    wall = wall_under(course, row.frame, (pixel[0], pixel[1])) if pixel else None
    distance_mm = wall.distance_mm if wall else corrected.distance_mm
    return Place(
        distance_mm=distance_mm,
        raw_mm=wall.raw_mm if wall else raw.distance_mm,
        u95_m=None if course.is_unmeasured else half_width_m(corrected.sigma_distance_mm),
        source="typed" if course.is_unmeasured else course.adjusted.source,
        time_s=raw.time_s,
        wall=wall,
        joint=None if course.is_unmeasured else course.adjusted.joint_near(distance_mm),
    )
