"""The scale of a finished track from known lengths and joints, without decoding again.

One camera measures lengths in units of its height above the wall.  The true distance is taken as

    D(t) = s d(t) + w(t)

with the distance d of the track, a scale s for the whole run, and a drift w whose covariance the
track states (see `drift`).  A known length between two frames says D(b) - D(a) = L.  The joints of
a pipe say D = P + n L + r at each of them, with an unknown P; segments scatter, so that r is a
random walk too.  Generalised least squares over everything that is known gives s with its
uncertainty and D between the marks with its own (universal kriging, Cressie 1993, section 3.4): at
the end of a taped length the distance is as certain as the tape, and a stretch without a lock takes
up what the joints on either side of it ask for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import assert_never

import numpy as np

from vo_core.drift import Drift, Rows, row_of
from vo_core.errors import InvalidCorrection
from vo_core.height import scale_sigma
from vo_core.joints import Sighting, places_mm
from vo_core.lattice import PRIOR_SCATTER_MM, SCALE_SIGMA, Joint, count_joints, seen_variance
from vo_core.rig import Rig
from vo_core.track import Track
from vo_core.types import Matrix

TAPE_SIGMA_MM = 5.0
"""Of a taped length, one sigma, the choice of the two frames included, unless it is said."""

SEGMENT_SIGMA_MM = 5.0
"""Of the stated length of a segment, one sigma, alike in all of them, unless it is said."""

SCALE_LIMITS = (0.5, 2.0)
"""Beyond them a length is not of the frames that it was given for."""

CONTRADICTION = 3.29
"""Standard deviations between two pieces of evidence that chance exceeds once in a thousand."""

_BLOCK = 4096
"""Rows of a track that are worked out at once, so that an hour of video does not fill memory."""


@dataclass(frozen=True)
class KnownLength:
    """The way of the camera along the axis between two frames, by a tape or by the drawings."""

    first_frame: int
    last_frame: int
    length_mm: float
    sigma_mm: float = TAPE_SIGMA_MM

    def __str__(self) -> str:
        return (
            f"{self.length_mm / 1000:g} m ± {self.sigma_mm:g} mm between frames "
            f"{self.first_frame} and {self.last_frame}"
        )


@dataclass(frozen=True)
class JointSpacing:
    """Joints that were counted, and the length of a segment, joint to joint."""

    joints: tuple[Joint, ...]
    segment_mm: float
    segment_sigma_mm: float = SEGMENT_SIGMA_MM

    def __str__(self) -> str:
        different = {(joint.count, joint.number) for joint in self.joints}
        return f"{len(different)} joints {self.segment_mm:g} mm apart"


@dataclass(frozen=True)
class StatedScale:
    """The scale as it is, with the uncertainty of the rig, see `height.scale_sigma`."""

    sigma: float
    """Relative, one sigma."""

    def __str__(self) -> str:
        return f"the rig, to {100 * self.sigma:.2g} %"


Evidence = KnownLength | JointSpacing | StatedScale


@dataclass(frozen=True)
class Finding:
    """What one piece of evidence says by itself."""

    evidence: Evidence
    scale: float
    sigma: float


@dataclass(frozen=True)
class Residual:
    """What is left of a length or a joint when the track is scaled and nothing else."""

    name: str
    measured_mm: float
    """The length, or the distance of the joint, at the new scale."""
    residual_mm: float
    """Known less measured."""


@dataclass(frozen=True)
class Stretch:
    """A piece of the way with a scale of its own."""

    from_mm: float
    """Corrected distance; `to_mm` is larger."""
    to_mm: float
    scale: float
    sigma: float


@dataclass(frozen=True)
class Correction:
    """A corrected track and how it came about; the raw one is left as it is."""

    track: Track
    scale: float
    """True length over that of the raw track."""
    sigma: float
    """Standard uncertainty of `scale`."""
    findings: tuple[Finding, ...]
    residuals: tuple[Residual, ...]
    scatter_mm: float | None
    """Of single segments about their stated length, one sigma; None without joints."""
    doubts_rig: bool = False
    """The rig's own scale contradicts all else, and was left out."""
    stretches: tuple[Stretch, ...] = ()
    """From joint to joint in the order of the distance, where the scale changes along the run; else
    none."""

    def metadata(self) -> dict[str, str]:
        """For the head of a track file: what was corrected by what."""
        findings = {
            f"scale_by_{number}": f"{found.scale:.6f} ± {found.sigma:.6f} from {found.evidence}"
            for number, found in enumerate(self.findings, 1)
        }
        return {"scale": f"{self.scale:.6f} ± {self.sigma:.6f}", **findings}


