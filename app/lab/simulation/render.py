"""Renders the pictures of a scenario, one by one: wall, light, lens, sensor, recorder."""

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
from app.lab.simulation.scenario import Scenario
from app.lab.simulation.time_stamps import time_stamps
from app.lab.simulation.wall import Wall, make_wall
from vo_core.geometry.wall import NOMINAL, Pose

_FULL_LIGHT_GREY = 235.0
"""Grey level of a perfect reflector in the centre of the lamp."""

_BLACK_GREY = 4.0
_MIN_TEXEL_MM = 0.2
_PUMPING_PERIOD_S = 5.0

_SKID = ((0.12, 1.0), (0.2, 0.86), (0.42, 0.83), (0.58, 0.83), (0.8, 0.86), (0.88, 1.0))
"""Corners of the robot's parts as shares of width and height of the picture; so are the next."""
_LAMP_FRAME = ((1.0, 0.0), (0.8, 0.0), (0.83, 0.07), (0.92, 0.2), (1.0, 0.24))

_WATER_CENTRE_MM = 5.0
_WATER_SPEED_MM_S = 420.0


@dataclass(frozen=True)
class RenderedFrame:
    """One picture and the true pose of its camera relative to the first one."""

    index: int
    t_s: float
    """Time stamp, which a network may delay; the picture was exposed at index / rate."""
    image: NDArray[np.uint8]
    """(H, W) grey."""
    x_mm: float
    y_mm: float
    yaw_deg: float
    z_mm: float
    pitch_deg: float
    roll_deg: float


def render(scenario: Scenario) -> Iterator[RenderedFrame]:
    """Render a scenario; equal scenarios give equal pictures."""
    trajectory = Trajectory(scenario)
    scene = _Scene(scenario, trajectory)
    recorder = _Recorder(scenario, trajectory.frames)
    for index, stamp_s in enumerate(time_stamps(scenario, trajectory.frames)):
        t_s = index / scenario.frames_per_s
        pose = trajectory.truth(t_s)
        yield RenderedFrame(
            index=index,
            t_s=stamp_s,
            image=recorder.record(index, scene.light_at(t_s)),
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

    def __init__(self, scenario: Scenario, trajectory: Trajectory) -> None:
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
        self._texel_mm = max(_MIN_TEXEL_MM, 0.8 * finest_mm)
        self._wall = self._visible_wall(self._texel_mm)
        self._beam = _beam(scenario)
        self._nominal = self._shot(NOMINAL)
        self._ripples = _ripples(scenario) if scenario.water else None
        # Sub-exposures are at most about 1.2 px apart.
        swept_px = scenario.speed_mm_s * scenario.exposure_s / finest_mm
        self._sub_exposures = max(1, ceil(swept_px / 1.2))
        self._row_delays_s = _row_delays_s(scenario)

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
            level_weights=_level_weights(pixel_mm / self._texel_mm, len(self._wall.levels)),
        )

    def _sample(self, shot: _Shot, t_s: float) -> FloatImage:
        """Sample the reflectance under each pixel at one moment."""
        at = {delay_s: self._trajectory.pose(t_s + delay_s) for delay_s in set(self._row_delays_s)}
        poses = [at[delay_s] for delay_s in self._row_delays_s]
        ahead_mm, arc_mm, _ = self._cast(*poses)
        x_mm = np.array([[pose.x_mm] for pose in poses])
        if self._ripples is None:
            return self._look_up(shot, x_mm, ahead_mm, arc_mm)
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


def _row_delays_s(scenario: Scenario) -> list[float]:
    """Exposure time of each row relative to the frame's time; one number if all rows are equal.

    The time of an interlaced frame is that of its upper field, which holds the even rows; with a
    rolling shutter it is that of the middle row.
    """
    camera = scenario.rendered_rig.camera
    rows = np.arange(camera.height)
    delays_s = camera.readout_ms / 1000 * (rows / camera.height - 0.5)
    if scenario.interlaced:
        delays_s = delays_s + rows % 2 / (2 * scenario.frames_per_s)
    return delays_s.tolist() if delays_s.any() else [0.0]


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


class _Recorder:
    """Glass, sensor and recorder, which turn the light into a stored picture."""

    def __init__(self, scenario: Scenario, frames: int) -> None:
        self._scenario = scenario
        self._rng = np.random.default_rng([scenario.seed, 1])
        camera = scenario.rendered_rig.camera
        self._noise = np.empty((camera.height, camera.width), np.float32)
        self._dirt = _dirt(scenario) if scenario.dirt_share else None
        self._parts = _parts(scenario) if scenario.parts else None
        self._faults = _drop_outs(scenario, frames)
        self._last: NDArray[np.uint8] | None = None

    def record(self, index: int, light: FloatImage) -> NDArray[np.uint8]:
        """Record the picture of one frame."""
        gain = float(np.clip(1 + self._scenario.flicker * self._rng.standard_normal(), 0.45, 1.7))
        gain *= _exposure(self._scenario, index / self._scenario.frames_per_s)
        self._rng.standard_normal(out=self._noise, dtype=np.float32)
        fault = self._faults.get(index)
        if fault == "frozen" and self._last is not None:
            return self._last
        if fault == "black":
            light = np.zeros_like(light)
        elif self._dirt is not None:
            clear, veil = self._dirt
            haze = cv2.blur(cv2.resize(light, None, fx=0.125, fy=0.125), (15, 15))
            light = light * clear
            light += veil * cv2.resize(haze, light.shape[::-1])
        if self._parts is not None and fault != "black":
            cover, grey = self._parts
            light = light * (1 - cover)
            light += cover * grey
        grey = self._noise * np.float32(self._scenario.noise_grey)
        grey += light * np.float32(gain)
        grey += np.float32(_BLACK_GREY + 0.5)
        image = np.clip(grey, 0, 255, out=grey).astype(np.uint8)
        if self._scenario.text:
            _burn_in(image, index / self._scenario.frames_per_s)
        self._last = image
        return image


