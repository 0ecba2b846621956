"""Joints of known spacing: which of the rings that were seen are joints, and how they are counted.

The joints of a pipe lie on a lattice of known spacing and unknown offset, and the track that
measures them has an unknown scale; some joints are not seen, and some rings are none.  The most
likely chain of sightings is found from each to the next by dynamic programming (Viterbi 1967), for
every scale that a wrong height may cause: no scale slips by a segment over a long way, because it
would have to miss every single joint on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vo_core.drift import Drift, row_of
from vo_core.errors import InvalidCorrection
from vo_core.joints import Sighting, places_mm
from vo_core.track import Track
from vo_core.types import Matrix

SCALE_SIGMA = 0.02
"""Relative error, one sigma, with which the height of a camera is known."""

SCATTER_MM = 6.0
"""What single segments may differ from the stated length, one sigma, before it is measured."""

PRIOR_SCATTER_MM = 3.0
"""The same, as far as it is believed against the joints themselves: a few may agree by chance."""

EDGE_SIGMA_MM = 0.5
"""Joints are broken and filled: seen anew, in another light, one is found so far off."""

_STEP, _TRIED = 0.001, 50
"""Between the scales that are tried, and how many to either side: 5 % in all.  A step moves a joint
by a millimetre or two against the one before."""

_REACH = 20
"""A joint is followed by another one within so many sightings."""

_MISSED, _MOST_MISSED = 0.5, 8
"""Log odds against each joint that should have been seen between two, up to so many: they are
missed in stretches, under water or after a loss.  It tells a lattice from one finer than it."""

_COUNTABLE = 1 / 6
"""Deviation of a way over the length of a segment, beyond which its segments cannot be counted."""

_BREAK = 7.0
"""Log odds against a count that starts anew; a joint on its place is worth about 4.5."""

_SURE = 3.0
"""Log odds that the best count must have against every other one."""

_LEAST = 2.0
"""Log odds for the lattice as a whole, below which the rings may as well lie anywhere."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A sighting that was counted; the same number in the same count is the same joint."""

    sighting: Sighting
    count: int
    """0; more after stretches over which the number of segments is not known."""
    number: int
    """Whole segments from the first joint of the count, negative behind it."""


def count_joints(
    track: Track,
    sightings: Sequence[Sighting],
    segment_mm: float,
    *,
    scale: float = 1.0,
    scale_sigma: float = SCALE_SIGMA,
) -> list[Joint]:
    """The sightings that lie on the lattice, in the order of their frames.

    Args:
        track: The one with which the sightings were made.
        segment_mm: From joint to joint.
        scale: True length over that of the track, as far as it is known without joints.
        scale_sigma: Its standard uncertainty.
    Raises:
        InvalidCorrection: No two sightings lie whole segments apart, or two joints so far apart
            that the segments between them cannot be counted.
    """
    ordered = sorted(sightings, key=lambda sighting: sighting.frame)
    if not ordered:
        raise InvalidCorrection("No joints were seen; correct the track by a taped length instead.")
    search = _Search.of(track, ordered, segment_mm)
    scales = scale + _STEP * np.arange(-_TRIED, _TRIED + 1, dtype=np.float64)
    paths = search.best_paths(scales, SCATTER_MM, _STEP / 2)
    # Bounded, so that a wrong scale is contradicted by many joints and not obeyed.
    against = np.minimum(((scales - scale) / scale_sigma) ** 2 / 2, _BREAK)
    scores = np.array([path.score for path in paths]) - against
    # Some scale brings any two rings onto a lattice: what counts is the mean over all scales.
    mean = np.sum(np.exp(scores - scores.max())) / np.sum(np.exp(-against))
    odds = scores.max() + np.log(mean) - np.log(max(len(ordered) - 1, 1))
    if odds < _LEAST:
        raise InvalidCorrection(
            f"Segments of {segment_mm:g} mm cannot be counted by the {len(ordered)} rings that "
            "were seen; check the length of a segment, or give a taped length."
        )
    best = paths[int(scores.argmax())]
    for path, score in zip(paths, scores, strict=True):
        if score > scores.max() - _SURE and (gap := best.contradiction(path)) is not None:
            first, last = (ordered[i].frame for i in gap)
            raise InvalidCorrection(
                f"How many segments lie between the joints in frames {first} and {last} is not "
                "certain; give a taped length too."
            )
    if not best.links():
        raise InvalidCorrection(
            "All rings that were seen are the same joint; give a taped length instead."
        )
    # Once more with the scatter of this pipe: rings beside the joints are told from them.
    (final,) = search.best_paths(*search.measured(best), 0.0)
    return final.joints(ordered)


def seen_variance(sightings: Sequence[Sighting]) -> Matrix:
    """(N,) mm^2, of where the joint is to the camera."""
    return np.asarray(np.square([s.sigma_mm for s in sightings]) + EDGE_SIGMA_MM**2)


