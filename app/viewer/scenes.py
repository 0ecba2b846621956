"""The 3D views of the pages that look at inspections: each page has its own.

Robot, camera, marked tag, language and unit of a view follow the page around it and no other page;
shared are only the inspection and its tags.  A view is made from track and observations when its
browser connects, follows what is published, and is closed soon after its browser has left.
"""

from __future__ import annotations

import asyncio
import itertools
import shutil
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from app.errors import NoScene
from app.inspections.corrections import Corrections
from app.inspections.inspections import Inspections
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.tracking.live import Live
from app.tracking.unrolled import Unrolled
from app.viewer.scene import CameraMode, CulvertScene, ViewerUnavailable, Wording
from app.viewer.scene_feed import Look, SceneFeed

MOST_OPEN = 48
"""Views at a time; each has three threads, four file handles and a copy of the wall's pictures."""
_CLOSE_UNUSED_AFTER_S = 10.0
"""A browser whose line was cut is back sooner."""
_SWEEP_S = 2.0


@dataclass
class PageView:
    """What one page looks at, and its 3D view while a browser shows it."""

    look: Look = field(default_factory=Look)
    feed: SceneFeed | None = None
    sockets: int = 0
    """Live sockets and 3D views that use it."""
    browsers: int = 0
    """3D views alone."""
    left_at_s: float = 0.0
    """When the last 3D view went, by time.monotonic."""

    def show_frame(self, frame: int | None) -> None:
        """The robot goes to this frame and stays; None lets it follow the tracking again."""
        self.look = replace(self.look, frame=frame)
        if self.feed is not None:
            self.feed.show_robot()

    def set_camera(self, mode: CameraMode) -> None:
        """Where the observer stands."""
        self.look = replace(self.look, mode=mode)
        if self.feed is not None:
            self.feed.scene.set_camera(mode)

    def select(self, observation_id: str | None) -> None:
        """Highlight its pin; None: no pin."""
        self.look = replace(self.look, selected=observation_id)
        if self.feed is not None:
            self.feed.scene.select(observation_id)

    def set_wording(self, wording: Wording) -> None:
        """Language and unit of the labels."""
        self.look = replace(self.look, wording=wording)
        if self.feed is not None:
            self.feed.show_wording()


class Scenes:
    """Opens the 3D view of a page for its browser and closes it some time after that has left."""

    def __init__(
        self,
        inspections: Inspections,
        corrections: Corrections,
        observations: Observations,
        unrolled: Unrolled,
        live: Live,
        packs: Packs,
    ) -> None:
        self._parts = (inspections, corrections, observations, unrolled, live, packs)
        # A socket's path is limited to 107 bytes, so it cannot lie in the data folder; mkdtemp
        # makes the folder for its owner only, as the socket itself is open to all.
        self._sockets = Path(tempfile.mkdtemp(prefix="chainage-"))
        self._numbers = itertools.count(1)
        self._opening = asyncio.Lock()
        self._pages: dict[tuple[str, str], PageView] = {}

    @asynccontextmanager
    async def page(self, inspection_id: str, page: str) -> AsyncIterator[PageView]:
        """What a page looks at, to be changed by its commands; opens no 3D view.

        Args:
            inspection_id: That it shows.
            page: What the page and the 3D view in it have in common, and no other page.
        """
        key = (inspection_id, page)
        view = self._pages.setdefault(key, PageView())
        view.sockets += 1
        try:
            yield view
        finally:
            view.sockets -= 1
            if not view.sockets and view.feed is None:
                self._pages.pop(key, None)

    @asynccontextmanager
    async def use(self, inspection_id: str, page: str) -> AsyncIterator[CulvertScene]:
        """The 3D view of a page, opened if need be, kept open while in use.

        Raises:
            InspectionNotFound: No inspection has this id.
            NoScene: The viewer could not be started, or too many are open.
        """
        async with self.page(inspection_id, page) as view:
            view.browsers += 1
            try:
                yield (await self._feed(inspection_id, view)).scene
            finally:
                view.browsers -= 1
                view.left_at_s = time.monotonic()

    async def _feed(self, inspection_id: str, view: PageView) -> SceneFeed:
        async with self._opening:
            if view.feed is not None and view.feed.scene.is_open:
                return view.feed
            if view.feed is not None:
                await _close(view)
            if self.count() >= MOST_OPEN:
                raise NoScene(f"{MOST_OPEN} 3D views are open already, and no more are allowed.")
            socket_path, look = self._sockets / str(next(self._numbers)), view.look
            try:
                view.feed = await asyncio.to_thread(
                    SceneFeed, inspection_id, socket_path, *self._parts, lambda: view.look
                )
            except ViewerUnavailable as error:
                raise NoScene(f"The 3D view could not be started: {error}") from error
            if view.look != look:  # the page has wished for something else meanwhile
                view.feed.show_look()
            return view.feed

    def count(self) -> int:
        """How many are open."""
        return sum(view.feed is not None for view in self._pages.values())

    async def redraw(self, inspection_id: str) -> None:
        """Close the scenes of a rig that has changed; whoever looks at one opens another."""
        async with self._opening:
            for (shown_id, _), view in self._pages.items():
                if shown_id == inspection_id:
                    await _close(view)

    async def sweep(self) -> None:
        """Close what nobody uses, for ever."""
        while True:
            await asyncio.sleep(_SWEEP_S)
            limit_s = time.monotonic() - _CLOSE_UNUSED_AFTER_S
            async with self._opening:
                for key, view in list(self._pages.items()):
                    if not view.browsers and view.feed is not None and view.left_at_s < limit_s:
                        await _close(view)
                    if not view.sockets and view.feed is None:
                        self._pages.pop(key, None)

    async def close(self) -> None:
        """Close all."""
        async with self._opening:
            for view in self._pages.values():
                await _close(view)
        await asyncio.to_thread(shutil.rmtree, self._sockets)


async def _close(view: PageView) -> None:
    feed, view.feed = view.feed, None
    if feed is not None:
        await asyncio.to_thread(feed.close)
