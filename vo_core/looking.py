"""Recognises a camera that looks around while the robot stands.

An operator stops at a defect, turns the camera to it and back.  The gaze then leaves the direction
in which the robot has driven, and returns to it, without any way between.  A camera that is pushed
through the pipe by hand turns as far, but only while it moves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vo_core.types import Matrix

ASIDE_RAD = float(np.radians(10.0))
"""Angle between gaze and driving direction from which the camera looks around."""

BACK_RAD = float(np.radians(6.0))
"""Angle below which it looks ahead again."""

MEMORY_MM = 100.0
"""Way over which the driving direction is averaged."""


@dataclass
class Looking:
    """Compares the gaze of each frame with the driving direction."""

    is_around: bool = False
    """Whether the camera looks around."""
    held_mm: float = 0.0
    """Where the robot has stood since then."""
    ahead: Matrix | None = None
    """(2,) yaw and pitch of the driving direction; None before the first frame."""
    _last_mm: float = 0.0

    def follow(self, x_mm: float, gaze: Matrix) -> None:
        """Add a frame with a fix.

        Args:
            x_mm: Position along the pipe.
            gaze: (2,) yaw and pitch of the camera in the pipe, rad.
        """
        if self.ahead is None:
            self.ahead, self._last_mm = gaze, x_mm
        driven = 1 - np.exp(-abs(x_mm - self._last_mm) / MEMORY_MM)
        ahead = self.ahead + (gaze - self.ahead) * driven
        aside_rad = float(np.abs(gaze - ahead).max())
        if self.is_around:
            self.is_around = aside_rad > BACK_RAD
        elif aside_rad > ASIDE_RAD:
            self.is_around, self.held_mm = True, self._last_mm
        if not self.is_around:
            self.ahead, self._last_mm = ahead, x_mm
