"""The travelled path: a point every 10 mm, so that it grows with the distance, not with the
frames.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import viser

from app.viewer.geometry import Section

STEP_MM = 10.0
CHUNK_POINTS = 256
MAX_CHUNKS = 512
MAX_POINTS = MAX_CHUNKS * (CHUNK_POINTS - 1)
"""1.3 km of path; beyond that the oldest chunk is overwritten."""

_SURE = np.array([0.0, 118.0, 190.0])
_UNSURE = np.array([190.0, 90.0, 0.0])
_UNSURE_SIGMA_M = 0.05


class PathPoint(NamedTuple):
    """Position of the camera, and its uncertainty."""

    x_mm: float
    y_mm: float
    sigma_mm: float


class Thinner:
    """Keeps a point when it lies a step away from the last one kept."""

    def __init__(self) -> None:
        self._last: PathPoint | None = None

    def thin(
        self, xs_mm: Sequence[float], ys_mm: Sequence[float], sigmas_mm: Sequence[float]
    ) -> list[PathPoint]:
        """Return the points to keep."""
        kept = []
        for values in zip(xs_mm, ys_mm, sigmas_mm, strict=True):
            point = PathPoint(*map(float, values))
            if self._last is None or _apart_mm(point, self._last) >= STEP_MM:
                kept.append(point)
                self._last = point
        return kept


def _apart_mm(a: PathPoint, b: PathPoint) -> float:
    return math.hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm)


class Trail:
    """Draws the path on the wall below the robot, from blue to amber as its uncertainty grows."""

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        self._chunks: dict[int, viser.LineSegmentsHandle] = {}
        self._number = 0
        self._open: list[PathPoint] = []

    def reset(self) -> None:
        """Remove the path."""
        for chunk in self._chunks.values():
            chunk.visible = False
        self._number = 0
        self._open = []

    def add(self, points: Sequence[PathPoint]) -> None:
        """Extend the path; only the chunks that change are sent."""
        start = 0
        while start < len(points):
            taken = points[start : start + CHUNK_POINTS - len(self._open)]
            start += len(taken)
            self._open.extend(taken)
            if len(self._open) > 1:
                self._draw_open_chunk()
            if len(self._open) == CHUNK_POINTS:
                self._number = (self._number + 1) % MAX_CHUNKS
                self._open = self._open[-1:]  # the next chunk starts at this point

    def _draw_open_chunk(self) -> None:
        x, y, sigma = np.array(self._open).T / 1000
        size = self._section.scale_m
        line = self._section.below(x, y, above_m=0.02 * size)
        unsure = np.minimum(sigma / _UNSURE_SIGMA_M, 1.0)[:, None]
        colors = (_SURE + unsure * (_UNSURE - _SURE)).astype(np.uint8)
        self._chunks[self._number] = self._scene.add_line_segments(
            f"/trail/{self._number}",
            np.stack([line[:-1], line[1:]], axis=1),
            colors=np.stack([colors[:-1], colors[1:]], axis=1),
            thickness=0.035 * size,
        )
