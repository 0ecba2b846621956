"""The scale of a finished track from known lengths and joints, without decoding again.

One camera measures lengths in units of its height above the wall.  The true distance is taken as

    D(t) = s d(t) + w(t)

with the distance d of the track, a scale s for the whole run, and a drift w whose covariance the
track states (see `drift`).  A known length between two frames says D(b) - D(a) = L.  The joints of
a pipe say D = P + n L + r at each of them, with an unknown P; segments scatter, so that r is a
random walk too, and all are longer or shorter than stated by the same.  Least squares over all that
is known (see `kriging`) give s with its uncertainty and D between the marks with its own: at the
end of a taped length the distance is as certain as the tape, and a stretch without a lock takes up
what the joints on either side of it ask for.  Where joints ask for more than segments can scatter,
the scale wanders along the run, as over silt of changing depth.

What a rig states is no measurement of the run.  Where it contradicts lengths or joints it is
doubted and left out, and beside joints it only helps to count them; measurements that contradict
each other are refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import assert_never

import numpy as np

from vo_core.drift import Drift, Places, own_scale_sigma, row_of
from vo_core.errors import InvalidCorrection
from vo_core.geometry.height import scale_sigma
from vo_core.joints.finder import Sighting, places_mm
from vo_core.joints.lattice import (
    PRIOR_SCATTER_MM,
    SCALE_SIGMA,
    SCATTER_MM,
    Joint,
    count_joints,
    seen_variance,
)
from vo_core.rig import Rig
from vo_core.scale.kriging import Equations, Solution, Source, joined
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

DOUBT = 2.58
"""The same of a rig's own scale against all else, once in a hundred: then the rig is wrong."""

WANDER = 0.015
"""By how much the scale changes over a metre, relative, one sigma, where the rig is doubted, before
the joints say it: a bed of silt is seldom even."""

CHANGE = 2.0
"""Log odds that a scale is constant rather than wandering, before anything is seen."""


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
        stretches = {
            f"scale_{stretch.from_mm / 1000:.3f}_to_{stretch.to_mm / 1000:.3f}_m": (
                f"{stretch.scale:.6f} ± {stretch.sigma:.6f}"
            )
            for stretch in self.stretches
        }
        doubt = {"rig_doubted": "its own scale was left out"} if self.doubts_rig else {}
        return {"scale": f"{self.scale:.6f} ± {self.sigma:.6f}", **findings, **stretches, **doubt}


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
        scale, sigma = _mean_scale(_solve(track, others).solution)
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
    solved = _solve(track, evidence)
    zero = None if zero_frame is None else row_of(track, zero_frame)
    distance_mm, variance_mm2 = solved.solution.distances(zero)
    scale, sigma = _mean_scale(solved.solution)
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
        findings=solved.findings,
        residuals=tuple(_residuals(solved)),
        scatter_mm=next((p.scatter_mm for p in solved.pieces if p.scatter_mm is not None), None),
        doubts_rig=solved.doubts_rig,
        stretches=tuple(_stretches(solved, distance_mm)) if solved.changes else (),
    )


def sigma_parts(
    track: Track, evidence: Sequence[Evidence], frame: int, *, zero_frame: int | None = None
) -> Mapping[Source, float]:
    """What the uncertainty of a distance of `correct` is made of: mm, they add in quadrature.

    Raises:
        InvalidCorrection: As `correct` does.
    """
    zero = None if zero_frame is None else row_of(track, zero_frame)
    return _solve(track, evidence).solution.parts(row_of(track, frame), zero)


def zeroed(track: Track, frame: int) -> Track:
    """A raw track with its distance counted from a frame, and sigma that of the way from there.

    Raises:
        InvalidCorrection: The track has no such frame.
    """
    row = row_of(track, frame)
    drift, rows = Drift.of(track), np.arange(len(track))
    way_mm = track.distance_mm - track.distance_mm[row]
    walked = drift.between(drift.places(rows), drift.places(np.full_like(rows, row)))
    return replace(
        track,
        x_mm=track.x_mm - track.x_mm[row],
        distance_mm=way_mm,
        sigma_distance_mm=np.hypot(np.sqrt(walked), own_scale_sigma(track) * way_mm),
    )


