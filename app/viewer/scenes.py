"""The 3D views of open pages; each page has its own.

Robot, camera, selected tag, language and unit of a view follow its own page; only the inspection
and its tags are shared. A view is built from track and observations when its browser connects,
follows published events, and is closed soon after its browser has left.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import shutil
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.errors import NoScene
from app.inspections.inspections import Inspections
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.inspections.picking import Picking, WallPlace
from app.tracking.live import Live
from app.tracking.unrolled import Unrolled
from app.viewer.geometry import WallHit
from app.viewer.look import ALL, Look
from vo_core.errors import ChainageError

if TYPE_CHECKING:
    from app.viewer.scene import CulvertScene
    from app.viewer.scene_feed import SceneFeed

logger = logging.getLogger(__name__)

MOST_OPEN = 48
"""Most views at a time; each has three threads, four file handles and a copy of the wall's
pictures."""
_CLOSE_UNUSED_AFTER_S = 10.0
"""A browser with an interrupted connection is back sooner."""
SWEEP_S = 2.0


@dataclass
class PageView:
    """What one page looks at, and its 3D view while a browser shows it."""

    look: Look = field(default_factory=Look)
    feed: SceneFeed | None = None
    sockets: int = 0
    """Number of live sockets and 3D views that use it."""
    browsers: int = 0
    """Number of 3D views alone."""
    left_at_s: float = 0.0
    """Time when the last 3D view left, by time.monotonic."""

    def change(self, **changes: Any) -> None:
        """Change the look, by the names of its fields."""
        self.look = replace(self.look, **changes)
        if self.feed is not None:
            self.feed.show_look(changes)

    def point_at(self, at: tuple[float, float] | None) -> None:
        """Label the pin under the pointer."""
        if self.feed is not None:
            self.feed.scene.show(pointer=at)


class Scenes:
    """Opens the 3D view of a page for its browser and closes it some time after the browser
    left.
    """

    def __init__(
        self,
        inspections: Inspections,
        observations: Observations,
        unrolled: Unrolled,
        live: Live,
        packs: Packs,
        picking: Picking,
    ) -> None:
        self._picking = picking
        self._parts = (inspections, picking.corrections, observations, unrolled, live, packs)
        # A socket's path is limited to 107 bytes, so it cannot be in the data folder; mkdtemp makes
        # the folder for its owner only, as the socket itself is open to all.
        self._sockets = Path(tempfile.mkdtemp(prefix="chainage-"))
        self._numbers = itertools.count(1)
        self._opening = asyncio.Lock()
        self._pages: dict[tuple[str, str], PageView] = {}

    @asynccontextmanager
    async def page(self, inspection_id: str, page: str) -> AsyncIterator[PageView]:
        """Provide the state of a page for its commands, without opening a 3D view.

        Args:
            inspection_id: The inspection that the page shows.
            page: Identifies the page and the 3D view in it.
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
        """Provide the 3D view of a page, opened if necessary and kept open during use.

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

    async def measure_to(self, inspection_id: str, scene: CulvertScene, point: WallHit) -> None:
        """Set the next point of the ruler, and with the second one its length and interval."""
        points = scene.measure_to(point)
        if len(points) < 2:
            return
        start, end = (_place_of(each) for each in points)
        try:
            figure = await asyncio.to_thread(
                self._picking.length_between, inspection_id, start, end
            )
        except ChainageError as error:  # the length without an interval stays; so does the view
            logger.warning("The ruler of %s has no interval: %s", inspection_id, error)
            return
        if figure is not None:
            scene.set_size(points, figure)

    async def _feed(self, inspection_id: str, view: PageView) -> SceneFeed:
        # They load viser, which a server without an open view does not need.
        from app.viewer.private_server import ViewerUnavailable
        from app.viewer.scene_feed import SceneFeed

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
            if view.look != look:  # the look of the page has changed meanwhile
                view.feed.show_look(ALL)
            return view.feed

    def count(self) -> int:
        """Return the number of open views."""
        return sum(view.feed is not None for view in self._pages.values())

    async def redraw(self, inspection_id: str) -> None:
        """Close the scenes of an inspection whose rig changed; their browsers open new ones."""
        async with self._opening:
            for (shown_id, _), view in list(self._pages.items()):
                if shown_id == inspection_id:
                    await _close(view)

    async def sweep(self) -> None:
        """Close unused views."""
        limit_s = time.monotonic() - _CLOSE_UNUSED_AFTER_S
        async with self._opening:
            for key, view in list(self._pages.items()):
                if not view.browsers and view.feed is not None and view.left_at_s < limit_s:
                    await _close(view)
                if not view.sockets and view.feed is None:
                    self._pages.pop(key, None)

    async def close(self) -> None:
        """Close all views."""
        async with self._opening:
            for view in list(self._pages.values()):
                await _close(view)
        await asyncio.to_thread(shutil.rmtree, self._sockets)


def _place_of(hit: WallHit) -> WallPlace:
    lateral_mm = 1000 * hit.lateral_m if hit.clock_h is None else None
    return WallPlace(1000 * hit.distance_m, hit.clock_h, lateral_mm)


async def _close(view: PageView) -> None:
    feed, view.feed = view.feed, None
    if feed is not None:
        await asyncio.to_thread(feed.close)