def rig_scale(rig: Rig) -> list[StatedScale]:
    """The scale by the tolerances of a rig as evidence; none if it states that it is exact."""
    sigma = scale_sigma(rig)
    return [StatedScale(sigma)] if sigma > 0 else []


def joint_spacing(
    track: Track,
    sightings: Sequence[Sighting],
    segment_mm: float,
    others: Sequence[Evidence] = (),
    *,
    segment_sigma_mm: float = SEGMENT_SIGMA_MM,
) -> JointSpacing:
    """The joints among sightings as evidence; other evidence helps to count them.

    Args:
        track: With which the sightings were made.
        sightings: Of rings that may be joints.
        segment_mm: From joint to joint.
        others: The rig's own scale, taped lengths.
        segment_sigma_mm: Standard uncertainty of `segment_mm`.
    Raises:
        InvalidCorrection: The joints cannot be counted, or the others not be used.
    """
    scale, sigma = 1.0, SCALE_SIGMA
    if others:
        told = correct(track, others)
        scale, sigma = told.scale, told.sigma
    joints = count_joints(track, sightings, segment_mm, scale=scale, scale_sigma=sigma)
    return JointSpacing(tuple(joints), segment_mm, segment_sigma_mm)


def correct(
    track: Track, evidence: Sequence[Evidence], *, zero_frame: int | None = None
) -> Correction:
    """The track at the scale that all the evidence together asks for.

    x, distance and sigma become those of the most likely true way, y takes the scale, all else
    stays.

    Args:
        track: As it was measured.
        evidence: All that is known.
        zero_frame: Where the distance is to be 0, so that sigma is that of the way from there; the
            zero of the track stays without it.
    Raises:
        InvalidCorrection: There is no evidence, a frame that the track has not or in which the wall
            was not recognised, a length that cannot be that of its frames, or a contradiction.
    """
    if not evidence:
        raise InvalidCorrection("Nothing was given to correct the track by.")
    drift = Drift.of(track)
    pieces = [_equations(track, drift, piece) for piece in evidence]
    findings = tuple(
        Finding(piece, *_Solution.of(drift, own).scale)
        for piece, own in zip(evidence, pieces, strict=True)
    )
    _require_agreement(findings)
    solution = _Solution.of(drift, _joined(pieces))
    scale, sigma = solution.scale
    zero = None if zero_frame is None else row_of(track, zero_frame)
    distance_mm, variance_mm2 = solution.distances(track.distance_mm, zero)
    return Correction(
        track=replace(
            track,
            x_mm=distance_mm,
            y_mm=scale * track.y_mm,
            distance_mm=distance_mm,
            sigma_distance_mm=np.sqrt(variance_mm2),
        ),
        scale=scale,
        sigma=sigma,
        findings=findings,
        residuals=tuple(_residuals(evidence, pieces, solution)),
        scatter_mm=next((p.scatter_mm for p in pieces if p.scatter_mm is not None), None),
    )


def zeroed(track: Track, frame: int) -> Track:
    """The same track with its distance counted from a frame, and sigma that of the way from there.

    Raises:
        InvalidCorrection: The track has no such frame.
    """
    row = row_of(track, frame)
    rows = np.arange(len(track))
    return replace(
        track,
        x_mm=track.x_mm - track.x_mm[row],
        distance_mm=track.distance_mm - track.distance_mm[row],
        sigma_distance_mm=np.sqrt(Drift.of(track).between(rows, np.full_like(rows, row))),
    )


def _residuals(
    evidence: Sequence[Evidence], pieces: Sequence[_Equations], solution: _Solution
) -> Iterator[Residual]:
    """Of the lengths and joints, in the order of the evidence."""
    residual = iter(solution.residual)
    for piece, own in zip(evidence, pieces, strict=True):
        names = [str(piece)]
        if isinstance(piece, JointSpacing):
            names = [f"joint {j.number} in frame {j.sighting.frame}" for j in piece.joints]
        for name, slope in zip(names, own.slope, strict=True):
            found = Residual(name, float(solution.scale[0] * slope), float(next(residual)))
            if not isinstance(piece, StatedScale):
                yield found


