"""Joints of known spacing: which of the rings that were seen are joints, and how they are counted.

The joints of a pipe lie on a lattice of known spacing and unknown offset, and the track that
measures them has an unknown scale; some joints are not seen, and some rings are none.  The most
likely chain of sightings is found from each to the next by dynamic programming (Viterbi 1967), over
every scale that a wrong rig may cause, and a bed of silt or water.  The scale may change from joint
to joint, at a price; so no scale slips by a segment over a long way, because it would have to miss
every single joint on it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vo_core.drift import Bed, Drift, row_of
from vo_core.errors import InvalidCorrection
from vo_core.joints.finder import Sighting, numbered, places_mm
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

_STEP = 0.001
"""Between the scales that are tried.  A step moves a joint by a millimetre or two against the one
before."""

_LOWEST, _HIGHEST = 0.75, 1.10
"""Scales that are tried, over what is known of it: silt is nearer than the wall, so that the track
over-reads by up to a third; water makes the wall seem nearer than it is, by a quarter of its depth.
"""

_UNUSUAL = 0.1
"""Share of the runs whose scale has nothing to do with what is known of it: any of the above."""

_REACH = 20
"""A joint is followed by another one within so many sightings."""

_RING = 2.0
"""Log odds that a ring is a joint, by what the finder shows beside them."""

_UNLIKE = 3.0
"""Log odds against two joints of one pipe of which one is a dark ring and one a bright one."""

_MISSED, _MISSED_TOO, _MOST_MISSED = 1.6, 0.5, 8
"""Log odds against a joint that should have been seen between two, and against each more, up to so
many: they are missed in stretches, under water or after a loss.  It tells a lattice from one finer
than it."""

_CHANGE = 0.02
"""By how much a scale changes between two joints where it does."""

_LEAVES_USUAL, _LEAVES_UNUSUAL = 2.5, 1.25
"""Log odds against a change, half of them for the scale before it and half for the one after: a run
whose rig is right has none, over silt they are the rule."""

_FINER = 4
"""So many joints do not lie on every second place of a lattice by chance."""

_COUNTABLE = 1 / 6
"""Deviation of a way over the length of a segment, beyond which its segments cannot be counted."""

_BREAK = 7.0
"""Log odds against a count that starts anew; a joint on its place is worth about 6.5."""

_LEAST_BED = 0.01
"""Share of the way between two rings, at least, by which a bed that the track shows may have
changed it."""

_BREAK_ON_BED, _LEAVES_ON_BED, _CHANGE_ON_BED = 14.0, 0.5, 0.1
"""The same three beside such a bed: there the scale changes rather than that a count begins anew
behind a segment of odd length."""

_SURE = 3.0
"""Log odds that the best count must have against every other one."""

_LEAST = 1.0
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
        raise InvalidCorrection(
            "No joints were seen; correct the track by a taped length instead.", "no_joints"
        )
    search = _Search.of(track, ordered, segment_mm, scale, scale_sigma)
    paths = search.best_paths(SCATTER_MM)
    scores = np.array([path.score for path in paths])
    best = paths[int(scores.argmax())]
    # Some scale brings any two rings onto a lattice: what counts is the mean over all scales.
    odds = np.logaddexp.reduce(scores) - np.log(max(len(ordered) - 1, 1))
    if not best.links() and len(set(numbered(track, ordered))) == 1:
        raise InvalidCorrection(
            "All rings that were seen are the same joint; give a taped length instead.",
            "one_joint",
        )
    rivals = [path for path in paths if path.score > best.score - _SURE]
    is_uncertain = not best.links() or any(best.is_apart(path) for path in rivals)
    if odds < _LEAST or is_uncertain or best.is_too_fine():
        raise InvalidCorrection(
            f"Segments of {segment_mm:g} mm cannot be counted by the {len(ordered)} rings that "
            "were seen; check the length of a segment, or give a taped length.",
            "uncountable",
            n=len(ordered),
            segment_mm=segment_mm,
        )
    for path in rivals:
        if (gap := best.contradiction(path)) is not None:
            first, last = (ordered[i].frame for i in gap)
            raise InvalidCorrection(
                f"How many segments lie between the joints in frames {first} and {last} is not "
                "certain; give a taped length too.",
                "uncertain_gap",
                first=first,
                last=last,
            )
    # Once more with the scatter of this pipe: rings beside the joints are told from them.
    again = search.best_paths(search.scatter_mm(best))
    return max(again, key=lambda path: path.score).joints(ordered)


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
    scales: tuple[float, ...]
    """Of the way to each member from the one before."""

    def links(self) -> list[tuple[int, int, int]]:
        """(from, to, segments) of members that follow one another and are not the same joint."""
        chain = list(zip(self.members, self.counts, self.numbers, strict=True))
        return [
            (i, j, there - here)
            for (i, count, here), (j, same, there) in pairwise(chain)
            if count == same and here != there
        ]

    def is_too_fine(self) -> bool:
        """Whether the same places of a finer lattice stay empty all along."""
        places = set(zip(self.counts, self.numbers, strict=True))
        return len(places) >= _FINER and math.gcd(*(n for _, _, n in self.links())) > 1

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

    def is_apart(self, other: _Path) -> bool:
        """Whether another path takes other rings for joints altogether."""
        own, theirs = ({(i, j) for i, j, _ in path.links()} for path in (self, other))
        return bool(theirs) and not own & theirs

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
    on_bed: NDArray[np.bool_]
    """(N, N) whether the track shows a bed between them."""
    beside_bed: NDArray[np.bool_]
    """(N,) whether it does a segment before or after, so that the scale may change there."""
    contrast: Matrix
    """(N,) of the rings, 0 where it is not known."""
    scales: Matrix
    """(S,) that are tried, evenly spaced."""
    prior: Matrix
    """(S,) their log probabilities before any joint was seen."""
    change: Matrix
    """(S,) half the log odds against a change from or to them."""

    @classmethod
    def of(
        cls,
        track: Track,
        sightings: Sequence[Sighting],
        segment_mm: float,
        scale: float,
        scale_sigma: float,
    ) -> _Search:
        rows = np.array([row_of(track, sighting.frame) for sighting in sightings])
        seen = seen_variance(sightings)
        drift = Drift.of(track).without_bed()  # the scales that are tried stand for it
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

    def best_paths(self, scatter_mm: float) -> list[_Path]:
        """The best chain for each scale that it may end with."""
        count, tried = len(self.at_mm), np.arange(len(self.scales))
        score = np.tile(self.prior, (count, 1))  # a chain may begin anywhere
        even = _Relaxed.none(score.shape, self.change, _CHANGE)
        uneven = _Relaxed.none(score.shape, np.minimum(self.change, _LEAVES_ON_BED), _CHANGE_ON_BED)
        links = _Links.none(score.shape)
        for j in range(count):
            if j > 0:
                breaks = np.where(self.on_bed[:j, j], _BREAK_ON_BED, _BREAK)
                started = score[:j] - breaks[:, None]
                anew = started.argmax(axis=0)
                links.take(j, score, started[anew, tried], before=anew, came=tried, broken=1)
                first = max(0, j - _REACH)
                gain, number = self._gains(first, j, scatter_mm)
                beds = self.beside_bed[first:j, None]
                through = np.where(beds, uneven.score[first:j], even.score[first:j]) + gain
                origin = np.where(beds, uneven.origin[first:j], even.origin[first:j])
                best = through.argmax(axis=0)
                links.take(
                    j,
                    score,
                    through[best, tried],
                    before=first + best,
                    came=origin[best, tried],
                    segments=number[best, tried],
                )
            even.take(j, score[j])
            uneven.take(j, score[j])
        return [links.traced(score, self.scales, int(s)) for s in tried]

    def _gains(self, first: int, j: int, scatter_mm: float) -> tuple[Matrix, NDArray[np.int64]]:
        """(j - first, S) log odds that j lies whole segments from those before it, against
        anywhere, and how many segments.
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
        countable = variance < (_COUNTABLE * self.segment_mm) ** 2
        return np.where(countable, gain, -np.inf), number

    def scatter_mm(self, path: _Path) -> float:
        """Of single segments, by the links of a path."""
        i, j, segments = np.array(path.links()).T
        scales = dict(zip(path.members, path.scales, strict=True))
        way = np.array([scales[k] for k in j]) * (self.at_mm[j] - self.at_mm[i])
        residual = np.abs(way - segments * self.segment_mm) / np.sqrt(np.abs(segments))
        return max(1.4826 * float(np.median(residual)), PRIOR_SCATTER_MM)