@dataclass(frozen=True, eq=False)
class _Piece:
    """One piece of evidence as equations."""

    evidence: Evidence
    equations: Equations
    scatter_mm: float | None = None
    """Of single segments, one sigma; None without joints."""
    wander: float = 0.0
    """How the scale wanders, as far as the joints ask for it: see `Drift.wander`."""
    may_wander: float = WANDER
    """The same where something else speaks for a scale that changes."""
    log_likelihood: float = 0.0
    """Of joints, by the drift that they were solved with."""


@dataclass(frozen=True)
class _Solved:
    """The evidence that was used, and what follows from it."""

    pieces: tuple[_Piece, ...]
    solution: Solution
    findings: tuple[Finding, ...]
    doubts_rig: bool
    changes: bool
    """The scale changes along the run: the joints ask for it, or the track shows a bed in parts."""


def _solve(track: Track, evidence: Sequence[Evidence]) -> _Solved:
    """All the evidence together, unless it contradicts itself.

    A rig is no measurement of this run: where it contradicts all else it is doubted.  Beside joints
    it is left out: it helped to count them, and would bring back some of its own error.
    """
    if not evidence:
        raise InvalidCorrection("Nothing was given to correct the track by.")
    drift, pieces = _by_the_likelier_bed(track, evidence)
    measured = tuple(p for p in pieces if not isinstance(p.evidence, StatedScale))
    stated = tuple(p for p in pieces if isinstance(p.evidence, StatedScale))
    wander, doubts_rig = max(piece.wander for piece in pieces), False
    drift = replace(drift, wander=wander)
    if measured:
        told, sigma = _mean_scale(_together(drift, measured))
        own = {piece: _together(drift, [piece]).scale[1] for piece in stated}
        doubts_rig = any(abs(told - 1) > DOUBT * np.hypot(sigma, own[p]) for p in stated)
        if doubts_rig or drift.bed.is_partial:
            drift = replace(drift, wander=max(wander, *(p.may_wander for p in measured)))
        if doubts_rig or any(isinstance(p.evidence, JointSpacing) for p in measured):
            stated = ()
    findings = tuple(Finding(p.evidence, *_mean_scale(_together(drift, [p]))) for p in pieces)
    _require_agreement(drift, dict(zip(pieces, findings, strict=True)), measured)
    used = (*measured, *stated)
    return _Solved(
        used, _together(drift, used), findings, doubts_rig, wander > 0 or drift.bed.is_partial
    )


def _by_the_likelier_bed(
    track: Track, evidence: Sequence[Evidence]
) -> tuple[Drift, tuple[_Piece, ...]]:
    """The drift of a track, with the bed that it shows or without, and the evidence by it.

    A bed all along is no other than a scale, which lengths and joints tell; and joints may say that
    it lies otherwise than the track shows it.
    """
    drift = Drift.of(track)
    pieces = tuple(_piece(track, drift, one) for one in evidence)
    if not drift.bed.is_there or all(isinstance(one, StatedScale) for one in evidence):
        return drift, pieces
    level = drift.without_bed()
    others = tuple(_piece(track, level, one) for one in evidence)
    gain = sum(p.log_likelihood for p in others) - sum(p.log_likelihood for p in pieces)
    return (level, others) if gain > CHANGE or not drift.bed.is_partial else (drift, pieces)


def _together(drift: Drift, pieces: Sequence[_Piece]) -> Solution:
    return Solution.of(drift, joined([piece.equations for piece in pieces]))


def _mean_scale(solution: Solution) -> tuple[float, float]:
    """With its standard uncertainty; where it wanders, over the way that the equations are of."""
    places = solution.equations.places
    if not solution.model.changes or len(places.rows) == 0:
        return solution.scale
    ends = (places.rows[places.at_mm.argmin()], places.rows[places.at_mm.argmax()])
    return solution.scale_between(*map(int, ends))


def _require_agreement(
    drift: Drift, findings: Mapping[_Piece, Finding], measured: Sequence[_Piece]
) -> None:
    for one, other in combinations(measured, 2):
        # One unknown less than each by itself has: the scale.
        excess = _together(drift, [one, other]).squares
        excess -= _together(drift, [one]).squares + _together(drift, [other]).squares
        if excess > CONTRADICTION**2:
            here, there = findings[one], findings[other]
            raise InvalidCorrection(
                f"Two corrections contradict each other: the scale is {here.scale:.4f} ± "
                f"{here.sigma:.4f} by {here.evidence}, but {there.scale:.4f} ± {there.sigma:.4f} "
                f"by {there.evidence}; one of them is wrong or less certain than stated.",
                "contradiction",
                scale=round(here.scale, 4),
                sigma=round(here.sigma, 4),
                evidence=str(here.evidence),
                other_scale=round(there.scale, 4),
                other_sigma=round(there.sigma, 4),
                other_evidence=str(there.evidence),
            )