def _require_agreement(findings: Sequence[Finding]) -> None:
    for one, other in combinations(findings, 2):
        if abs(one.scale - other.scale) > CONTRADICTION * np.hypot(one.sigma, other.sigma):
            raise InvalidCorrection(
                f"Two corrections contradict each other: the scale is {one.scale:.4f} ± "
                f"{one.sigma:.4f} by {one.evidence}, but {other.scale:.4f} ± {other.sigma:.4f} by "
                f"{other.evidence}; one of them is wrong or less certain than stated."
            )


@dataclass(frozen=True)
class _Equations:
    """M linear equations, z = s slope + offsets P + A w + noise."""

    known: Matrix
    """(M,) z in mm."""
    slope: Matrix
    """(M,)"""
    offsets: Matrix
    """(M, K), for K unknown offsets P."""
    rows: Rows
    """(F,) rows of the track whose drift w takes part."""
    drift: Matrix
    """(M, F) A."""
    noise: Matrix
    """(M, M) covariance in mm^2 of the evidence itself."""
    scatter_mm: float | None = None


def _equations(track: Track, drift: Drift, evidence: Evidence) -> _Equations:
    match evidence:
        case KnownLength():
            return _of_length(track, evidence)
        case JointSpacing():
            return _of_joints(track, drift, evidence)
        case StatedScale():
            return _of_rig(evidence)
        case _:
            assert_never(evidence)


def _of_length(track: Track, length: KnownLength) -> _Equations:
    if not (length.length_mm > 0 and length.sigma_mm > 0):
        raise InvalidCorrection(f"A length and its uncertainty must be above 0; found {length}.")
    rows = np.array([row_of(track, frame) for frame in (length.first_frame, length.last_frame)])
    for row in rows:
        if track.status[row] == "lost":
            raise InvalidCorrection(
                f"The wall was not recognised in frame {track.frame[row]}, so that its distance is "
                "not measured; mark a frame beside it."
            )
    way = float(np.diff(track.distance_mm[rows])[0])
    low, high = SCALE_LIMITS
    if not low * abs(way) < length.length_mm < high * abs(way):
        raise InvalidCorrection(
            f"The known length of {length} cannot be right: the track has {abs(way) / 1000:.3f} m "
            "there; check the frames and the length."
        )
    return _Equations(
        known=np.array([length.length_mm]),
        slope=np.array([abs(way)]),
        offsets=np.zeros((1, 0)),
        rows=rows,
        drift=np.sign(way) * np.array([[-1.0, 1.0]]),
        noise=np.array([[length.sigma_mm**2]]),
    )


def _of_joints(track: Track, drift: Drift, spacing: JointSpacing) -> _Equations:
    sightings = [joint.sighting for joint in spacing.joints]
    count = np.array([joint.count for joint in spacing.joints])
    number = np.array([joint.number for joint in spacing.joints])
    # With unknown offsets it does not matter from which joint the segments' errors add up.
    steps = number - np.array([number[count == own].min() for own in count])
    walk = np.minimum.outer(steps, steps) * np.equal.outer(count, count)
    perfect = _Equations(
        known=number * spacing.segment_mm,
        slope=places_mm(track, sightings),
        offsets=np.where(np.equal.outer(count, np.unique(count)), -1.0, 0.0),
        rows=np.array([row_of(track, sighting.frame) for sighting in sightings]),
        drift=np.eye(len(sightings)),
        noise=np.diag(seen_variance(sightings)),
    )
    scatter_mm = _scatter(drift, perfect, walk)
    alike = np.outer(number, number) * spacing.segment_sigma_mm**2
    noise = perfect.noise + scatter_mm**2 * walk + alike
    return replace(perfect, noise=noise, scatter_mm=scatter_mm)


def _scatter(drift: Drift, perfect: _Equations, walk: Matrix) -> float:
    """Scatter of single segments, one sigma in mm, that makes the residuals as large as they are.

    With it the weighted sum of squares is the number of degrees of freedom (Paule & Mandel 1982).
    `PRIOR_SCATTER_MM` counts as one residual more.
    """
    freedom = len(perfect.known) - perfect.offsets.shape[1]  # one more, less the scale

    def excess(scatter_mm: float) -> float:
        noise = perfect.noise + scatter_mm**2 * walk
        solution = _Solution.of(drift, replace(perfect, noise=noise))
        return float(solution.squares + (PRIOR_SCATTER_MM / scatter_mm) ** 2 - freedom)

    low, high = 1e-3, 1e2
    for _ in range(40):  # bisection of its logarithm: the excess falls with the scatter
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    return low


