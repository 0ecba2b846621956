"""Where the robot is at every moment of a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, pi, sin, sqrt

from app.simulation.scenarios import Scenario

# Two waves each, as (share of the amplitude, wavelength in mm); no common period.
_SWAY_WAVES = ((0.75, 1700.0), (0.25, 610.0))
_YAW_WAVES = ((0.75, 1300.0), (0.25, 470.0))


@dataclass(frozen=True)
class Pose:
    """Pose of the camera in the pipe, relative to the first frame."""

    x_mm: float
    y_mm: float
    yaw_rad: float


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
        return self.length_mm / self.speed_mm_s + self.speed_mm_s / self.acceleration_mm_s2

    def driven_mm(self, t_s: float) -> float:
        """Path of this leg after `t_s` since its start."""
        t_s = min(max(t_s, 0.0), self.duration_s)
        ramp_s = self.speed_mm_s / self.acceleration_mm_s2
        if t_s < ramp_s:
            return self.acceleration_mm_s2 * t_s**2 / 2
        left_s = self.duration_s - t_s
        if left_s < ramp_s:
            return self.length_mm - self.acceleration_mm_s2 * left_s**2 / 2
        return self.speed_mm_s * (t_s - ramp_s / 2)


class Trajectory:
    """The drive of a scenario: standstill, its legs with rests between them, standstill.

    Sway and yaw are waves over the length of the path, so that a robot that stands is still and
    one that comes back does so on another line.
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
                # A leg too short to reach the full speed brakes half-way.
                speed_mm_s=min(scenario.speed_mm_s, sqrt(scenario.acceleration_mm_s2 * length_mm)),
                acceleration_mm_s2=scenario.acceleration_mm_s2,
            )
            self._legs.append(leg)
            start_s += leg.duration_s + scenario.rest_s
            start_mm += leg.direction * length_mm
            travelled_mm += length_mm
        self.duration_s = start_s - scenario.rest_s

    @property
    def frames(self) -> int:
        """Frames from t = 0 to the final stop."""
        return floor(self.duration_s * self._scenario.frames_per_s) + 1

    @property
    def x_range_mm(self) -> tuple[float, float]:
        """Smallest and largest axial position."""
        stops = [0.0, *(leg.start_mm + leg.direction * leg.length_mm for leg in self._legs)]
        return min(stops), max(stops)

    def pose(self, t_s: float) -> Pose:
        """Pose at `t_s` seconds after the first frame."""
        leg = next((leg for leg in reversed(self._legs) if t_s >= leg.start_s), self._legs[0])
        driven_mm = leg.driven_mm(t_s - leg.start_s)
        path_mm = leg.travelled_mm + driven_mm
        yaw_deg = self._scenario.yaw_deg * _wave(path_mm, _YAW_WAVES)
        return Pose(
            x_mm=leg.start_mm + leg.direction * driven_mm,
            y_mm=self._scenario.sway_mm * _wave(path_mm, _SWAY_WAVES),
            yaw_rad=yaw_deg * pi / 180,
        )


def _wave(path_mm: float, waves: tuple[tuple[float, float], ...]) -> float:
    return sum(share * sin(2 * pi * path_mm / length_mm) for share, length_mm in waves)
