"""Corrects the scale of a finished track by known lengths and joints, without decoding again.

One camera measures lengths in units of its height above the wall. The model of the true distance is

    D(t) = s d(t) + w(t)

with the distance d of the track, a scale s for the whole run, and a drift w whose covariance
follows from the track (see `drift`). A known length between two frames means D(b) - D(a) = L. A
joint, or a crest of a corrugated wall, means D = P + n L + r, with an unknown P; segments scatter,
so r is a random walk too, and all segments differ from the stated length by a common error. Least
squares over all evidence (see `kriging`) give s and D with their uncertainties: at the end of a
taped length the distance is as certain as the tape, and a stretch without a lock absorbs the
difference between the joints on either side. Where joints differ by more than segments can scatter,
the scale changes along the run, as over silt of varying depth.

The values of a rig are no measurement of the run.  If they contradict lengths or joints, the rig is
doubted and left out; beside joints it only helps to count them.  Measurements that contradict each
other are rejected.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from vo_core.drift import Drift, own_scale_sigma, row_of
from vo_core.errors import InvalidCorrection
from vo_core.joints.lattice import SCALE_SIGMA, count_joints
from vo_core.joints.sightings import Sighting, rings
from vo_core.scale.evidence import (
    SEGMENT_SIGMA_MM,
    CrestSpacing,
    Evidence,
    JointSpacing,
    StatedScale,
)
from vo_core.scale.kriging import Solution, Source, joined
from vo_core.scale.pieces import CHANGE, Piece, piece_of
from vo_core.track import Track
from vo_core.types import Matrix

CONTRADICTION = 3.29
"""Two measurements contradict each other beyond this many standard deviations (1 in 1000)."""

DOUBT = 2.58
"""A rig is doubted if it differs from the measurements by more standard deviations (1 in 100)."""


@dataclass(frozen=True)
class Finding:
    """The scale by one piece of evidence alone."""

    evidence: Evidence
    scale: float
    sigma: float


@dataclass(frozen=True)
class Residual:
    """Residual of a length or a joint after only the scale is applied."""

    name: str
    measured_mm: float
    """The length, or the distance of the joint, at the new scale."""
    residual_mm: float
    """Known value minus measured value."""


@dataclass(frozen=True)
class Stretch:
    """A part of the way with its own scale."""

    from_mm: float
    """Corrected distance at the beginning; `to_mm` is larger."""
    to_mm: float
    scale: float
    sigma: float


@dataclass(frozen=True)
class Correction:
    """A corrected track and its evidence; the raw track is not changed."""

    track: Track
    scale: float
    """True length over that of the raw track."""
    sigma: float
    """Standard uncertainty of `scale`."""
    findings: tuple[Finding, ...]
    residuals: tuple[Residual, ...]
    scatter_mm: float | None
    """Scatter of single segments about their stated length, one sigma; None without joints."""
    doubts_rig: bool = False
    """Whether the rig's own scale contradicts the measurements and was left out."""
    stretches: tuple[Stretch, ...] = ()
    """The scale from joint to joint in the order of the distance; empty if it is constant."""

    @property
    def changing_scales(self) -> tuple[float, ...]:
        """The scale from joint to joint, to three decimals; empty where these do not differ."""
        scales = tuple(round(stretch.scale, 3) for stretch in self.stretches)
        return scales if len(set(scales)) > 1 else ()

    def metadata(self) -> dict[str, str]:
        """Lines for the head of a track file: scale, evidence and stretches."""
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


def joint_spacing(
    track: Track,
    sightings: Sequence[Sighting],
    segment_mm: float,
    others: Sequence[Evidence] = (),
    *,
    segment_sigma_mm: float = SEGMENT_SIGMA_MM,
) -> JointSpacing:
    """Count the joints among sightings, as evidence; other evidence helps to count them.

    Args:
        track: The track of the sightings.
        sightings: Sightings of rings that may be joints.
        segment_mm: Distance from joint to joint.
        others: The rig's own scale, taped lengths.
        segment_sigma_mm: Standard uncertainty of `segment_mm`.
    Raises:
        InvalidCorrection: The joints cannot be counted, or the other evidence cannot be used.
    """
    scale, sigma = 1.0, SCALE_SIGMA
    if others:
        scale, sigma = _mean_scale(_solve(track, others).solution)
    joints = count_joints(track, rings(sightings), segment_mm, scale=scale, scale_sigma=sigma)
    return JointSpacing(tuple(joints), segment_mm, segment_sigma_mm)


