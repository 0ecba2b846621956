"""How well pictures agree with the wall by now, and the systematic errors that follow from it.

Noise and coding shift each registration a little, always with the same sign, so their errors grow
with the way and not with its root.  They are taken to be

    error = constant + noise * (1 - fidelity)

with the fidelity of an alignment, the correlation of the blocks that agree.
"""

from __future__ import annotations

import numpy as np

from vo_core.geometry.rectify import Rectifier
from vo_core.links.fix import Fix
from vo_core.links.locator import CERTAIN
from vo_core.links.rivals import MOVES_PX
from vo_core.types import Matrix

GHOST_PX = 0.25
"""Systematic error of a keyframe's link in a coarsely coded film ahead, px of the patch.

What a coder leaves of the picture before pulls each registration back a little: by 0.1 to 0.3 px on
H.264 at crf 30, much the same over one frame and over six."""

USUAL_AGREEMENT = 0.7
"""A fix is as usual if it agrees at least by this share of the mean agreement."""

LINK_ERROR = (0.0, 0.0, 0.0, 0.01, np.radians(0.003), np.radians(0.003), 0.0, 0.0)
"""Standard deviation that each keyframe adds to z, pitch and roll beyond its covariance, mm and
rad."""

TURN_ERROR = np.radians([0.03, 1.0])
"""Systematic error of a keyframe's turn, rad: constant and noise.

Video coding and the rest of the lamp's light turn each registration a little, with the same sign
over many keyframes. Without this term the chained yaw would outweigh the shear, which shows where
the axis of a cylinder is, and would drift (yaw rms on coded video: 0.05 degrees with it, 0.15 to
1.2 without).
"""

SHEAR_ERROR = float(np.radians(0.5))
"""Standard deviation of the shear by coarse coding (see `CodedMotion`) at a fidelity of 0, rad.

Measured from I frames to the P frames that follow: 0.12 degrees at crf 38 (fidelity 0.8 to 0.6),
with one sign, where the scatter of the blocks states 0.05. At crf 30 it is 0.07 degrees, and one
more unknown in each frame would cost more accuracy than it gains.
"""

FIDELITY_GAIN = 0.1
"""Weight of the newest frame in the mean fidelity and in the mean agreement."""

SCALE_ERROR = np.array([5e-5, 9e-4])
"""Systematic error of the distance, relative: constant and noise.

It is multiplied by the unevenness of the picture, because blur and coding vary with the resolution.
"""


class Fidelity:
    """Keeps what fixes have shown of the pictures, and the systematic error of the distance."""

    def __init__(self, rectify: Rectifier) -> None:
        self._unevenness, self._mm_per_px = rectify.unevenness, rectify.grid.mm_per_px
        self.systematic_mm = 0.0
        """Systematic error that may have accumulated, signed like the distance."""
        self.unexplained = 1.0
        """`Alignment.unexplained` of the last fix."""
        self.has_moved = not rectify.rig.looks_along_pipe
        """Whether the wall has been seen to move.

        Before, a camera that looks ahead may show nothing but its own lamp on a smooth wall, which
        stands still however far the robot drives."""
        self._fidelity = 1.0
        """Running mean of `Alignment.fidelity`, and of `agreement`."""
        self._agreement = 0.0

    @property
    def shear_rad(self) -> float:
        """Standard deviation of the shear by the coding of a coarsely coded film."""
        return SHEAR_ERROR * (1 - self._fidelity)

    def is_usual(self, fix: Fix) -> bool:
        """Whether a fix agrees nearly as well as those before."""
        return fix.alignment.agreement > USUAL_AGREEMENT * self._agreement

    def take(self, fix: Fix, last_mm: float) -> None:
        """Add a fix; `last_mm` is the distance of the one before."""
        share = _systematic(SCALE_ERROR, fix) * self._unevenness
        self.systematic_mm += share * (fix.pose.x_mm - last_mm)
        self.unexplained = fix.alignment.unexplained
        self._agreement += FIDELITY_GAIN * (fix.alignment.agreement - self._agreement)
        self._fidelity += FIDELITY_GAIN * (fix.alignment.fidelity - self._fidelity)
        self.has_moved |= fix.moved_px > MOVES_PX and fix.alignment.significance > CERTAIN

    def add_ghost(self, fix: Fix) -> None:
        """Add the error of a keyframe's link in a coarsely coded film ahead, see `GHOST_PX`."""
        self.systematic_mm += float(np.copysign(GHOST_PX * self._mm_per_px, fix.change[0]))


def widening(fix: Fix | None = None) -> Matrix:
    """(8,) variance that a state gains as a reference: by a fix of its frame, or without one."""
    variance = np.square(LINK_ERROR)
    if fix is not None:
        variance[2] += _systematic(TURN_ERROR, fix) ** 2
    return variance


def _systematic(error: Matrix, fix: Fix) -> float:
    return float(error[0] + error[1] * (1 - fix.alignment.fidelity))
