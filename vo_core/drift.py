"""Correlation of the errors of a track's frames, derived from the variances that it states."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vo_core.errors import InvalidCorrection
from vo_core.track import Track
from vo_core.types import Matrix

Rows = NDArray[np.intp]
"""Indices into the columns of a track."""

TREND = 2.0
"""Change of the scale over the first metre by a trend, relative to that by the random walk.

Water lays beds evenly, so they change little from one metre to the next."""

_PARTLY = 0.1
"""A bed is partial if it deviates from an even one by this share of its largest effect."""

_STEP = 5.0
"""Growth of the doubt at more than this many times its usual rate is a step."""

_LEAST_RATE = 0.01
"""Least growth of the doubt on a bed, per mm."""

_LEAST_WAY_MM = 1.0
"""Least distance at which a rig's tolerances show in a track, which has four decimals."""

_CLEARLY = 1.2
"""A variance beyond this many times that of the tolerances has another source too.

Any wall may be a bed, or have waves, to some small probability."""


@dataclass(frozen=True)
class Places:
    """Where distances are needed: (N,) frames, and cameras or wall points seen from them."""

    rows: Rows
    """Rows of the track."""
    at_mm: Matrix
    """Axial coordinates by the track, of the cameras or of wall points."""


@dataclass(frozen=True)
class Bed:
    """Possible error of the distance by wall without the pipe's shape, place by place."""

    distance_mm: Matrix
    """(N,) distances of the track, in rising order."""
    doubt_mm: Matrix
    """(N,) standard uncertainty at these distances, fully correlated; see `bed_mm`."""

    @classmethod
    def of(cls, track: Track) -> Bed:
        """Derive the bed from what a track states."""
        doubt_mm = bed_mm(track)
        if not doubt_mm.any():
            return NO_BED
        order = np.argsort(track.distance_mm, kind="stable")
        return cls(track.distance_mm[order], doubt_mm[order])

    @property
    def is_there(self) -> bool:
        """Whether the track shows a bed."""
        return len(self.distance_mm) > 0

    @property
    def is_partial(self) -> bool:
        """Whether the track shows a bed in some parts only."""
        if not self.is_there:
            return False
        left_mm = self.doubt_mm - self.share * self.distance_mm
        return bool(np.abs(left_mm).max() > _PARTLY * np.abs(self.doubt_mm).max())

    @property
    def share(self) -> float:
        """Relative change of the whole way by the bed, one sigma."""
        if not self.is_there:
            return 0.0
        far = int(np.abs(self.distance_mm).argmax())
        return float(self.doubt_mm[far] / self.distance_mm[far])

    def at(self, at_mm: Matrix) -> Matrix:
        """Interpolate `doubt_mm` to places of the wall."""
        if not self.is_there:
            return np.zeros_like(at_mm)
        return np.asarray(np.interp(at_mm, self.distance_mm, self.doubt_mm))


