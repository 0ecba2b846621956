"""Distances by generalised least squares, from linear equations in a scale and a drift.

With the distance d of a track the true distance is D = s d + w, with a scale s and a drift w of
known covariance (see `drift`). Equations in D determine s and D with their uncertainties (universal
kriging, Cressie 1993, section 3.4), and each uncertainty can be split into its sources.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from vo_core.drift import Drift, Places, Rows
from vo_core.types import Matrix

Source = Literal["tracking", "wander", "joints", "segment", "tape", "rig"]
"""Source of an error: registration and bridging; a scale that changes along the run, as on a bed;
positions of joints and single segments; the stated length of all segments; taped lengths; the
rig."""

_BLOCK = 4096
"""Rows of a track that are computed at once, which bounds the memory for an hour of video."""

_KNOTS = 8192
"""Longer tracks are solved at about so many rows, or twice as many beside steps."""


@dataclass(frozen=True)
class Equations:
    """M linear equations, z = s slope + offsets P + A w + noise."""

    known: Matrix
    """(M,) z in mm."""
    slope: Matrix
    """(M,) factor of the scale."""
    offsets: Matrix
    """(M, K) factors of K unknown offsets P."""
    places: Places
    """(F,) places whose drift w takes part."""
    drift: Matrix
    """(M, F) A, the factors of the drift."""
    noise: Mapping[Source, Matrix] = field(default_factory=dict)
    """(M, M) covariances of the evidence itself in mm^2, by source."""

    def with_noise(self, noise: Mapping[Source, Matrix]) -> Equations:
        """Add noise of further sources."""
        return replace(self, noise={**self.noise, **noise})


def joined(pieces: Sequence[Equations]) -> Equations:
    """Join several sets of equations; each keeps its own offsets."""
    sources = {source for piece in pieces for source in piece.noise}
    return Equations(
        known=np.concatenate([piece.known for piece in pieces]),
        slope=np.concatenate([piece.slope for piece in pieces]),
        offsets=_block_diagonal([piece.offsets for piece in pieces]),
        places=Places(
            np.concatenate([piece.places.rows for piece in pieces]),
            np.concatenate([piece.places.at_mm for piece in pieces]),
        ),
        drift=_block_diagonal([piece.drift for piece in pieces]),
        noise={
            source: _block_diagonal(
                [
                    piece.noise.get(source, np.zeros((len(piece.known), len(piece.known))))
                    for piece in pieces
                ]
            )
            for source in sources
        },
    )


def _block_diagonal(blocks: Sequence[Matrix]) -> Matrix:
    ends = np.cumsum([block.shape for block in blocks], axis=0)
    whole = np.zeros(ends[-1])
    for block, (row, column) in zip(blocks, ends - [block.shape for block in blocks], strict=True):
        whole[row : row + block.shape[0], column : column + block.shape[1]] = block
    return whole


@dataclass(frozen=True)
class Solution:
    """Scale and offsets that fit best, with their residuals."""

    model: Drift
    equations: Equations
    design: Matrix
    """(M, 1 + K) slope and offsets."""
    weight: Matrix
    """(M, M) inverse of the covariance of z."""
    parameters: Matrix
    """(1 + K,) scale and offsets."""
    covariance: Matrix
    residual: Matrix
    """(M,)"""
    log_likelihood: float
    """Restricted likelihood (Patterson & Thompson 1971), to compare models of equal equations."""

    @classmethod
    def of(cls, model: Drift, equations: Equations) -> Solution:
        """Solve the equations by generalised least squares (Aitken 1935)."""
        along = model.covariance(equations.places, equations.places)
        spread = equations.drift @ along @ equations.drift.T + sum(equations.noise.values())
        design = np.column_stack([equations.slope, equations.offsets])
        weight = np.asarray(np.linalg.inv(spread))
        information = design.T @ weight @ design
        covariance = np.asarray(np.linalg.inv(information))
        parameters = covariance @ design.T @ weight @ equations.known
        residual = equations.known - design @ parameters
        determinants = np.linalg.slogdet(spread)[1] + np.linalg.slogdet(information)[1]
        likelihood = -float(determinants + residual @ weight @ residual) / 2
        return cls(model, equations, design, weight, parameters, covariance, residual, likelihood)

    @property
    def scale(self) -> tuple[float, float]:
        """Scale at the zero of the track, with its standard uncertainty."""
        return float(self.parameters[0]), float(np.sqrt(self.covariance[0, 0]))

    @property
    def squares(self) -> float:
        """Weighted sum of the squared residuals."""
        return float(self.residual @ self.weight @ self.residual)

    @property
    def wandered_mm(self) -> Matrix:
        """(M,) part of the residuals that a scale changing along the run explains."""
        at_mm, drift = self.equations.places.at_mm, self.equations.drift
        common = drift @ self.model.wandering(at_mm[:, None], at_mm) @ drift.T
        return np.asarray(common @ self.weight @ self.residual)

    def scale_between(self, first: int, last: int) -> tuple[float, float]:
        """Mean scale from one row of the track to another, with its standard uncertainty."""
        way_mm = float(self.model.distance_mm[last] - self.model.distance_mm[first])
        mean, variance = self._distances(np.array([last]), first)
        return float(mean[0] / way_mm), float(np.sqrt(variance[0]) / abs(way_mm))

    def distances(self, zero: int | None) -> tuple[Matrix, Matrix]:
        """Estimate the true distance of every row of the track, and its variance in mm^2.

        A long track is solved at some rows, its knots; between two of them the drift and its
        variance are interpolated, beside the independent variance of each row.

        Args:
            zero: The row from which distances are counted; None for the zero of the track.
        """
        model, knots = self.model, self._knots(zero)
        blocks = np.array_split(knots, 1 + len(knots) // _BLOCK)
        found = [self._distances(block, zero) for block in blocks]
        mean, variance = (np.concatenate(part) for part in zip(*found, strict=True))
        if len(knots) == len(model.distance_mm):
            return mean, variance
        along, way_mm = _progress(model), self.parameters[0] * model.distance_mm
        mean = way_mm + np.interp(along, along[knots], mean - way_mm[knots])
        shared = np.interp(along, along[knots], variance - model.own_mm2[knots])
        # Rounding leaves up to 1e-3 mm^2 too little where a row is as certain as the zero.
        return mean, np.maximum(shared + model.own_mm2, 0.0)

    def _knots(self, zero: int | None) -> Rows:
        """Rows to solve at: all of a short track, of a long one where the drift has moved on."""
        rows = np.arange(len(self.model.distance_mm))
        if len(rows) <= _KNOTS:
            return rows
        along = _progress(self.model)
        evenly = np.searchsorted(along, np.linspace(0.0, along[-1], _KNOTS))
        exact = np.concatenate([self.equations.places.rows, [0 if zero is None else zero]])
        # A step of the variance lies between two knots; where a row takes part in the equations,
        # its own error counts in another way than in the rows beside it.
        knots = np.concatenate([evenly, evenly - 1, exact - 1, exact, exact + 1])
        return np.unique(np.clip(knots, 0, rows[-1]))

    def parts(self, row: int, zero: int | None) -> dict[Source, float]:
        """Split the standard uncertainty of the distance of one row by source, in mm."""
        rows = np.array([row])
        along = self._along(rows, zero)
        slope, variance = self._slope(rows, zero, along), self._variance(rows, zero, along)
        # The distance is this linear combination of the known values, and so is its error.
        gain = along @ self._informed
        combined = (slope @ self.covariance @ self.design.T @ self.weight + gain)[0]
        found: dict[Source, float] = {
            source: float(combined @ noise @ combined)
            for source, noise in self.equations.noise.items()
        }
        found["wander"] = self._of_wander(rows, zero, combined)
        found["tracking"] = float(variance[0]) - sum(found.values())
        return {source: float(np.sqrt(max(square, 0.0))) for source, square in found.items()}

    def _of_wander(self, rows: Rows, zero: int | None, combined: Matrix) -> float:
        """Variance of a distance that a changing scale leaves after the equations."""
        ends_mm = self.model.distance_mm[[*rows, *([] if zero is None else [zero])]]
        at_mm = np.concatenate([ends_mm, self.equations.places.at_mm])
        share = np.concatenate([[1.0, -1.0][: len(ends_mm)], -combined @ self.equations.drift])
        return float(share @ self.model.wandering(at_mm[:, None], at_mm) @ share)

    def _distances(self, rows: Rows, zero: int | None) -> tuple[Matrix, Matrix]:
        along = self._along(rows, zero)
        mean = self.parameters[0] * self._way_mm(rows, zero) + along @ self._to_drift
        return mean, self._variance(rows, zero, along)

    def _variance(self, rows: Rows, zero: int | None, along: Matrix) -> Matrix:
        """(N,) variance of distances in mm^2, from `_along` and `_slope`."""
        model, slope = self.model, self._slope(rows, zero, along)
        places = model.places(rows)
        if zero is None:
            prior = model.variance(places)
        else:
            prior = model.between(places, model.places(np.full_like(rows, zero)))
        known = np.einsum("nf,nf->n", along @ self._known, along)
        unknown = np.einsum("np,pq,nq->n", slope, self.covariance, slope)
        # Rounding may take it below 0.
        return np.asarray(np.maximum(prior - known + unknown, 0.0))

    def _slope(self, rows: Rows, zero: int | None, along: Matrix) -> Matrix:
        """(N, 1 + K) factors of the parameters in the errors of distances."""
        slope = -along @ self._to_slope
        slope[:, 0] += self._way_mm(rows, zero)
        return np.asarray(slope)

    @cached_property
    def _informed(self) -> Matrix:
        """(F, M) factors of the equations in the drift at their places."""
        return np.asarray(self.equations.drift.T @ self.weight)

    @cached_property
    def _to_slope(self) -> Matrix:
        """(F, 1 + K)"""
        return np.asarray(self._informed @ self.design)

    @cached_property
    def _to_drift(self) -> Matrix:
        """(F,)"""
        return np.asarray(self._informed @ self.residual)

    @cached_property
    def _known(self) -> Matrix:
        """(F, F) inverse covariance that the equations add to the drift at their places."""
        return np.asarray(self._informed @ self.equations.drift)

    def _way_mm(self, rows: Rows, zero: int | None) -> Matrix:
        """(N,) way by the track."""
        distance_mm = self.model.distance_mm
        return np.asarray(distance_mm[rows] - (0.0 if zero is None else distance_mm[zero]))

    def _along(self, rows: Rows, zero: int | None) -> Matrix:
        """(N, F) covariance of the drift over the ways with that at the equations' places."""
        model, places = self.model, self.equations.places
        along = model.covariance(model.places(rows), places)
        if zero is not None:
            along -= model.covariance(model.places(np.array([zero])), places)
        return np.asarray(along)


def _progress(model: Drift) -> Matrix:
    """(N,) how far the drift can have moved on, rising from row to row, 3 at the end.

    By the variance of the walk, by the way, and by the time.
    """
    moved_mm = np.abs(np.diff(model.distance_mm, prepend=model.distance_mm[:1]))
    parts = (model.shared_mm2 - model.shared_mm2[0], np.cumsum(moved_mm))
    rows = np.arange(len(moved_mm))
    return np.asarray(sum((part / max(part[-1], 1e-9) for part in parts), rows / rows[-1]))
