"""The printed board, and its views in the pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vo_core.errors import ChainageError
from vo_core.geometry.wall import Points


class UnusableBoards(ChainageError):
    """The pictures do not determine a camera; the message states why and what to do."""


@dataclass(frozen=True)
class Board:
    """A flat calibration pattern: a ChArUco board if it has markers, else a checkerboard."""

    columns: int
    """Squares along a row of a ChArUco board; inner corners or squares of a checkerboard."""
    rows: int
    square_mm: float
    marker_mm: float | None = None
    """Side of a ChArUco board's markers."""

    def __post_init__(self) -> None:
        if self.marker_mm is not None and not 0 < self.marker_mm < self.square_mm:
            raise UnusableBoards(
                f"The markers of a ChArUco board are smaller than its squares of "
                f"{self.square_mm:g} mm; found {self.marker_mm:g} mm."
            )

    @property
    def margin(self) -> float:
        """Distance on both sides of a square's edge over which the print has one colour, in
        squares.

        It is half a square, or the white around a marker, minus a tenth for safety.
        """
        return 0.4 if self.marker_mm is None else 0.45 * (1 - self.marker_mm / self.square_mm)


@dataclass(frozen=True, eq=False)
class View:
    """The view of a board in one picture."""

    name: str
    corners_px: Points
    """(N, 2), pixel centres at integers."""
    corners_mm: Points
    """(N, 3) on the board, z = 0."""
    edge_px: float
    """Width of the edges between squares: height of the step over its steepest slope."""

    def only(self, good: NDArray[np.bool_]) -> View:
        """Keep only the corners in the mask `good`, (N,)."""
        return replace(self, corners_px=self.corners_px[good], corners_mm=self.corners_mm[good])


@dataclass(frozen=True)
class Dropped:
    """A picture that was rejected."""

    name: str
    reason: str


@dataclass(frozen=True)
class Boards:
    """The boards found in a set of pictures."""

    size_wh: tuple[int, int]
    views: tuple[View, ...]
    dropped: tuple[Dropped, ...]
