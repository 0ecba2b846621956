"""Draws the robot: a small crawler with camera, field of view, live picture and lamp."""

from __future__ import annotations

import numpy as np
import viser
from viser.transforms import SO3

from app.survey.distances.interval import half_width_m
from app.survey.rounding import metres
from app.viewer.geometry import Frustum, Section, camera_xyz_m, yaw_wxyz
from app.viewer.look import CameraMode
from app.viewer.wording import Wording
from vo_core.rig import Rig
from vo_core.track import Estimate

_BODY = (240, 172, 32)
_TRIM = (104, 114, 124)
_TYRE = (52, 56, 60)
_LAMP = (255, 244, 214)
_SIGHT = (64, 214, 255)
_LABEL_HEIGHT: dict[CameraMode, float] = {"overview": 3.4, "follow": 1.9, "inside": 0.72}
"""Height above the axis, in scales of the section: clear of the pins' labels, and in sight."""


class Robot:
    """Creates the robot once and then only moves it."""

    def __init__(self, scene: viser.SceneApi, rig: Rig, section: Section) -> None:
        self._scene = scene
        self._rig = rig
        self._section = section
        self._frame = scene.add_frame("/robot", show_axes=False)
        frustum = Frustum.of(rig)
        self._solid = (
            scene.add_frame("/robot/body", show_axes=False),
            scene.add_frame(
                "/robot/camera", show_axes=False, wxyz=SO3.from_matrix(frustum.rotation).wxyz
            ),
        )
        self._draw_body(frustum)
        self._draw_lamp(frustum)
        self._picture = self._draw_camera(frustum)
        self._label = scene.add_label(
            "/robot_label", "", font_screen_scale=1.6, anchor="bottom-center"
        )

    def show(
        self, estimate: Estimate, mode: CameraMode, wording: Wording, *, is_quiet: bool
    ) -> None:
        """Move everything to the estimate; in a low window the read-out of the page must do."""
        x_m, y_m = estimate.distance_mm / 1000, estimate.y_mm / 1000
        self._frame.position = camera_xyz_m(self._rig, x_m, y_m)
        self._frame.wxyz = yaw_wxyz(np.radians(estimate.yaw_deg))
        # From inside the robot would fill the picture; its lamp stays.
        is_solid = mode != "inside"
        for part in self._solid:
            if part.visible != is_solid:
                part.visible = is_solid

        self._label.visible = not (wording.is_late or is_quiet)
        self._label.text = _label_text(estimate, wording)
        raised_m = _LABEL_HEIGHT[mode] * self._section.scale_m
        self._label.position = (x_m, 0.0, self._section.axis_z_m - raised_m)

    def show_preview(self, jpeg: bytes) -> None:
        """Show the live picture; its bytes are sent to the browser undecoded."""
        self._picture._image_data = jpeg

    def _draw_body(self, frustum: Frustum) -> None:
        """Draw a chassis on four wheels behind the field of view, and a mast that carries the
        camera.
        """
        size, mount = self._section.scale_m, self._rig.mount
        y = -mount.lateral_mm / 1000
        ground = self._below_camera_m(0.42 * size)
        wheel_z, deck_z = ground - 0.2 * size, ground - 0.36 * size
        ahead = 0.12 * size if mount.view == "forward" else frustum.half_extent_robot_m[0]
        front = -min(ahead, size) - 0.14 * size
        self._box("body/chassis", _BODY, (1.25, 0.62, 0.24), (front - 0.62 * size, y, deck_z))
        self._box(
            "body/deck", _TRIM, (0.8, 0.4, 0.08), (front - 0.66 * size, y, deck_z - 0.16 * size)
        )
        for name, along in (("rear", -1.02), ("front", -0.24)):
            for side in (-1, 1):
                self._scene.add_cylinder(
                    f"/robot/body/wheel_{name}_{'left' if side < 0 else 'right'}",
                    radius=0.2 * size,
                    height=0.14 * size,
                    color=_TYRE,
                    wxyz=SO3.from_x_radians(np.pi / 2).wxyz,
                    position=(front + along * size, y + side * 0.4 * size, wheel_z),
                    cast_shadow=False,
                    receive_shadow=False,
                )
        arm_z = -0.1 * size if mount.view == "down" else 0.0
        mast_x = front - 0.12 * size
        self._box(
            "body/mast",
            _TRIM,
            (0.09, 0.12, abs(deck_z - arm_z) / size + 0.09),
            (mast_x, y, (deck_z + arm_z) / 2),
        )
        self._box("body/arm", _TRIM, (-mast_x / size, 0.1, 0.09), (mast_x / 2, y, arm_z))
        if y:
            self._box("body/cross", _TRIM, (0.09, abs(y) / size, 0.09), (0.0, y / 2, arm_z))

    def _draw_lamp(self, frustum: Frustum) -> None:
        size = self._section.scale_m
        self._scene.add_light_point(
            "/robot/lamp",
            color=_LAMP,
            intensity=3.3 * size**2,  # in cd: the same light on the wall of any size of pipe
            distance=9 * size,
            position=tuple(0.1 * size * frustum.rotation[:, 2]),
        )

    def _draw_camera(self, frustum: Frustum) -> viser.CameraFrustumHandle:
        size = self._section.scale_m
        self._box("camera/head", _BODY, (0.24, 0.2, 0.18), (0.0, 0.0, -0.1 * size))
        self._scene.add_cylinder(
            "/robot/camera/lens",
            radius=0.075 * size,
            height=0.05 * size,
            color=_LAMP,
            cast_shadow=False,
            receive_shadow=False,
        )
        # viser normalises a frustum by its volume: depth = scale / cbrt(tan(fov/2)^2 aspect / 3).
        volume = np.tan(frustum.fov_rad / 2) ** 2 * frustum.aspect / 3
        return self._scene.add_camera_frustum(
            "/robot/camera/view",
            fov=frustum.fov_rad,
            aspect=frustum.aspect,
            scale=float(frustum.depth_m * np.cbrt(volume)),
            thickness=0.018 * size,
            color=_SIGHT,
            format="jpeg",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _below_camera_m(self, beside_m: float) -> float:
        """Return the height of the wall below the camera at a lateral distance from the middle."""
        height_m = self._rig.mount.height_mm / 1000
        radius = self._section.radius_m
        return (
            height_m
            if radius is None
            else height_m - radius + float(np.sqrt(radius**2 - beside_m**2))
        )

    def _box(
        self,
        name: str,
        color: tuple[int, int, int],
        size_in_scales: tuple[float, float, float],
        position: tuple[float, float, float],
    ) -> None:
        self._scene.add_box(
            f"/robot/{name}",
            color=color,
            dimensions=self._section.scale_m * np.array(size_in_scales),
            position=position,
            cast_shadow=False,
            receive_shadow=False,
        )


def _label_text(estimate: Estimate, wording: Wording) -> str:
    note = "" if estimate.status == "ok" else f" · {wording.word(estimate.status)}"
    # Another program measured the distance, without sigma or quality.
    is_imported = estimate.sigma_distance_mm == 0 and estimate.quality == 0
    half_m = half_width_m(estimate.sigma_distance_mm)
    interval = "" if is_imported else f" {wording.interval(half_m)}"
    distance = wording.distance(metres(estimate.distance_mm), more_decimals=1)
    return f"{distance}{interval}{note}"
