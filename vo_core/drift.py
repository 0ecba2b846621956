"""How the errors of the frames of a track go together, from the variances that it states."""

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
"""Change of the scale over the first metre by a trend, over that by the random walk: beds are laid
by water and change little from one metre to the next."""

_PARTLY = 0.1
"""Of the most that a bed may have done, from which it is not alike all along."""

_STEP = 5.0
"""Times what a track's doubt grows by on a bed, from which it is what came in one step."""

_LEAST_RATE = 0.01
"""What the doubt grows by on a bed, over the way, at least."""

_LEAST_WAY_MM = 1.0
"""From which the tolerances of a rig show in what a track states, written to four digits."""

_CLEARLY = 1.2
"""Times the variance by the tolerances, from which there is something beside them."""


@dataclass(frozen=True)
class Places:
    """Where distances are asked for: (N,) frames, and wall points that they see."""

    rows: Rows
    """Of the track."""
    at_mm: Matrix
    """Axial coordinates by the track: of the cameras, or of what they see."""


@dataclass(frozen=True)
class Bed:
    """What wall that has not the pipe's shape may have done to the distance, place by place."""

    distance_mm: Matrix
    """(N,) of the track, rising."""
    doubt_mm: Matrix
    """(N,) one standard uncertainty there, alike all along; see `bed_mm`."""

    @classmethod
    def of(cls, track: Track) -> Bed:
        """As the track states it."""
        doubt_mm = bed_mm(track)
        if not doubt_mm.any():
            return NO_BED
        order = np.argsort(track.distance_mm, kind="stable")
        return cls(track.distance_mm[order], doubt_mm[order])

    @property
    def is_there(self) -> bool:
        """Whether the track shows any."""
        return len(self.distance_mm) > 0

    @property
    def is_partial(self) -> bool:
        """Whether the track shows one here and none there."""
        if not self.is_there:
            return False
        left_mm = self.doubt_mm - self.share * self.distance_mm
        return bool(np.abs(left_mm).max() > _PARTLY * np.abs(self.doubt_mm).max())

    @property
    def share(self) -> float:
        """Of the whole way that it may have changed, one sigma."""
        if not self.is_there:
            return 0.0
        far = int(np.abs(self.distance_mm).argmax())
        return float(self.doubt_mm[far] / self.distance_mm[far])

    def at(self, at_mm: Matrix) -> Matrix:
        """The doubt in mm at places of the wall."""
        if not self.is_there:
            return np.zeros_like(at_mm)
        return np.asarray(np.interp(at_mm, self.distance_mm, self.doubt_mm))


