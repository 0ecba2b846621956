"""Shapes of the scene in metres: the wall and its meshes, the camera's frustum, rays.

World as in `vo_core.geometry.wall`: X along the axis, Y right, Z down; the axis of a circular pipe
at Y = Z = 0, a flat floor at Z = 0.  Wall angle phi: 0 at the invert, rising to the right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.wall import (
    Pose,
    camera_position,
    cast,
    clock_of,
    pixel_rays,
    rotation_robot_camera,
)
from vo_core.rig import Rig

Vector = NDArray[np.float64]
"""(3,)"""


class Mesh(NamedTuple):
    """Triangles whose front shows their vertices counter-clockwise."""

    vertices: NDArray[np.float64]
    """(V, 3)"""
    faces: NDArray[np.int64]
    """(F, 3)"""


@dataclass(frozen=True, slots=True)
class WallHit:
    """A point on the wall that was clicked."""

    distance_m: float
    clock_h: float | None
    """In (0, 12], 12 at the crown; None on a floor."""
    lateral_m: float
    """Distance to the right of the axis."""


@dataclass(frozen=True, slots=True)
class PinHit:
    """A pin that was clicked."""

    id: str


Cut = Literal["none", "top", "side"]
"""Half of the pipe that is cut away: none, the upper, or the right one, near the observer."""


@dataclass(frozen=True, slots=True)
class Section:
    """Cross-section of the wall."""

    radius_m: float | None
    """None for a flat floor."""
    half_width_m: float
    """Half of the drawn floor, or the radius of a pipe."""

    @classmethod
    def of(cls, rig: Rig) -> Section:
        """Make the section of a rig; a floor is drawn six camera heights wide, as its edge is
        unknown.
        """
        if rig.pipe.radius_mm is not None:
            radius_m = rig.pipe.radius_mm / 1000
            return cls(radius_m, radius_m)
        return cls(None, 3e-3 * rig.mount.height_mm)

    @property
    def scale_m(self) -> float:
        """The length that sizes drawn things: a radius, or about one for a floor."""
        return self.radius_m or self.half_width_m / 4

    @property
    def axis_z_m(self) -> float:
        """Height of the middle of the space in which the robot drives."""
        return 0.0 if self.radius_m is not None else -self.scale_m

    def inset(self, by_m: float) -> Section:
        """Return the section moved towards the axis; a floor stays."""
        if self.radius_m is None:
            return self
        return Section(self.radius_m - by_m, self.half_width_m)

    @property
    def arcs_m(self) -> tuple[float, float]:
        """First and last arc of the whole wall."""
        half_m = self.half_width_m if self.radius_m is None else math.pi * self.radius_m
        return -half_m, half_m

    def kept_arcs_m(self, cut: Cut) -> tuple[float, float]:
        """Return first and last arc of the wall that a cut leaves; nothing is cut off a floor."""
        if cut == "none" or self.radius_m is None:
            return self.arcs_m
        quarter_m = math.pi / 2 * self.radius_m
        return (-quarter_m, quarter_m) if cut == "top" else (-2 * quarter_m, 0.0)

    def below(
        self, x_m: NDArray[np.float64], y_m: NDArray[np.float64], *, above_m: float
    ) -> Vector:
        """Return (N, 3) points on the wall below (x, y), raised by `above_m`."""
        if self.radius_m is None:
            z = np.full_like(x_m, -above_m)
        else:
            z = np.sqrt(np.maximum(self.radius_m**2 - y_m**2, 0.0)) - above_m
        return np.stack([x_m, y_m, z], axis=-1)

    def hit(
        self,
        origin: Sequence[float],
        direction: Sequence[float],
        reach_m: tuple[float, float],
        cut: Cut = "none",
    ) -> WallHit | None:
        """Return where a ray first meets the wall that is drawn from reach_m[0] to reach_m[1].

        For an observer outside, the near wall of a whole pipe is not drawn, so the far crossing
        counts; from inside there is only one ahead. What a cut has left is drawn from both sides.
        """
        o, d = np.asarray(origin, np.float64), np.asarray(direction, np.float64)
        for t in self._crossings(o, d, near_too=cut != "none"):
            point = o + t * d
            if t > 0 and self._is_drawn(point, reach_m, cut):
                x, y, z = point
                clock_h = None if self.radius_m is None else clock_of(float(np.arctan2(y, z)))
                return WallHit(float(x), clock_h, float(y))
        return None

    def _crossings(self, o: Vector, d: Vector, *, near_too: bool) -> list[float]:
        """Return where o + t d crosses the surface of the wall, as t, the nearest first."""
        if self.radius_m is None:
            return [float(-o[2] / d[2])] if abs(d[2]) > 1e-12 else []
        # |o + t d| = R across the axis: a t^2 + 2 b t + c = 0.
        a, b, c = d[1:] @ d[1:], o[1:] @ d[1:], o[1:] @ o[1:] - self.radius_m**2
        inner = b * b - a * c
        if a <= 1e-12 or inner < 0:
            return []
        near, far = (float((-b + sign * np.sqrt(inner)) / a) for sign in (-1, 1))
        return [near, far] if near_too else [far]

    def _is_drawn(self, point: Vector, reach_m: tuple[float, float], cut: Cut) -> bool:
        x, y, z = point
        if not reach_m[0] <= x <= reach_m[1]:
            return False
        if self.radius_m is None:
            return bool(abs(y) <= self.half_width_m)
        first_m, last_m = self.kept_arcs_m(cut)
        return bool(first_m <= self.radius_m * np.arctan2(y, z) <= last_m)


def wall_points(
    section: Section, xs_m: Sequence[float] | Vector, arcs_m: Sequence[float] | Vector, inset: float
) -> NDArray[np.float64]:
    """Return (N, 3) points before the wall by `inset` scales; arcs as in `Section.arcs_m`."""
    x, arc = np.asarray(xs_m, np.float64), np.asarray(arcs_m, np.float64)
    inset_m = inset * section.scale_m
    if section.radius_m is None:
        return np.stack([x, arc, np.full_like(x, -inset_m)], axis=1)
    phi, reach = arc / section.radius_m, section.radius_m - inset_m
    return np.stack([x, reach * np.sin(phi), reach * np.cos(phi)], axis=1)


def phi_of_clock(clock_h: float) -> float:
    """Return the wall angle in rad of a clock position: 6 o'clock is 0, 3 o'clock a quarter
    turn.
    """
    return float(np.radians(180.0 - 30.0 * clock_h))


def tube(radius_m: float, length_m: float, *, sides: int = 64, inward: bool) -> Mesh:
    """Return a cylinder's side along +X from the origin, visible from inside or from outside
    only.
    """
    ring = radius_m * _ring(np.linspace(0, 2 * np.pi, sides, endpoint=False))
    return _extruded(ring, length_m, is_closed=True, flip=inward)


def torus(radius_m: float, thickness_m: float, *, sides: int = 64, around: int = 8) -> Mesh:
    """Return a ring around the X axis; `radius_m` is that of its centre line."""
    ring = _ring(np.linspace(0, 2 * np.pi, sides, endpoint=False))
    psi = np.linspace(0, 2 * np.pi, around, endpoint=False)[:, None, None]
    vertices = (radius_m + thickness_m / 2 * np.cos(psi)) * ring
    vertices[..., 0] = thickness_m / 2 * np.sin(psi[..., 0])
    strip = _strip_faces(sides, is_closed=True)
    faces = np.concatenate([strip + sides * k for k in range(around)]) % (sides * around)
    return Mesh(vertices.reshape(-1, 3), faces)


def _ring(phi: Vector) -> NDArray[np.float64]:
    """Return (N, 3) points at the distance 1 from the axis, at x = 0."""
    return np.stack([np.zeros_like(phi), np.sin(phi), np.cos(phi)], axis=1)


def _extruded(
    line: NDArray[np.float64], length_m: float = 1.0, *, is_closed: bool = False, flip: bool = False
) -> Mesh:
    """Return the surface over which an (N, 3) line sweeps along +X."""
    faces = _strip_faces(len(line), is_closed=is_closed)
    return Mesh(np.concatenate([line, line + [length_m, 0, 0]]), faces[:, ::-1] if flip else faces)


def _strip_faces(count: int, *, is_closed: bool) -> NDArray[np.int64]:
    """Return faces between a line of so many vertices and the next one."""
    here = np.arange(count if is_closed else count - 1)
    there = (here + 1) % count
    return np.concatenate(
        [
            np.stack([here, here + count, there], axis=1),
            np.stack([there, here + count, there + count], axis=1),
        ]
    )


def plank(length_m: float, half_width_m: float) -> Mesh:
    """Return a floor from the origin along +X, visible from above (-Z)."""
    w = half_width_m
    vertices = np.array([[0, -w, 0], [length_m, -w, 0], [length_m, w, 0], [0, w, 0]], np.float64)
    return Mesh(vertices, np.array([[0, 2, 1], [0, 3, 2]]))


def strip(
    section: Section, arc_from_m: float, arc_to_m: float, *, sides: int = 64
) -> tuple[Mesh, NDArray[np.float64]]:
    """Return the wall between two arcs, one unit long from the origin along +X, visible from
    inside.

    The second value holds the (V, 2) texture coordinates of its vertices: u along +X, v from the
    first arc.
    """
    v = np.linspace(0.0, 1.0, sides + 1)
    arcs_m = arc_from_m + v * (arc_to_m - arc_from_m)
    mesh = _extruded(wall_points(section, np.zeros_like(v), arcs_m, 0.0), flip=True)
    return mesh, np.concatenate([np.stack([np.full_like(v, u), v], axis=1) for u in (0.0, 1.0)])


def dashed(mesh: Mesh, sides: int, *, dashes: int, share: float) -> Mesh:
    """Cut gaps into a strip, tube or torus with this number of sides; `share` of it stays."""
    side = np.arange(len(mesh.faces)) % sides
    return Mesh(mesh.vertices, mesh.faces[side * dashes / sides % 1.0 < share])


def half_shell(radius_m: float, thickness_m: float, phi_from: float, phi_to: float) -> Mesh:
    """Return a pipe, one metre long from the origin along +X, of which only the wall between two
    angles is left: inner and outer side and both faces of the cut.

    Its triangles have no common side to face, so it is to be drawn from both sides.
    """
    ring = _ring(np.linspace(phi_from, phi_to, 33))
    inner, outer = radius_m * ring, (radius_m + thickness_m) * ring
    # Each part has its own vertices: shared ones would round the edges of the cut.
    parts = [inner, outer, np.stack([inner[0], outer[0]]), np.stack([inner[-1], outer[-1]])]
    return joined([_extruded(line) for line in parts])


def cut_away(mesh: Mesh, phi_from: float, phi_to: float) -> Mesh:
    """Keep the triangles whose middles are between two wall angles."""
    _, y, z = mesh.vertices[mesh.faces].mean(axis=1).T
    phi = np.arctan2(y, z)
    return Mesh(mesh.vertices, mesh.faces[(phi_from <= phi) & (phi <= phi_to)])


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Return several meshes as one."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
    )


def octahedron() -> Mesh:
    """Return the diamond of a pin's head, one unit from the centre to each corner."""
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    x, y, z, a, b, c = range(6)  # a, b, c are opposite x, y, z
    faces = [[x, y, z], [y, a, z], [a, b, z], [b, x, z], [y, x, c], [a, y, c], [b, a, c], [x, b, c]]
    return Mesh(vertices, np.array(faces))


