"""Sizes on the wall between points that a person points at: lengths, areas, steps, depths.

Points lie on the wall of a pipe about the axis Y = Z = 0, or on the floor Z = 0, in the axes of
`wall`: X along the pipe, Y right, Z down, mm. Lengths and areas are those of the developed wall,
since a tape follows the wall too.
"""

from __future__ import annotations

import numpy as np

from vo_core.geometry.wall import Points


def developed_points(points_xyz: Points, radius_mm: float | None) -> Points:
    """(N, 2) axial and arc mm of (N, 3) points on the wall, without a jump at the crown.

    Each point follows the one before it the short way round, so that arcs may exceed half a turn.
    """
    if radius_mm is None:
        return points_xyz[:, :2]
    phi_rad = np.unwrap(np.arctan2(points_xyz[:, 1], points_xyz[:, 2]))
    return np.column_stack([points_xyz[:, 0], radius_mm * phi_rad])


def length_mm(points_xyz: Points, radius_mm: float | None) -> float:
    """Length of the line through (N, 3) points, along the wall."""
    steps = np.diff(developed_points(points_xyz, radius_mm), axis=0)
    return float(np.hypot(*steps.T).sum())


def area_mm2(points_xyz: Points, radius_mm: float | None) -> float:
    """Area of the polygon with (N, 3) corners, on the developed wall (Gauss's formula)."""
    x, y = developed_points(points_xyz, radius_mm).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def gap_mm(points_xyz: Points) -> float:
    """Distance of two points along the pipe's axis, as of an open joint."""
    return float(abs(points_xyz[1, 0] - points_xyz[0, 0]))


def step_mm(points_xyz: Points, camera_xyz: Points, radius_mm: float | None) -> float:
    """How far an edge stands into the pipe, or above the floor; negative behind the wall.

    One picture gives a ray to the edge but no depth. A step at a joint lies in the section across
    the pipe through the joint; the first point, on the near wall, gives that section, and the ray
    through the second one, (2, 3) `camera_xyz` to `points_xyz`, meets it at the edge.

    Returns:
        nan where the ray runs along the section, as a camera that looks straight at the wall sees
        no step, and where the section lies behind the camera.
    """
    section, towards = points_xyz[0, 0], points_xyz[1] - camera_xyz[1]
    ahead = section - camera_xyz[1, 0]
    if ahead * towards[0] <= 0:
        return float("nan")
    edge = camera_xyz[1] + ahead / towards[0] * towards
    if radius_mm is None:
        return float(-edge[2])
    return float(radius_mm - np.hypot(edge[1], edge[2]))


def fill_share(points_xyz: Points) -> float:
    """Depth of a level bed or of water in a pipe, as a share of its diameter, 0 to 1.

    The chord between its two edges on the wall, half angle a from the middle of the bed, cuts off
    (1 - cos a) / 2 of the diameter. Both edges are seen from the invert, so a pipe more than half
    full has a > 90 degrees; a robot that leans does not change it.
    """
    left_rad, right_rad = np.arctan2(points_xyz[:, 1], points_xyz[:, 2])
    return float((1 - np.cos((right_rad - left_rad) / 2)) / 2)