NO_BED = Bed(np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class Drift:
    """The error of the distance as a random walk, with what single frames add of their own.

    Registration chains keyframes, so that an error stays in all frames after it.  But where the
    stated variance falls again (a lock after a bridged stretch, a way back), what was there too
    much cannot have stayed.  So frame t shares the smallest variance of the frames from t on, and
    the rest is its own.

    The scale may wander too, as over a bed of silt of changing depth.  It belongs to the place on
    the wall, so that it is the same on the way back; as a random walk of variance q per mm that is
    0 at the zero of the track it takes the distances u <= v to one side of it together by
    q (u^2 v / 2 - u^3 / 6), the kernel of cubic splines (Wahba 1978).  A bed that falls or rises
    all along adds a trend of the scale.  Where the track itself shows a bed, the scale has another
    value there, and only there.
    """

    shared_mm2: Matrix
    """(N,), never falling."""
    own_mm2: Matrix
    """(N,)"""
    distance_mm: Matrix
    """(N,) of the track."""
    bed: Bed
    """That the track shows."""
    wander: float = 0.0
    """By how much the scale changes over a metre, relative, one sigma."""

    @classmethod
    def of(cls, track: Track) -> Drift:
        """From `sigma_registration_mm`: a scale that is wrong all along is no drift."""
        variance = np.square(track.sigma_registration_mm)
        shared = np.minimum.accumulate(variance[::-1])[::-1]
        return cls(shared, variance - shared, track.distance_mm, Bed.of(track))

    def without_bed(self) -> Drift:
        """The same of a track that shows no bed."""
        return replace(self, bed=NO_BED)

    def places(self, rows: Rows) -> Places:
        """Of the camera in rows of the track."""
        return Places(rows, self.distance_mm[rows])

    def covariance(self, places: Places, others: Places) -> Matrix:
        """(len(places), len(others)) in mm^2."""
        rows, columns = places.rows, others.rows
        shared = np.minimum.outer(self.shared_mm2[rows], self.shared_mm2[columns])
        own = np.equal.outer(rows, columns) * self.own_mm2[rows][:, None]
        return np.asarray(shared + own + self.wandering(places.at_mm[:, None], others.at_mm))

    def variance(self, places: Places) -> Matrix:
        """(N,) in mm^2."""
        own = self.shared_mm2[places.rows] + self.own_mm2[places.rows]
        return np.asarray(own + self.wandering(places.at_mm, places.at_mm))

    def between(self, places: Places, others: Places) -> Matrix:
        """(N,) variance of the way from each of `places` to the one of `others`."""
        rows, columns = places.rows, others.rows
        shared = np.abs(self.shared_mm2[rows] - self.shared_mm2[columns])
        own = np.where(rows == columns, 0.0, self.own_mm2[rows] + self.own_mm2[columns])
        here, there = places.at_mm, others.at_mm
        both = self.wandering(here, here) + self.wandering(there, there)
        return np.asarray(shared + own + both - 2 * self.wandering(here, there))

    def wandering(self, here_mm: Matrix, there_mm: Matrix) -> Matrix:
        """Covariance in mm^2 of distances, as far as it comes from a scale that wanders."""
        u, v = np.abs(here_mm), np.abs(there_mm)
        low, high = np.minimum(u, v), np.maximum(u, v)
        same_side = np.sign(here_mm) == np.sign(there_mm)
        together = np.where(same_side, low**2 * high / 2 - low**3 / 6, 0.0)
        trend = TREND**2 * (here_mm * there_mm) ** 2 / 4 / 1000
        walk = self.wander**2 / (1 + TREND**2) / 1000
        return np.asarray(walk * (together + trend) + self.bed.at(here_mm) * self.bed.at(there_mm))

    @property
    def changes(self) -> bool:
        """Whether the scale may be another one at another place."""
        return self.wander > 0 or self.bed.is_there


def bed_mm(track: Track) -> Matrix:
    """(N,) standard uncertainty in mm by wall that has not the pipe's shape, signed as distance.

    A track states it beside its registration and its rig's tolerances, which alone are in the
    frames before a bed is noticed.  It grows along the bed only, and stays behind it.
    """
    way_mm = np.abs(track.distance_mm)
    squares = np.square(track.sigma_distance_mm) - np.square(track.sigma_registration_mm)
    gone = way_mm >= _LEAST_WAY_MM
    if not gone.any():
        return np.zeros_like(way_mm)
    own = float((squares[gone] / np.square(way_mm[gone])).min()) * np.square(way_mm)
    beyond = np.where(squares > _CLEARLY * own, squares - own, 0.0)
    doubt_mm = np.sqrt(np.maximum(beyond, 0.0)) * np.sign(track.distance_mm)
    return _given_back(doubt_mm, track.distance_mm)


def _given_back(doubt_mm: Matrix, distance_mm: Matrix) -> Matrix:
    """What came in one step when a bed, or its end, was noticed, along the way before."""
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
    """Relative, by what a raw track states beside its registration and `bed_mm`."""
    far = int(np.abs(track.distance_mm).argmax())
    own = track.sigma_distance_mm[far] ** 2 - track.sigma_registration_mm[far] ** 2
    if track.distance_mm[far] == 0:
        return 0.0
    own -= bed_mm(track)[far] ** 2
    return float(np.sqrt(max(own, 0.0)) / abs(track.distance_mm[far]))


def row_of(track: Track, frame: int) -> int:
    """The row of a frame.

    Raises:
        InvalidCorrection: The track has no such frame.
    """
    row = int(np.searchsorted(track.frame, frame))
    if row == len(track) or track.frame[row] != frame:
        known = f"frames {track.frame[0]} to {track.frame[-1]}" if len(track) else "no frames"
        raise InvalidCorrection(f"There is no frame {frame} in the track; it has {known}.")
    return row
