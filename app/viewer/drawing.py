"""Draws everything in one viser scene: what is new, and what moves along with the robot."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

import viser

from app.survey.places.measure import Figure
from app.viewer.culvert import Culvert, JointMark
from app.viewer.geometry import Cut, Section, WallHit
from app.viewer.interval import Interval
from app.viewer.look import CameraMode
from app.viewer.page import with_our_head
from app.viewer.pin import Pin
from app.viewer.pin_labels import Emphasis
from app.viewer.pins import Pins, pin_under
from app.viewer.robot import Robot
from app.viewer.ruler import Ruler
from app.viewer.scale_bar import ScaleBar
from app.viewer.trail import MAX_POINTS, PathPoint, Trail
from app.viewer.views import Observers, Reach, named_stretch, sight_line
from app.viewer.wall import TexturedWall, WallPictures
from app.viewer.wording import Wording
from vo_core.rig import Rig
from vo_core.track import Estimate

_PREVIEW_PERIOD_S = 0.2
_PREVIEW_BYTES_PER_S = 100_000
"""Limit of the picture stream: queued pictures delay a browser on a slow line."""


@dataclass(frozen=True)
class Shown:
    """Everything that can be clicked."""

    pins: tuple[Pin, ...]
    mode: CameraMode
    reach_m: Reach
    cut: Cut


@dataclass(frozen=True)
class Measure:
    """Whether clicks measure, and the points that they have set: none, one or two."""

    is_on: bool
    points: tuple[WallHit, ...] = ()
    figure: Figure | None = None
    """The length between two points, as soon as it is known."""


class Changes(TypedDict, total=False):
    """What to draw next, the newest of each kind; what is missing stays as it is."""

    pose: Estimate
    """Of the robot; the culvert is extended to it."""
    preview: bytes
    """JPEG for the frustum, 320 px wide; it is shown at most 5 times and 100 kB a second."""
    pins: Sequence[Pin]
    """All defects; their labels are in the language of the page."""
    selected: str | None
    """Id of the pin to highlight, now or as soon as it exists; None: no pin."""
    pointer: tuple[float, float] | None
    """Where the pointer is in the view: right and down, as shares of its size; None: elsewhere."""
    measure: Measure
    cut: Cut
    mode: CameraMode
    """To which the cameras of the browsers are moved."""
    wording: Wording
    """Language and unit of the labels."""
    length_m: float
    """At least this length of culvert is drawn, in whole metres; it never shrinks."""
    joints: Sequence[JointMark]
    wall: WallPictures
    path_is_reset: bool
    """The path is removed, before `path` extends it."""
    path: list[PathPoint]


class Drawing:
    """Everything that touches viser; used by one thread at a time."""

    def __init__(
        self,
        server: viser.ViserServer,
        rig: Rig,
        section: Section,
        wake: threading.Event,
        *,
        is_still: bool,
    ) -> None:
        """`wake` is set when a browser has come; `is_still` is for a stand-alone page."""
        self.server = server
        self._section = section
        scene = server.scene
        scene.set_up_direction("-z")
        _light(scene)
        scene.world_axes.visible = False
        # Makes browsers send shift-clicks; the pump, which knows the user, intercepts them.
        scene.on_click(modifier="shift")(_ignore)
        self._culvert = Culvert(scene, section)
        self._robot = Robot(scene, rig, section)
        self._interval = Interval(scene, section)
        self._wall = TexturedWall(scene, section)
        self._trail = Trail(scene, section)
        self._pins = Pins(scene, section)
        self._is_still = is_still
        self._scale_bar = ScaleBar(scene, section)
        self._ruler = Ruler(scene, section)
        self._measure = Measure(is_on=False)
        self._observers = Observers(server, section)
        self._mode: CameraMode = "overview"
        self._wording = Wording()
        self._pose = Estimate(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, "ok", 0.0)
        self._pins_shown: tuple[Pin, ...] = ()
        self._preview: bytes | None = None
        self._preview_due_s = 0.0  # time.monotonic
        self._selected: str | None = None
        self._hovered: str | None = None
        self._cut: Cut = "none"
        self._is_low = False
        self._show_robot()

        @server.on_client_connect
        async def _(client: viser.ClientHandle) -> None:
            client.camera.on_update(look_at_size)
            wake.set()

        async def look_at_size(_: viser.CameraHandle) -> None:
            if self._observers.are_low != self._is_low:
                wake.set()

    @property
    def shown(self) -> Shown:
        """Return a copy for other threads."""
        return Shown(self._pins_shown, self._mode, self._culvert.reach_m, self._cut)

    def due_in_s(self) -> float | None:
        """Return the time until a waiting picture may be sent; None if none waits."""
        waits_s = [s for s in (self._preview_due_in_s(), self._wall.due_in_s()) if s is not None]
        return min(waits_s, default=None)

    def _preview_due_in_s(self) -> float | None:
        if self._preview is None:
            return None
        return max(0.0, self._preview_due_s - time.monotonic())

    def apply(self, changes: Changes) -> None:
        """Draw what has changed."""
        self._wording = changes.get("wording", self._wording)
        if "mode" in changes:
            self._mode = changes["mode"]
            self._observers.set_mode(self._mode)
        if "cut" in changes:
            self._cut = changes["cut"]
            self._culvert.set_cut(self._cut)
            self._wall.set_cut(self._cut)
        if "length_m" in changes:
            self._culvert.grow_to(changes["length_m"])
        if "joints" in changes:
            self._culvert.set_joints(changes["joints"])
        if "wall" in changes:
            self._wall.set(changes["wall"])
        if changes.get("path_is_reset"):
            self._trail.reset()
        if "path" in changes:
            self._trail.add(changes["path"][-MAX_POINTS:])
        if "pins" in changes:
            self._pins_shown = tuple({pin.id: pin for pin in changes["pins"]}.values())
        self._selected = changes.get("selected", self._selected)
        if not changes.keys().isdisjoint(("pins", "mode", "selected")):
            self._pins.show(self._pins_shown, self._mode, self._selected)
        if "pointer" in changes:
            self._hovered = self._pin_at(changes["pointer"])
        if "measure" in changes:
            self._show_measure(changes["measure"])
        elif "wording" in changes:
            self._show_ruler()
        if not changes.keys().isdisjoint(("mode", "wording", "pose")):
            self._pose = changes.get("pose", self._pose)
            self._culvert.grow_to(self._pose.distance_mm / 1000)
            self._show_robot()

    def follow(self, preview: bytes | None) -> None:
        """Send the pictures that are due, and move labels and observers along."""
        self._show_preview(preview)
        robot_x_m, is_low = self._pose.distance_mm / 1000, self._observers.are_low
        self._wall.update(robot_x_m)
        if is_low != self._is_low:
            self._is_low = is_low
            self._show_robot()
        named_m = named_stretch(
            self._mode, self._section, self._culvert.reach_m, robot_x_m, is_low=is_low
        )
        self._culvert.label(named_m, self._mode, self._wording, is_low=is_low)
        if not self._is_still:
            emphasis = Emphasis(self._selected, self._hovered)
            self._pins.label(self._mode, emphasis, robot_x_m, self._wording, is_low=is_low)
        self._scale_bar.show(robot_x_m, self._wording)
        self._observers.update(self._culvert.reach_m, robot_x_m)

    def page(self) -> str:
        """Return everything as a page."""
        view = self._observers.set_initial(self._culvert.reach_m)
        self._pins.show_numbers(view)
        return with_our_head(self.server.scene.as_html(dark_mode=True))

    def _pin_at(self, pointer: tuple[float, float] | None) -> str | None:
        """Return the id of the pin under the pointer; each page has one browser."""
        for client in self.server.get_clients().values():
            if pointer is None:
                break
            origin, direction = sight_line(client.camera, pointer)
            pin = pin_under(
                self._pins_shown, self._mode, self._section, origin.tolist(), direction.tolist()
            )
            if pin is not None:
                return pin.id
        return None

    def _show_measure(self, measure: Measure) -> None:
        """While measuring, browsers send plain clicks too, as a finger has no Shift key."""
        if measure.is_on and not self._measure.is_on:
            self.server.scene.on_click()(_measured)
        elif self._measure.is_on and not measure.is_on:
            self.server.scene.remove_click_callback(_measured)
        self._measure = measure
        self._show_ruler()

    def _show_ruler(self) -> None:
        self._ruler.show(self._measure.points, self._wording, self._measure.figure)

    def _show_robot(self) -> None:
        self._robot.show(
            self._pose, self._mode, self._wording, is_quiet=self._is_low or self._is_still
        )
        self._interval.show(self._pose, self._mode)

    def _show_preview(self, newest: bytes | None) -> None:
        self._preview = newest or self._preview
        if self._preview is not None and self._preview_due_in_s() == 0.0:
            self._robot.show_preview(self._preview)
            pause_s = max(_PREVIEW_PERIOD_S, len(self._preview) / _PREVIEW_BYTES_PER_S)
            self._preview_due_s = time.monotonic() + pause_s
            self._preview = None


def _ignore(_: viser.SceneClickEvent) -> None:
    """The pump has taken the click."""


def _measured(_: viser.SceneClickEvent) -> None:
    """The pump has taken the click; another function, so that it can be removed alone."""


def _light(scene: viser.SceneApi) -> None:
    """Add dim daylight from above, so that the lamp of the robot is visible."""
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere(
        "/light/sky",
        sky_color=(190, 212, 235),
        ground_color=(112, 112, 118),
        intensity=1.0,
        position=(0.0, 0.0, -1.0),  # its direction
    )
    scene.add_light_directional(
        "/light/sun", color=(255, 246, 232), intensity=1.2, position=(-1.0, 1.6, -3.0)
    )