def yaw_wxyz(yaw_rad: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a turn about Z (down), positive from X towards Y."""
    return (float(np.cos(yaw_rad / 2)), 0.0, 0.0, float(np.sin(yaw_rad / 2)))


def camera_xyz_m(rig: Rig, x_m: float, y_m: float) -> Vector:
    """Return the position of the camera in the world."""
    return np.asarray(camera_position(rig, Pose(1000 * x_m, 1000 * y_m)) / 1000)


@dataclass(frozen=True, slots=True)
class Frustum:
    """The camera's field of view, cut off just before it touches the wall."""

    rotation: NDArray[np.float64]
    """(3, 3), p_robot = R p_camera."""
    fov_rad: float
    """Vertical field of view."""
    aspect: float
    """Width over height."""
    depth_m: float

    @property
    def half_extent_robot_m(self) -> Vector:
        """Half the size of the picture plane along the robot's axes."""
        half_height = self.depth_m * np.tan(self.fov_rad / 2)
        corner = [half_height * self.aspect, half_height, 0.0]
        return np.asarray(np.abs(self.rotation) @ corner)

    @classmethod
    def of(cls, rig: Rig) -> Frustum:
        """Make a frustum from the rays at the middles of the picture's edges, at most 120 degrees
        wide.
        """
        camera = rig.camera
        right, bottom = camera.width - 1.0, camera.height - 1.0
        edges = [(0.0, camera.cy), (right, camera.cy), (camera.cx, 0.0), (camera.cx, bottom)]
        rays = np.nan_to_num(pixel_rays(camera, edges))
        off_axis = np.arctan2(np.abs([rays[0:2, 0], rays[2:4, 1]]), rays[:, 2].reshape(2, 2))
        half_width, half_height = np.tan(np.minimum(off_axis.mean(axis=1), np.radians(60)))
        rotation = rotation_robot_camera(rig.mount)
        signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        corners = np.column_stack([signs * [half_width, half_height], np.ones(4)])
        touches = cast(rig, Pose(), corners @ rotation.T) - camera_position(rig, Pose())
        depths_m = touches @ rotation[:, 2] / 1000
        # A forward or wide camera sees far and wide: its picture stays within the size of the
        # robot.
        size = Section.of(rig).scale_m
        limits = [1.8 * size, size / half_width, size / half_height]
        depth_m = min([0.97 * d for d in depths_m if d > 0] + limits)
        return cls(
            rotation,
            float(2 * np.arctan(half_height)),
            float(half_width / half_height),
            float(depth_m),
        )
