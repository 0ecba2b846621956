"""Columns of numbers that grow at their end while others read the existing rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import DTypeLike, NDArray

_FIRST_ROWS = 256


class GrowingColumns:
    """Named columns of equal length.

    Rows are only ever appended, after those of any view, so that a view stays valid without a copy.
    The caller makes sure that only one thread adds rows at a time.
    """

    def __init__(self, dtypes: Mapping[str, DTypeLike]) -> None:
        self._columns: dict[str, NDArray[Any]] = {
            name: np.empty(_FIRST_ROWS, dtype) for name, dtype in dtypes.items()
        }
        self._rows = 0

    def __len__(self) -> int:
        return self._rows

    def extend(self, rows: int, columns: Mapping[str, Sequence[Any] | NDArray[Any]]) -> None:
        """Add `rows` rows, given as a sequence of that length for each column."""
        end = self._rows + rows
        self._make_room(end)
        for name, column in self._columns.items():
            column[self._rows : end] = columns[name]
        self._rows = end

    def view(self, name: str) -> NDArray[Any]:
        """Return the current rows of one column, read-only."""
        view = self._columns[name][: self._rows]
        view.flags.writeable = False
        return view

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the current rows of all columns, read-only."""
        return {name: self.view(name) for name in self._columns}

    def copy(self) -> Self:
        """Return a copy that can grow separately; shared rows never change."""
        same = type(self).__new__(type(self))
        same._columns, same._rows = self.columns(), self._rows
        return same

    def _make_room(self, rows: int) -> None:
        """Double the capacity when it is used up; views keep the old memory."""
        room = len(next(iter(self._columns.values())))
        if rows <= room:
            return
        for name, column in self._columns.items():
            wider = np.empty(max(rows, 2 * room), column.dtype)
            wider[: self._rows] = column[: self._rows]
            self._columns[name] = wider
