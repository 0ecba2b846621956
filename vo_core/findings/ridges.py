"""Dark lines on the wall: oriented ridge filters at several widths, and the lines they leave."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from heapq import heappop, heappush
from math import ceil, cos, hypot, pi, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.findings.surface import Surface
from vo_core.types import ByteImage, GrayImage, Matrix

WIDTHS_MM = (1.0, 1.6, 2.5)
"""Sigmas of the ridges across their line, for gaps of up to some 8 mm."""

DIRECTIONS = 16
"""Directions of half a turn."""

LONG = 4.0
"""Length of a filter (sigma) over its width: so far a crack is straight."""

LEAST_LONG_MM = 5.0

WEAK, STRONG = 7.0, 10.0
"""Strength that carries a line on, and strength that begins one, in deviations of white noise, on a
wall whose upper quartile of strength is `USUAL`; on a wall of more lines in proportion more."""

USUAL = 4.6
"""Upper quartile of the strength on concrete."""

TILE_PX = 512
"""Side of the pieces on which the filters are computed, by Fourier transforms."""

LEAST_STRONG = 5
"""Strong pixels of a line."""

GAP_MM = 4.0
"""Gap over which a line goes on."""

LEAST_MM = 60.0
"""Extent of a line, along the pipe or around it."""


@cache
def _kernels(step_mm: float) -> list[GrayImage]:
    """Filters for each width and direction: zero mean, unit norm, positive on a dark line."""
    kernels = []
    for width_mm in WIDTHS_MM:
        across = max(width_mm / step_mm, 1.0)
        along = max(LONG * across, LEAST_LONG_MM / step_mm)
        reach = ceil(2.5 * along)
        y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.float64)
        for angle in np.arange(DIRECTIONS) * pi / DIRECTIONS:
            u, v = x * cos(angle) + y * sin(angle), y * cos(angle) - x * sin(angle)
            ridge = (1 - (v / across) ** 2) * np.exp(-((v / across) ** 2) / 2)
            kernel = -ridge * np.exp(-((u / along) ** 2) / 2)
            kernel -= kernel.mean()
            kernels.append((kernel / np.linalg.norm(kernel)).astype(np.float32))
    return kernels


@cache
def _spectra(step_mm: float) -> tuple[list[GrayImage], int]:
    """Spectra of the filters, two in each as its real and its imaginary part, and their reach."""
    kernels = _kernels(step_mm)
    reach = max(kernel.shape[0] for kernel in kernels) // 2
    spectra = []
    for pair in zip(kernels[::2], kernels[1::2], strict=True):
        both = np.zeros((TILE_PX, TILE_PX, 2), np.float32)
        for k, kernel in enumerate(pair):
            side = kernel.shape[0]
            both[:side, :side, k] = kernel
            both[..., k] = np.roll(both[..., k], (-(side // 2), -(side // 2)), (0, 1))
        spectra.append(np.asarray(cv2.dft(both, flags=cv2.DFT_COMPLEX_OUTPUT), np.float32))
    return spectra, reach


def ridges(surface: Surface) -> tuple[GrayImage, ByteImage]:
    """Strength of the best filter at each place (0 where not seen), and its direction's number.

    Direction k is k pi / `DIRECTIONS` from the pipe's axis towards growing arc.
    """
    spectra, reach = _spectra(round(float(surface.step_mm.mean()), 2))
    height, width = surface.relief.shape
    best: GrayImage = np.zeros((height, width), np.float32)
    direction: ByteImage = np.zeros((height, width), np.uint8)
    inner = TILE_PX - 2 * reach
    padded = cv2.copyMakeBorder(surface.relief, reach, TILE_PX, reach, TILE_PX, cv2.BORDER_REFLECT)
    for top in range(0, height, inner):
        for left in range(0, width, inner):
            here = np.s_[top : top + inner, left : left + inner]
            if surface.seen[here].any():
                tile = padded[top : top + TILE_PX, left : left + TILE_PX]
                _raise(best[here], direction[here], np.asarray(tile, np.float32), spectra, reach)
    quartile = float(np.percentile(best[surface.seen], 75)) if surface.seen.any() else USUAL
    return best * surface.seen / max(quartile / USUAL, 1.0), direction


def _raise(
    best: GrayImage, direction: ByteImage, tile: GrayImage, spectra: list[GrayImage], reach: int
) -> None:
    """Raise `best` and `direction` in place to the answers of the filters on a tile."""
    rows, columns = best.shape
    inside = np.s_[reach : reach + rows, reach : reach + columns]
    spectrum = cv2.dft(np.ascontiguousarray(tile), flags=cv2.DFT_COMPLEX_OUTPUT)
    for number, filters in enumerate(spectra):
        answers = cv2.idft(cv2.mulSpectrums(spectrum, filters, 0), flags=cv2.DFT_SCALE)[inside]
        for k, answer in enumerate(cv2.split(answers)):
            better = answer > best
            np.copyto(best, answer, where=better)
            np.copyto(direction, np.uint8((2 * number + k) % DIRECTIONS), where=better)


def crests(strength: GrayImage, direction: ByteImage) -> GrayImage:
    """Strength where it is largest across the line, 0 elsewhere."""
    crest = np.zeros_like(strength)
    padded = np.pad(strength, 1)
    height, width = strength.shape
    octant = (direction.astype(int) * 4 + DIRECTIONS // 2) // DIRECTIONS % 4
    for number, (dx, dy) in enumerate([(0, 1), (-1, 1), (1, 0), (1, 1)]):
        ahead = padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width]
        behind = padded[1 - dy : 1 - dy + height, 1 - dx : 1 - dx + width]
        is_crest = (octant == number) & (strength >= ahead) & (strength >= behind)
        np.copyto(crest, strength, where=is_crest)
    return crest


def components(crest: GrayImage, step_mm: float) -> Iterator[NDArray[np.intp]]:
    """Yield the pixels of each connected crest, (n, 2) columns and rows.

    A crest begins at `STRONG` and goes on while it is `WEAK` (Canny 1986), over gaps of
    `GAP_MM`.
    """
    weak = (crest >= WEAK).astype(np.uint8)
    side = _bridge_px(step_mm)
    bridged = cv2.dilate(weak, np.ones((side, side), np.uint8))
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(bridged, connectivity=8)
    labels *= weak
    strong = np.bincount(labels[crest >= STRONG], minlength=count)
    for label in range(1, count):
        left, top, width, height, _ = boxes[label].tolist()
        if strong[label] < LEAST_STRONG or max(width, height) * step_mm < LEAST_MM:
            continue
        rows, columns = np.nonzero(labels[top : top + height, left : left + width] == label)
        yield np.stack([columns + left, rows + top], 1)


def _bridge_px(step_mm: float) -> int:
    """Side of the square by which crests are widened to bridge a gap; it is odd."""
    return 2 * max(round(GAP_MM / step_mm / 2), 1) + 1


def main_line(pixels: NDArray[np.intp], step_mm: float) -> Matrix:
    """Longest of the shortest ways between two pixels of a crest, in order; without branches.

    A step reaches over a gap; its cost grows faster than its length, so that the way keeps to the
    crest. The pixel farthest from any other is one end (two sweeps of Dijkstra 1959).
    """
    number = {pixel: k for k, pixel in enumerate(map(tuple, pixels.tolist()))}
    side = _bridge_px(step_mm)
    reach = range(-side, side + 1)
    steps = [(x, y, hypot(x, y) ** 1.5) for x in reach for y in reach if (x, y) != (0, 0)]

    def farthest(start: int) -> tuple[int, list[int]]:
        cost, before = np.full(len(pixels), np.inf), np.full(len(pixels), -1)
        cost[start] = 0.0
        waiting, last = [(0.0, start)], start
        while waiting:
            so_far, at = heappop(waiting)
            if so_far > cost[at]:
                continue
            last = at
            column, row = pixels[at].tolist()
            for x, y, way in steps:
                near = number.get((column + x, row + y))
                if near is not None and so_far + way < cost[near]:
                    cost[near], before[near] = so_far + way, at
                    heappush(waiting, (so_far + way, near))
        path = [last]
        while before[path[-1]] >= 0:
            path.append(int(before[path[-1]]))
        return last, path

    end, _ = farthest(0)
    _, path = farthest(end)
    return pixels[path].astype(np.float64)
