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


@dataclass(frozen=True)
class Drift:
    """The error of the distance as a random walk, with what single frames add of their own.

    Registration chains keyframes, so that an error stays in all frames after it.  But where the
    stated variance falls again (a lock after a bridged stretch, a way back), what was there too
    much cannot have stayed.  So frame t shares the smallest variance of the frames from t on, and
    the rest is its own.
    """

    shared_mm2: Matrix
    """(N,), never falling."""
    own_mm2: Matrix
    """(N,)"""

    @classmethod
    def of(cls, track: Track) -> Drift:
        """From `sigma_registration_mm`: a wrong scale is no drift."""
        variance = np.square(track.sigma_registration_mm)
        shared = np.minimum.accumulate(variance[::-1])[::-1]
        return cls(shared, variance - shared)

    def covariance(self, rows: Rows, others: Rows) -> Matrix:
        """(len(rows), len(others)) in mm^2."""
        shared = np.minimum.outer(self.shared_mm2[rows], self.shared_mm2[others])
        return np.asarray(shared + np.equal.outer(rows, others) * self.own_mm2[rows][:, None])

    def between(self, rows: Rows, others: Rows) -> Matrix:
        """(N,) variance of the distance from each of `rows` to the one of `others`."""
        shared = np.abs(self.shared_mm2[rows] - self.shared_mm2[others])
        own = np.where(rows == others, 0.0, self.own_mm2[rows] + self.own_mm2[others])
        return np.asarray(shared + own)


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
