"""Decides which rings are joints of known spacing, and counts them.

The joints of a pipe lie on a lattice of known spacing and unknown offset, and the track that
measures them has an unknown scale; some joints are missed, and some rings are no joints. Dynamic
programming (Viterbi 1967) finds the most likely chain of sightings, over every scale that a wrong
rig, silt or water may cause. The scale may change from joint to joint, at a cost. Over a long way
no chain slips by a segment, because it would have to miss every joint on the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vo_core.errors import InvalidCorrection
from vo_core.joints.chains import Search
from vo_core.joints.sightings import Sighting, numbered
from vo_core.track import Track

SCALE_SIGMA = 0.02
"""Default relative uncertainty of the scale, by the height of the camera, one sigma."""

SCATTER_MM = 6.0
"""Scatter of single segments about the stated length, one sigma, before it is measured."""

_SURE = 3.0
"""Least log odds of the best count against every other one."""

_LEAST = 1.0
"""Least log odds of the lattice as a whole against rings that lie anywhere."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A counted sighting; equal numbers in the same count are the same joint."""

    sighting: Sighting
    count: int
    """Index of the count: 0, and one more after each stretch of an unknown number of segments."""
    number: int
    """Whole segments from the first joint of the count; negative before it."""


def count_joints(
    track: Track,
    sightings: Sequence[Sighting],
    segment_mm: float,
    *,
    scale: float = 1.0,
    scale_sigma: float = SCALE_SIGMA,
) -> list[Joint]:
    """Count the sightings that lie on the lattice, in the order of their frames.

    Args:
        track: The track of the sightings.
        sightings: Sightings of rings that may be joints.
        segment_mm: Distance from joint to joint.
        scale: True length over that of the track, as known without joints.
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
    search = Search.of(track, ordered, segment_mm, scale, scale_sigma)
    chains = search.best_chains(SCATTER_MM)
    scores, best = chains.scores, chains.best
    # Any two rings fit a lattice at some scale, so the mean over all scales counts.
    odds = np.logaddexp.reduce(scores) - np.log(max(len(ordered) - 1, 1))
    if not best.links() and len(set(numbered(track, ordered))) == 1:
        raise InvalidCorrection(
            "All rings that were seen are the same joint; give a taped length instead.",
            "one_joint",
        )
    rivals = [chains.path(s) for s in np.flatnonzero(scores > best.score - _SURE).tolist()]
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
    # Once more with the scatter of this pipe, which separates rings close to joints from joints.
    path = search.best_chains(search.scatter_mm(best)).best
    chain = zip(path.members, path.counts, path.numbers, strict=True)
    return [Joint(ordered[i], count, number) for i, count, number in chain]
