"""Rows for the frames that a camera sent faster than they could be tracked."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import msgspec

from app.jobs.messages import Row

UNKNOWN_ACCELERATION_MM_S2 = 500.0
"""One sigma of what a robot may have done unseen; the odometry bridges a loss by the same."""

_IN_PROPORTION = (
    *("x_mm", "y_mm", "yaw_deg", "distance_mm"),
    *("z_mm", "pitch_deg", "roll_deg"),
)


def between(before: Row, after: Row, skipped: Sequence[tuple[int, float]]) -> Iterator[Row]:
    """Poses in proportion to the time between two tracked frames.

    They are weak, and lost next to a lost one.  Their sigma is the larger one of the neighbours',
    with what an unseen acceleration moves by in the middle of the gap: a t (T - t) / 2.

    Args:
        before, after: Of the nearest tracked frames.
        skipped: Number and time in s of each frame between them.
    """
    length_s = after.time_s - before.time_s
    neighbours_mm = {
        name: max(getattr(before, name), getattr(after, name))
        for name in ("sigma_distance_mm", "sigma_registration_mm")
    }
    is_lost = "lost" in (before.status, after.status)
    for frame, time_s in skipped:
        passed_s = time_s - before.time_s
        share = passed_s / length_s
        unseen_mm = UNKNOWN_ACCELERATION_MM_S2 * passed_s * (length_s - passed_s) / 2
        yield msgspec.structs.replace(
            before,
            frame=frame,
            time_s=time_s,
            quality=min(before.quality, after.quality) / 2,
            status="lost" if is_lost else "weak",
            **{
                name: (1 - share) * getattr(before, name) + share * getattr(after, name)
                for name in _IN_PROPORTION
            },
            **{name: math.hypot(sigma, unseen_mm) for name, sigma in neighbours_mm.items()},
        )
