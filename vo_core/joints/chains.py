"""Chains of sightings that may be joints: the most likely one, by dynamic programming.

The log odds of a chain are those of its links: how well each sighting lies whole segments after the
one before, how many joints were missed between them, and what it costs that the scale changes or
the count restarts (Viterbi 1967).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vo_core.drift import Bed, Drift, row_of
from vo_core.joints.sightings import Sighting, places_mm, seen_variance
from vo_core.track import Track
from vo_core.types import Matrix

PRIOR_SCATTER_MM = 3.0
"""Lower limit of the measured scatter, because a few joints may agree by chance."""

_STEP = 0.001
"""Step between the scales that are tried; it moves a joint by one or two millimetres against the
joint before."""

_LOWEST = 0.75
"""Lowest scale that is tried, relative to the known scale.

Silt is nearer than the wall, so the track reads up to a third too long; water makes the wall seem
nearer by a quarter of the water's depth."""

_HIGHEST = 1.10
"""Highest scale that is tried, relative to the known scale."""

_UNUSUAL = 0.1
"""Share of the runs whose scale is unrelated to the known one and may be any in that range."""

_REACH = 20
"""The next joint is looked for among this many sightings."""

_RING = 2.0
"""Log odds that a ring of the finder is a joint."""

_UNLIKE = 3.0
"""Log odds against a dark and a bright ring both being joints of one pipe."""

_MISSED = 1.6
"""Log odds against one missed joint between two; this cost separates a lattice from a finer one
that contains it."""

_MISSED_TOO = 0.5
"""Log odds against each further joint that is missed: joints are missed in stretches, under water
or after a loss."""

_MOST_MISSED = 8
"""Number of missed joints from which more cost nothing."""

_CHANGE = 0.02
"""Typical change of the scale between two joints, where it changes."""

_LEAVES_USUAL = 2.5
"""Log odds against a change from or to a usual scale; half counts for each end.

A run whose rig is right has no change; over silt changes are the rule."""

_LEAVES_UNUSUAL = 1.25
"""The same for an unusual scale."""

_FINER = 4
"""This many joints do not lie on every second place of a lattice by chance."""

COUNTABLE = 1 / 6
"""Uncertainty of a way, in segments, beyond which the segments on it cannot be counted."""

_BREAK = 7.0
"""Log odds against restarting the count; a joint in its place gains about 6.5."""

_LEAST_BED = 0.01
"""A bed lies between two rings if it may change the way between them by more than this share."""

_BREAK_ON_BED = 14.0
"""`_BREAK` beside such a bed.

There a change of the scale is more likely than a restart of the count after a segment of odd
length."""

_LEAVES_ON_BED = 0.5
"""`_LEAVES_UNUSUAL` beside such a bed."""

_CHANGE_ON_BED = 0.1
"""`_CHANGE` beside such a bed."""


@dataclass(frozen=True)
class Path:
    """A chain of sightings that are counted as joints."""

    score: float
    """Log odds of the chain against sightings that lie anywhere."""
    members: tuple[int, ...]
    counts: tuple[int, ...]
    numbers: tuple[int, ...]
    scales: tuple[float, ...]
    """Scale of the way to each member from the one before."""

    def links(self) -> list[tuple[int, int, int]]:
        """(from, to, segments) of consecutive members that are different joints of one count."""
        chain = list(zip(self.members, self.counts, self.numbers, strict=True))
        return [
            (i, j, there - here)
            for (i, count, here), (j, same, there) in pairwise(chain)
            if count == same and here != there
        ]

    def is_too_fine(self) -> bool:
        """Whether the members use only every second or third place of the lattice."""
        places = set(zip(self.counts, self.numbers, strict=True))
        return len(places) >= _FINER and math.gcd(*(n for _, _, n in self.links())) > 1

    def contradiction(self, other: Path) -> tuple[int, int] | None:
        """Two members between which another path counts another number of segments, if any."""
        places = dict(
            zip(other.members, zip(other.counts, other.numbers, strict=True), strict=True)
        )
        for i, j, segments in self.links():
            if i in places and j in places:
                (count, here), (same, there) = places[i], places[j]
                if count == same and there - here != segments:
                    return i, j
        return None

    def is_apart(self, other: Path) -> bool:
        """Whether another path takes entirely different rings for joints."""
        own, theirs = ({(i, j) for i, j, _ in path.links()} for path in (self, other))
        return bool(theirs) and not own & theirs


