"""Shift-clicks in the 3D view, passed on to the page around it.

The 3D view has its own socket, on which clicks arrive; they are passed to the live sockets of the
page that contains the view. All of this runs on the event loop.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from contextlib import contextmanager

from app.viewer.geometry import PinHit, WallHit

logger = logging.getLogger(__name__)

Click = WallHit | PinHit

_WAITING = 8
"""Most clicks that wait for a page; a person makes at most two a second."""


class Clicks:
    """Delivers the clicks in a page's 3D view to its listeners."""

    def __init__(self) -> None:
        self._queues: dict[tuple[str, str], set[asyncio.Queue[Click]]] = {}

    @contextmanager
    def listening(self, inspection_id: str, page: str) -> Iterator[asyncio.Queue[Click]]:
        """Provide the clicks in the 3D view of a page until the block ends.

        `page` identifies the page and the view in it.
        """
        key, queue = (inspection_id, page), asyncio.Queue[Click](_WAITING)
        queues = self._queues.setdefault(key, set())
        queues.add(queue)
        try:
            yield queue
        finally:
            queues.discard(queue)
            if not queues:
                self._queues.pop(key, None)

    def publish(self, inspection_id: str, page: str, click: Click) -> None:
        """Deliver a click; it is dropped where nobody listens or keeps up."""
        for queue in self._queues.get((inspection_id, page), ()):
            try:
                queue.put_nowait(click)
            except asyncio.QueueFull:
                logger.warning("A page of inspection %s does not take its clicks.", inspection_id)