NO_BED = Bed(np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class Drift:
    """Model of the error of the distance: a random walk, plus an independent part of each frame.

    Registration chains keyframes, so an error stays in all frames after it.  Where the stated
    variance falls again (a lock after a bridged stretch, a way back), the excess has not stayed. So
    frame t shares the smallest variance of the frames from t on, and the rest is independent.

    The scale may change too, as over a bed of silt of varying depth. It belongs to the place on the
    wall, so it is the same on the way back. As a random walk of variance q per mm that starts at
    the zero of the track, it gives the distances u <= v on one side the covariance q (u^2 v / 2 -
    u^3 / 6), the kernel of cubic splines (Wahba 1978). A bed that falls or rises all along adds a
    trend of the scale. Where the track itself shows a bed, and only there, the scale has another
    value.
    """

    shared_mm2: Matrix
    """(N,) variance shared with all later frames; it never falls."""
    own_mm2: Matrix
    """(N,) independent variance of each frame."""
    distance_mm: Matrix
    """(N,) distances of the track."""
    bed: Bed
    """The bed that the track shows."""
    wander: float = 0.0
    """Relative change of the scale over a metre, one sigma."""

    @classmethod
    def of(cls, track: Track) -> Drift:
        """Derive the drift from `sigma_registration_mm`: a constant scale error is no drift."""
        variance = np.square(track.sigma_registration_mm)
        shared = np.minimum.accumulate(variance[::-1])[::-1]
        return cls(shared, variance - shared, track.distance_mm, Bed.of(track))

    def without_bed(self) -> Drift:
        """The same drift without the bed."""
        return replace(self, bed=NO_BED)

    def places(self, rows: Rows) -> Places:
        """Places of the camera in rows of the track."""
        return Places(rows, self.distance_mm[rows])

    def covariance(self, places: Places, others: Places) -> Matrix:
        """(len(places), len(others)) covariance in mm^2."""
        rows, columns = places.rows, others.rows
        found = np.minimum.outer(self.shared_mm2[rows], self.shared_mm2[columns])
        row, column = np.nonzero(np.equal.outer(rows, columns))
        found[row, column] += self.own_mm2[rows[row]]
        if self.changes:
            found += self.wandering(places.at_mm[:, None], others.at_mm)
        return np.asarray(found)

    def variance(self, places: Places) -> Matrix:
        """(N,) variance in mm^2."""
        own = self.shared_mm2[places.rows] + self.own_mm2[places.rows]
        return np.asarray(own + self.wandering(places.at_mm, places.at_mm))

    def between(self, places: Places, others: Places) -> Matrix:
        """(N,) variance of the way from each of `places` to its counterpart in `others`."""
        rows, columns = places.rows, others.rows
        shared = np.abs(self.shared_mm2[rows] - self.shared_mm2[columns])
        own = np.where(rows == columns, 0.0, self.own_mm2[rows] + self.own_mm2[columns])
        here, there = places.at_mm, others.at_mm
        both = self.wandering(here, here) + self.wandering(there, there)
        return np.asarray(shared + own + both - 2 * self.wandering(here, there))

    def wandering(self, here_mm: Matrix, there_mm: Matrix) -> Matrix:
        """Covariance of distances by a changing scale, in mm^2."""
        by_bed = self.bed.at(here_mm) * self.bed.at(there_mm)
        if self.wander == 0:
            return np.asarray(by_bed)
        u, v = np.abs(here_mm), np.abs(there_mm)
        low, high = np.minimum(u, v), np.maximum(u, v)
        same_side = np.sign(here_mm) == np.sign(there_mm)
        together = np.where(same_side, low**2 * high / 2 - low**3 / 6, 0.0)
        trend = TREND**2 * (here_mm * there_mm) ** 2 / 4 / 1000
        walk = self.wander**2 / (1 + TREND**2) / 1000
        return np.asarray(walk * (together + trend) + by_bed)

    @property
    def changes(self) -> bool:
        """Whether the scale may change along the run."""
        return self.wander > 0 or self.bed.is_there


def bed_mm(track: Track) -> Matrix:
    """(N,) standard uncertainty in mm by wall without the pipe's shape, signed like the distance.

    A track contains it beside its registration and its rig's tolerances; frames before a bed
    contain only those two. It grows along the bed only, and stays after its end.
    """
    way_mm = np.abs(track.distance_mm)
    squares = np.square(track.sigma_distance_mm) - np.square(track.sigma_registration_mm)
    gone = way_mm >= _LEAST_WAY_MM
    if not gone.any():
        return np.zeros_like(way_mm)
    own = float((squares[gone] / np.square(way_mm[gone])).min()) * np.square(way_mm)
    beyond = np.where(squares > _CLEARLY * own, squares - own, 0.0)
    if beyond.max() < (_CLEARLY - 1) * own.max():  # nothing that counts in the whole run
        return np.zeros_like(way_mm)
    doubt_mm = np.sqrt(np.maximum(beyond, 0.0)) * np.sign(track.distance_mm)
    return _given_back(doubt_mm, track.distance_mm)


def _given_back(doubt_mm: Matrix, distance_mm: Matrix) -> Matrix:
    """Spread the step at which a bed or its end was detected over the way before it."""
    doubt_mm, steps = doubt_mm.copy(), np.abs(np.diff(doubt_mm))
    ways = np.abs(np.diff(distance_mm))
    growing = steps > _LEAST_RATE * np.maximum(ways, 1e-3)
    if not growing.any():
        return doubt_mm
    usual = float(np.median(steps[growing] / np.maximum(ways[growing], 1e-3)))
    for before in np.flatnonzero(steps > _STEP * usual * np.maximum(ways, 1e-3)).tolist():
        last = before + 1
        way_mm = np.abs(distance_mm[:last] - distance_mm[last])
        far = np.flatnonzero(way_mm > steps[before] / usual)
        first = int(far[-1]) + 1 if far.size else 0
        share = 1 - way_mm[first:] / max(float(way_mm[first:].max()), 1e-9)
        doubt_mm[first:last] += share * (doubt_mm[last] - doubt_mm[before])
    return doubt_mm


def own_scale_sigma(track: Track) -> float:
    """Relative scale uncertainty that a raw track contains beside registration and `bed_mm`."""
    far = int(np.abs(track.distance_mm).argmax())
    own = track.sigma_distance_mm[far] ** 2 - track.sigma_registration_mm[far] ** 2
    if track.distance_mm[far] == 0:
        return 0.0
    own -= bed_mm(track)[far] ** 2
    return float(np.sqrt(max(own, 0.0)) / abs(track.distance_mm[far]))


def row_of(track: Track, frame: int) -> int:
    """Find the row of a frame.

    Raises:
        InvalidCorrection: The track has no such frame.
    """
    row = int(np.searchsorted(track.frame, frame))
    if row == len(track) or track.frame[row] != frame:
        known = f"frames {track.frame[0]} to {track.frame[-1]}" if len(track) else "no frames"
        raise InvalidCorrection(f"There is no frame {frame} in the track; it has {known}.")
    return row