@dataclass(frozen=True)
class Search:
    """The search for the best chain: the data of the sightings, and the scales that are tried."""

    segment_mm: float
    at_mm: Matrix
    """(N,) axial coordinates of the rings by the track."""
    variance_mm2: Matrix
    """(N, N) variances of their differences, by track and picture."""
    on_bed: NDArray[np.bool_]
    """(N, N) whether the track shows a bed between two rings."""
    beside_bed: NDArray[np.bool_]
    """(N,) whether it shows a bed within a segment of a ring, so that the scale may change
    there."""
    contrast: Matrix
    """(N,) contrasts of the rings, 0 where unknown."""
    scales: Matrix
    """(S,) scales that are tried, evenly spaced."""
    prior: Matrix
    """(S,) log prior probabilities of the scales."""
    change: Matrix
    """(S,) half the log odds against a change from or to each scale."""

    @classmethod
    def of(
        cls,
        track: Track,
        sightings: Sequence[Sighting],
        segment_mm: float,
        scale: float,
        scale_sigma: float,
    ) -> Search:
        """Prepare the search among sightings in the order of their frames; see `count_joints`."""
        rows = np.array([row_of(track, sighting.frame) for sighting in sightings])
        seen = seen_variance(sightings)
        drift = Drift.of(track).without_bed()  # the scales that are tried include its effect
        places = drift.places(rows)
        between = np.stack(
            [drift.between(drift.places(np.full_like(rows, row)), places) for row in rows]
        )
        steps = np.arange(np.rint((_LOWEST - 1) / _STEP), np.rint((_HIGHEST - 1) / _STEP) + 1)
        usual = np.exp(-((steps * _STEP) ** 2) / (2 * max(scale_sigma / scale, _STEP) ** 2))
        usual *= (1 - _UNUSUAL) / usual.sum()
        prior = usual + _UNUSUAL / len(steps)
        at_mm, bed = places_mm(track, sightings), Bed.of(track)
        doubt_mm = bed.at(at_mm)
        ways = [np.abs(np.subtract.outer(mm, mm)) for mm in (doubt_mm, at_mm)]
        beside_mm = bed.at(at_mm + segment_mm) - bed.at(at_mm - segment_mm)
        return cls(
            segment_mm,
            at_mm,
            between + np.add.outer(seen, seen),
            ways[0] > _LEAST_BED * ways[1],
            beside_mm > _LEAST_BED * segment_mm,
            np.array([sighting.contrast for sighting in sightings]),
            scale * (1 + _STEP * steps),
            np.log(prior),
            _LEAVES_UNUSUAL + (_LEAVES_USUAL - _LEAVES_UNUSUAL) * usual / prior,
        )

    def best_chains(self, scatter_mm: float) -> Chains:
        """Find the best chain for each scale at its end."""
        count, tried = len(self.at_mm), np.arange(len(self.scales))
        score = np.tile(self.prior, (count, 1))  # a chain may begin at any sighting
        even = _Relaxed.none(score.shape, self.change, _CHANGE)
        uneven = _Relaxed.none(score.shape, np.minimum(self.change, _LEAVES_ON_BED), _CHANGE_ON_BED)
        chains = Chains.none(score, self.scales)
        for j in range(count):
            if j > 0:
                breaks = np.where(self.on_bed[:j, j], _BREAK_ON_BED, _BREAK)
                started = score[:j] - breaks[:, None]
                anew = started.argmax(axis=0)
                chains.take(j, started[anew, tried], before=anew, came=tried, broken=1)
                first = max(0, j - _REACH)
                gain, number = self._gains(first, j, scatter_mm)
                beds = self.beside_bed[first:j, None]
                through = np.where(beds, uneven.score[first:j], even.score[first:j]) + gain
                origin = np.where(beds, uneven.origin[first:j], even.origin[first:j])
                best = through.argmax(axis=0)
                chains.take(
                    j,
                    through[best, tried],
                    before=first + best,
                    came=origin[best, tried],
                    segments=number[best, tried],
                )
            even.take(j, score[j])
            uneven.take(j, score[j])
        return chains

    def _gains(self, first: int, j: int, scatter_mm: float) -> tuple[Matrix, NDArray[np.int64]]:
        """(j - first, S) log odds that j lies whole segments from each sighting before it.

        The odds are against a ring anywhere; the second value is the number of segments.
        """
        way = (self.at_mm[j] - self.at_mm[first:j])[:, None]
        true = self.scales * way
        number = np.rint(true / self.segment_mm).astype(np.int64)
        gone = np.abs(number)
        variance = (
            self.variance_mm2[first:j, j, None] + scatter_mm**2 * gone + (_STEP / 2 * way) ** 2
        )
        spread = np.log(self.segment_mm / np.sqrt(2 * np.pi * variance))
        further = np.clip(gone - 2, 0, _MOST_MISSED)
        missed = np.where(gone > 1, _MISSED + _MISSED_TOO * further, 0.0)
        residual = true - number * self.segment_mm
        unlike = _UNLIKE * (self.contrast[first:j, None] * self.contrast[j] < 0)
        gain = _RING + spread - residual**2 / (2 * variance) - missed - unlike
        countable = variance < (COUNTABLE * self.segment_mm) ** 2
        return np.where(countable, gain, -np.inf), number

    def scatter_mm(self, path: Path) -> float:
        """Scatter of single segments, measured by the links of a path."""
        i, j, segments = np.array(path.links()).T
        scales = dict(zip(path.members, path.scales, strict=True))
        way = np.array([scales[k] for k in j]) * (self.at_mm[j] - self.at_mm[i])
        residual = np.abs(way - segments * self.segment_mm) / np.sqrt(np.abs(segments))
        return max(1.4826 * float(np.median(residual)), PRIOR_SCATTER_MM)


