"""What is kept of each frame of a film until its end, outside of a saved state."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


class Records:
    """Rows of one kind, one for each frame, in little more memory than they hold.

    A state that is saved again and again would grow with the film if it held them. So it holds
    none: who saves it asks for the rows since the last time (`drained`), keeps them elsewhere, and
    returns all of them to the state that was loaded (`restore`).
    """

    def __init__(self, dtype: DTypeLike) -> None:
        """Begin without rows."""
        self._dtype = np.dtype(dtype)
        self._content = bytearray()
        self._kept = 0
        """Bytes that are kept elsewhere."""

    def __len__(self) -> int:
        return len(self._content) // self._dtype.itemsize

    def append(self, row: tuple[Any, ...]) -> None:
        """Add the row of the next frame."""
        self._content += np.array(row, self._dtype).tobytes()

    @property
    def rows(self) -> NDArray[Any]:
        """(N,) all rows, without a copy; none may be added while they are held."""
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
        self._content = bytearray(content)

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_content": bytearray()}
