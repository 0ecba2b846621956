"""Renders the pictures of a scenario, one by one: wall, light and lens; then the recorder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, degrees

import cv2
import numpy as np
from numpy.typing import NDArray

from app.lab.simulation.camera import REACH_MM, FloatImage, WallCaster
from app.lab.simulation.motion import Trajectory
from app.lab.simulation.recorder import Recorder
from app.lab.simulation.relief import shade
from app.lab.simulation.scenario import Scenario
from app.lab.simulation.time_stamps import row_delays_s, time_stamps
from app.lab.simulation.wall import Wall, make_wall
from vo_core.geometry.wall import NOMINAL, Pose

_FULL_LIGHT_GREY = 235.0
"""Grey level of a perfect reflector in the centre of the lamp."""

_MIN_TEXEL_MM = 0.2

_WATER_CENTRE_MM = 5.0
_WATER_SPEED_MM_S = 420.0


@dataclass(frozen=True)
class RenderedFrame:
    """One picture and the true pose of its camera relative to the first one."""

    index: int
    t_s: float
    """Time stamp, which a network may delay."""
    image: NDArray[np.uint8]
    """(H, W) grey."""
    x_mm: float
    y_mm: float
    yaw_deg: float
    z_mm: float
    pitch_deg: float
    roll_deg: float


def render(scenario: Scenario, wall: Wall | None = None) -> Iterator[RenderedFrame]:
    """Render a scenario; equal scenarios give equal pictures.

    Args:
        scenario: The inspection.
        wall: What it drives along, if that is not drawn for it: the wall of another inspection.
    """
    trajectory = Trajectory(scenario)
    scene = _Scene(scenario, trajectory, wall)
    recorder = Recorder(scenario, trajectory.frames)
    rate = scenario.camera_frames_per_s

    @lru_cache(maxsize=2)
    def record(number: int) -> NDArray[np.uint8]:
        return recorder.record(number, scene.light_at(number / rate))

    for index, stamp_s in enumerate(time_stamps(scenario, trajectory.frames)):
        number, mixed = scenario.camera_frame(index)
        image = record(number)
        if mixed:
            following = record(number + 1)
            image = np.asarray(cv2.addWeighted(image, 1 - mixed, following, mixed, 0), np.uint8)
        pose = trajectory.truth((number + mixed) / rate)
        yield RenderedFrame(
            index=index,
            t_s=stamp_s,
            image=image,
            x_mm=pose.x_mm,
            y_mm=pose.y_mm,
            yaw_deg=degrees(pose.yaw_rad),
            z_mm=pose.z_mm,
            pitch_deg=degrees(pose.pitch_rad),
            roll_deg=degrees(pose.roll_rad),
        )


@dataclass(frozen=True)
class _LevelWeight:
    """Where a level of the wall shows in the picture."""

    level: int
    rows: slice
    columns: slice
    weight: FloatImage | None
    """In each pixel of those rows and columns; None where the level has the whole weight."""


@dataclass(frozen=True)
class _Shot:
    """What the sensor gets of the wall from one pose, whatever the wall shows."""

    light: FloatImage
    """(H, W) grey level of a perfect reflector."""
    level_weights: Sequence[_LevelWeight]


class _Scene:
    """The light on the sensor: the wall, seen from the robot's pose and lit by its lamp."""

    def __init__(
        self, scenario: Scenario, trajectory: Trajectory, wall: Wall | None = None
    ) -> None:
        self._scenario = scenario
        self._trajectory = trajectory
        self._caster = WallCaster(scenario.rendered_rig, scenario.silt)
        # Light and picture of a short exposure are those of one pose.
        self._cast = lru_cache(maxsize=1)(self._caster.cast)
        ahead_mm, arc_mm, range_mm = self._caster.cast(NOMINAL)
        pixel_mm = _pixel_size_mm(ahead_mm, arc_mm, self._caster.radius_mm)
        lit = range_mm < REACH_MM
        finest_mm = float(np.percentile(pixel_mm[lit], 2))
        self._full_light_mm = np.float32(np.percentile(range_mm, 5))
        self._wall = wall or self._visible_wall(max(_MIN_TEXEL_MM, 0.8 * finest_mm))
        self._beam = _beam(scenario)
        self._nominal = self._shot(NOMINAL)
        self._ripples = _ripples(scenario) if scenario.water else None
        # Sub-exposures are at most about 1.2 px apart.
        swept_px = scenario.speed_mm_s * scenario.exposure_s / finest_mm
        self._sub_exposures = max(1, ceil(swept_px / 1.2))
        self._row_delays_s = row_delays_s(scenario)

    def light_at(self, t_s: float) -> FloatImage:
        """Expose a picture without noise around `t_s`, in grey levels."""
        shot = self._nominal
        if self._scenario.light_follows_view:
            shot = self._shot(self._trajectory.pose(t_s))
        count = self._sub_exposures
        offsets = (np.arange(count) + 0.5) / count - 0.5
        sum_ = self._sample(shot, t_s + offsets[0] * self._scenario.exposure_s)
        for offset in offsets[1:]:
            sum_ += self._sample(shot, t_s + offset * self._scenario.exposure_s)
        sum_ *= shot.light / np.float32(count) if count > 1 else shot.light
        return sum_

    def _shot(self, pose: Pose) -> _Shot:
        """Work out light and resolution of each pixel from a pose."""
        ahead_mm, arc_mm, range_mm = self._cast(pose)
        pixel_mm = _pixel_size_mm(ahead_mm, arc_mm, self._caster.radius_mm)
        return _Shot(
            light=_lamp(self._beam, range_mm, self._full_light_mm)
            * (_FULL_LIGHT_GREY * self._scenario.brightness),
            level_weights=_level_weights(pixel_mm / self._wall.texel_x_mm, len(self._wall.levels)),
        )

    def _sample(self, shot: _Shot, t_s: float) -> FloatImage:
        """Sample the reflectance under each pixel at one moment."""
        at = {delay_s: self._trajectory.pose(t_s + delay_s) for delay_s in set(self._row_delays_s)}
        poses = [at[delay_s] for delay_s in self._row_delays_s]
        ahead_mm, arc_mm, range_mm = self._cast(*poses)
        x_mm = np.array([[pose.x_mm] for pose in poses])
        if self._ripples is None:
            seen = self._look_up(shot, x_mm, ahead_mm, arc_mm)
            if (waves := self._scenario.rendered_rig.pipe.corrugation) is not None:
                seen *= shade(waves, x_mm, ahead_mm, range_mm)
            return seen
        return self._through_water(shot, self._ripples, t_s, x_mm, ahead_mm, arc_mm)

    def _look_up(
        self, shot: _Shot, x_mm: NDArray[np.float64], ahead_mm: FloatImage, arc_mm: FloatImage
    ) -> FloatImage:
        """Look up the wall's reflectance, each pixel at the level that matches its size."""
        wall = self._wall
        # Large coordinates are subtracted in double precision, before they become float32.
        first = int((float(x_mm.min()) + float(ahead_mm.min()) - wall.x0_mm) / wall.texel_x_mm)
        coarsest = 1 << (len(wall.levels) - 1)
        first = max(0, first // coarsest - 1) * coarsest
        columns = ahead_mm * np.float32(1 / wall.texel_x_mm)
        columns += np.float32((x_mm - wall.x0_mm) / wall.texel_x_mm - first)
        rows = arc_mm * np.float32(1 / wall.texel_arc_mm)
        rows -= np.float32(wall.arc0_mm / wall.texel_arc_mm)
        width = int(columns.max()) + 2 * coarsest
        total = np.zeros_like(columns)
        for shown in shot.level_weights:
            level, place = shown.level, (shown.rows, shown.columns)
            scale = np.float32(0.5**level)
            seen = cv2.remap(
                wall.levels[level][:, first >> level : (first + width) >> level],
                columns[place] * scale,
                rows[place] * scale,
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
            total[place] += seen if shown.weight is None else seen * shown.weight
        return total

    def _through_water(
        self,
        shot: _Shot,
        ripples: FloatImage,
        t_s: float,
        x_mm: NDArray[np.float64],
        ahead_mm: FloatImage,
        arc_mm: FloatImage,
    ) -> FloatImage:
        """Look up the wall through a rippled stream, which bends the view, dims it and glitters."""
        away_mm = np.abs(arc_mm - np.float32(_WATER_CENTRE_MM))
        cover = np.clip(
            (np.float32(self._scenario.water_half_mm + 1.5) - away_mm) / np.float32(3.0), 0, 1
        )
        size = ripples.shape[0]

        def ripple(speed_mm_s: float, texel_mm: float) -> FloatImage:
            along = (ahead_mm + np.float32((x_mm - speed_mm_s * t_s) % (size * texel_mm))) / (
                np.float32(texel_mm)
            )
            across = arc_mm / np.float32(texel_mm) + np.float32(size // 2)
            return np.asarray(
                cv2.remap(ripples, along, across, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP),
                np.float32,
            )

        waves = ripple(_WATER_SPEED_MM_S, 0.7)
        waves += ripple(0.6 * _WATER_SPEED_MM_S, 0.45)
        bend = waves * cover
        bend *= np.float32(0.35)
        seen = self._look_up(shot, x_mm, ahead_mm + bend, arc_mm + bend)
        glitter = np.clip(waves - np.float32(1.8), 0, 0.6)
        glitter *= np.float32(0.9)
        glitter += waves * np.float32(0.035)
        glitter -= np.float32(0.12)
        glitter *= cover
        seen += glitter
        return np.maximum(seen, np.float32(0.0), out=seen)

    def _visible_wall(self, texel_mm: float) -> Wall:
        """Draw the wall that the camera can see on its way."""
        ahead: list[float] = []
        arc: list[float] = []
        for pose in self._trajectory.extremes():
            ahead_mm, arc_mm, range_mm = self._caster.cast(pose)
            seen = range_mm < REACH_MM
            ahead += [float(ahead_mm[seen].min()), float(ahead_mm[seen].max())]
            arc += [float(arc_mm[seen].min()), float(arc_mm[seen].max())]
        first_mm, last_mm = self._trajectory.x_range_mm
        return make_wall(
            self._scenario,
            x_range_mm=(first_mm + min(ahead) - 5, last_mm + max(ahead) + 5),
            arc_range_mm=(min(arc) - 5, max(arc) + 5),
            texel_mm=texel_mm,
        )


def _pixel_size_mm(ahead_mm: FloatImage, arc_mm: FloatImage, radius_mm: float | None) -> FloatImage:
    """Larger side of each pixel's footprint on the wall."""

    def squared_steepness(values: FloatImage) -> FloatImage:
        rows, columns = np.gradient(values)
        rows *= rows
        columns *= columns
        rows += columns
        return np.asarray(rows, np.float32)

    if radius_mm is None:
        across = squared_steepness(arc_mm)
    else:  # over the chord: the arc itself jumps at the crown
        phi = arc_mm / np.float32(radius_mm)
        across = squared_steepness(np.sin(phi))
        across += squared_steepness(np.cos(phi))
        across *= np.float32(radius_mm**2)
    size = np.sqrt(np.maximum(squared_steepness(ahead_mm), across))
    return np.maximum(size, np.float32(1e-3))


def _level_weights(pixel_texels: FloatImage, levels: int) -> list[_LevelWeight]:
    """Weight of each level of the wall in the pixels that show it."""
    level = np.clip(np.log2(pixel_texels), 0, levels - 1).astype(np.float32)
    weights = []
    for number in range(levels):
        is_shown = np.abs(level - number) < 1
        rows, columns = (_extent(np.asarray(is_shown.any(axis))) for axis in (1, 0))
        weight = 1 - np.abs(level[rows, columns] - number)
        np.maximum(weight, 0, out=weight)
        if weight.size:
            whole = float(weight.min()) == 1
            weights.append(_LevelWeight(number, rows, columns, None if whole else weight))
    return weights


def _extent(is_in: NDArray[np.bool_]) -> slice:
    """From the first to the last true value; nothing if there is none."""
    places = np.flatnonzero(is_in)
    return slice(places[0], places[-1] + 1) if places.size else slice(0)


def _beam(scenario: Scenario) -> FloatImage:
    """Light of the lamp in each pixel times the lens's fall-off, at most 1."""
    camera = scenario.rendered_rig.camera
    half_diagonal = np.hypot(camera.width, camera.height) / 2
    u, v = np.meshgrid(
        np.arange(camera.width, dtype=np.float32) - np.float32((camera.width - 1) / 2),
        np.arange(camera.height, dtype=np.float32) - np.float32((camera.height - 1) / 2),
    )
    u /= np.float32(half_diagonal)
    v /= np.float32(half_diagonal)
    beam = np.exp(-0.5 * ((u - 0.08) ** 2 + (v + 0.05) ** 2) / scenario.lamp_width**2)
    vignette = 1 - 0.22 * (u**2 + v**2)
    return np.asarray((0.05 + 0.95 * beam) * vignette, np.float32)


def _lamp(beam: FloatImage, range_mm: FloatImage, full_light_mm: np.float32) -> FloatImage:
    """Light on the wall, at most 1; wall nearer than `full_light_mm` has all of the beam."""
    light = np.minimum(1, full_light_mm / range_mm)
    light *= np.sqrt(light)  # to the power of 1.5
    light *= np.clip((REACH_MM - range_mm) / np.float32(0.2 * REACH_MM), 0, 1)
    return np.asarray(light * beam, np.float32)


def _ripples(scenario: Scenario) -> FloatImage:
    """A square of waves of unit variance that repeats seamlessly."""
    rng = np.random.default_rng([scenario.seed, 3])
    size = 512
    fy, fx = np.meshgrid(np.fft.fftfreq(size), np.fft.rfftfreq(size), indexing="ij")
    # Waves of about 14 texels, longer along the stream than across it.
    r = np.hypot(fy, 1.8 * fx)
    band = np.exp(-0.5 * ((r - 0.07) / 0.03) ** 2)
    waves = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((size, size))) * band)
    return np.asarray(waves / waves.std(), np.float32)
