"""What the bundle adjustment knows of one part of the film, and where it expects each point.

The focal length is nearly confounded with the way driven (r = f R / x) and with yaw and pitch (the
axis vanishes f tan(yaw) from the principal point).  So the unknowns are those that the film shows
directly: ways divided by the focal length, and the place where the axis vanishes.  They hardly
change with the lens, and the fit does not have to follow a long and bent valley.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.lab.film_rig.flow import Flow
from app.lab.film_rig.lens import LensPrior
from app.lab.film_rig.tracks import Tracks
from vo_core.geometry.wall import (
    Points,
    Poses,
    cast,
    develop,
    enclose,
    ray_pixels,
    robot_rays,
    rotation_robot_camera,
    sight,
)
from vo_core.rig import Camera, Mount, Pipe, Rig
from vo_core.types import Matrix

VIEW = 6
"""Unknowns of a keyframe: way over focal length (mm/px), y (mm), u of the vanishing point (px), z
(mm), v of the vanishing point (px), roll (rad): those of a pose, in its order."""

PLACE = 2
"""Unknowns of a point: axial place over focal length (mm/px), arc (mm)."""

FURTHEST = 60.0
"""Largest axial distance of a wall point from its first keyframe, in radii."""

NEAREST = 0.3
"""Least such distance."""


@dataclass(frozen=True)
class Part:
    """One part of the film in the fit."""

    tracks: Tracks
    views: Matrix
    """(K, 6) unknowns of the keyframes."""
    places: Matrix
    """(P, 2) unknowns of the points."""

    def observed(self, uv_px: Points) -> Part:
        """The same with other observations, (N, 2)."""
        return replace(self, tracks=replace(self.tracks, uv_px=uv_px))

    def only(self, kept: NDArray[np.bool_]) -> Part:
        """Keep the observations in a mask, (N,), of points that are still seen often enough."""
        tracks, still = self.tracks.only(kept)
        return replace(self, tracks=tracks, places=self.places[still])


@dataclass(frozen=True)
class Scene:
    """A camera of a certain kind in a pipe of known diameter."""

    prior: LensPrior
    diameter_mm: float

    @property
    def radius_mm(self) -> float:
        """Radius of the pipe."""
        return self.diameter_mm / 2

    def rig(self, camera: Camera) -> Rig:
        """A camera on the axis that looks straight ahead; poses are stated against it."""
        mount = {"view": "forward", "height_mm": self.radius_mm, "rotation_deg": 0.0}
        pipe = {"shape": "circular", "diameter_mm": self.diameter_mm}
        return Rig(camera=camera, mount=Mount.parse(mount), pipe=Pipe.parse(pipe))

    def start(self, tracks: Tracks, flow: Flow, lens: Matrix) -> Part:
        """Views by the flow; points where their first rays meet the wall.

        Points that are not on the wall are left out.
        """
        views = np.zeros((len(tracks.t_s), VIEW))
        views[:, 0] = flow.drive * self.radius_mm
        views[:, [2, 4]] = flow.vanishing_px
        first = tracks.starts
        camera = self.prior.camera(lens)
        ahead, arc = self._developed(camera, views[tracks.keyframe[first]], tracks.uv_px[first]).T
        far = ahead * camera.fx / self.radius_mm
        good = np.isfinite(arc) & (far > NEAREST) & (far < FURTHEST)
        places = np.stack([ahead + views[tracks.keyframe[first], 0], arc], 1)
        return Part(tracks, views, places).only(good[tracks.point])

    def poses(self, camera: Camera, views: Matrix) -> Matrix:
        """(N, 6) poses x, y, yaw, z, pitch, roll, mm and rad, of unknowns."""
        poses = views.copy()
        poses[:, 0] *= camera.fx
        # The axis is seen along (1, -tan(yaw), tan(pitch) / cos(yaw)) in robot axes.
        yaw = np.arctan((camera.cx - views[:, 2]) / camera.fx)
        poses[:, 2] = yaw
        poses[:, 4] = np.arctan((views[:, 4] - camera.cy) / camera.fy * np.cos(yaw))
        return poses

    def pixels(self, lens: Matrix, part: Part) -> Points:
        """(N, 2) where the observations of a part should be; nan where the camera cannot see."""
        tracks = part.tracks
        return self.seen(lens, part.views[tracks.keyframe], part.places[tracks.point])

    def seen(self, lens: Matrix, views: Matrix, places: Matrix) -> Points:
        """(N, 2) px of points of the wall, (N, 2), from the views (N, 6)."""
        camera = self.prior.camera(lens)
        rig, poses = self.rig(camera), self.poses(camera, views)
        rays = sight(rig, Poses(*poses.T), enclose(rig, places * (camera.fx, 1.0)))
        return ray_pixels(camera, rays @ rotation_robot_camera(rig.mount))

    def around(
        self, lens: Matrix, part: Part, reference: NDArray[np.intp], reach_px: float
    ) -> Matrix:
        """How the neighbourhoods of the points look in each observation.

        Args:
            lens: The lens, (5,).
            part: The part of the film.
            reference: (P,) one observation of each point.
            reach_px: Half the side of a square in the picture of that observation.
        Returns:
            (N, 3, 3, 2) px from the point to rows and columns of the square's nine nodes.
        """
        tracks, camera = part.tracks, self.prior.camera(lens)
        steps = np.array([-reach_px, 0.0, reach_px])
        square = np.stack(np.meshgrid(steps, steps), -1)  # [row, column] -> (u, v)
        centre = self.pixels(lens, part)
        nodes = (centre[reference][:, None, None] + square).reshape(-1, 2)
        views = np.repeat(part.views[tracks.keyframe[reference]], 9, axis=0)
        places = self._developed(camera, views, nodes)
        places[:, 0] += views[:, 0]
        places = places.reshape(-1, 9, 2)[tracks.point].reshape(-1, 2)
        seen = self.seen(lens, np.repeat(part.views[tracks.keyframe], 9, axis=0), places)
        return np.nan_to_num(seen.reshape(-1, 3, 3, 2) - centre[:, None, None])

    def _developed(self, camera: Camera, views: Matrix, uv_px: Points) -> Matrix:
        """(N, 2) unknowns of the wall points that pixels show, the axial one from the camera."""
        rig, poses = self.rig(camera), self.poses(camera, views)
        poses[:, 0] = 0.0
        wall = develop(rig, cast(rig, Poses(*poses.T), robot_rays(rig, uv_px)))
        return np.asarray(wall / (camera.fx, 1.0))
