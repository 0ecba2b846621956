"""Films of a converter of frame rates, which mixes neighbouring exposures of the camera.

A picture M = a I_1 + b I_2 shows the wall at two poses.  Reference and picture correlate with c_1
at one and c_2 at the other; with the correlation rho of the reference with itself at their
distance, regression gives the shares, a ~ c_1 - rho c_2 and b ~ c_2 - rho c_1.  The pose of the
picture is the mean of the two by their shares, as its time lies between theirs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vo_core.links.fix import Fix
from vo_core.links.locator import Locator
from vo_core.links.picture import Picture, Reference
from vo_core.matching.template import Likeness
from vo_core.types import Matrix

NEIGHBOUR = (0.75, 2.1)
"""Distance of two exposures of a mixture over the way per picture of the film: from four exposures
for three pictures to one for two."""

CLEAR = 0.25
"""Share of what one exposure leaves unexplained that the other explains in a clear mixture.

It is 0.6 to 0.9 in mixtures.  What a coarse coding repeats of the last picture explains up to
0.2."""

EXPECTED_FRAMES = 30
"""Frames after a clear mixture in which others are expected."""

PURE = 0.18
"""Share of another exposure below which a picture is as good a reference as any."""


class Mixing:
    """Recognises mixtures, and chooses references that show one exposure as far as there are."""

    def __init__(self, locator: Locator) -> None:
        self._locator = locator
        self._apart_mm = 0.0
        """Distance of the exposures in the last clear mixture."""
        self._left = 0
        """Frames in which mixtures are still expected."""
        self._least_like = 1.0
        """Least agreement of a picture with itself at that distance: that of the bare wall."""

    def resolve(self, fix: Fix, picture: Picture, way: Matrix | None) -> Fix:
        """Add the other exposure to a fix, if the picture is a mixture.

        A clear one has a second peak of correlation, and others follow at the same distance.

        Args:
            way: (3,) mm along, mm across and rad that were expected since the last fix.
        """
        self._left -= 1
        length_mm = 0.0 if way is None else float(np.hypot(*way[:2]))
        if way is None or length_mm == 0:
            return fix
        best = max(fix.found or [fix], key=lambda each: float(each.alignment.ncc.sum()))
        found = [(each.pose.vector - best.pose.vector, each.likeness) for each in fix.found]
        near, far = NEIGHBOUR
        clear = [
            (by, like, CLEAR) for by, like in found if near < np.hypot(*by[:2]) / length_mm < far
        ]
        expected = []
        if self._left > 0:
            step = np.append(way, np.zeros(3)) * (self._apart_mm / length_mm)
            expected = [(by, self._likeness(best, picture, by), 0.0) for by in (step, -step)]
        apart = None
        for by, likeness, least in clear + expected:
            rho = self._like_itself(best.reference, by)
            share = share_of_other(best.likeness, likeness, rho, least)
            if share > best.share:
                best, apart = replace(best, share=share, offset=share * by), by
        if best.share == 0:
            return fix
        if apart is not None and any(apart is by for by, _, _ in clear):
            self._apart_mm, self._left = float(np.hypot(*apart[:2])), EXPECTED_FRAMES
        return best

    def rated(self, reference: Reference, fix: Fix, way: Matrix | None) -> Reference:
        """Rate the located picture as a reference: its share of another exposure.

        Against a reference that is a mixture itself, a like mixture seems pure; but it resembles
        itself one exposure further.
        """
        impurity = fix.share
        if self._left > 0 and impurity < PURE and way is not None:
            by = np.append(way, np.zeros(3)) * (self._apart_mm / max(np.hypot(*way[:2]), 1e-9))
            likeness = self._like_itself(reference, by)
            self._least_like = min(self._least_like, likeness)
            impurity = max(impurity, likeness - self._least_like)
        return replace(reference, impurity=impurity, offset=fix.offset)

    def fallback(self, newest: Reference, before: Reference | None) -> Reference:
        """The newest picture, unless one that still shows its wall is purer."""
        if before is None or newest.impurity < max(PURE, before.impurity):
            return newest
        is_far = self._locator.overlap(before, newest.pose) < 0.5
        return newest if is_far else before

    def _likeness(self, fix: Fix, picture: Picture, by: Matrix) -> Likeness:
        return self._locator.likeness(fix.reference, picture, fix.pose.vector + by)

    def _like_itself(self, reference: Reference, by: Matrix) -> float:
        """Agreement of a reference with itself as seen from elsewhere."""
        at = reference.pose.vector + by
        return self._locator.likeness(reference, reference.picture, at)[1]


def share_of_other(one: Likeness, other: Likeness, rho: float, least: float = 0.0) -> float:
    """Estimate the share b / (a + b) of the other exposure; 0 for a picture of one exposure.

    In a mixture all blocks show both exposures, in one proportion, and both together explain no
    more than there is.  With dirt, water or skipped blocks in the picture each block shows either.
    So most blocks must agree better with the mixture than with the better one of its parts.

    Args:
        one, other: The picture with the reference at the two poses.
        rho: Agreement of the reference with itself, as far apart as the poses.
        least: Least share of what the first exposure leaves unexplained that the other explains,
            the square of their partial correlation (Fisher 1924).
    """
    (first, c_one), (second, c_other) = one, other
    a, b = c_one - rho * c_other, c_other - rho * c_one
    seen = (first > 0) | (second > 0)
    if min(a, b) <= 0 or not seen.any():
        return 0.0
    size = np.sqrt(a * a + b * b + 2 * a * b * rho)
    mixed = (a * first + b * second) / size
    is_better = mixed[seen] > np.maximum(first, second)[seen]
    explains = b * b >= least * (1 - rho * rho) * (1 - c_one * c_one)
    is_mixed = explains and a * c_one + b * c_other <= size and is_better.mean() > 0.5
    return b / (a + b) if is_mixed else 0.0
