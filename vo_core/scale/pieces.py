"""Turns each piece of evidence into linear equations in the distance (see `kriging`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import assert_never

import numpy as np

from vo_core.drift import Drift, Places, row_of
from vo_core.errors import InvalidCorrection
from vo_core.joints.sightings import places_mm, seen_variance
from vo_core.scale.evidence import (
    CrestSpacing,
    Evidence,
    JointSpacing,
    KnownLength,
    StatedScale,
)
from vo_core.scale.kriging import Equations, Solution
from vo_core.track import Track

SCALE_LIMITS = (0.5, 2.0)
"""A length that implies a scale outside these limits does not belong to its frames."""

WANDER = 0.015
"""Relative change of the scale over a metre, one sigma, where the rig is doubted: a bed of silt is
seldom even. Joints replace this prior by their own value."""

UNEVEN = 2.0
"""Scatter of segments over the usual one beyond which a changing scale is as likely a cause."""

_ROOT = 1e-6
"""The estimate of a spread makes the sum of squares right to this share."""

CHANGE = 2.0
"""Prior log odds that the scale is constant rather than changing along the run."""


@dataclass(frozen=True, eq=False)
class Piece:
    """One piece of evidence as equations."""

    evidence: Evidence
    equations: Equations
    scatter_mm: float | None = None
    """Scatter of single segments, one sigma; None without joints and crests."""
    wander: float = 0.0
    """Change of the scale that the joints require, see `Drift.wander`."""
    may_wander: float = WANDER
    """The same if other evidence implies a changing scale."""
    log_likelihood: float = 0.0
    """Log likelihood of joints under the drift of their solution."""


def piece_of(track: Track, drift: Drift, evidence: Evidence) -> Piece:
    """Build the equations of one piece of evidence.

    Raises:
        InvalidCorrection: The evidence does not fit the track.
    """
    match evidence:
        case KnownLength():
            return Piece(evidence, _of_length(track, drift, evidence))
        case JointSpacing() | CrestSpacing():
            return _of_places(track, drift, evidence)
        case StatedScale():
            return Piece(evidence, _of_rig(evidence))
        case _:
            assert_never(evidence)


def _of_length(track: Track, drift: Drift, length: KnownLength) -> Equations:
    if not (length.length_mm > 0 and length.sigma_mm > 0):
        raise InvalidCorrection(f"A length and its uncertainty must be above 0; found {length}.")
    rows = np.array([row_of(track, frame) for frame in (length.first_frame, length.last_frame)])
    for row in rows:
        if track.status[row] == "lost":
            raise InvalidCorrection(
                f"The wall was not recognised in frame {track.frame[row]}, so that its distance is "
                "not measured; mark a frame beside it.",
                "length_lost",
                frame=int(track.frame[row]),
            )
    way = float(np.diff(track.distance_mm[rows])[0])
    low, high = SCALE_LIMITS
    if not low * abs(way) < length.length_mm < high * abs(way):
        raise InvalidCorrection(
            f"The known length of {length} cannot be right: the track has {abs(way) / 1000:.3f} m "
            "there; check the frames and the length.",
            "impossible_length",
            length_m=length.length_mm / 1000,
            measured_m=abs(way) / 1000,
        )
    return Equations(
        known=np.array([length.length_mm]),
        slope=np.array([abs(way)]),
        offsets=np.zeros((1, 0)),
        places=drift.places(rows),
        drift=np.sign(way) * np.array([[-1.0, 1.0]]),
        noise={"tape": np.array([[length.sigma_mm**2]])},
    )


def _of_places(track: Track, drift: Drift, spacing: JointSpacing | CrestSpacing) -> Piece:
    """Explain the residuals by segments that differ or by a changing scale, as is likelier."""
    sightings, prior_mm = [joint.sighting for joint in spacing.joints], spacing.scatter_mm
    count = np.array([joint.count for joint in spacing.joints])
    number = np.array([joint.number for joint in spacing.joints])
    # As offsets are unknown, errors of segments may add up from any joint.
    steps = number - np.array([number[count == own].min() for own in count])
    walk = np.minimum.outer(steps, steps) * np.equal.outer(count, count)
    rows = np.array([row_of(track, sighting.frame) for sighting in sightings])
    at_mm, seen = places_mm(track, sightings), np.diag(seen_variance(sightings))
    perfect = Equations(
        known=number * spacing.segment_mm,
        slope=at_mm,
        offsets=np.where(np.equal.outer(count, np.unique(count)), -1.0, 0.0),
        places=Places(rows, at_mm),
        drift=np.eye(len(sightings)),
    )

    def scattered(scatter_mm: float) -> Equations:
        return perfect.with_noise({"joints": seen + scatter_mm**2 * walk})

    def constant(scatter_mm: float) -> Solution:
        return Solution.of(drift, scattered(scatter_mm))

    def changing(wander: float) -> Solution:
        return Solution.of(replace(drift, wander=wander), scattered(prior_mm))

    scatter_mm = _spread(constant, prior_mm)
    wander = _spread(changing, WANDER)
    even = constant(scatter_mm).log_likelihood - (scatter_mm / (UNEVEN * prior_mm)) ** 2 / 2
    uneven = changing(wander).log_likelihood - CHANGE
    changes = uneven > even
    if changes:
        scatter_mm = prior_mm
    alike = np.outer(number, number) * spacing.segment_sigma_mm**2
    return Piece(
        spacing,
        scattered(scatter_mm).with_noise({"segment": alike}),
        scatter_mm,
        wander=wander if changes else 0.0,
        may_wander=wander,
        log_likelihood=max(even, uneven),
    )


def _spread(solve: Callable[[float], Solution], prior: float) -> float:
    """Estimate a standard deviation of the model from the size of the residuals.

    It makes the weighted sum of squares equal the degrees of freedom (Paule & Mandel 1982).  The
    prior value counts as one more residual.
    """

    def excess(log_spread: float) -> float:
        spread = float(np.exp(log_spread))
        solution = solve(spread)
        rows, unknown = solution.design.shape
        squares = solution.squares + (prior / spread) ** 2
        return float(np.log(squares / (rows - unknown + 1)))

    return float(np.exp(_root(excess, np.log(prior / 1e3), np.log(prior * 1e2))))


def _root(falling: Callable[[float], float], low: float, high: float) -> float:
    """Find where a function that falls is zero, else the nearer end: regula falsi (Illinois)."""
    above, below = falling(low), falling(high)
    if above <= 0 or below >= 0:
        return low if above <= 0 else high
    stayed = 0  # 1 while the high end stays, -1 while the low one does
    for _ in range(40):
        middle = (low * below - high * above) / (below - above)
        value = falling(middle)
        if abs(value) < _ROOT:
            break
        # The value of an end that stays twice is halved, so that both ends move.
        if value > 0:
            low, above, below = middle, value, below / 2 if stayed == 1 else below
            stayed = 1
        else:
            high, below, above = middle, value, above / 2 if stayed == -1 else above
            stayed = -1
    return middle


def _of_rig(stated: StatedScale) -> Equations:
    if not stated.sigma > 0:
        raise InvalidCorrection("The uncertainty of a rig's scale must be above 0.")
    one = np.ones((1, 1))
    return Equations(
        known=one[0],
        slope=one[0],
        offsets=np.zeros((1, 0)),
        places=Places(np.zeros(0, np.intp), np.zeros(0)),
        drift=np.zeros((1, 0)),
        noise={"rig": one * stated.sigma**2},
    )
