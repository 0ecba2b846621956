"""How the developed wall moves in a patch when the robot moves: the exact motion model.

A patch is rectified as if the camera stood centred and straight.  With the camera y mm beside the
axis or turned by a yaw this is not quite so, and driving on then shears the patch (by dx y / (R h)
on a cylinder); a rigid fit reads half of that as rotation.  So the model is not rigid: each patch
point goes out along its ray to the wall from the reference pose, and back from there to the patch
of the moving camera.
"""

from __future__ import annotations

import numpy as np

from vo_core.align import Warp
from vo_core.rectify import NOMINAL, PatchGrid
from vo_core.rig import Rig
from vo_core.types import Matrix
from vo_core.wall import Points, Pose, Poses, cast, develop, enclose, sight


class WallMotion:
    """The motion model at fixed points of the patch, whose rays are computed once.

    q = (x, y, yaw, y_reference, yaw_reference) in mm and rad: the pose of the moving camera, and
    what of the reference's pose shows in the picture.  Its axial coordinate does not: it is given.
    """

    def __init__(self, rig: Rig, grid: PatchGrid, points_px: Points) -> None:
        self._rig, self._grid = rig, grid
        self._rays = sight(rig, NOMINAL, enclose(rig, grid.to_mm(points_px)))
        turn_rad = 2 / max(grid.shape)
        self.scales = np.array([grid.mm_per_px, grid.mm_per_px, turn_rad, grid.mm_per_px, turn_rad])
        """Steps of q that move the content by about a pixel at the border of the patch."""

    def against(self, reference_x_mm: float) -> Warp:
        """w(q): where the points of a reference's patch lie in the moving camera's patch, px."""

        def warp(q: Matrix) -> Points:
            x, y, yaw, y_reference, yaw_reference = (q[..., i, None] for i in range(5))
            at = Poses(np.full_like(x, reference_x_mm), y_reference, yaw_reference)
            wall = cast(self._rig, at, self._rays)
            appears = cast(self._rig, NOMINAL, sight(self._rig, Poses(x, y, yaw), wall))
            return self._grid.to_px(develop(self._rig, appears))

        return warp


def moved_by_content(pose: Pose, shift_mm: tuple[float, float], reference_yaw_rad: float) -> Pose:
    """The pose of a camera that sees the content `shift_mm` (axial, arc) off the expected place.

    Content moves opposite to the camera, in the axes of the reference: d = -R(yaw_reference) s.
    """
    cos, sin = np.cos(reference_yaw_rad), np.sin(reference_yaw_rad)
    axial, arc = shift_mm
    return Pose(
        pose.x_mm - (cos * axial - sin * arc), pose.y_mm - (sin * axial + cos * arc), pose.yaw_rad
    )
