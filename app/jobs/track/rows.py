"""The rows of a run's track, made of the estimates of its parts: as they come, and smoothed."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from app.jobs.track.gaps import POSE, SIGMAS, between, place_after
from app.jobs.track.parts import Between
from vo_core.track import Estimate

LeftOut = Sequence[tuple[int, float]]
"""Number and time, s, of frames that were not tracked."""


def at_rest(frame: int, time_s: float) -> Estimate:
    """Return the row of a first frame of which nothing is known."""
    numbers = dict.fromkeys((*POSE, *SIGMAS, "quality"), 0.0)
    return Estimate(frame=frame, time_s=time_s, status="lost", **numbers)


class Rows:
    """Places the estimates of consecutive parts, which begin at (0, 0, 0) each, in the run."""

    def __init__(self, start: Estimate | None, how: Between | None) -> None:
        """Begin at the last frame of an earlier run, after which the robot moved as `how` says; at
        the first frame of the run without one.
        """
        self.start, self._how = start, how
        self.last = start
        self._is_first = True

    def begin_part(self, how: Between | None) -> None:
        """Place what follows after the last row."""
        self.start, self._how, self._is_first = self.last, how, True

    def place(self, estimate: Estimate, left_out: LeftOut = ()) -> tuple[list[Estimate], Estimate]:
        """Return the rows of the frames left out before a frame, and its own row.

        Args:
            estimate: Relative to the first frame of its part; its number is that in the run.
            left_out: The frames between it and the frame before.
        """
        if self.start is not None:
            if self._is_first and estimate.frame > self.start.frame:
                self.start = place_after(self.start, self._how, estimate.time_s)
                if self._how != "stood_still":
                    estimate = replace(estimate, status="lost")
            estimate = _placed(estimate, self.start)
        before = [] if self.last is None else list(between(self.last, estimate, left_out))
        self._is_first, self.last = False, estimate
        return before, estimate

    def leave_out(self, frames: LeftOut) -> list[Estimate]:
        """Return the rows of frames at the end of the run that the film does not show."""
        if self.last is None:
            return []
        return [
            replace(place_after(self.last, None, time_s), frame=frame, time_s=time_s, quality=0.0)
            for frame, time_s in frames
        ]


@dataclass
class _Part:
    how: Between | None
    """The robot's movement before it; that of the first part is known from the start."""
    frames: array[int] = field(default_factory=lambda: array("q"))
    """Number of each tracked frame."""
    left_out: dict[int, LeftOut] = field(default_factory=dict)
    """The frames left out before a tracked one, by its number."""
    smoothed: list[Estimate] = field(default_factory=list)
    """Of a part that has ended."""


class RowPlan:
    """What the rows of a run are made of beside the estimates, to make them again."""

    def __init__(self, start: Estimate | None, how: Between | None) -> None:
        """Begin like `Rows`."""
        self._start, self._how = start, how
        self._parts = [_Part(None)]
        self._at_end: LeftOut = ()

    def add(self, frame: int, left_out: LeftOut) -> None:
        """Note a tracked frame, and those left out before it."""
        part = self._parts[-1]
        part.frames.append(frame)
        if left_out:
            part.left_out[frame] = left_out

    def begin_part(self, how: Between | None, smoothed: list[Estimate]) -> None:
        """Begin another part; `smoothed` are the estimates of the one that has ended."""
        self._parts[-1].smoothed = smoothed
        self._parts.append(_Part(how))

    def leave_out(self, frames: LeftOut) -> None:
        """Note frames at the end."""
        self._at_end = frames

    def rows(self, smoothed: list[Estimate]) -> Iterator[Estimate]:
        """Yield all rows anew; `smoothed` are the estimates of the last part.

        A frame that an earlier run has tracked keeps its row, and all do if a part has no smoothed
        estimates.
        """
        placing = Rows(self._start, self._how)
        self._parts[-1].smoothed = smoothed
        if any(len(part.smoothed) < len(part.frames) for part in self._parts):
            return
        for number, part in enumerate(self._parts):
            if number > 0:
                placing.begin_part(part.how)
            for frame, estimate in zip(part.frames, part.smoothed, strict=True):
                left_out = part.left_out.get(frame, ())
                before, own = placing.place(replace(estimate, frame=frame), left_out)
                yield from before
                if self._start is None or frame > self._start.frame:
                    yield own
        yield from placing.leave_out(self._at_end)


def _placed(estimate: Estimate, start: Estimate) -> Estimate:
    """Convert a pose relative to this part's first frame to the earlier run, which ends at
    `start`.
    """
    sums: dict[str, Any] = {name: getattr(start, name) + getattr(estimate, name) for name in POSE}
    sums |= {name: math.hypot(getattr(start, name), getattr(estimate, name)) for name in SIGMAS}
    return replace(estimate, **sums)
