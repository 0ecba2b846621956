"""The pose of the robot at every moment of a scenario."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from itertools import product
from math import ceil, cos, floor, pi, radians, sin, sqrt

import numpy as np

from app.lab.simulation.scenario import Look, Scenario, Shaking
from vo_core.geometry.wall import Pose

# Two waves each, as (share of the amplitude, wavelength in mm), without a common period.
_SWAY_WAVES = ((0.75, 1700.0), (0.25, 610.0))
_YAW_WAVES = ((0.75, 1300.0), (0.25, 470.0))
_CLIMB_WAVES = ((0.75, 1500.0), (0.25, 530.0))

_SHAKING_SHARES = (0.6, 0.4)
"""Shares of the amplitude in the two waves of a shaking robot."""


_SAMPLES_PER_S = 4.0
"""Poses looked at to bound the others; robots and hands turn more slowly."""

_PHASE_STEP_RAD = 2.4
"""Phase between two movements of a shaking robot, so that they are not synchronous."""


@dataclass(frozen=True)
class _Leg:
    """One drive from stop to stop with constant acceleration, speed and deceleration."""

    start_s: float
    start_mm: float
    travelled_mm: float
    """Length of the path before this leg."""
    direction: float
    length_mm: float
    speed_mm_s: float
    acceleration_mm_s2: float

    @property
    def duration_s(self) -> float:
        return self.length_mm / self.speed_mm_s + self._ramp_s if self.length_mm else 0.0

    @property
    def _ramp_s(self) -> float:
        return self.speed_mm_s / self.acceleration_mm_s2

    def driven_mm(self, t_s: float) -> float:
        """Path on this leg at `t_s` after its start."""
        t_s = min(max(t_s, 0.0), self.duration_s)
        if t_s < self._ramp_s:
            return self.acceleration_mm_s2 * t_s**2 / 2
        left_s = self.duration_s - t_s
        if left_s < self._ramp_s:
            return self.length_mm - self.acceleration_mm_s2 * left_s**2 / 2
        return self.speed_mm_s * (t_s - self._ramp_s / 2)

    def speed_share(self, t_s: float) -> float:
        """Speed at `t_s` after the start of this leg, relative to its full speed."""
        left_s = self.duration_s - t_s
        if min(t_s, left_s) <= 0:
            return 0.0
        return 1.0 if self._ramp_s == 0 else min(t_s / self._ramp_s, left_s / self._ramp_s, 1.0)


class Trajectory:
    """The drive of a scenario: standstill, its legs with rests between them, standstill.

    During a rest the camera may look around: it turns about its centre.  Sway, yaw and climb are
    waves over the length of the path, so that a standing robot is still and a returning one takes
    another line.  It shakes over time, in proportion to its speed.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._legs: list[_Leg] = []
        start_s = start_mm = travelled_mm = 0.0
        for share in scenario.legs:
            length_mm = abs(share) * scenario.length_mm
            leg = _Leg(
                start_s=start_s,
                start_mm=start_mm,
                travelled_mm=travelled_mm,
                direction=1.0 if share > 0 else -1.0,
                length_mm=length_mm,
                # On a leg too short for the full speed the robot brakes half-way.
                speed_mm_s=min(scenario.speed_mm_s, sqrt(scenario.acceleration_mm_s2 * length_mm)),
                acceleration_mm_s2=scenario.acceleration_mm_s2,
            )
            self._legs.append(leg)
            start_s += leg.duration_s + scenario.rest_s
            start_mm += leg.direction * length_mm
            travelled_mm += length_mm
        self.duration_s = start_s - scenario.rest_s
        self._cut_s = scenario.cut_frames / scenario.frames_per_s
        self._start = self.pose(0.0)

    @property
    def frames(self) -> int:
        """Number of frames from the first one that is not cut to the final stop."""
        rate, cut = self._scenario.frames_per_s, self._scenario.cut_frames
        # Rounding of the times must not drop a last frame that ends the film.
        return floor(self.duration_s * rate + 1e-6) + 1 - cut

    @property
    def x_range_mm(self) -> tuple[float, float]:
        """Smallest and largest axial position."""
        stops = [0.0, *(leg.start_mm + leg.direction * leg.length_mm for leg in self._legs)]
        return min(stops), max(stops)

    def pose(self, t_s: float) -> Pose:
        """Pose in the pipe at `t_s` seconds after the first frame."""
        t_s += self._cut_s
        number = max((n for n, leg in enumerate(self._legs) if t_s >= leg.start_s), default=0)
        leg = self._legs[number]
        driven_mm = leg.driven_mm(t_s - leg.start_s)
        path_mm = leg.travelled_mm + driven_mm
        scenario = self._scenario
        shaken = _shaken(scenario.shaking, t_s)
        strength = leg.speed_share(t_s - leg.start_s) * leg.speed_mm_s / scenario.speed_mm_s
        pose = self._pose(
            x_mm=leg.start_mm + leg.direction * driven_mm,
            sway_mm=scenario.sway_mm * _wave(path_mm, _SWAY_WAVES),
            yaw_deg=scenario.yaw_deg * _wave(path_mm, _YAW_WAVES),
            climb_deg=scenario.climb_deg * _wave(path_mm, _CLIMB_WAVES),
            shaken=[strength * value for value in shaken],
        )
        if number >= len(scenario.looks):
            return pose
        return self._looking(scenario.looks[number], pose, t_s - leg.start_s - leg.duration_s)

    def _looking(self, look: Look, pose: Pose, rested_s: float) -> Pose:
        """Turn a camera that looks around, at `rested_s` after the start of its rest."""
        share = look.share(rested_s - (self._scenario.rest_s - look.duration_s) / 2)
        return replace(
            pose,
            yaw_rad=pose.yaw_rad + share * radians(look.yaw_deg),
            pitch_rad=pose.pitch_rad + share * radians(look.pitch_deg),
        )

    def truth(self, t_s: float) -> Pose:
        """Change of the pose since the first frame."""
        return Pose.of(self.pose(t_s).vector - self._start.vector)

    def extremes(self) -> list[Pose]:
        """Poses at x = 0 that approximately bound all others."""
        scenario = self._scenario
        if scenario.light_follows_view:
            return [replace(self.pose(t_s), x_mm=0.0) for t_s in self._samples_s()]
        largest = list(astuple(scenario.shaking)[1:])
        return [
            self._pose(
                x_mm=0.0,
                sway_mm=sway * scenario.sway_mm,
                yaw_deg=yaw * scenario.yaw_deg,
                climb_deg=climb * scenario.climb_deg,
                shaken=[share * value for value in largest],
            )
            for sway, yaw in product((-1, 0, 1), repeat=2)
            for climb in ((-1, 1) if scenario.climb_deg else (0,))
            for share in ((-1, 1) if any(largest) else (0,))
        ]

    def _samples_s(self) -> list[float]:
        """Times of the whole drive, a few per second."""
        count = ceil(self.duration_s * _SAMPLES_PER_S) + 1
        times_s = np.linspace(-self._cut_s, self.duration_s - self._cut_s, count)
        return [float(t_s) for t_s in times_s]

    def _pose(
        self,
        *,
        x_mm: float,
        sway_mm: float,
        yaw_deg: float,
        climb_deg: float,
        shaken: Sequence[float],
    ) -> Pose:
        """Compose a pose; `shaken` holds y, z in mm and yaw, pitch, roll in degrees."""
        shaken_y_mm, shaken_z_mm, shaken_yaw_deg, pitch_deg, roll_deg = shaken
        lateral_mm, below_axis_mm = self._camera_from_axis_mm
        y_mm, z_mm = _turned(
            lateral_mm + sway_mm + shaken_y_mm, below_axis_mm + shaken_z_mm, radians(climb_deg)
        )
        return Pose(
            x_mm=x_mm,
            y_mm=y_mm - lateral_mm,
            yaw_rad=(yaw_deg + self._scenario.aside_deg + shaken_yaw_deg) * pi / 180,
            z_mm=z_mm - below_axis_mm,
            pitch_rad=radians(pitch_deg),
            roll_rad=radians(roll_deg + climb_deg),
        )

    @property
    def _camera_from_axis_mm(self) -> tuple[float, float]:
        """Position of the camera to the right of the pipe's axis and below it."""
        rig = self._scenario.rendered_rig
        diameter_mm = rig.pipe.diameter_mm
        below_mm = 0.0 if diameter_mm is None else diameter_mm / 2 - rig.mount.height_mm
        return rig.mount.lateral_mm, below_mm


def _turned(y_mm: float, z_mm: float, angle_rad: float) -> tuple[float, float]:
    """Rotate a position about the pipe's axis, right-handed about x."""
    if angle_rad == 0:
        return y_mm, z_mm
    c, s = cos(angle_rad), sin(angle_rad)
    return c * y_mm - s * z_mm, s * y_mm + c * z_mm


def _wave(path_mm: float, waves: tuple[tuple[float, float], ...]) -> float:
    return sum(share * sin(2 * pi * path_mm / length_mm) for share, length_mm in waves)


def _shaken(shaking: Shaking, t_s: float) -> list[float]:
    """Shaking of a robot at full speed: y, z in mm, yaw, pitch, roll in degrees."""
    frequencies_hz, *largest = astuple(shaking)
    return [
        value
        * sum(
            share * sin(2 * pi * hz * t_s + _PHASE_STEP_RAD * number)
            for share, hz in zip(_SHAKING_SHARES, frequencies_hz, strict=True)
        )
        for number, value in enumerate(largest)
    ]