def _residuals(solved: _Solved) -> Iterator[Residual]:
    """Of the lengths and joints, in the order of the evidence."""
    solution, first = solved.solution, 0
    measured_mm = solution.scale[0] * solution.equations.slope + solution.wandered_mm
    residual_mm = solution.residual - solution.wandered_mm
    for piece in solved.pieces:
        count = len(piece.equations.known)
        if not isinstance(piece.evidence, StatedScale):
            names = [str(piece.evidence)]
            if isinstance(piece.evidence, JointSpacing):
                joints = piece.evidence.joints
                names = [f"joint {j.number} in frame {j.sighting.frame}" for j in joints]
            for index, name in enumerate(names, first):
                yield Residual(name, float(measured_mm[index]), float(residual_mm[index]))
        first += count


def _stretches(solved: _Solved, distance_mm: Matrix) -> Iterator[Stretch]:
    """From joint to joint, each where a camera was nearest to it."""
    nearest: dict[tuple[int, int], tuple[float, int]] = {}
    for piece in solved.pieces:
        if isinstance(piece.evidence, JointSpacing):
            rows = piece.equations.places.rows
            for joint, row in zip(piece.evidence.joints, rows, strict=True):
                found = (abs(joint.sighting.ahead_mm), int(row))
                key = (joint.count, joint.number)
                nearest[key] = min(found, nearest.get(key, found))
    frames = sorted((row for _, row in nearest.values()), key=lambda row: distance_mm[row])
    for first, last in pairwise(frames):
        scale, sigma = solved.solution.scale_between(first, last)
        yield Stretch(float(distance_mm[first]), float(distance_mm[last]), scale, sigma)


def _piece(track: Track, drift: Drift, evidence: Evidence) -> _Piece:
    match evidence:
        case KnownLength():
            return _Piece(evidence, _of_length(track, drift, evidence))
        case JointSpacing():
            return _of_joints(track, drift, evidence)
        case StatedScale():
            return _Piece(evidence, _of_rig(evidence))
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


def _of_joints(track: Track, drift: Drift, spacing: JointSpacing) -> _Piece:
    """Segments that differ and a scale that wanders both leave residuals; the likelier has them."""
    sightings = [joint.sighting for joint in spacing.joints]
    count = np.array([joint.count for joint in spacing.joints])
    number = np.array([joint.number for joint in spacing.joints])
    # With unknown offsets it does not matter from which joint the segments' errors add up.
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
        return Solution.of(replace(drift, wander=wander), scattered(PRIOR_SCATTER_MM))

    scatter_mm = _spread(constant, PRIOR_SCATTER_MM)
    wander = _spread(changing, WANDER)
    even = constant(scatter_mm).log_likelihood - (scatter_mm / SCATTER_MM) ** 2 / 2
    uneven = changing(wander).log_likelihood - CHANGE
    changes = uneven > even
    if changes:
        scatter_mm = PRIOR_SCATTER_MM
    alike = np.outer(number, number) * spacing.segment_sigma_mm**2
    return _Piece(
        spacing,
        scattered(scatter_mm).with_noise({"segment": alike}),
        scatter_mm,
        wander=wander if changes else 0.0,
        may_wander=wander,
        log_likelihood=max(even, uneven),
    )


def _spread(solve: Callable[[float], Solution], prior: float) -> float:
    """A standard deviation of the model that makes the residuals as large as they are.

    With it the weighted sum of squares is the number of degrees of freedom (Paule & Mandel 1982).
    The prior value counts as one residual more.
    """

    def excess(spread: float) -> float:
        solution = solve(spread)
        rows, unknown = solution.design.shape
        return float(solution.squares + (prior / spread) ** 2 - (rows - unknown + 1))

    low, high = prior / 1e3, prior * 1e2
    for _ in range(40):  # bisection of its logarithm: the excess falls with the spread
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    return low


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
