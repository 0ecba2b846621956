"""Positions of the observer: overview, follow and inside; and moving browsers to them."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import viser
from viser.transforms import SO3

from app.viewer.geometry import Section, Vector
from app.viewer.look import CameraMode

Reach = tuple[float, float]
"""First and last metre of the drawn culvert."""

UP = np.array([0.0, 0.0, -1.0])
"""Away from the ground: world z points down."""
LOW_PX = 260
"""Height of a window below which labels hide each other: then only the needed ones are shown."""
_SETTLED_S = 2.0
"""Until this long after a command, a browser may still report its old camera."""


@dataclass(frozen=True)
class View:
    """A pose of the observer's camera."""

    position: Vector
    look_at: Vector
    fov_rad: float
    """Vertical field of view."""

    def is_near(self, other: View) -> bool:
        """Return whether a move from this view to the other would be invisible."""
        scale = np.linalg.norm(self.look_at - self.position)
        moved = np.abs([self.position - other.position, self.look_at - other.look_at]).max()
        return bool(moved < 1e-3 * scale)


def view_of(
    mode: CameraMode, section: Section, reach_m: Reach, robot_x_m: float, aspect: float
) -> View:
    """Return the view of a mode; `aspect` is width over height of the observer's window."""
    if mode == "overview":
        return _overview(section, _stretch(section, reach_m, robot_x_m), aspect)
    size, axis_z = section.scale_m, section.axis_z_m
    if mode == "follow":
        away = size * max(1.0, 1.3 / aspect)  # a narrow window needs more distance
        return View(
            np.array([robot_x_m - 4.6 * away, 3.4 * away, axis_z - 3.2 * away]),
            np.array([robot_x_m - 0.2 * size, 0.0, axis_z]),
            np.radians(45),
        )
    # Just far enough behind that the ring on the wall, the place that the film shows, is in sight.
    return View(
        np.array([robot_x_m - 2.2 * size, 0.0, axis_z]),
        np.array([robot_x_m + 1.0 * size, 0.0, axis_z]),
        np.radians(60),
    )


def named_stretch(
    mode: CameraMode, section: Section, reach_m: Reach, robot_x_m: float, *, is_low: bool
) -> Reach:
    """Return the part of the culvert that is seen well enough to be labelled; `is_low`: in a low
    window.
    """
    if mode == "overview":
        return _stretch(section, reach_m, robot_x_m)
    if is_low:
        return robot_x_m, robot_x_m + 6 * section.scale_m
    ahead = 22 if mode == "follow" else 14
    return robot_x_m - 9 * section.scale_m, robot_x_m + ahead * section.scale_m


def _stretch(section: Section, reach_m: Reach, robot_x_m: float) -> Reach:
    """Return the part shown in an overview: the whole culvert, or the part around the robot.

    It moves in steps of half its length, so that the overview rests most of the time.
    """
    first, last = reach_m
    span = 60 * section.scale_m
    if last - first <= span:
        return reach_m
    start = first + (np.floor(2 * (robot_x_m - first) / span) - 0.5) * span / 2
    start = float(np.clip(start, first, last - span))
    return start, start + span


def _overview(section: Section, stretch_m: Reach, aspect: float) -> View:
    """Look from the right, above and behind, as near as the stretch still fits the window."""
    fov_rad = np.radians(36)
    azimuth, elevation = np.radians(46), np.radians(24)
    forward = np.array([np.cos(azimuth), -np.sin(azimuth), np.tan(elevation)])
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, UP)
    right /= np.linalg.norm(right)
    above = np.cross(right, forward)
    half, axis_z = 1.3 * section.half_width_m, section.axis_z_m
    corners = np.array(
        [[x, y, axis_z + z] for x in stretch_m for y in (-half, half) for z in (-half, half)]
    )
    centre = corners.mean(axis=0)
    across, upward, depth = ((corners - centre) @ np.stack([right, above, forward], axis=1)).T
    # A corner is in view while |across - shift| <= (distance + depth) tan(half the field of view).
    tan_v = 0.88 * np.tan(fov_rad / 2)
    tan_h = tan_v * aspect
    shift_h, distance_h = _fit(across, depth, tan_h)
    shift_v, distance_v = _fit(upward, depth, tan_v)
    look_at = centre + shift_h * right + shift_v * above
    return View(look_at - max(distance_h, distance_v) * forward, look_at, fov_rad)


