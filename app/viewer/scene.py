"""One inspection in 3D: callers store the newest state, one writer thread draws it.

The database is the record; the scene can be rebuilt from it at any time. Every scene node has a
stable name, so that the scene grows with the culvert and not with the number of frames.
"""

from __future__ import annotations

import gc
import tempfile
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import viser

from app.viewer.culvert import Culvert, JointMark
from app.viewer.geometry import PinHit, Section, WallHit
from app.viewer.interval import Interval
from app.viewer.page import with_our_head
from app.viewer.pins import Pin, Pins, pin_under
from app.viewer.private_server import ViewerUnavailable, start_private_server, stop_private_server
from app.viewer.robot import Robot
from app.viewer.trail import MAX_POINTS, PathPoint, Thinner, Trail
from app.viewer.views import CameraMode, Observers, Reach, named_stretch
from app.viewer.wall import ReadPicture, TexturedWall, WallLayout, WallPictures, WallTile
from app.viewer.wording import Wording
from vo_core.rig import Rig
from vo_core.track import Estimate, Track

__all__ = [
    "CameraMode",
    "CulvertScene",
    "JointMark",
    "Pin",
    "PinHit",
    "ViewerUnavailable",
    "WallHit",
    "WallLayout",
    "WallTile",
    "Wording",
    "still_page",
]

_TICK_S = 1 / 15
"""Interval at which robot and following cameras move together."""

_PREVIEW_PERIOD_S = 0.2
_PREVIEW_BYTES_PER_S = 100_000
"""Limit of the picture stream: queued pictures delay a browser on a slow line."""

_CLOSE_LIMIT_S = 15.0


@dataclass(frozen=True)
class _Shown:
    """Everything that can be clicked."""

    pins: tuple[Pin, ...]
    mode: CameraMode
    reach_m: Reach


def still_page(
    rig: Rig,
    track: Track,
    pose: Estimate | None,
    pins: Sequence[Pin],
    joints: Sequence[JointMark],
    tiles: Sequence[WallTile],
    layout: WallLayout | None,
    read: ReadPicture,
    wording: Wording,
) -> str:
    """Make a page that shows a finished run without a server; blocks for some 100 ms.

    Args:
        rig: The rig of the run.
        track: The corrected track, with poses in the pipe.
        pose: Pose of the robot; None leaves it at the zero.
        pins: Defects to show.
        joints: Seen and expected joints.
        tiles: Pictures of the wall, as many as a browser can hold.
        layout: Layout of the tiles; None if there are none.
        read: Returns the picture of a tile by its index.
        wording: Language and unit of the labels.

    Raises:
        ViewerUnavailable: The viser server could not be started.
    """
    with tempfile.TemporaryDirectory(prefix="chainage-") as folder:
        socket_path = Path(folder) / "still"
        server = start_private_server(socket_path)
        try:
            drawing = _Drawing(server, rig, Section.of(rig), threading.Event())
            inbox = _Inbox(pins=tuple(pins), joints=tuple(joints), wording=wording)
            if len(track):
                columns = (track.distance_mm, track.y_mm, track.sigma_distance_mm)
                inbox.path.extend(Thinner().thin(*(column.tolist() for column in columns)))
                inbox.length_m = float(track.distance_mm.max()) / 1000
            inbox.pose = pose
            if layout is not None:
                inbox.wall = WallPictures(tuple(tiles), layout, read)
            drawing.apply(inbox)
            drawing.follow(None)
            for _ in tiles:  # a few pictures at a time; missing ones stay due
                if drawing.due_in_s() is None:
                    break
                drawing.follow(None)
            return drawing.page()
        finally:
            stop_private_server(server, socket_path)
            gc.collect()  # stopped viser servers remain in reference cycles


@dataclass(frozen=True)
class _Selection:
    id: str | None


@dataclass
class _Inbox:
    """What to draw next, only the newest of each kind."""

    pose: Estimate | None = None
    preview: bytes | None = None
    pins: tuple[Pin, ...] | None = None
    selection: _Selection | None = None
    mode: CameraMode | None = None
    wording: Wording | None = None
    length_m: float | None = None
    joints: tuple[JointMark, ...] | None = None
    wall: WallPictures | None = None
    path_is_reset: bool = False
    path: deque[PathPoint] = field(default_factory=lambda: deque(maxlen=MAX_POINTS))


