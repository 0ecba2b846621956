"""Chooses among the possible readings of a counter those that follow from each other.

A counter moves in small ticks, so a misread digit jumps out and back. A reset jumps once, and the
readings after it agree with each other again. The chain of readings with the greatest sum of
certainties, less the costs of its jumps, is kept (dynamic programming, Viterbi 1967); what is not
on it is refused. No value is ever interpolated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

JUMP = 2.0
"""Cost of a jump, in certain readings."""

MOST_READINGS = 3
"""A stretch counts as so many readings at most: a digit may be misread as often as it is shown."""

LOOK_BACK = 8
"""Most stretches between two neighbours of the chain, plus 1."""

USUAL = 0.3
"""Quantile of the changes that counts as usual; each misread digit makes two larger ones."""

SLACK = 3.0
"""A change by this many times the usual is no jump."""

SPEED = 1.5
"""Units of the counter in a second, m or ft, that a camera may drive besides."""

AGREEMENT = 4.0
"""Factor of the odds of a reading that is within one tick of both neighbours."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A possible reading."""

    value: float
    sure: float
    """Probability from the picture alone."""


@dataclass(slots=True)
class Stretch:
    """Consecutive frames that show the same reading."""

    first: int
    last: int
    """Frames, both included."""
    first_s: float
    last_s: float
    candidates: tuple[Candidate, ...]
    """The most probable first; at least one."""
    readings: int = 1
    """How often the reading was taken from pictures that differ."""


def consistent(stretches: Sequence[Stretch], tick: float) -> list[Candidate | None]:
    """Choose a reading for each stretch, or none; its certainty takes its neighbours into account.

    Args:
        stretches: In the order of time.
        tick: Smallest change of the counter.
    """
    limits = _Limits(stretches, tick)
    chain = _best_chain(stretches, limits)
    chosen: list[Candidate | None] = [None] * len(stretches)
    for n, (at, which) in enumerate(chain):
        neighbours = [chain[k] for k in (n - 1, n + 1) if 0 <= k < len(chain)]
        near = [(stretches[k], stretches[k].candidates[c].value) for k, c in neighbours]
        stretch = stretches[at]
        candidate = stretch.candidates[which]
        refuted = sum(
            other.sure
            for other in stretch.candidates
            if other != candidate and not _fits(stretch, other, near, limits)
        )
        sure = candidate.sure / max(1 - refuted, candidate.sure)
        if len(near) == 2 and all(abs(value - candidate.value) < 1.5 * tick for _, value in near):
            sure = AGREEMENT * sure / (1 - sure + AGREEMENT * sure)  # odds times AGREEMENT
        chosen[at] = Candidate(candidate.value, sure)
    return chosen


class _Limits:
    """How far the counter usually moves from one stretch to the next."""

    def __init__(self, stretches: Sequence[Stretch], tick: float) -> None:
        changes = [
            abs(b.candidates[0].value - a.candidates[0].value) for a, b in pairwise(stretches)
        ]
        self._usual = max(tick, float(np.quantile(changes, USUAL)) if changes else tick)

    def excess(self, before: Stretch, value_before: float, after: Stretch, value: float) -> float:
        """By how many times the change exceeds what is usual or possible; 0 within it."""
        limit = SLACK * self._usual + SPEED * (after.first_s - before.last_s)
        return max(abs(value - value_before) / limit - 1, 0.0)


def _best_chain(stretches: Sequence[Stretch], limits: _Limits) -> list[tuple[int, int]]:
    """Stretches and candidates of the chain with the greatest gain, in the order of time."""
    nodes = [(n, c) for n, stretch in enumerate(stretches) for c in range(len(stretch.candidates))]
    gains: list[float] = []
    before: list[int] = []
    start_of = {n: k for k, (n, c) in enumerate(nodes) if c == 0}
    for n, c in nodes:
        stretch = stretches[n]
        candidate = stretch.candidates[c]
        best, best_from = 0.0, -1
        for j in range(start_of[max(n - LOOK_BACK, 0)], start_of[n]):
            earlier = stretches[nodes[j][0]]
            value = earlier.candidates[nodes[j][1]].value
            cost = JUMP * min(limits.excess(earlier, value, stretch, candidate.value), 1.0)
            if gains[j] - cost > best:
                best, best_from = gains[j] - cost, j
        gains.append(best + candidate.sure * min(stretch.readings, MOST_READINGS))
        before.append(best_from)
    chain = []
    at = int(np.argmax(gains)) if gains else -1
    while at >= 0:
        chain.append(nodes[at])
        at = before[at]
    return chain[::-1]


def _fits(
    stretch: Stretch, candidate: Candidate, near: list[tuple[Stretch, float]], limits: _Limits
) -> bool:
    """Whether a candidate follows without a jump from one of the neighbours at least."""
    return any(
        limits.excess(
            *(
                (other, value, stretch, candidate.value)
                if other.first < stretch.first
                else (stretch, candidate.value, other, value)
            )
        )
        == 0
        for other, value in near
    )