def _fit(offset: Vector, depth: Vector, tan: float) -> tuple[float, float]:
    """Return sideways shift and distance of the nearest observer who sees all offsets."""
    high, low = np.max(offset - tan * depth), np.max(-offset - tan * depth)
    return float(high - low) / 2, float(high + low) / (2 * tan)


def sight_line(camera: viser.CameraHandle, at: tuple[float, float]) -> tuple[Vector, Vector]:
    """Return origin and direction of the ray through a point of the picture.

    `at` holds right and down as shares of the picture's size. A camera looks along its Z, X is
    right and Y down.
    """
    half = np.tan(camera.fov / 2)
    across = [(2 * at[0] - 1) * half * camera.aspect, (2 * at[1] - 1) * half, 1.0]
    return np.asarray(camera.position), np.asarray(SO3(camera.wxyz).as_matrix() @ across)


@dataclass(frozen=True)
class _Command:
    view: View
    at_s: float
    """time.monotonic"""


class Observers:
    """Moves the camera of each connected browser: at once on a new mode, then along with the robot.

    An overview that the user has turned stays until a mode is chosen again. Follow and inside move
    with the robot and may be turned while it stands still.
    """

    def __init__(self, server: viser.ViserServer, section: Section) -> None:
        self._server = server
        self._section = section
        self._mode: CameraMode = "overview"
        self._commands: dict[int, _Command] = {}
        server.initial_camera.near = 0.03 * section.scale_m
        server.initial_camera.far = 4000 * section.scale_m

    @property
    def are_low(self) -> bool:
        """Whether a browser's window is too low for many labels."""
        clients = self._server.get_clients().values()
        return any(client.camera.image_height < LOW_PX for client in clients)

    def set_mode(self, mode: CameraMode) -> None:
        """Set the mode of all browsers; the next `update` applies it."""
        self._mode = mode
        self._commands.clear()
        size = self._section.scale_m
        # In the pipe the far end fades to dark instead of ending in a bright spot.
        self._server.scene.configure_fog(
            4 * size, 36 * size, color=(9, 13, 18), enabled=mode == "inside"
        )

    def set_initial(self, reach_m: Reach) -> View:
        """Set and return the first view of a stand-alone page, which gets no commands and has an
        unknown aspect.

        Do not use it for browsers that get commands: viser's client moves to the initial camera
        some time after connecting, whatever it received in between.
        """
        view = view_of("overview", self._section, reach_m, reach_m[0], aspect=1.2)
        self._server.initial_camera.position = view.position
        self._server.initial_camera.look_at = view.look_at
        self._server.initial_camera.fov = view.fov_rad
        return view

    def update(self, reach_m: Reach, robot_x_m: float) -> None:
        """Move each browser to its view, if that has changed."""
        clients = self._server.get_clients()
        self._commands = {n: command for n, command in self._commands.items() if n in clients}
        for number, client in clients.items():
            view = view_of(self._mode, self._section, reach_m, robot_x_m, client.camera.aspect)
            last = self._commands.get(number)
            if last is None or not (
                view.is_near(last.view)
                or (self._mode == "overview" and _has_left(client.camera, last))
            ):
                self._commands[number] = _Command(view, time.monotonic())
                with client.atomic():
                    client.camera.position = view.position
                    client.camera.look_at = view.look_at
                    client.camera.up_direction = UP
                    client.camera.fov = view.fov_rad


def _has_left(camera: viser.CameraHandle, command: _Command) -> bool:
    """Return whether the user has moved the camera away from where it was sent."""
    if time.monotonic() - command.at_s < _SETTLED_S:
        return False
    seen = View(camera.position, camera.look_at, camera.fov)
    return not command.view.is_near(seen)