class CulvertScene:
    """The culvert, the robot, its path and the defects, as shown to one page.

    Create and close it in a worker thread: both block for some milliseconds.  All other methods
    return at once and may be called from any thread.

    Raises:
        ViewerUnavailable: The viser server could not be started.
    """

    def __init__(self, rig: Rig, socket_path: Path) -> None:
        self.socket_path = socket_path
        self._section = Section.of(rig)
        self._lock = threading.Lock()
        self._inbox = _Inbox()
        self._thinner = Thinner()
        self._wake = threading.Event()
        self._closing = threading.Event()
        server = start_private_server(socket_path)
        try:
            drawing = _Drawing(server, rig, self._section, self._wake)
        except Exception as error:
            stop_private_server(server, socket_path)
            raise ViewerUnavailable(f"The 3D view cannot be drawn: {error}.") from error
        self._shown = drawing.shown
        # Only the writer refers to the drawing, so that nothing of viser outlives it.
        self._writer = threading.Thread(
            target=self._write, args=(drawing,), name="scene-writer", daemon=True
        )
        self._writer.start()

    @property
    def is_open(self) -> bool:
        """False after `close`, and if the writer has failed: then a new scene is needed."""
        return self._writer.is_alive() and not self._closing.is_set()

    def show_pose(self, estimate: Estimate) -> None:
        """Move the robot; extend the culvert if necessary."""
        with self._lock:
            self._inbox.pose = estimate
        self._wake.set()

    def extend_path(
        self, xs_mm: Sequence[float], ys_mm: Sequence[float], sigmas_mm: Sequence[float]
    ) -> None:
        """Extend the path by distance, lateral offset and sigma of the distance of each frame."""
        with self._lock:
            self._inbox.path.extend(self._thinner.thin(xs_mm, ys_mm, sigmas_mm))
        self._wake.set()

    def reset_path(self) -> None:
        """Remove the path, for another run."""
        with self._lock:
            self._thinner = Thinner()
            self._inbox.path.clear()
            self._inbox.path_is_reset = True
        self._wake.set()

    def show_preview(self, jpeg: bytes) -> None:
        """Show a picture in the frustum, at most 5 times and 100 kB a second; 320 px wide is
        enough.
        """
        with self._lock:
            self._inbox.preview = jpeg
        self._wake.set()

    def set_pins(self, pins: Sequence[Pin]) -> None:
        """Show exactly these defects."""
        with self._lock:
            self._inbox.pins = tuple({pin.id: pin for pin in pins}.values())
        self._wake.set()

    def select(self, pin_id: str | None) -> None:
        """Highlight this pin, now or as soon as it exists; None: no pin."""
        with self._lock:
            self._inbox.selection = _Selection(pin_id)
        self._wake.set()

    def set_wall(self, tiles: Sequence[WallTile], layout: WallLayout, read: ReadPicture) -> None:
        """Show exactly these pictures of the wall, as many as a browser can hold.

        `read(index)` is called later, by another thread, for the pictures to send.
        """
        with self._lock:
            self._inbox.wall = WallPictures(tuple(tiles), layout, read)
        self._wake.set()

    def set_camera(self, mode: CameraMode) -> None:
        """Move the cameras of its browsers to this view."""
        with self._lock:
            self._inbox.mode = mode
        self._wake.set()

    def set_wording(self, wording: Wording) -> None:
        """Write the labels in this language and unit; `set_pins` sets the texts of pins."""
        with self._lock:
            self._inbox.wording = wording
        self._wake.set()

    def set_length(self, length_mm: float) -> None:
        """Draw at least this length of culvert, in whole metres; it never shrinks."""
        with self._lock:
            self._inbox.length_m = length_mm / 1000
        self._wake.set()

    def set_joints(self, joints: Sequence[JointMark]) -> None:
        """Show exactly these joints, seen and expected."""
        with self._lock:
            self._inbox.joints = tuple(joints)
        self._wake.set()

    def pick(
        self, origin: tuple[float, float, float], direction: tuple[float, float, float]
    ) -> PinHit | WallHit | None:
        """Return what a ray in scene coordinates meets: a pin, or the wall drawn towards its
        origin.
        """
        shown = self._shown
        pin = pin_under(shown.pins, shown.mode, self._section, origin, direction)
        return pin or self._section.hit(origin, direction, shown.reach_m)

    def close(self) -> None:
        """Disconnect every browser, stop the server and remove its socket."""
        self._closing.set()
        self._wake.set()
        self._writer.join(_CLOSE_LIMIT_S)
        gc.collect()  # stopped viser servers remain in reference cycles

    def _write(self, drawing: _Drawing) -> None:
        try:
            while True:
                self._wake.wait(drawing.due_in_s())
                self._wake.clear()
                if self._closing.is_set():
                    return
                with self._lock:
                    inbox, self._inbox = self._inbox, _Inbox()
                with drawing.server.atomic():
                    drawing.apply(inbox)
                    self._shown = drawing.shown  # what a browser shows can be clicked
                drawing.follow(inbox.preview)
                self._closing.wait(_TICK_S)
        finally:
            self._closing.set()
            stop_private_server(drawing.server, self.socket_path)


