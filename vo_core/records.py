"""What is kept of each frame of a film until its end, outside of a saved state."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

MOST_BYTES = 2**28
"""Longest content: some 400,000 frames of 700 bytes, four hours and a half at 25 a second."""


class Records:
    """Rows of one kind, one for each frame, in little more memory than they hold.

    A state that is saved again and again would grow with the film if it held them. So it holds
    none: who saves it asks for the rows since the last time (`drained`), keeps them elsewhere, and
    returns all of them to the state that was loaded (`restore`).

    A camera may run for days: a run that grows too long keeps nothing.
    """

    def __init__(self, dtype: DTypeLike) -> None:
        """Begin without rows."""
        self._dtype = np.dtype(dtype)
        self._content = bytearray()
        self._kept = 0
        """Bytes that are kept elsewhere."""
        self._is_full = False

    def __len__(self) -> int:
        return len(self._content) // self._dtype.itemsize

    def append(self, row: tuple[Any, ...]) -> None:
        """Add the row of the next frame."""
        self._is_full |= len(self._content) >= MOST_BYTES
        if self._is_full:
            self._content, self._kept = bytearray(), 0
        else:
            self._content += np.array(row, self._dtype).tobytes()

    @property
    def rows(self) -> NDArray[Any]:
        """(N,) all rows without a copy, none of a run that was too long; while they are held, none
        may be added.
        """
        return np.frombuffer(self._content, self._dtype)

    def changed(self) -> None:
        """Let all rows be kept anew, as earlier ones were changed."""
        self._kept = 0

    def drained(self) -> tuple[int, bytes]:
        """Return where in the content what is new begins, and the content from there on."""
        first, self._kept = self._kept, len(self._content)
        return first, bytes(self._content[first:])

    def restore(self, content: bytes | bytearray) -> None:
        """Take the content that a loaded state is without."""
        self._content = bytearray() if self._is_full else bytearray(content)

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_content": bytearray()}
