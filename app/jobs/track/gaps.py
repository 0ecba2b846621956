"""Estimates for frames that were not tracked, and the pose after an unobserved time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from app.jobs.track.parts import Between
from vo_core.track import Estimate
from vo_core.tracker.course import UNSEEN_ACCELERATION

_UNKNOWN_MOVE_MM = 10_000.0
"""One sigma of the position of a robot that was moved by hand: the length of a culvert."""
_UNKNOWN_SPEED_MM_S = 500.0
"""One sigma of the speed of a robot that was not observed."""

POSE = ("x_mm", "y_mm", "yaw_deg", "distance_mm", "z_mm", "pitch_deg", "roll_deg")
SIGMAS = ("sigma_distance_mm", "sigma_registration_mm")
"""Fields of an estimate that add up from run to run, and those of which the variances do."""


def between(
    before: Estimate, after: Estimate, skipped: Sequence[tuple[int, float]]
) -> Iterator[Estimate]:
    """Interpolate poses over time between two tracked frames.

    They are weak, or lost next to a lost frame. Their sigma is the larger one of the neighbours
    plus the displacement by an unseen acceleration within the gap: a t (T - t) / 2.

    Args:
        before, after: Those of the nearest tracked frames.
        skipped: Number and time in s of each frame between them.
    """
    length_s = after.time_s - before.time_s
    neighbours_mm = {name: max(getattr(before, name), getattr(after, name)) for name in SIGMAS}
    is_lost = "lost" in (before.status, after.status)
    for frame, time_s in skipped:
        passed_s = time_s - before.time_s
        share = passed_s / length_s
        unseen_mm = float(UNSEEN_ACCELERATION[0]) * passed_s * (length_s - passed_s) / 2
        yield replace(
            before,
            frame=frame,
            time_s=time_s,
            quality=min(before.quality, after.quality) / 2,
            status="lost" if is_lost else "weak",
            **{
                name: (1 - share) * getattr(before, name) + share * getattr(after, name)
                for name in POSE
            },
            **{name: math.hypot(sigma, unseen_mm) for name, sigma in neighbours_mm.items()},
        )


def place_after(last: Estimate, between: Between | None, time_s: float) -> Estimate:
    """Return the pose at which a run continues after an unobserved time.

    A robot that was moved may be anywhere: its distance continues with a large uncertainty, and the
    rest is as at a first frame. For a robot that was only unobserved, the uncertainty is the
    distance that it may have driven in that time.
    """
    if between == "stood_still":
        return last
    furthest_mm = math.hypot(_UNKNOWN_MOVE_MM, last.distance_mm)
    if between == "moved":
        unseen_mm = furthest_mm
        last = replace(last, y_mm=0.0, yaw_deg=0.0, z_mm=0.0, pitch_deg=0.0, roll_deg=0.0)
    else:
        unseen_mm = min(_UNKNOWN_SPEED_MM_S * max(time_s - last.time_s, 0.0), furthest_mm)
    return replace(
        last,
        status="lost",
        sigma_distance_mm=math.hypot(last.sigma_distance_mm, unseen_mm),
        sigma_registration_mm=math.hypot(last.sigma_registration_mm, unseen_mm),
    )
