"""Takes the pictures out of an MJPEG stream, whatever stands between them.

Cameras differ in the boundary, and in type, length and line ends of the parts; all of them send
whole JPEG pictures. So only these are read: each from its start marker, over the lengths of its
segments, to its end marker.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

_START = b"\xff\xd8\xff"
_MARKER = re.compile(rb"\xff[\x02-\xcf\xd8-\xfe]")
"""A marker, other than the restart markers within coded data, where FF 00 is a byte FF."""
_SOI, _EOI = 0xD8, 0xD9


class JpegReader:
    """The bytes of a stream as pictures (ITU-T T.81, annex B)."""

    def __init__(self) -> None:
        self._held = bytearray()
        self._at = 0
        """Where the picture is read on; 0 before its start."""

    @property
    def held_bytes(self) -> int:
        """Size of the unfinished picture so far."""
        return len(self._held)

    def feed(self, piece: bytes) -> Iterator[bytes]:
        """Yield the pictures that a piece of the stream completes.

        A picture without an end marker ends where the next begins.
        """
        self._held += piece
        while (end := self._end()) is not None:
            yield bytes(self._held[:end])
            del self._held[:end]
            self._at = 0

    def _end(self) -> int | None:
        """Return where the picture at the beginning ends; None before its end has come."""
        if not self._at:
            start = self._held.find(_START)
            if start < 0:
                del self._held[: 1 - len(_START)]
                return None
            del self._held[:start]
            self._at = 2
        while (marker := _MARKER.search(self._held, self._at)) is not None:
            code, at = marker[0][1], marker.end()
            if code in (_SOI, _EOI):
                return at if code == _EOI else marker.start()
            if len(self._held) < at + 2:
                return None
            self._at = at + int.from_bytes(self._held[at : at + 2])
        self._at = max(self._at, len(self._held) - 1)
        return None