class _Drawing:
    """Everything that touches viser; used by one thread at a time."""

    def __init__(
        self, server: viser.ViserServer, rig: Rig, section: Section, wake: threading.Event
    ) -> None:
        self.server = server
        self._section = section
        scene = server.scene
        scene.set_up_direction("-z")
        _light(scene)
        scene.world_axes.visible = False
        # Makes browsers send shift-clicks; the pump, which knows the user, intercepts them.
        scene.on_click(modifier="shift")(lambda _: None)
        self._culvert = Culvert(scene, section)
        self._robot = Robot(scene, rig, section)
        self._interval = Interval(scene, section)
        self._wall = TexturedWall(scene, section)
        self._trail = Trail(scene, section)
        self._pins = Pins(scene, section)
        self._observers = Observers(server, section)
        self._mode: CameraMode = "overview"
        self._wording = Wording()
        self._pose = Estimate(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, "ok", 0.0)
        self._pins_shown: tuple[Pin, ...] = ()
        self._preview: bytes | None = None
        self._preview_due_s = 0.0  # time.monotonic
        self._selected: str | None = None
        self._show_robot()

        @server.on_client_connect
        async def _(_: viser.ClientHandle) -> None:
            wake.set()

    @property
    def shown(self) -> _Shown:
        """Return a copy for other threads."""
        return _Shown(self._pins_shown, self._mode, self._culvert.reach_m)

    def due_in_s(self) -> float | None:
        """Return the time until a waiting picture may be sent; None if none waits."""
        waits_s = [s for s in (self._preview_due_in_s(), self._wall.due_in_s()) if s is not None]
        return min(waits_s, default=None)

    def _preview_due_in_s(self) -> float | None:
        if self._preview is None:
            return None
        return max(0.0, self._preview_due_s - time.monotonic())

    def apply(self, inbox: _Inbox) -> None:
        """Draw what has changed."""
        self._wording = inbox.wording or self._wording
        is_seen_anew = inbox.mode is not None or inbox.wording is not None
        if inbox.mode is not None:
            self._mode = inbox.mode
            self._observers.set_mode(inbox.mode)
        if inbox.length_m is not None:
            self._culvert.grow_to(inbox.length_m)
        if inbox.joints is not None:
            self._culvert.set_joints(inbox.joints)
        if inbox.wall is not None:
            self._wall.set(inbox.wall)
        if inbox.path_is_reset:
            self._trail.reset()
        if inbox.path:
            self._trail.add(tuple(inbox.path))
        if inbox.pins is not None:
            self._pins_shown = inbox.pins
        if inbox.selection is not None:
            self._selected = inbox.selection.id
        if is_seen_anew or inbox.pins is not None or inbox.selection is not None:
            self._pins.show(self._pins_shown, self._mode, self._selected, self._wording)
        if is_seen_anew or inbox.pose is not None:
            self._pose = inbox.pose or self._pose
            self._culvert.grow_to(self._pose.distance_mm / 1000)
            self._show_robot()

    def follow(self, preview: bytes | None) -> None:
        """Send the pictures that are due, and move labels and observers along."""
        self._show_preview(preview)
        robot_x_m = self._pose.distance_mm / 1000
        self._wall.update(robot_x_m)
        named_m = named_stretch(self._mode, self._section, self._culvert.reach_m, robot_x_m)
        self._culvert.label(named_m, self._mode, self._wording)
        self._observers.update(self._culvert.reach_m, robot_x_m)

    def page(self) -> str:
        """Return everything as a page."""
        self._observers.set_initial(self._culvert.reach_m)
        return with_our_head(self.server.scene.as_html(dark_mode=True))

    def _show_robot(self) -> None:
        self._robot.show(self._pose, self._mode, self._wording)
        self._interval.show(self._pose, self._mode)

    def _show_preview(self, newest: bytes | None) -> None:
        self._preview = newest or self._preview
        if self._preview is not None and self._preview_due_in_s() == 0.0:
            self._robot.show_preview(self._preview)
            pause_s = max(_PREVIEW_PERIOD_S, len(self._preview) / _PREVIEW_BYTES_PER_S)
            self._preview_due_s = time.monotonic() + pause_s
            self._preview = None


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
