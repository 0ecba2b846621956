"""Which of several fixes of one picture shows the wall, and not dirt, water or a repeated pattern.

Two peaks of correlation can both be good: dirt on the lens shows a standstill, and running water
its own speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vo_core.geometry.motion import REFERENCE
from vo_core.geometry.wall import Pose, apart_mm
from vo_core.links.fix import Fix, Outlook
from vo_core.types import Matrix

STANDS_PX = 3.0
"""Below this motion of the content the robot counts as standing still: a fixed pattern pulls an
alignment by as much."""

MOVES_PX = 2 * STANDS_PX
"""Motion of the content since the reference from which the wall has certainly moved."""

RIVAL = 0.9
"""A pose with at least this share of the best support counts as equally good."""

CLEARER = 0.3
"""A block votes for one motion against another if its normalised correlation is higher by this."""

LEAST_CLEARER = 0.01
"""Share of blocks voting against a standstill from which it counts as a fixed pattern."""

SURPRISE = 2.0
"""A picture of which this many times as much is unexplained as of the last one may show more than
the predicted motion."""


def best_of(
    found: Sequence[Fix],
    in_reach: Sequence[Fix],
    outlook: Outlook,
    guess: Pose,
    mm_per_px: float,
) -> Fix | None:
    """The fix that shows the wall: of equally good ones the nearest to the guess.

    Those blocks decide that have shown the wall before.  The variance includes the distance to the
    other good fixes.

    Args:
        found: Fixes that may count.
        in_reach: Those of all fixes that the robot can have reached.
        outlook: What was known before.
        guess: The pose around which they were found.
        mm_per_px: Size of a pixel of the patch.
    """
    credible = [fix for fix in found if _is_credible(fix, found, in_reach, outlook, mm_per_px)]
    if not credible:
        return None
    weights = outlook.ncc_weights
    if weights is None:
        weights = np.ones(len(credible[0].alignment.ncc))
    supports = [fix.alignment.support(weights) for fix in credible]
    as_good = [
        fix
        for fix, support in zip(credible, supports, strict=True)
        if support >= RIVAL * max(supports)
    ]
    best = credible[int(np.argmax(supports))]
    if np.isfinite(outlook.reach_mm):
        best = min(as_good, key=lambda fix: off_mm(fix, guess))
    best = replace(best, found=tuple(credible) if len(credible) > 1 else ())
    if _stands(best) and any(_is_pattern(best, other) for other in found):
        best = replace(best, is_doubtful=True)
    apart = max(abs(fix.pose.x_mm - best.pose.x_mm) for fix in as_good)
    if apart < mm_per_px:
        return best
    variance = np.zeros(len(best.state.covariance))
    variance[0] = apart**2
    return replace(best, state=best.state.widened(variance), is_ambiguous=True)


def explains_all(fix: Fix, outlook: Outlook) -> bool:
    """Whether all blocks agree so well that none can vote for another motion.

    No block can exceed such a correlation by `CLEARER`; and all blocks agree less in a mixture of
    two motions.
    """
    if fix.alignment.unexplained > SURPRISE * outlook.unexplained:
        return False
    seen = fix.alignment.overlap * np.count_nonzero(fix.reference.template.seen)
    agree = np.count_nonzero(fix.alignment.ncc >= 1 - CLEARER)
    return bool(agree >= (1 - LEAST_CLEARER) * seen)


def off_mm(fix: Fix, guess: Pose) -> float:
    """Distance of the robot from a guess, measured by its motion since the reference.

    A clear picture after poor ones also corrects the pose of the reference, by millimetres beside
    the axis; that is no motion of the robot.
    """
    corrected = Pose.of(fix.alignment.parameters[REFERENCE])
    moved, expected = _since(corrected, fix.pose), _since(fix.reference.pose, guess)
    return float(np.hypot(*(moved - expected)))


def _is_credible(
    fix: Fix,
    found: Sequence[Fix],
    in_reach: Sequence[Fix],
    outlook: Outlook,
    mm_per_px: float,
) -> bool:
    """Whether a fix shows the wall and not a standstill of the lens only.

    Dirt stands still against every reference.  A robot that stops dead stands still against the
    newest picture only; against an older one it would have had to jump back.
    """
    if not _stands(fix):
        return True
    if fix in in_reach:
        return not any(_is_pattern(fix, other) for other in in_reach)
    if in_reach or apart_mm(fix.pose, outlook.last) > MOVES_PX * mm_per_px:
        return False
    return not any(_is_pattern(fix, other) for other in found)


def _stands(fix: Fix) -> bool:
    """Whether the picture lies on the reference, within the pull of a fixed pattern."""
    return fix.moved_px < STANDS_PX


def _is_pattern(fix: Fix, other: Fix) -> bool:
    """Whether `fix` is the standstill of dirt on the lens, and `other` the motion of the wall.

    A wall that stands still agrees in all blocks, even where a repeating texture also agrees one
    period off.  Dirt agrees only where it lies: some other blocks agree with the motion and not
    with the standstill.
    """
    if other.moved_px < MOVES_PX:
        return False
    clearer = other.alignment.ncc - fix.alignment.ncc > CLEARER
    return float(clearer.mean()) > LEAST_CLEARER


def _since(reference: Pose, pose: Pose) -> Matrix:
    """(2,) motion ahead and to the right, mm, in the axes of the reference."""
    cos, sin = np.cos(reference.yaw_rad), np.sin(reference.yaw_rad)
    x_mm, y_mm = pose.x_mm - reference.x_mm, pose.y_mm - reference.y_mm
    return np.array([cos * x_mm + sin * y_mm, cos * y_mm - sin * x_mm])
