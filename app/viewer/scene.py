"""One inspection in 3D: callers store the newest state, one writer thread draws it.

The database is the record; the scene can be rebuilt from it at any time. Every scene node has a
stable name, so that the scene grows with the culvert and not with the number of frames.
"""

from __future__ import annotations

import gc
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Unpack

from app.survey.places.measure import Figure
from app.viewer.culvert import JointMark
from app.viewer.drawing import Changes, Drawing, Measure
from app.viewer.geometry import PinHit, Section, WallHit
from app.viewer.pin import Pin
from app.viewer.pins import pin_under
from app.viewer.private_server import ViewerUnavailable, start_private_server, stop_private_server
from app.viewer.trail import MAX_POINTS, Thinner
from app.viewer.wall import WallPictures
from app.viewer.wording import Wording
from vo_core.rig import Rig
from vo_core.track import Estimate, Track

_TICK_S = 1 / 15
"""Interval at which robot and following cameras move together."""

_CLOSE_LIMIT_S = 15.0


def still_page(
    rig: Rig,
    track: Track,
    pose: Estimate | None,
    pins: Sequence[Pin],
    joints: Sequence[JointMark],
    wall: WallPictures | None,
    wording: Wording,
) -> str:
    """Make a page that shows a finished run without a server; blocks for some 100 ms.

    The track is corrected, with poses in the pipe; without a `pose` the robot stands at the zero.

    Raises:
        ViewerUnavailable: The viser server could not be started.
    """
    with tempfile.TemporaryDirectory(prefix="chainage-") as folder:
        socket_path = Path(folder) / "still"
        server = start_private_server(socket_path)
        try:
            drawing = Drawing(server, rig, Section.of(rig), threading.Event(), is_still=True)
            changes = Changes(pins=pins, joints=joints, wording=wording)
            if len(track):
                columns = (track.distance_mm, track.y_mm, track.sigma_distance_mm)
                changes["path"] = Thinner().thin(*(column.tolist() for column in columns))
                changes["length_m"] = float(track.distance_mm.max()) / 1000
            if pose is not None:
                changes["pose"] = pose
            if wall is not None:
                changes["wall"] = wall
            drawing.apply(changes)
            drawing.follow(None)
            for _ in wall.tiles if wall else ():  # a few pictures at a time; missing ones stay due
                if drawing.due_in_s() is None:
                    break
                drawing.follow(None)
            return drawing.page()
        finally:
            stop_private_server(server, socket_path)
            gc.collect()  # stopped viser servers remain in reference cycles


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
        self._changes = Changes()
        self._thinner = Thinner()
        self._measure = Measure(is_on=False)
        self._wake = threading.Event()
        self._closing = threading.Event()
        server = start_private_server(socket_path)
        try:
            drawing = Drawing(server, rig, self._section, self._wake, is_still=False)
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

    def show(self, **changes: Unpack[Changes]) -> None:
        """Show these things as they are now; pictures of the wall are read later, by another
        thread.
        """
        with self._lock:
            self._changes.update(changes)
        self._wake.set()

    def extend_path(
        self, xs_mm: Sequence[float], ys_mm: Sequence[float], sigmas_mm: Sequence[float]
    ) -> None:
        """Extend the path by distance, lateral offset and sigma of the distance of each frame."""
        with self._lock:
            path = self._changes.setdefault("path", [])
            path.extend(self._thinner.thin(xs_mm, ys_mm, sigmas_mm))
            del path[:-MAX_POINTS]
        self._wake.set()

    def reset_path(self) -> None:
        """Remove the path, for another run, and the ruler, whose places had the old distances."""
        self._put_measure(Measure(self.is_measuring))
        with self._lock:
            self._thinner = Thinner()
            self._changes.update({"path": [], "path_is_reset": True})
        self._wake.set()

    @property
    def is_measuring(self) -> bool:
        """Whether clicks set the points of the ruler."""
        return self._measure.is_on

    def set_measuring(self, is_on: bool) -> None:
        """Let clicks measure from now on, or no longer; then the line disappears."""
        if is_on != self.is_measuring:
            self._put_measure(Measure(is_on))

    def measure_to(self, point: WallHit) -> tuple[WallHit, ...]:
        """Set the next point, and return all of the line; a third one begins another line."""
        before = self._measure.points if len(self._measure.points) < 2 else ()
        points = (*before, point)
        self._put_measure(Measure(is_on=True, points=points))
        return points

    def set_size(self, points: tuple[WallHit, ...], figure: Figure) -> None:
        """Write the length between these points, if they are still those of the line."""
        if self._measure.points == points:
            self._put_measure(replace(self._measure, figure=figure))

    def _put_measure(self, measure: Measure) -> None:
        with self._lock:
            self._measure = self._changes["measure"] = measure
        self._wake.set()

    def pick(
        self, origin: tuple[float, float, float], direction: tuple[float, float, float]
    ) -> PinHit | WallHit | None:
        """Return what a ray in scene coordinates meets: a pin, or the wall drawn towards its
        origin. While measuring, pins do not cover the wall.
        """
        shown = self._shown
        pins = () if self.is_measuring else shown.pins
        pin = pin_under(pins, shown.mode, self._section, origin, direction)
        return pin or self._section.hit(origin, direction, shown.reach_m, shown.cut)

    def close(self) -> None:
        """Disconnect every browser, stop the server and remove its socket."""
        self._closing.set()
        self._wake.set()
        self._writer.join(_CLOSE_LIMIT_S)
        gc.collect()  # stopped viser servers remain in reference cycles

    def _write(self, drawing: Drawing) -> None:
        try:
            while True:
                self._wake.wait(drawing.due_in_s())
                self._wake.clear()
                if self._closing.is_set():
                    return
                with self._lock:
                    changes, self._changes = self._changes, Changes()
                with drawing.server.atomic():
                    drawing.apply(changes)
                    self._shown = drawing.shown  # what a browser shows can be clicked
                    drawing.follow(changes.get("preview"))
                self._closing.wait(_TICK_S)
        finally:
            self._closing.set()
            stop_private_server(drawing.server, self.socket_path)