def correct(
    track: Track, evidence: Sequence[Evidence], *, zero_frame: int | None = None
) -> Correction:
    """Correct a track by all the evidence together.

    x, distance and sigma become those of the most likely true way, y is scaled, and all else stays.

    Args:
        track: As it was measured.
        evidence: Lengths, joints and the rig's own scale.
        zero_frame: Frame at which the distance is 0 and from which sigma counts; by default the
            track's zero.
    Raises:
        InvalidCorrection: There is no evidence; a frame is missing or its wall was not recognised;
        a
            length is impossible for its frames; or measurements contradict each other.
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
    """Split the uncertainty of a distance of `correct` by source; mm, adding in quadrature.

    Raises:
        InvalidCorrection: As `correct` does.
    """
    zero = None if zero_frame is None else row_of(track, zero_frame)
    return _solve(track, evidence).solution.parts(row_of(track, frame), zero)


def zeroed(track: Track, frame: int) -> Track:
    """Count the distance and its sigma of a raw track from a frame.

    Raises:
        InvalidCorrection: The track does not have the frame.
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


@dataclass(frozen=True)
class _Solved:
    """The evidence that was used, and its solution."""

    pieces: tuple[Piece, ...]
    solution: Solution
    findings: tuple[Finding, ...]
    doubts_rig: bool
    changes: bool
    """Whether the scale changes along the run, by the joints or by a bed in parts of it."""


def _solve(track: Track, evidence: Sequence[Evidence]) -> _Solved:
    """Solve for all the evidence together, unless it contradicts itself.

    A rig is no measurement of this run and is doubted if it contradicts the measurements.  Beside
    joints it is left out: it helped to count them, and would add some of its own error again.
    """
    if not evidence:
        raise InvalidCorrection("Nothing was given to correct the track by.")
    drift, pieces = _by_the_likelier_bed(track, evidence)
    measured = tuple(p for p in pieces if not isinstance(p.evidence, StatedScale))
    stated = tuple(p for p in pieces if isinstance(p.evidence, StatedScale))
    wander, doubts_rig = max(piece.wander for piece in pieces), False
    drift = replace(drift, wander=wander)
    if measured:
        scale, sigma = _mean_scale(_together(drift, measured))
        own = {piece: _together(drift, [piece]).scale[1] for piece in stated}
        doubts_rig = any(abs(scale - 1) > DOUBT * np.hypot(sigma, own[p]) for p in stated)
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
) -> tuple[Drift, tuple[Piece, ...]]:
    """Choose the drift with or without the bed that the track shows, and build the equations.

    A bed all along the run acts like a scale, which lengths and joints determine; and joints may
    show that it lies elsewhere than the track shows it.
    """
    drift = Drift.of(track)
    pieces = tuple(piece_of(track, drift, one) for one in evidence)
    if not drift.bed.is_there or all(isinstance(one, StatedScale) for one in evidence):
        return drift, pieces
    level = drift.without_bed()
    others = tuple(piece_of(track, level, one) for one in evidence)
    gain = sum(p.log_likelihood for p in others) - sum(p.log_likelihood for p in pieces)
    return (level, others) if gain > CHANGE or not drift.bed.is_partial else (drift, pieces)


def _together(drift: Drift, pieces: Sequence[Piece]) -> Solution:
    return Solution.of(drift, joined([piece.equations for piece in pieces]))


def _mean_scale(solution: Solution) -> tuple[float, float]:
    """Scale with its standard uncertainty; where it changes, the mean between the places."""
    places = solution.equations.places
    if not solution.model.changes or len(places.rows) == 0:
        return solution.scale
    ends = (places.rows[places.at_mm.argmin()], places.rows[places.at_mm.argmax()])
    return solution.scale_between(*map(int, ends))


def _require_agreement(
    drift: Drift, findings: Mapping[Piece, Finding], measured: Sequence[Piece]
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
    """Residuals of the lengths and joints, in the order of the evidence; crests are too many."""
    solution, first = solved.solution, 0
    measured_mm = solution.scale[0] * solution.equations.slope + solution.wandered_mm
    residual_mm = solution.residual - solution.wandered_mm
    for piece in solved.pieces:
        count = len(piece.equations.known)
        if not isinstance(piece.evidence, StatedScale | CrestSpacing):
            names = [str(piece.evidence)]
            if isinstance(piece.evidence, JointSpacing):
                joints = piece.evidence.joints
                names = [f"joint {j.number} in frame {j.sighting.frame}" for j in joints]
            for index, name in enumerate(names, first):
                yield Residual(name, float(measured_mm[index]), float(residual_mm[index]))
        first += count


def _stretches(solved: _Solved, distance_mm: Matrix) -> Iterator[Stretch]:
    """Stretches between the rows at which the camera was nearest to each joint."""
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
