"""The 3D scenes of the inspections that somebody looks at.

A scene is a view: it is made from track and observations when the first page opens, follows what is
published, and is closed when nobody has looked for a while.
"""

from __future__ import annotations

import asyncio
import logging
import shutil
import tempfile
import threading
import time
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path

from app.catalogue import find
from app.errors import NoScene
from app.services.inspections import Inspections
from app.services.live import Event, Live, Update
from app.services.observations import Observations, ObservationView, rig_of
from app.services.tracks import Tracks, estimate_at
from app.viewer.scene import CameraMode, CulvertScene, Pin, ViewerUnavailable
from vo_core import Track

logger = logging.getLogger(__name__)

_CLOSE_UNUSED_AFTER_S = 60.0
_SWEEP_S = 10.0


class SceneFeed:
    """One scene, and what keeps it up to date."""

    def __init__(
        self,
        inspection_id: str,
        socket_path: Path,
        inspections: Inspections,
        tracks: Tracks,
        observations: Observations,
        live: Live,
    ) -> None:
        """Blocks for some milliseconds; make it in a worker thread."""
        self._inspection_id = inspection_id
        self._tracks = tracks
        self._observations = observations
        inspection = inspections.row(inspection_id)
        self.scene = CulvertScene(rig_of(inspection), socket_path)
        self._lock = threading.Lock()
        self._shown_frame: int | None = None
        self._drawn = 0
        """Frames whose path is drawn."""
        self._subscription = ExitStack()
        self._subscription.enter_context(live.listening(inspection_id, self._on_event))
        try:
            self._draw_track()
            self._draw_pins()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stop following, disconnect every browser."""
        self._subscription.close()
        self.scene.close()

    def show_frame(self, frame: int | None) -> None:
        """The robot goes to this frame and stays; None lets it follow the tracking again."""
        self._shown_frame = frame
        track = self._tracks.get(self._inspection_id)
        estimate = estimate_at(track, len(track) - 1 if frame is None else frame)
        if estimate is not None:
            self.scene.show_pose(estimate)

    def set_camera(self, mode: CameraMode) -> None:
        """Where the observers stand."""
        self.scene.set_camera(mode)

    def _draw_track(self) -> None:
        track = self._tracks.get(self._inspection_id)
        with self._lock:
            self._extend_path(track)
        estimate = estimate_at(track, len(track) - 1)
        if estimate is not None and self._shown_frame is None:
            self.scene.show_pose(estimate)

    def _extend_path(self, track: Track) -> None:
        new = slice(self._drawn, None)
        if len(track) > self._drawn:
            self.scene.extend_path(
                track.x_mm[new].tolist(),
                track.y_mm[new].tolist(),
                track.sigma_distance_mm[new].tolist(),
            )
            self.scene.set_length(float(track.distance_mm.max()))
            self._drawn = len(track)

    def _draw_pins(self) -> None:
        views = self._observations.all(self._inspection_id)
        self.scene.set_pins([pin for view in views if (pin := _pin(view)) is not None])

    def _on_event(self, event: Event) -> None:
        if not isinstance(event, Update):
            self._draw_pins()
        elif not event.estimates:
            self._on_state(event.state)
        else:
            self._on_frames(event)

    def _on_state(self, state: str) -> None:
        if state == "running":
            with self._lock:
                self._drawn = 0
            self.scene.reset_path()
        self._draw_pins()  # distances appear, or go, with the track

    def _on_frames(self, update: Update) -> None:
        new = update.estimates
        with self._lock:
            if new[0].frame == self._drawn:
                self.scene.extend_path(
                    [e.x_mm for e in new], [e.y_mm for e in new], [e.sigma_distance_mm for e in new]
                )
                self._drawn += len(new)
            else:  # the scene was made between two batches
                self._extend_path(self._tracks.get(self._inspection_id))
        if self._shown_frame is None:
            self.scene.show_pose(new[-1])
            if update.jpeg:
                self.scene.show_preview(update.jpeg)


class Scenes:
    """Opens a scene for its first user and closes it some time after its last."""

    def __init__(
        self, inspections: Inspections, tracks: Tracks, observations: Observations, live: Live
    ) -> None:
        self._parts = (inspections, tracks, observations, live)
        # A socket's path is limited to 107 bytes, so it cannot lie in the data folder; mkdtemp
        # makes the folder for its owner only, as the socket itself is open to all.
        self._sockets = Path(tempfile.mkdtemp(prefix="chainage-"))
        self._opening = asyncio.Lock()
        self._feeds: dict[str, SceneFeed] = {}
        self._users: dict[str, int] = {}
        self._left_at: dict[str, float] = {}

    @asynccontextmanager
    async def use(self, inspection_id: str) -> AsyncIterator[SceneFeed]:
        """The scene of an inspection, opened if need be, kept open while in use.

        Raises:
            InspectionNotFound: There is no such inspection.
            NoScene: The viewer could not be started.
        """
        self._users[inspection_id] = self._users.get(inspection_id, 0) + 1
        try:
            yield await self._feed(inspection_id)
        finally:
            self._users[inspection_id] -= 1
            if not self._users[inspection_id]:
                del self._users[inspection_id]
                self._left_at[inspection_id] = time.monotonic()

    async def _feed(self, inspection_id: str) -> SceneFeed:
        async with self._opening:
            feed = self._feeds.get(inspection_id)
            if feed is not None and feed.scene.is_open:
                return feed
            if feed is not None:
                await self._close(inspection_id)
            socket_path = self._sockets / inspection_id
            try:
                feed = await asyncio.to_thread(SceneFeed, inspection_id, socket_path, *self._parts)
            except ViewerUnavailable as error:
                raise NoScene(f"The 3D view could not be started: {error}") from error
            self._feeds[inspection_id] = feed
            return feed

    async def sweep(self) -> None:
        """Close what nobody uses, for ever."""
        while True:
            await asyncio.sleep(_SWEEP_S)
            limit = time.monotonic() - _CLOSE_UNUSED_AFTER_S
            async with self._opening:
                for inspection_id in list(self._feeds):
                    is_used = inspection_id in self._users
                    if not is_used and self._left_at.get(inspection_id, 0.0) < limit:
                        await self._close(inspection_id)

    async def close(self) -> None:
        """Close all."""
        async with self._opening:
            for inspection_id in list(self._feeds):
                await self._close(inspection_id)
        await asyncio.to_thread(shutil.rmtree, self._sockets)

    async def _close(self, inspection_id: str) -> None:
        feed = self._feeds.pop(inspection_id)
        self._left_at.pop(inspection_id, None)
        await asyncio.to_thread(feed.close)


def _pin(view: ObservationView) -> Pin | None:
    if view.place is None:
        return None
    fields = view.row.fields
    wall = view.place.wall
    clock_h = wall.clock_h if wall else None
    code = " ".join(fields[name] for name in ("code", "char1", "char2") if fields.get(name))
    row = find(fields.get("code"), fields.get("char1"), fields.get("char2"))
    return Pin(
        id=view.row.id,
        distance_m=view.place.distance_mm / 1000,
        clock=fields.get("clock_from", clock_h),
        u95_m=view.place.u95_mm / 1000,
        severity=fields.get("severity"),
        label=f"{code} {row.label.partition(':')[0]}" if row else code or "?",
        lateral_m=wall.lateral_mm / 1000 if wall else 0.0,
    )