def _exposure(scenario: Scenario, t_s: float) -> float:
    """Exposure around 1, a slow wave of its logarithm."""
    return float(scenario.pumping ** (np.sin(2 * np.pi * t_s / _PUMPING_PERIOD_S) / 2))


def _parts(scenario: Scenario) -> tuple[FloatImage, FloatImage]:
    """(H, W) cover of the robot's own parts, and their light, which is that of the fixed lamp."""
    rng = np.random.default_rng([scenario.seed, 6])
    camera = scenario.rendered_rig.camera
    shape = (camera.height, camera.width)
    hidden = np.zeros(shape, np.float32)
    for outline in (_SKID, _LAMP_FRAME):
        corners = np.rint(np.array(outline) * (camera.width, camera.height)).astype(np.int32)
        cv2.fillPoly(hidden, [corners], 1.0)
    cover = cv2.GaussianBlur(hidden, (0, 0), 1.5)  # they stand too near to be in focus
    scratches = cv2.GaussianBlur(rng.standard_normal(shape).astype(np.float32), (0, 0), 2.5)
    shine = np.linspace(40, 90, camera.height, dtype=np.float32)[:, None]
    return np.asarray(cover, np.float32), np.asarray(shine * (1 + 0.8 * scratches), np.float32)


def _dirt(scenario: Scenario) -> tuple[FloatImage, FloatImage]:
    """(H, W) transmission of the glass, and share of the surrounding light it scatters."""
    rng = np.random.default_rng([scenario.seed, 2])
    camera = scenario.rendered_rig.camera
    shape = (camera.height, camera.width)
    cover = np.zeros(shape, np.float32)
    while float((cover > 0.5).mean()) < scenario.dirt_share:
        blob = np.zeros(shape, np.float32)
        centre = rng.uniform((0, 0), (camera.width, camera.height))
        radius = min(float(rng.lognormal(np.log(0.02), 0.8)), 0.09) * camera.width
        axes = (max(2, round(radius)), max(2, round(radius * rng.uniform(0.5, 1))))
        cv2.ellipse(
            blob,
            (round(centre[0]), round(centre[1])),
            axes,
            float(rng.uniform(0, 180)),
            0,
            360,
            float(rng.uniform(0.6, 0.95)),
            -1,
        )
        cover = np.maximum(cover, cv2.GaussianBlur(blob, (0, 0), 1.0 + radius * 0.12))
    streaks = rng.standard_normal((camera.height // 40 + 2, camera.width // 40 + 2))
    haze = cv2.resize(streaks.astype(np.float32), shape[::-1], interpolation=cv2.INTER_CUBIC)
    haze = np.clip(0.1 + 0.04 * haze, 0, 0.3)
    grain = cv2.GaussianBlur(rng.standard_normal(shape).astype(np.float32), (0, 0), 1.2)
    veil = haze + cover * np.clip(0.3 + 0.4 * grain, 0, 0.6)
    return (1 - cover) * (1 - haze), veil.astype(np.float32)


def _drop_outs(scenario: Scenario, frames: int) -> dict[int, str]:
    """Frames that are "black" or "frozen", by number."""
    faults: dict[int, str] = {}
    if not scenario.drop_out_frames:
        return faults
    rng = np.random.default_rng([scenario.seed, 4])
    index = 20
    kinds = ("black", "frozen")
    while index < frames:
        length = int(rng.integers(2, scenario.drop_out_frames + 1))
        kind = kinds[int(rng.integers(2))]
        faults |= {index + step: kind for step in range(length)}
        index += length + int(rng.integers(25, 70))
    return faults


def _burn_in(image: NDArray[np.uint8], t_s: float) -> None:
    """Write a name above and date and running time below onto the picture."""
    height, width = image.shape
    scale = width / 640
    clock = f"2024-05-17  14:{int(t_s) // 60:02d}:{int(t_s) % 60:02d}.{int(t_s * 100) % 100:02d}"
    for text, x, y in (
        ("CULVERT 12  DN300  DOWNSTREAM", 14 * scale, 28 * scale),
        (clock, width - 330 * scale, height - 14 * scale),
    ):
        for grey, thickness in ((0, 5), (245, 2)):
            cv2.putText(
                image,
                text,
                (round(x), round(y)),
                cv2.FONT_HERSHEY_SIMPLEX,
                0.75 * scale,
                grey,
                max(1, round(thickness * scale)),
                cv2.LINE_AA,
            )