@dataclass(frozen=True)
class Chains:
    """The best chain to each sighting, for each scale there, by its last link; (N, S) each."""

    score: Matrix
    tried: Matrix
    """(S,) scales."""
    before: NDArray[np.intp]
    """Index of the sighting before; -1 where the chain begins."""
    came: NDArray[np.intp]
    """Index of the scale at that sighting."""
    segments: NDArray[np.int64]
    broken: NDArray[np.bool_]
    """Whether the count restarts."""

    @classmethod
    def none(cls, score: Matrix, tried: Matrix) -> Chains:
        """No links yet: each sighting may begin a chain, with this (N, S) score."""
        shape = score.shape
        return cls(
            score,
            tried,
            np.full(shape, -1, np.intp),
            np.zeros(shape, np.intp),
            np.zeros(shape, np.int64),
            np.zeros(shape, np.bool_),
        )

    def take(
        self,
        j: int,
        offered: Matrix,
        *,
        before: NDArray[np.intp],
        came: NDArray[np.intp],
        segments: NDArray[np.int64] | int = 0,
        broken: int = 0,
    ) -> None:
        """Replace the links of sighting j where the offered score is higher."""
        better = offered > self.score[j]
        self.score[j] = np.where(better, offered, self.score[j])
        self.before[j] = np.where(better, before, self.before[j])
        self.came[j] = np.where(better, came, self.came[j])
        self.segments[j] = np.where(better, segments, self.segments[j])
        self.broken[j] = np.where(better, broken, self.broken[j])

    @property
    def scores(self) -> Matrix:
        """(S,) score of the best chain that ends with each scale."""
        return np.asarray(self.score.max(axis=0))

    @property
    def best(self) -> Path:
        """The chain of the highest score."""
        return self.path(int(self.scores.argmax()))

    def path(self, s: int) -> Path:
        """Trace the best chain that ends with scale s, from its beginning on."""
        last = int(self.score[:, s].argmax())
        chain = [(last, s)]
        while self.before[chain[-1]] >= 0:
            at = chain[-1]
            chain.append((int(self.before[at]), int(self.came[at])))
        chain.reverse()
        counts, numbers = [0], [0]
        for at in chain[1:]:
            counts.append(counts[-1] + int(self.broken[at]))
            numbers.append(0 if self.broken[at] else numbers[-1] + int(self.segments[at]))
        return Path(
            float(self.score[last, s]),
            tuple(j for j, _ in chain),
            tuple(counts),
            tuple(numbers),
            tuple(float(self.tried[k]) for _, k in chain),
        )


@dataclass
class _Relaxed:
    """The best score from which each scale is reached, with or without a change."""

    change: Matrix
    """(S,) half the log odds against a change from or to a scale."""
    size: float
    """Change of the scale that adds one to the cost."""
    score: Matrix
    """(N, S) best score."""
    origin: NDArray[np.intp]
    """(N, S) index of the scale before the change."""

    @classmethod
    def none(cls, shape: tuple[int, ...], change: Matrix, size: float) -> _Relaxed:
        return cls(change, size, np.zeros(shape), np.zeros(shape, np.intp))

    def take(self, j: int, score: Matrix) -> None:
        """Compute the row of sighting j from its scores.

        The cost of a change grows with its size, so one pass upwards and one downwards find the
        best (distance transforms, Felzenszwalb & Huttenlocher 2012).
        """
        tried = np.arange(len(score))
        slope = _STEP / self.size * tried
        best, origin = score, tried
        for order, cost in ((slice(None), slope), (slice(None, None, -1), slope[::-1])):
            lifted = (score - self.change)[order] + slope
            highest = np.maximum.accumulate(lifted)
            where = np.maximum.accumulate(np.where(lifted >= highest, tried, 0))
            moved = highest[order] - cost - self.change
            better = moved > best
            best = np.where(better, moved, best)
            origin = np.where(better, tried[order][where][order], origin)
        self.score[j], self.origin[j] = best, origin