def _of_rig(stated: StatedScale) -> _Equations:
    if not stated.sigma > 0:
        raise InvalidCorrection("The uncertainty of a rig's scale must be above 0.")
    one = np.ones((1, 1))
    none = np.zeros((1, 0))
    return _Equations(one[0], one[0], none, np.zeros(0, np.intp), none, one * stated.sigma**2)


def _joined(pieces: Sequence[_Equations]) -> _Equations:
    """All of them as one; each keeps its own offsets."""
    return _Equations(
        known=np.concatenate([piece.known for piece in pieces]),
        slope=np.concatenate([piece.slope for piece in pieces]),
        offsets=_block_diagonal([piece.offsets for piece in pieces]),
        rows=np.concatenate([piece.rows for piece in pieces]),
        drift=_block_diagonal([piece.drift for piece in pieces]),
        noise=_block_diagonal([piece.noise for piece in pieces]),
    )


def _block_diagonal(blocks: Sequence[Matrix]) -> Matrix:
    ends = np.cumsum([block.shape for block in blocks], axis=0)
    whole = np.zeros(ends[-1])
    for block, (row, column) in zip(blocks, ends - [block.shape for block in blocks], strict=True):
        whole[row : row + block.shape[0], column : column + block.shape[1]] = block
    return whole


@dataclass(frozen=True)
class _Solution:
    """Scale and offsets that fit best, and what they leave."""

    model: Drift
    equations: _Equations
    design: Matrix
    """(M, 1 + K) slope and offsets."""
    weight: Matrix
    """(M, M) inverse of the covariance of z."""
    parameters: Matrix
    """(1 + K,)"""
    covariance: Matrix
    residual: Matrix
    """(M,)"""

    @classmethod
    def of(cls, model: Drift, equations: _Equations) -> _Solution:
        """By generalised least squares (Aitken 1935)."""
        along = model.covariance(equations.rows, equations.rows)
        spread = equations.drift @ along @ equations.drift.T + equations.noise
        design = np.column_stack([equations.slope, equations.offsets])
        weight = np.asarray(np.linalg.inv(spread))
        covariance = np.asarray(np.linalg.inv(design.T @ weight @ design))
        parameters = covariance @ design.T @ weight @ equations.known
        residual = equations.known - design @ parameters
        return cls(model, equations, design, weight, parameters, covariance, residual)

    @property
    def scale(self) -> tuple[float, float]:
        """With its standard uncertainty."""
        return float(self.parameters[0]), float(np.sqrt(self.covariance[0, 0]))

    @property
    def squares(self) -> float:
        """Weighted sum of the squared residuals."""
        return float(self.residual @ self.weight @ self.residual)

    def distances(self, distance_mm: Matrix, zero: int | None) -> tuple[Matrix, Matrix]:
        """The true distance of every row of the track, and its variance in mm^2.

        Args:
            distance_mm: (N,) of the track.
            zero: The row from which the way is counted; None for where the track's distance is 0.
        """
        blocks = np.array_split(np.arange(len(distance_mm)), 1 + len(distance_mm) // _BLOCK)
        found = [self._distances(rows, distance_mm, zero) for rows in blocks]
        mean, variance = (np.concatenate(part) for part in zip(*found, strict=True))
        return mean, variance

    def _distances(
        self, rows: Rows, distance_mm: Matrix, zero: int | None
    ) -> tuple[Matrix, Matrix]:
        common = self._common(rows)
        way_mm = distance_mm[rows]
        prior = self.model.shared_mm2[rows] + self.model.own_mm2[rows]
        if zero is not None:
            common = common - self._common(np.array([zero]))
            way_mm = way_mm - distance_mm[zero]
            prior = self.model.between(rows, np.full_like(rows, zero))
        gain = common @ self.weight
        mean = self.parameters[0] * way_mm + gain @ self.residual
        slope = -gain @ self.design
        slope[:, 0] += way_mm
        variance = (
            prior
            - np.einsum("nm,nm->n", gain, common)
            + np.einsum("np,pq,nq->n", slope, self.covariance, slope)
        )
        return mean, np.maximum(variance, 0.0)  # rounding may take it below

    def _common(self, rows: Rows) -> Matrix:
        """(len(rows), M) covariance of the drift of the rows with the equations."""
        return np.asarray(self.model.covariance(rows, self.equations.rows) @ self.equations.drift.T)
