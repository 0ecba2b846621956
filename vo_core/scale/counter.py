"""Compares a track with a distance counter, such as that of a cable: its faults and its scale.

A counter says c = s d + r + e: d is the distance of the track, s the scale, e the rounding to a
tick, and r stays the same while the counter counts. Where r changes, the counter has slipped, stuck
or been set anew. The longest part without such faults is offered as a known length.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vo_core.drift import Drift, own_scale_sigma
from vo_core.scale.evidence import KnownLength
from vo_core.track import Track
from vo_core.types import Matrix

Unit = Literal["m", "ft"]
"""Units of counters."""

MM_PER_UNIT: Mapping[Unit, float] = {"m": 1000.0, "ft": 304.8}

COUNTER_SHARE = 0.005
"""Standard uncertainty of a counter without faults, as a share of its way: wheel, slack of the
cable. Specifications ask for 0.5 to 1 % of the length."""

WINDOW_TICKS = 20
"""Way over which the counter is compared with the track, in ticks, and at least `WINDOW_MM`."""

WINDOW_MM = 300.0
"""Least way over which the counter is compared with the track."""

CERTAINLY_OFF = 4.0
"""Standard deviations of the track beyond which a difference is a fault of the counter."""

ROUNDING_TICKS = 2.0
"""Difference that rounding to ticks, and a tick seen a frame late, can make."""

SHARE = 0.05
"""Share of the way by which the local scale may differ: soft ground, a camera that sways."""

STUCK_TICKS = 2.5
"""A counter that counts no more than this while the camera drives is stuck."""

STUCK_SHARE = 0.15
"""Or no more than this share of what the camera drives."""

RESET_TICKS = 10.0
"""A larger change between two readings, beyond what the track drove, sets the counter anew."""


@dataclass(frozen=True)
class Fault:
    """A stretch of the film in which the counter did not count what the camera drove."""

    kind: Literal["slip", "stuck", "reset"]
    first_frame: int
    last_frame: int
    counter_mm: float
    """Change of the counter."""
    camera_mm: float
    """Change of the track, at the scale of the counter."""


@dataclass(frozen=True)
class CounterComparison:
    """What a counter and a track say about each other."""

    scale: float | None
    """Way of the counter over that of the raw track; None if too little was driven."""
    sigma: float
    """Standard uncertainty of `scale`; infinite without one."""
    length: KnownLength | None
    """The longest way without a fault, by the counter, as evidence for `correct`."""
    camera_mm: float
    """The same way by the raw track."""
    camera_sigma_mm: float
    """Its standard uncertainty with everything in it, the scale of the rig included."""
    faults: tuple[Fault, ...]
    """In the order of the frames."""

    @property
    def agrees(self) -> bool:
        """Whether counter and raw track differ by less than two standard deviations."""
        if self.length is None:
            return True
        sigma_mm = float(np.hypot(self.length.sigma_mm, self.camera_sigma_mm))
        return abs(self.length.length_mm - self.camera_mm) < 2 * sigma_mm

    def __str__(self) -> str:
        """A sentence such as "counter 15.088 m, camera 15.210 ± 0.300 m: scale 0.992 ± 0.005"."""
        if self.length is None or self.scale is None:
            return "too little was driven without a fault of the counter"
        return (
            f"counter {self.length.length_mm / 1000:.3f} m, camera {self.camera_mm / 1000:.3f} ± "
            f"{self.camera_sigma_mm / 1000:.3f} m: scale {self.scale:.3f} ± {self.sigma:.3f}"
        )


def compare_counter(
    track: Track, reading: NDArray[np.float64], *, unit: Unit, tick: float
) -> CounterComparison:
    """Compare the readings of a counter with a raw track.

    Args:
        track: As it was measured.
        reading: (N,) in `unit`, one for each row of the track; NaN where it is not legible.
        unit: Of `reading` and `tick`.
        tick: Smallest change of the counter, in `unit`.
    """
    mm = MM_PER_UNIT[unit]
    rows = np.flatnonzero(~np.isnan(reading))
    pair = _Pair(track, rows, reading[rows] * mm, tick * mm)
    scale = pair.usual_scale()
    if scale is None:
        return _without_scale(())
    resets = pair.resets(scale)
    bounds = [0, *(after for _, after in resets), len(rows)]
    parts = list(pairwise(bounds))
    slips = [span for first, end in parts for span in pair.faults(first, end, scale)]
    faults = [
        *(pair.fault("reset", span, scale) for span in resets),
        *(pair.fault(pair.kind_of(span), span, scale) for span in slips),
    ]
    faults.sort(key=lambda fault: fault.first_frame)
    sound = [span for part in parts for span in _between(part, slips)]
    return pair.compared(sound, tuple(faults))


Span = tuple[int, int]
"""First and last index into the readings, both included."""


class _Pair:
    """A track and the readings of a counter in some of its rows."""

    def __init__(
        self, track: Track, rows: NDArray[np.intp], counter_mm: Matrix, tick_mm: float
    ) -> None:
        self._track, self._rows, self._tick_mm = track, rows, tick_mm
        self._counter_mm = counter_mm
        self._camera_mm = track.distance_mm[rows]
        self._drift = Drift.of(track)
        self._lost_before = np.concatenate([[0], np.cumsum(track.status == "lost")])
        self._window_mm = max(WINDOW_TICKS * tick_mm, WINDOW_MM)

    def usual_scale(self) -> float | None:
        """The median ratio of counter and track over many short ways."""
        here, there = self._windows(0, len(self._rows))
        camera = self._camera_mm[there] - self._camera_mm[here]
        drives = (np.abs(camera) > self._window_mm / 2) & self._is_seen(here, there)
        if not drives.any():
            return None
        counter = self._counter_mm[there] - self._counter_mm[here]
        scale = float(np.median(counter[drives] / camera[drives]))
        return scale if scale > 0 else None

    def resets(self, scale: float) -> list[Span]:
        """Neighbouring readings between which the counter was set to another value."""
        here = np.arange(len(self._rows) - 1)
        driven = scale * np.diff(self._camera_mm)
        beyond = np.abs(np.diff(self._counter_mm) - driven)
        limit = RESET_TICKS * self._tick_mm + np.abs(driven) / 2
        limit += CERTAINLY_OFF * self._sigma_mm(here, here + 1)
        return [(k, k + 1) for k in np.flatnonzero(beyond > limit).tolist()]

    def faults(self, first: int, end: int, scale: float) -> list[Span]:
        """Spans of one part in which counter and track differ by more than their uncertainty."""
        here, there = self._windows(first, end)
        camera = scale * (self._camera_mm[there] - self._camera_mm[here])
        beyond = np.abs(self._counter_mm[there] - self._counter_mm[here] - camera)
        limit = ROUNDING_TICKS * self._tick_mm + SHARE * np.abs(camera)
        limit += CERTAINLY_OFF * scale * self._sigma_mm(here, there)
        spans: list[Span] = []
        for k in np.flatnonzero((beyond > limit) & self._is_seen(here, there)).tolist():
            span = (int(here[k]), int(there[k]))
            if spans and span[0] <= spans[-1][1]:
                spans[-1] = (spans[-1][0], span[1])
            else:
                spans.append(span)
        return [self._narrowed(span, scale) for span in spans]

    def kind_of(self, span: Span) -> Literal["slip", "stuck"]:
        """Whether the counter stood; at the ends of a fault it may still count some ticks."""
        inside = slice(span[0], span[1] + 1)
        shown_mm, driven_mm = np.ptp(self._counter_mm[inside]), np.ptp(self._camera_mm[inside])
        stood = shown_mm < max(STUCK_TICKS * self._tick_mm, STUCK_SHARE * driven_mm)
        return "stuck" if stood and driven_mm > shown_mm else "slip"

    def fault(self, kind: Literal["slip", "stuck", "reset"], span: Span, scale: float) -> Fault:
        """Describe a fault."""
        first, last = span
        return Fault(
            kind,
            int(self._track.frame[self._rows[first]]),
            int(self._track.frame[self._rows[last]]),
            float(self._counter_mm[last] - self._counter_mm[first]),
            scale * float(self._camera_mm[last] - self._camera_mm[first]),
        )

    def compared(self, sound: list[Span], faults: tuple[Fault, ...]) -> CounterComparison:
        """Compare over the longest way in the parts without faults."""
        ways = [self._longest(span) for span in sound]
        low, high = max(ways, key=lambda way: self._way_mm(way), default=(0, 0))
        length_mm = self._way_mm((low, high))
        camera_mm = float(self._camera_mm[high] - self._camera_mm[low])
        if length_mm < self._window_mm or camera_mm <= 0:
            return _without_scale(faults)
        rounding_mm = self._tick_mm / np.sqrt(6)  # of two readings, each even over one tick
        sigma_mm = float(np.hypot(rounding_mm, COUNTER_SHARE * length_mm))
        drift_mm = float(self._sigma_mm(np.array([low]), np.array([high]))[0])
        frames = [int(self._track.frame[self._rows[k]]) for k in (low, high)]
        scale = length_mm / camera_mm
        return CounterComparison(
            scale=scale,
            sigma=scale * float(np.hypot(sigma_mm / length_mm, drift_mm / camera_mm)),
            length=KnownLength(frames[0], frames[1], length_mm, sigma_mm),
            camera_mm=camera_mm,
            camera_sigma_mm=float(np.hypot(drift_mm, own_scale_sigma(self._track) * camera_mm)),
            faults=faults,
        )

    def _longest(self, span: Span) -> Span:
        """The readings of a span that are furthest apart, the smaller first."""
        shown = self._counter_mm[span[0] : span[1] + 1]
        return span[0] + int(shown.argmin()), span[0] + int(shown.argmax())

    def _way_mm(self, way: Span) -> float:
        return (
            float(self._counter_mm[way[1]] - self._counter_mm[way[0]]) if len(self._rows) else 0.0
        )

    def _windows(self, first: int, end: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Pairs of readings between which counter or camera went `_window_mm`, to and fro added."""
        counter, camera = self._counter_mm[first:end], self._camera_mm[first:end]
        steps = np.maximum(np.abs(np.diff(counter)), np.abs(np.diff(camera)))
        path = np.concatenate([[0.0], np.cumsum(steps)])
        there = np.searchsorted(path, path + self._window_mm)
        here = np.flatnonzero(there < len(path))
        return first + here, first + there[here]

    def _is_seen(self, here: NDArray[np.intp], there: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether the camera was not lost between readings: a counter is not to blame for that."""
        lost = self._lost_before
        return np.asarray(lost[self._rows[here]] == lost[self._rows[there] + 1])

    def _sigma_mm(self, here: NDArray[np.intp], there: NDArray[np.intp]) -> Matrix:
        """Standard uncertainty of the camera's way between readings, without the rig's scale."""
        places = (self._drift.places(self._rows[at]) for at in (here, there))
        return np.sqrt(self._drift.between(*places))

    def _narrowed(self, span: Span, scale: float) -> Span:
        """Leave out the ends of a span in which the counter still counts.

        From its first reading on, the difference to the track stays within rounding until the fault
        begins, and before its last reading it does again.
        """
        inside = slice(span[0], span[1] + 1)
        left_mm = self._counter_mm[inside] - scale * self._camera_mm[inside]
        rounding_mm = ROUNDING_TICKS * self._tick_mm
        starts = np.flatnonzero(np.abs(left_mm - left_mm[0]) > rounding_mm)
        ends = np.flatnonzero(np.abs(left_mm - left_mm[-1]) > rounding_mm)
        if len(starts) == 0 or len(ends) == 0 or starts[0] > ends[-1] + 1:
            return span
        return span[0] + int(starts[0]) - 1, span[0] + int(ends[-1]) + 1


def _between(part: Span, faults: list[Span]) -> Iterator[Span]:
    """What a part (the end excluded) has before, between and after its faults."""
    first, end = part
    for fault in sorted(faults):
        if first <= fault[0] and fault[1] < end:
            yield first, fault[0]
            first = fault[1]
    if first < end:
        yield first, end - 1


def _without_scale(faults: tuple[Fault, ...]) -> CounterComparison:
    return CounterComparison(None, np.inf, None, 0.0, 0.0, faults)
