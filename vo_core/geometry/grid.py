"""The wall of a pipe as lines in the picture of a camera that looks along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vo_core.errors import InvalidRig
from vo_core.geometry.wall import NOMINAL, Points, Pose, enclose, robot_pixels, sight
from vo_core.rig import Rig

RINGS_RADII = (1.0, 2.0, 3.0)
"""Usual distances of the rings ahead of the camera, in radii of the pipe."""

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
    """(RING_POINTS, 2) for each ring."""
    generators_uv: list[Points]
    """(GENERATOR_POINTS, 2) for each of `GENERATORS`, from the invert to the right."""


def grid(rig: Rig, pose: Pose = NOMINAL, *, rings_radii: Sequence[float] = RINGS_RADII) -> Grid:
    """Rings and generators that a rig's camera sees from a pose; they go with its distance.

    Raises:
        InvalidRig: The rig is of a flat floor, which has no rings.
    """
    radius_mm = rig.pipe.radius_mm
    if radius_mm is None:
        raise InvalidRig("A flat floor has no rings; the grid needs pipe.diameter_mm.")
    pose = replace(pose, x_mm=0.0)

    def seen(axial_radii: Points | float, phi_rad: Points | float) -> Points:
        axial, arc = np.broadcast_arrays(axial_radii, phi_rad)
        wall = enclose(rig, radius_mm * np.stack([axial, arc], 1))
        return robot_pixels(rig, sight(rig, pose, wall))

    around = np.linspace(0.0, 2 * np.pi, RING_POINTS)
    ahead = np.geomspace(NEAREST_RADII, FARTHEST_RADII, GENERATOR_POINTS)
    hours = 2 * np.pi * np.arange(GENERATORS) / GENERATORS
    return Grid(
        [seen(radii, around) for radii in rings_radii],
        [seen(ahead, float(phi)) for phi in hours],
    )
