"""Carries the distance where the camera does not measure it: by a counter, or by what is typed.

A frame is anchored where a reading says its distance. Between two anchors the way follows the
camera where it measured and time where it did not, and what is left over at the next anchor is
spread like the variance of the way: a Brownian bridge. Over a stretch in which the camera was lost
only the way between its ends is taken from the readings, so that faults of a counter elsewhere do
no harm. Where the camera is much less certain than the readings, these carry the whole film.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vo_core.drift import Drift, Rows, own_scale_sigma
from vo_core.scale.correction import DOUBT
from vo_core.scale.pieces import SCALE_LIMITS
from vo_core.track import Track
from vo_core.types import Matrix

SPEED_MM_S = 150.0
"""Fastest way of a camera that nobody measures; specifications ask for no more."""

STEADY_S = 1.0
"""A camera that nobody measures keeps its speed for so long."""

RESET_MM_S = 1000.0
"""A counter that moves faster between two readings was set anew."""

RESET_TICKS = 10.0
"""Such a change has more ticks than this."""

CLEARLY = 2.0
"""Readings carry the whole film where its way is more certain by them by this factor."""

GUESS = 4.0
"""A rig that knows its scale so many times worse than readings is a guess."""

GROSS = 0.2
"""Share of the way by which no cable is wrong in most of a film."""

MOSTLY = 0.5
"""They do too where the camera is lost, or contradicts them, in more of the film than this."""

LEAST_WAY_MM = 300.0
"""Least way of camera and readings together from which their scale is known."""

_SQRT12 = float(np.sqrt(12.0))
_LEAST_STEP_MM2 = 1e-6
"""Keeps the variance of the way rising from row to row."""


@dataclass(frozen=True)
class Readings:
    """Distances of some frames that the camera has not measured."""

    rows: Rows
    """(M,) rows of the track, rising."""
    distance_mm: Matrix
    """(M,)"""
    sigma_mm: float
    """Standard uncertainty of each, independent of the others."""
    share: float
    """Standard uncertainty of the way between two of them, as a share of it."""
    zero_sigma_mm: float = 0.0
    """Standard uncertainty that they have in common."""
    legible: Rows = field(default_factory=lambda: np.empty(0, np.intp))
    """(L,) rows in which a counter is legible, rising: those between two anchors too."""
    shown_mm: Matrix = field(default_factory=lambda: np.empty(0))
    """(L,) what it shows there; the row is within half a tick of it."""

    @classmethod
    def of_counter(
        cls, time_s: Matrix, reading_mm: Matrix, *, tick_mm: float, share: float
    ) -> Readings | None:
        """Return what a counter says; None unless two of its readings are legible.

        A counter is anchored where it moves on by a tick: there it is half-way between the two. A
        counter that was set anew goes on from its last reading.

        Args:
            time_s: (N,) of the rows of the track.
            reading_mm: (N,) as shown in each row, NaN where it is not legible.
            tick_mm: Smallest change of the counter.
            share: Error of its way, as a share of it.
        """
        legible = np.flatnonzero(~np.isnan(reading_mm))
        if len(legible) < 2:
            return None
        change_mm, pause_s = np.diff(reading_mm[legible]), np.diff(time_s[legible])
        fastest_mm = RESET_TICKS * tick_mm + RESET_MM_S * pause_s
        change_mm[np.abs(change_mm) > fastest_mm] = 0.0
        shown_mm = reading_mm[legible[0]] + np.concatenate([[0.0], np.cumsum(change_mm)])
        moves = np.flatnonzero(change_mm)
        ticks = moves[np.abs(change_mm[moves]) < 1.5 * tick_mm]
        others = np.setdiff1d(moves, ticks)
        ends = np.concatenate([[0, len(legible) - 1], others, others + 1])
        at = np.concatenate([legible[ticks + 1], legible[ends]])
        value_mm = np.concatenate([(shown_mm[ticks] + shown_mm[ticks + 1]) / 2, shown_mm[ends]])
        rows, first = np.unique(at, return_index=True)
        # Nobody knows whether it rounds or cuts off.
        zero_sigma_mm = tick_mm / 2
        return cls(
            rows, value_mm[first], tick_mm / _SQRT12, share, zero_sigma_mm, legible, shown_mm
        )

    def within(self, first: int, last: int) -> Readings:
        """Return the readings in these rows, both included."""
        inside = (first <= self.rows) & (self.rows <= last)
        seen = (first <= self.legible) & (self.legible <= last)
        return replace(
            self,
            rows=self.rows[inside],
            distance_mm=self.distance_mm[inside],
            legible=self.legible[seen],
            shown_mm=self.shown_mm[seen],
        )

    def scaled(self, scale: float) -> Readings:
        """Return the readings in other units of length."""
        return replace(
            self,
            distance_mm=scale * self.distance_mm,
            sigma_mm=abs(scale) * self.sigma_mm,
            shown_mm=scale * self.shown_mm,
        )


@dataclass(frozen=True)
class Carried:
    """A track whose distances are read where the camera did not measure them."""

    track: Track
    is_read: NDArray[np.bool_]
    """(N,) whether a row has its distance from readings."""
    is_bridged: NDArray[np.bool_]
    """(N,) whether it has it from readings and camera together: one of them fails there, and holds
    on both sides."""
    is_whole: bool
    """Whether readings carry the whole film; its distances are then those of the readings."""
    scale: float | None = None
    """Way of the readings over that of the camera, where both hold; None if that is not known."""

    @property
    def is_carried(self) -> NDArray[np.bool_]:
        """(N,) whether readings have to do with the distance of a row."""
        return self.is_read | self.is_bridged

    @property
    def measured(self) -> Track:
        """The track, in which a row with a reading counts as measured."""
        return replace(self.track, status=np.where(self.is_carried, "weak", self.track.status))


def carry(track: Track, readings: Readings) -> Carried | None:
    """Carry the distances of a track by readings where the camera did not measure them.

    Args:
        track: As it was measured; rows without a lock are `lost`.
        readings: Of the same film.
    Returns:
        None where they are not needed, or are of no use.
    """
    readings = readings.within(0, len(track) - 1)
    if len(readings.rows) == 0:
        return None
    lost = track.status == "lost"
    scale = _scale(track, readings, lost)
    whole = _whole(track, readings, scale, lost)
    if lost.mean() > MOSTLY:
        return whole
    bridged = _bridged(track, readings.scaled(1.0 / (scale or 1.0)), lost)
    best = track if bridged is None else bridged.track
    # A stretch that begins or ends the film says nothing of the rest.
    own_mm, read_mm = (np.median(each.sigma_registration_mm) for each in (best, whole.track))
    return whole if own_mm > CLEARLY * read_mm else bridged


def are_better(readings: Readings, track: Track, *, has_ruler: bool) -> bool:
    """Whether readings contradict a track in most of the film, or know its scale far better, and
    are to be believed.

    The rig is no measurement of this run, so it is believed only if it is the more certain. Joints
    and crests are one, which only a gross contradiction shows to be counted wrongly.

    Args:
        readings: Of the same film.
        track: Corrected by what is known besides.
        has_ruler: Whether joints or crests set its scale.
    """
    readings = readings.within(0, len(track) - 1)
    here, there = _ways(readings)
    if len(here) == 0:
        return False
    rows, own = readings.rows, own_scale_sigma(track)
    read_mm = readings.distance_mm[there] - readings.distance_mm[here]
    seen_mm = track.distance_mm[rows[there]] - track.distance_mm[rows[here]]
    drift = Drift.of(track)
    walked = drift.between(drift.places(rows[here]), drift.places(rows[there]))
    by_scale = (own**2 + readings.share**2) * read_mm**2
    off_mm = np.abs(read_mm - seen_mm)
    sigma_mm = np.sqrt(walked + 2 * readings.sigma_mm**2 + by_scale)
    contradicts = float((off_mm > DOUBT * sigma_mm).mean()) > MOSTLY
    if contradicts and float(np.median(off_mm / np.abs(read_mm))) > GROSS:
        return True
    is_guess = own > GUESS * readings.share
    return not has_ruler and own > readings.share and (contradicts or is_guess)


def carried_wholly(track: Track, readings: Readings) -> Carried:
    """Carry all rows by the readings; the camera interpolates between them where it measured."""
    readings = readings.within(0, len(track) - 1)
    lost = track.status == "lost"
    return _whole(track, readings, _scale(track, readings, lost), lost)


def _whole(
    track: Track, readings: Readings, scale: float | None, lost: NDArray[np.bool_]
) -> Carried:
    """Carry all rows by absolute readings."""
    doubt = own_scale_sigma(track) if scale is None else 0.0
    distance_mm, variance = _between(
        track, readings, scale or 1.0, lost, 0, len(track) - 1, scale_sigma=doubt
    )
    bridged = ~lost & (variance > readings.sigma_mm**2)
    bridged[: readings.rows[0]] = bridged[readings.rows[-1] + 1 :] = False
    way_mm = distance_mm - readings.distance_mm[0]
    variance += readings.sigma_mm**2 + readings.zero_sigma_mm**2 + (readings.share * way_mm) ** 2
    sigma_mm = np.sqrt(variance)
    return Carried(
        replace(
            track,
            x_mm=distance_mm,
            distance_mm=distance_mm,
            sigma_distance_mm=sigma_mm,
            sigma_registration_mm=sigma_mm,
        ),
        ~bridged,
        bridged,
        is_whole=True,
        scale=scale,
    )


def _bridged(track: Track, readings: Readings, lost: NDArray[np.bool_]) -> Carried | None:
    """Take the ways over lost stretches from readings, in the camera's unit of length.

    None if they make no stretch more certain.
    """
    distance_mm, variance = track.distance_mm.copy(), np.square(track.sigma_registration_mm)
    read, bridged = np.zeros_like(lost), np.zeros_like(lost)
    for first, last in _stretches(lost, readings.rows):
        inside = slice(first, last + 1)
        own = readings.within(first, last)
        way_mm, walked = _between(track, own, 1.0, lost, first, last)
        way_mm = way_mm - way_mm[0]
        grown = walked + 2 * own.sigma_mm**2 + (own.share * way_mm) ** 2
        grown[0] = 0.0
        if grown[-1] >= variance[last] - variance[first]:
            continue
        further_mm = distance_mm[first] + way_mm[-1] - distance_mm[last]
        certain = variance[first] + grown[-1] - variance[last]
        distance_mm[inside], variance[inside] = distance_mm[first] + way_mm, variance[first] + grown
        distance_mm[last + 1 :] += further_mm
        variance[last + 1 :] = np.maximum(variance[last + 1 :] + certain, 0.0)
        on_both_sides = not lost[first] and not lost[last]
        (bridged if on_both_sides else read)[inside] = lost[inside]
    if not (read.any() or bridged.any()):
        return None
    carried = replace(
        track,
        x_mm=distance_mm,
        distance_mm=distance_mm,
        sigma_registration_mm=np.sqrt(variance),
        sigma_distance_mm=np.sqrt(variance + (own_scale_sigma(track) * distance_mm) ** 2),
    )
    return Carried(carried, read, bridged, is_whole=False)


def _stretches(lost: NDArray[np.bool_], rows: Rows) -> Iterator[tuple[int, int]]:
    """Yield first and last row, both with a reading, of each stretch around lost rows."""
    reading = np.zeros_like(lost)
    reading[rows] = True
    # Lost rows between the same two measured readings belong to one stretch.
    ends = [int(row) for row in rows if not lost[row]]
    if lost[0]:
        ends.insert(0, int(rows[0]))
    if lost[-1]:
        ends.append(int(rows[-1]))
    for first, last in pairwise(ends):
        if last > first and lost[first : last + 1].any():
            yield first, last


def _between(
    track: Track,
    readings: Readings,
    scale: float,
    lost: NDArray[np.bool_],
    first: int,
    last: int,
    *,
    scale_sigma: float = 0.0,
) -> tuple[Matrix, Matrix]:
    """Distances of rows from readings among them, and their variance in mm^2 without that of the
    readings.
    """
    rows = slice(first, last + 1)
    shared = Drift.of(track).shared_mm2[rows]
    is_measured = ~(lost[rows][1:] | lost[rows][:-1])
    step_mm = np.where(is_measured, scale * np.diff(track.distance_mm[rows]), 0.0)
    pause_s = np.maximum(np.diff(track.time_s[rows]), 0.0)
    unknown_s = np.where(is_measured, 0.0, pause_s)
    # A frame that the camera measured is never less certain than one that it did not.
    unseen = SPEED_MM_S**2 * STEADY_S * pause_s
    by_scale = np.diff((scale_sigma * np.cumsum(np.abs(step_mm))) ** 2, prepend=0.0)
    known = scale**2 * np.diff(shared) + by_scale
    walk = np.where(is_measured, np.minimum(known, unseen), unseen)
    path_mm, walked, unknown_s = (
        np.concatenate([[0.0], np.cumsum(each)])
        for each in (step_mm, walk + _LEAST_STEP_MM2, unknown_s)
    )
    at = readings.rows - first
    left_mm = readings.distance_mm - path_mm[at]
    distance_mm = path_mm + np.interp(walked, walked[at], left_mm)
    row = np.arange(len(path_mm))
    before = at[np.maximum(np.searchsorted(at, row, "right") - 1, 0)]
    after = at[np.minimum(np.searchsorted(at, row), len(at) - 1)]
    since, until = np.abs(walked - walked[before]), np.abs(walked[after] - walked)
    bridge = since * until / np.maximum(since + until, _LEAST_STEP_MM2)
    # Beyond the first and the last reading a camera may have driven on all the time.
    far_s = np.abs(unknown_s - unknown_s[before])
    beyond = since + (SPEED_MM_S * far_s) ** 2
    is_beyond = (row < at[0]) | (row > at[-1])
    variance = np.where(is_beyond, beyond, bridge)
    # While it stands, or nobody knows how fast it drives, what the counter shows is more certain.
    shown = variance[readings.legible - first] > readings.sigma_mm**2
    unsure, shown_mm = readings.legible[shown] - first, readings.shown_mm[shown]
    half_tick_mm = _SQRT12 / 2 * readings.sigma_mm
    distance_mm[unsure] = np.clip(
        distance_mm[unsure], shown_mm - half_tick_mm, shown_mm + half_tick_mm
    )
    variance[unsure] = readings.sigma_mm**2
    return distance_mm, variance


def _ways(readings: Readings) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and last reading of ways of `LEAST_WAY_MM` by the readings, from each of them on."""
    path_mm = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(readings.distance_mm)))])
    there = np.searchsorted(path_mm, path_mm + LEAST_WAY_MM)
    here = np.flatnonzero(there < len(readings.rows))
    # To and fro is no way.
    way_mm = readings.distance_mm[there[here]] - readings.distance_mm[here]
    here = here[np.abs(way_mm) > LEAST_WAY_MM / 2]
    return here, there[here]


def _scale(track: Track, readings: Readings, lost: NDArray[np.bool_]) -> float | None:
    """Way of the readings over that of the camera, where both hold: the median over many ways, so
    that a slip does not count; None if that is not known.
    """
    rows, (here, there) = readings.rows, _ways(readings)
    lost_before = np.concatenate([[0], np.cumsum(lost)])
    held = lost_before[rows[here]] == lost_before[rows[there] + 1]
    if not held.any():
        return None
    seen_mm = track.distance_mm[rows[there]] - track.distance_mm[rows[here]]
    read_mm = readings.distance_mm[there] - readings.distance_mm[here]
    share = float(np.median((seen_mm / read_mm)[held]))
    low, high = SCALE_LIMITS
    return 1.0 / share if low < abs(share) < high else None
