"""Rolling shutter: the exposure times of points of the developed wall.

Row r of H is exposed at t + readout (r / H - 1/2), where t is the frame's time. A patch is
rectified from the nominal pose, so the rig alone determines the row that shows a place of the
patch, in the reference and in the moving picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vo_core.geometry.wall import Points, Pose, enclose, robot_pixels, sight
from vo_core.rig import Rig
from vo_core.types import Matrix


def exposure_s(rig: Rig, axial_arc_mm: Points) -> Matrix:
    """Compute when places of the developed wall were exposed, from the frame's own time.

    Args:
        axial_arc_mm: (..., 2), from the nominal pose, as `PatchGrid.to_mm` gives them.
    Returns:
        (...), within +-readout / 2 for places in the picture and beyond it for those around it; 0
        where the lens cannot see.
    """
    places = np.asarray(axial_arc_mm, np.float64)
    rays = sight(rig, Pose(), enclose(rig, places.reshape(-1, 2)))
    rows = robot_pixels(rig, rays)[:, 1].reshape(places.shape[:-1])
    offset_s = rig.camera.readout_ms / 1000 * (rows / rig.camera.height - 0.5)
    return np.nan_to_num(offset_s, nan=0.0)


@dataclass(frozen=True)
class Exposure:
    """Exposure times of fixed places of a reference's patch, with their first two derivatives."""

    offset_s: Matrix
    """(N,) from the frame's own time."""
    slope: Matrix
    """(N, 2) slope along the axial and the arc coordinate, s/mm."""
    bend: Matrix
    """(N, 2, 2) second derivatives, s/mm^2: wide lenses show rows as curves."""

    @classmethod
    def of(cls, rig: Rig, axial_arc_mm: Points) -> Exposure:
        """Compute the times of (N, 2) places, as `exposure_s` takes them."""
        step_mm = 0.5  # step of the numerical derivatives; rows bend over many millimetres
        steps_mm = step_mm * np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
        around = exposure_s(rig, axial_arc_mm[:, None, :] + steps_mm)
        # The place itself is 4; 1 and 7 lie behind and ahead of it, 3 and 5 to its left and right.
        at = around[:, 4]
        slope = np.stack([around[:, 7] - around[:, 1], around[:, 5] - around[:, 3]], 1)
        axial = around[:, 7] + around[:, 1] - 2 * at
        arc = around[:, 5] + around[:, 3] - 2 * at
        mixed = (around[:, 8] + around[:, 0] - around[:, 2] - around[:, 6]) / 4
        bend = np.stack([axial, mixed, mixed, arc], 1).reshape(-1, 2, 2)
        return cls(at, slope / (2 * step_mm), bend / step_mm**2)

    def of_moved(self, moved_mm: Matrix, velocity_mm_s: Matrix) -> Matrix:
        """Exposure times of the places in a picture that shows them elsewhere, s from its time.

        A place that appears at w at the frame's time, and drifts with V, is exposed dt later, when
        it appears at w + V dt: dt = T(w + V dt), so dt = T(w) / (1 - T'(w) V), where T gives the
        exposure time of a place.  T and T' are expanded about the place in the reference to second
        order.

        Args:
            moved_mm: (..., N, 2): where the moving picture would show the places at its own
                time, less their places in the reference, both as (axial, arc) of the patch.
            velocity_mm_s: (..., N, 2) or (2,), V: how fast they drift in the patch. A camera that
                drives forward at v has V = (-v, 0), about.
        Returns:
            (..., N)
        """
        turned = (self.bend * moved_mm[..., None, :]).sum(-1)
        offset_s = self.offset_s + ((self.slope + turned / 2) * moved_mm).sum(-1)
        return np.asarray(offset_s / (1 - ((self.slope + turned) * velocity_mm_s).sum(-1)))
