"""The accuracy and the speed that Chainage must reach on each scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """What Chainage must reach on a scenario over 6 m; None where there is no target."""

    end_percent: float | None = None
    """Largest end error, either sign, in percent of the path."""
    ate_mm: float | None = None
    yaw_rms_deg: float | None = None
    max_error_mm: float | None = None
    """Largest error of the distance in any frame."""
    lost_frames: int | None = None


_STEADY = Target(end_percent=0.05, ate_mm=4, yaw_rms_deg=0.15)
_HINDERED = Target(end_percent=0.1, ate_mm=4, yaw_rms_deg=0.2)
_INTERRUPTED = Target(end_percent=0.3, ate_mm=12, yaw_rms_deg=0.4)
_LATE = Target(end_percent=0.1, yaw_rms_deg=0.3)
_SCALE_ASIDE = Target()
TARGETS: Mapping[str, Target] = {
    **dict.fromkeys(("nominal", "photo_wall", "brick_wall", "dim"), _STEADY),
    **dict.fromkeys(("reverse", "flicker", "turned_camera"), _STEADY),
    "blur": Target(end_percent=0.05, ate_mm=8, yaw_rms_deg=0.15),
    "low_texture": Target(end_percent=0.05, ate_mm=6, yaw_rms_deg=0.2),
    **dict.fromkeys(("spot_light", "burnt_in_text", "dirty_lens"), _HINDERED),
    **dict.fromkeys(("large_sway", "tiled_floor"), _HINDERED),
    "fast": Target(end_percent=0.1, ate_mm=20, yaw_rms_deg=0.2),
    "wide_lens": Target(end_percent=0.1, ate_mm=6, yaw_rms_deg=0.2),
    **dict.fromkeys(("drop_outs", "running_water"), _INTERRUPTED),
    "there_and_back": Target(end_percent=0.02, ate_mm=4, yaw_rms_deg=0.15),
    **dict.fromkeys(("network_burst", "network_jitter"), Target(0.05, yaw_rms_deg=0.15)),
    **dict.fromkeys(("late_start", "late_return"), _LATE),
    "stop_dead": Target(end_percent=0.05, yaw_rms_deg=0.15, max_error_mm=15, lost_frames=15),
    "bounce": Target(end_percent=0.1, ate_mm=2, yaw_rms_deg=0.15),
    **dict.fromkeys(("climb", "pitched_mount"), Target(end_percent=0.1)),
    "rolling_shutter": Target(end_percent=0.1),
    "interlaced": Target(end_percent=0.05),
    "low_bit_rate": Target(end_percent=0.05, yaw_rms_deg=0.5),
    "weak_spot_light": Target(end_percent=0.1, yaw_rms_deg=0.3),
    "pulsed_lamp": Target(end_percent=0.05, lost_frames=0),
    "corrugated": Target(end_percent=0.3),
    "corrugated_forward": Target(end_percent=1.0),
    "mixed_frames": Target(end_percent=0.1, ate_mm=4, lost_frames=0),
    "pull_down": Target(end_percent=0.1),
    "standing": Target(max_error_mm=3),
    "mist": Target(end_percent=0.3, yaw_rms_deg=0.5),
    "fast_turns": Target(end_percent=1.0, max_error_mm=40),
    **dict.fromkeys(
        ("swinging_cable", "late_stabiliser", "drops_on_the_glass"), Target(end_percent=0.1)
    ),
    "forward": Target(end_percent=0.05),
    "forward_crooked": Target(end_percent=1.0, lost_frames=40),
    "forward_looking_around": Target(end_percent=1.0, max_error_mm=40),
    "forward_stream": Target(end_percent=0.3),
    **dict.fromkeys(("tape_height", "tape_height_wide_lens", "data_sheet_lens"), _SCALE_ASIDE),
    **dict.fromkeys(("corrugated_unstated", "corrugated_forward_unstated"), _SCALE_ASIDE),
    "wrong_diameter": _SCALE_ASIDE,
    **dict.fromkeys(("silt", "silt_rising", "silt_wide_lens"), _SCALE_ASIDE),
}
"""Targets by scenario, the strict end where a range is allowed; others have no target."""

LEAST_COVERAGE = 0.97
"""Least share of frames whose true distance lies within three sigma, all sources included."""

LEAST_REGISTRATION_COVERAGE = 0.99
"""The same for the registration's sigma, where the rig is right."""

ERROR_OVER_SIGMA = (0.1, 1.5)
"""Range of the median |error| / sigma of the registration, where the rig is right.

Below it sigma is too large, above it too small."""


@dataclass(frozen=True)
class ScaleTarget:
    """What Chainage must reach with a rig that is wrong by its tolerance."""

    error_over_sigma: float = 2.6
    """Largest |error| / sigma of the distance in the last frame, before the joints correct it."""
    sigma_percent: float = 2.5
    """Largest sigma there, in percent of the path."""
    registration_mm: float = 2.0
    joined_error_percent: float = 0.2
    """Largest error after the joints have corrected the scale."""
    joined_sigma_percent: float = 0.5


SCALE_TARGET = ScaleTarget()
STEP_TARGET = 2.0
"""Largest time of a step, relative to one windowed `cv2.phaseCorrelate`."""

TRACK_TARGET = 3.0
"""Largest wall time of `chainage track`, relative to decoding the same file to grey."""
