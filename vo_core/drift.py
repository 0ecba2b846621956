"""How the errors of the frames of a track go together, from the variances that it states."""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True)
class Places:
    """Where distances are asked for: (N,) frames, and wall points that they see."""

    rows: Rows
    """Of the track."""
    at_mm: Matrix
    """Axial coordinates by the track: of the cameras, or of what they see."""


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
    all along adds a trend of the scale.
    """

    shared_mm2: Matrix
    """(N,), never falling."""
    own_mm2: Matrix
    """(N,)"""
    distance_mm: Matrix
    """(N,) of the track."""
    wander: float = 0.0
    """By how much the scale changes over a metre, relative, one sigma."""

    @classmethod
    def of(cls, track: Track) -> Drift:
        """From `sigma_registration_mm`: a scale that is wrong all along is no drift."""
        variance = np.square(track.sigma_registration_mm)
        shared = np.minimum.accumulate(variance[::-1])[::-1]
        return cls(shared, variance - shared, track.distance_mm)

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
        return np.asarray(self.wander**2 / 1000 * (together + trend))


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
