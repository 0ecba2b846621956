"""The wall of a pipe as lines in the picture of a camera that looks along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vo_core.errors import InvalidRig
from vo_core.geometry.wall import Points, Pose, enclose, robot_pixels, sight
from vo_core.rig import Rig

RINGS_RADII = (1.0, 2.0, 3.0)
"""Distances of the rings ahead of the camera, in radii of the pipe."""

GENERATORS = 12
"""Straight lines along the wall, one at each hour of the clock."""

RING_POINTS = 97
"""Points of a ring, the first and the last at the invert."""

NEAREST_RADII, FARTHEST_RADII, GENERATOR_POINTS = 0.5, 30.0, 33
"""A generator begins beside most pictures and ends near the axis; its points are about evenly
spaced in the picture, and so ever farther apart on the wall."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Lines of the wall in a picture; nan where the lens does not see the wall."""

    rings_uv: list[Points]
    """(RING_POINTS, 2) for each of `RINGS_RADII`."""
    generators_uv: list[Points]
    """(GENERATOR_POINTS, 2) for each of `GENERATORS`, from the invert to the right."""


def grid(rig: Rig, yaw_rad: float = 0.0) -> Grid:
    """Rings and generators that a rig's camera sees, turned aside by `yaw_rad` (from x towards y).

    Raises:
        InvalidRig: The rig is of a flat floor, which has no rings.
    """
    if rig.pipe.diameter_mm is None:
        raise InvalidRig("A flat floor has no rings; the grid needs pipe.diameter_mm.")
    radius_mm = rig.pipe.diameter_mm / 2
    pose = Pose(yaw_rad=yaw_rad)

    def seen(axial_radii: Points | float, phi_rad: Points | float) -> Points:
        axial, arc = np.broadcast_arrays(axial_radii, phi_rad)
        wall = enclose(rig, radius_mm * np.stack([axial, arc], 1))
        return robot_pixels(rig, sight(rig, pose, wall))

    around = np.linspace(0.0, 2 * np.pi, RING_POINTS)
    ahead = np.geomspace(NEAREST_RADII, FARTHEST_RADII, GENERATOR_POINTS)
    hours = 2 * np.pi * np.arange(GENERATORS) / GENERATORS
    return Grid(
        [seen(radii, around) for radii in RINGS_RADII],
        [seen(ahead, float(phi)) for phi in hours],
    )
