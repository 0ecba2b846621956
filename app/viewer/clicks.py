"""Shift-clicks in the 3D view, on their way to the page around it.

The 3D view has a socket of its own, so a click comes in there and is handed to the live sockets
of the page that it stands in.  All of it happens on the event loop.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from contextlib import contextmanager

from app.viewer.scene import PinHit, WallHit

logger = logging.getLogger(__name__)

Click = WallHit | PinHit

_WAITING = 8
"""Clicks that a page may be behind; a person makes two a second at most."""


class Clicks:
    """Who listens to the clicks of which page."""

    def __init__(self) -> None:
        self._queues: dict[tuple[str, str], set[asyncio.Queue[Click]]] = {}

    @contextmanager
    def listening(self, inspection_id: str, page: str) -> Iterator[asyncio.Queue[Click]]:
        """The clicks in the 3D view of a page, until the block ends.

        `page` is what page and view have in common, and no other page.
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

    def tell(self, inspection_id: str, page: str, click: Click) -> None:
        """Hand it on; it is dropped where nobody listens, or does not keep up."""
        for queue in self._queues.get((inspection_id, page), ()):
            try:
                queue.put_nowait(click)
            except asyncio.QueueFull:
                logger.warning("A page of inspection %s does not take its clicks.", inspection_id)
