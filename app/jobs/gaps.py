"""Rows for frames that were not tracked, and for what follows on a time that nobody saw."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import msgspec

from app.jobs.messages import Row
from app.jobs.parts import Between
from vo_core.bridge import BRIDGE_ACCELERATION_MM_S2

_UNKNOWN_MOVE_MM = 10_000.0
"""One sigma of where a robot is that was moved by hand: a culvert's length."""
_UNKNOWN_SPEED_MM_S = 500.0
"""One sigma of how fast a robot drove while nobody looked."""

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
        unseen_mm = BRIDGE_ACCELERATION_MM_S2 * passed_s * (length_s - passed_s) / 2
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


def place_after(last: Row, between: Between | None, time_s: float) -> Row:
    """Where a run goes on that did not see what was behind this frame.

    A robot that was moved may have been set back to the start, or anywhere: only along the pipe
    goes the distance on, with an uncertainty that says so, and the rest is as at a first frame.
    One that nobody looked after is about as far off as it may have driven in the time.
    """
    if between == "stood_still":
        return last
    furthest_mm = math.hypot(_UNKNOWN_MOVE_MM, last.distance_mm)
    if between == "moved":
        unseen_mm = furthest_mm
        last = msgspec.structs.replace(
            last, y_mm=0.0, yaw_deg=0.0, z_mm=0.0, pitch_deg=0.0, roll_deg=0.0
        )
    else:
        unseen_mm = min(_UNKNOWN_SPEED_MM_S * max(time_s - last.time_s, 0.0), furthest_mm)
    return msgspec.structs.replace(
        last,
        status="lost",
        sigma_distance_mm=math.hypot(last.sigma_distance_mm, unseen_mm),
        sigma_registration_mm=math.hypot(last.sigma_registration_mm, unseen_mm),
    )