@dataclass(frozen=True)
class _Links:
    """How the best chain came to each sighting, for each scale there: (N, S) each."""

    before: NDArray[np.intp]
    """The sighting before it; -1 where the chain begins."""
    came: NDArray[np.intp]
    """Which scale it had there."""
    segments: NDArray[np.int64]
    broken: NDArray[np.bool_]
    """The count starts anew."""

    @classmethod
    def none(cls, shape: tuple[int, ...]) -> _Links:
        return cls(
            np.full(shape, -1, np.intp),
            np.zeros(shape, np.intp),
            np.zeros(shape, np.int64),
            np.zeros(shape, np.bool_),
        )

    def take(
        self,
        j: int,
        score: Matrix,
        offered: Matrix,
        *,
        before: NDArray[np.intp],
        came: NDArray[np.intp],
        segments: NDArray[np.int64] | int = 0,
        broken: int = 0,
    ) -> None:
        """Link j where that is worth more than what it has."""
        better = offered > score[j]
        score[j] = np.where(better, offered, score[j])
        self.before[j] = np.where(better, before, self.before[j])
        self.came[j] = np.where(better, came, self.came[j])
        self.segments[j] = np.where(better, segments, self.segments[j])
        self.broken[j] = np.where(better, broken, self.broken[j])

    def traced(self, score: Matrix, scales: Matrix, s: int) -> _Path:
        """The chain that ends with a scale where its score is best, from its begin on."""
        last = int(score[:, s].argmax())
        chain = [(last, s)]
        while self.before[chain[-1]] >= 0:
            at = chain[-1]
            chain.append((int(self.before[at]), int(self.came[at])))
        chain.reverse()
        counts, numbers = [0], [0]
        for at in chain[1:]:
            counts.append(counts[-1] + int(self.broken[at]))
            numbers.append(0 if self.broken[at] else numbers[-1] + int(self.segments[at]))
        return _Path(
            float(score[last, s]),
            tuple(j for j, _ in chain),
            tuple(counts),
            tuple(numbers),
            tuple(float(scales[k]) for _, k in chain),
        )


@dataclass
class _Relaxed:
    """The best score from which a scale is come to, changed or not, and which that was."""

    change: Matrix
    """(S,) half the log odds against a change from or to a scale."""
    size: float
    """Of a change that costs one more."""
    score: Matrix
    """(N, S)"""
    origin: NDArray[np.intp]
    """(N, S)"""

    @classmethod
    def none(cls, shape: tuple[int, ...], change: Matrix, size: float) -> _Relaxed:
        return cls(change, size, np.zeros(shape), np.zeros(shape, np.intp))

    def take(self, j: int, score: Matrix) -> None:
        """Of sighting j.

        Changes cost by their size, so that one pass up and one down find the best (Felzenszwalb &
        Huttenlocher 2012, distance transforms).
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