@dataclass(frozen=True)
class _Path:
    """A chain of sightings."""

    score: float
    """Log odds against sightings that lie anywhere."""
    members: tuple[int, ...]
    counts: tuple[int, ...]
    numbers: tuple[int, ...]

    def links(self) -> list[tuple[int, int, int]]:
        """(from, to, segments) of members that follow one another and are not the same joint."""
        chain = list(zip(self.members, self.counts, self.numbers, strict=True))
        return [
            (i, j, there - here)
            for (i, count, here), (j, same, there) in pairwise(chain)
            if count == same and here != there
        ]

    def contradiction(self, other: _Path) -> tuple[int, int] | None:
        """Two members that another path counts otherwise, if there are any."""
        places = dict(
            zip(other.members, zip(other.counts, other.numbers, strict=True), strict=True)
        )
        for i, j, segments in self.links():
            if i in places and j in places:
                (count, here), (same, there) = places[i], places[j]
                if count == same and there - here != segments:
                    return i, j
        return None

    def joints(self, sightings: Sequence[Sighting]) -> list[Joint]:
        """The members as joints."""
        return [
            Joint(sightings[i], count, number)
            for i, count, number in zip(self.members, self.counts, self.numbers, strict=True)
        ]


@dataclass(frozen=True)
class _Search:
    """What is needed of each sighting and of those shortly before it."""

    segment_mm: float
    at_mm: Matrix
    """(N,) axial coordinates by the track."""
    variance_mm2: Matrix
    """(N, N) of their differences, by track and picture."""

    @classmethod
    def of(cls, track: Track, sightings: Sequence[Sighting], segment_mm: float) -> _Search:
        rows = np.array([row_of(track, sighting.frame) for sighting in sightings])
        seen = seen_variance(sightings)
        drift = Drift.of(track)
        places = drift.places(rows)
        between = np.stack(
            [drift.between(drift.places(np.full_like(rows, row)), places) for row in rows]
        )
        at_mm = places_mm(track, sightings)
        return cls(segment_mm, at_mm, between + np.add.outer(seen, seen))

    def best_paths(self, scales: Matrix, scatter_mm: float, step: float) -> list[_Path]:
        """The best chain for each scale, which is uncertain by `step`."""
        count, tried = len(self.at_mm), np.arange(len(scales))
        score = np.zeros((count, len(scales)))  # a chain may begin anywhere
        before = np.full((count, len(scales)), -1)
        segments = np.zeros((count, len(scales)), np.int64)
        broken = np.zeros((count, len(scales)), bool)
        for j in range(1, count):
            anew = score[:j].argmax(axis=0)
            breaks = score[anew, tried] - _BREAK
            broken[j] = breaks > 0
            score[j], before[j] = np.maximum(breaks, 0), np.where(broken[j], anew, -1)
            for i in range(max(0, j - _REACH), j):
                gain, number = self._gain(i, j, scales, scatter_mm, step)
                better = score[i] + gain > score[j]
                score[j] = np.where(better, score[i] + gain, score[j])
                before[j] = np.where(better, i, before[j])
                segments[j] = np.where(better, number, segments[j])
                broken[j] &= ~better
        return [_traced(score[:, s], before[:, s], segments[:, s], broken[:, s]) for s in tried]

    def _gain(
        self, i: int, j: int, scales: Matrix, scatter_mm: float, step: float
    ) -> tuple[Matrix, NDArray[np.int64]]:
        """Log odds that j lies whole segments from i, against anywhere, and how many."""
        way = self.at_mm[j] - self.at_mm[i]
        number = np.rint(scales * way / self.segment_mm).astype(np.int64)
        residual = scales * way - number * self.segment_mm
        variance = self.variance_mm2[i, j] + scatter_mm**2 * np.abs(number) + (step * way) ** 2
        spread = np.log(self.segment_mm / np.sqrt(2 * np.pi * variance))
        countable = variance < (_COUNTABLE * self.segment_mm) ** 2
        missed = _MISSED * np.clip(np.abs(number) - 1, 0, _MOST_MISSED)
        gain = spread - residual**2 / (2 * variance) - missed
        return np.where(countable, gain, -np.inf), number

    def measured(self, path: _Path) -> tuple[Matrix, float]:
        """Scale, as an array of one, and scatter of single segments by the links of a path."""
        i, j, segments = np.array(path.links()).T
        way, true = self.at_mm[j] - self.at_mm[i], segments * self.segment_mm
        weight = 1 / (self.variance_mm2[i, j] + SCATTER_MM**2 * np.abs(segments))
        scale = np.sum(weight * way * true) / np.sum(weight * way * way)
        residual = np.abs(scale * way - true) / np.sqrt(np.abs(segments))
        return np.array([scale]), max(1.4826 * float(np.median(residual)), PRIOR_SCATTER_MM)


def _traced(
    score: Matrix, before: NDArray[np.int64], segments: NDArray[np.int64], broken: NDArray[np.bool_]
) -> _Path:
    """The chain that ends where the score is best, from its begin on."""
    last = int(score.argmax())
    members = [last]
    while before[members[-1]] >= 0:
        members.append(int(before[members[-1]]))
    members.reverse()
    counts, numbers = [0], [0]
    for j in members[1:]:
        counts.append(counts[-1] + int(broken[j]))
        numbers.append(0 if broken[j] else numbers[-1] + int(segments[j]))
    return _Path(float(score[last]), tuple(members), tuple(counts), tuple(numbers))
