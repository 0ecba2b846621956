"""Recognises waves along the pipe in its pictures, such as those of corrugated metal.

The brightness of the wall, cell by cell of a coarse raster, is laid side by side over the last way,
without what stands still in the picture (the lamp).  A plane wave explains a share of its variance:
0.5 to 0.9 over corrugated metal, up to 0.2 over other walls.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.doubt import UNLIKELY, Doubt, probability
from vo_core.geometry.rectify import PatchGrid
from vo_core.rig import Rig
from vo_core.types import ByteImage, GrayImage, Matrix

PITCHES_MM = (20.0, 200.0)
"""Pitches that are looked for: corrugated pipes have 38 to 152 mm."""

DEPTH_SHARE = 0.25
"""Depth of waves over their pitch, root mean square: 0.17 to 0.33 in pipes on the market."""

CELLS = 512
"""Cells along the pipe that are kept: two metres."""


@dataclass(frozen=True)
class Wave:
    """The plane wave that explains most of the wall."""

    pitch_mm: float
    """From crest to crest along the pipe."""
    share: float
    """Of the variance of the brightness within `PITCHES_MM`, 0 to 1."""
    probability: float
    """That it is no coincidence."""
    crest_mm: float
    """Axial coordinate of the brightest line nearest to the middle of the seen way."""
    sigma_mm: float
    """Standard deviation of `crest_mm`."""
    length_mm: float
    """Length of the wall that shows it."""


class Waves:
    """Follows the waves of the wall through the pictures of a film."""

    def __init__(self, rig: Rig, grid: PatchGrid) -> None:
        """`grid` is that of the patches."""
        cell_mm = 4.0  # length of the raster's cells along the pipe
        # Cells around the visible arc, so that waves may run around the pipe as a helix.
        sectors = 8
        steps_per_view = 8  # pictures that are added while a wall passes through the view
        rows, columns = grid.shape
        view_mm = columns * grid.mm_per_px
        # Whole pixels: pictures are reduced by whole numbers many times faster.
        cell_px, sector_px = max(1, round(cell_mm / grid.mm_per_px)), max(1, rows // sectors)
        self._size_wh = (columns // cell_px, rows // sector_px)
        self._covered = np.s_[: self._size_wh[1] * sector_px, : self._size_wh[0] * cell_px]
        self._cell_mm = cell_px * grid.mm_per_px
        self._seen: tuple[ByteImage, NDArray[np.bool_]] | None = None
        """The last mask of the wall, and the cells that it shows whole."""
        self._near_mm = grid.axial_mm - grid.mm_per_px / 2
        self._step_mm = view_mm / steps_per_view
        self._across_mm = rig.mount.height_mm
        if rig.looks_along_pipe and rig.pipe.radius_mm is not None:
            self._across_mm = rig.pipe.radius_mm
        self._doubts = rig.pipe.diameter_mm is not None and rig.pipe.corrugation is None
        self._lamp = np.zeros((self._size_wh[1], self._size_wh[0]))
        self._pictures = np.zeros_like(self._lamp)
        self._total = np.zeros((self._size_wh[1], CELLS))
        self._count = np.zeros_like(self._total)
        self._first = 0
        """Number of the raster's first cell, counted from the zero point."""
        self._added_mm: float | None = None
        """Distance of the camera in the last picture that was added."""
        self._unsearched = 0
        """Number of pictures added since the last search for the wave."""
        self._last_mm: float | None = None
        self.doubt = Doubt(CELLS * self._cell_mm)
        """That of the distance by waves that the rig does not state."""
        self.wave: Wave | None = None
        """The wave in the wall seen of late; None before enough of it was seen."""

    def take(self, patch: GrayImage, valid: ByteImage, x_mm: float) -> None:
        """Take the next picture.

        Args:
            patch: (rows, columns), the developed wall; `valid` is 1 where it shows it.
            x_mm: Distance of the camera.
        """
        # Pictures that are added between two searches for the wave: half of the wall in view is
        # new.
        added_at_once = 4
        if self._added_mm is None or abs(x_mm - self._added_mm) >= self._step_mm:
            self._add(patch, valid, x_mm)
            self._added_mm = x_mm
            self._unsearched += 1
            if self._unsearched == added_at_once:
                self.wave, self._unsearched = self._strongest(), 0
        way_mm = 0.0 if self._last_mm is None else x_mm - self._last_mm
        self._last_mm = x_mm
        if self._doubts:
            self.doubt.take(self._share, way_mm)

    @property
    def _share(self) -> float:
        """Relative uncertainty of the way: half the depth of the waves, as far as they are there.

        Of a mixture of waves and none it is the standard deviation.
        """
        if self.wave is None:
            return 0.0
        half_mm = DEPTH_SHARE * self.wave.pitch_mm / 2
        there = self.wave.share * np.sqrt(self.wave.probability)
        return float(there * half_mm / self._across_mm)

    def _add(self, patch: GrayImage, valid: ByteImage, x_mm: float) -> None:
        """Add a picture to the raster, without the mean of all pictures so far."""
        lamp_pictures = 100  # pictures over which the light of the lamp is averaged
        is_seen = self._cells_of(valid)
        if not is_seen.any():
            return
        bright = np.log(np.maximum(self._reduced(patch), 1.0))
        bright -= bright[is_seen].mean()
        self._pictures = np.minimum(self._pictures + is_seen, lamp_pictures)
        self._lamp += is_seen * (bright - self._lamp) / np.maximum(self._pictures, 1)
        begin = round((x_mm + self._near_mm) / self._cell_mm)
        self._move_to(begin, begin + self._size_wh[0])
        here = slice(begin - self._first, begin - self._first + self._size_wh[0])
        self._total[:, here] += is_seen * (bright - self._lamp)
        self._count[:, here] += is_seen

    def _cells_of(self, valid: ByteImage) -> NDArray[np.bool_]:
        """Cells in which the whole wall shows."""
        if self._seen is None or self._seen[0] is not valid:
            self._seen = valid, self._reduced(valid.astype(np.float32)) > 0.99
        return self._seen[1]

    def _reduced(self, image: GrayImage) -> GrayImage:
        return np.asarray(
            cv2.resize(image[self._covered], self._size_wh, interpolation=cv2.INTER_AREA)
        )

    def _move_to(self, begin: int, end: int) -> None:
        """Move the raster so that it holds the cells from `begin` to `end`."""
        by = min(begin - self._first, 0) or max(end - self._first - CELLS, 0)
        kept = np.arange(CELLS) + by
        is_kept = (kept >= 0) & (kept < CELLS)
        for layer in (self._total, self._count):
            layer[:] = np.where(is_kept, np.roll(layer, -by, axis=1), 0.0)
        self._first += by

    def _strongest(self) -> Wave | None:
        """Find the wave in the spectrum of the seen part of the raster."""
        padded = 2 * CELLS  # length of the spectrum along the pipe, with zeros beyond the raster
        tapered = 1.5  # length of a tapered window over that of an even one as good (Hann)
        half_line = 2.0  # half the width of a line in its spectrum, over 1 / its length
        least_waves = 2.0  # least number of waves in sight
        seen = np.flatnonzero(self._count.any(axis=0))
        if not len(seen):
            return None
        begin, end = int(seen[0]), int(seen[-1]) + 1
        wall = self._total[:, begin:end] / np.maximum(self._count[:, begin:end], 1)
        wall = (wall - wall.mean(axis=1, keepdims=True)) * np.hanning(end - begin)
        per_mm = np.fft.rfftfreq(padded, self._cell_mm)
        length_mm = (end - begin) * self._cell_mm
        shortest_mm = max(PITCHES_MM[0], 5 * self._cell_mm)
        band = (per_mm >= 1 / PITCHES_MM[1]) & (per_mm <= 1 / shortest_mm)
        per_mm = per_mm[band]
        spectrum = np.fft.fft(np.fft.rfft(wall, padded, axis=1)[:, band], axis=0)
        power = np.square(np.abs(spectrum))
        wanted = power * (per_mm * length_mm >= least_waves)
        turn, at = np.unravel_index(int(wanted.argmax()), power.shape)
        if wanted[turn, at] <= 0:
            return None
        frequency = float(per_mm[at])
        lobe = np.abs(per_mm - frequency) <= half_line / length_mm
        share = min(float(power[turn, lobe].sum() / power.sum()), 1 - 1e-6)
        # So many values a band of this width has in this length.
        independent = 2 * (1 / shortest_mm - 1 / PITCHES_MM[1]) * length_mm / tapered
        # Of a model with one wave against none (Gaussian), beside the number of waves tried.
        gain = -independent / 2 * np.log(1 - share) - np.log(max(independent / 2, 1.0))
        middle_mm = (begin + end) / 2 * self._cell_mm
        phase = self._phase(wall, int(turn), frequency, begin * self._cell_mm - middle_mm)
        phase_sigma = np.sqrt((1 - share) / share / max(independent, 1.0))
        return Wave(
            pitch_mm=1 / frequency,
            share=share,
            probability=probability(gain - UNLIKELY),
            crest_mm=self._first * self._cell_mm + middle_mm - phase / (2 * np.pi * frequency),
            sigma_mm=float(phase_sigma / (2 * np.pi * frequency)),
            length_mm=length_mm,
        )

    def _phase(self, wall: Matrix, turn: int, frequency: float, begin_mm: float) -> float:
        """Phase of a wave in the middle of a part of the raster that begins at `begin_mm`."""
        at_mm = begin_mm + (np.arange(wall.shape[1]) + 0.5) * self._cell_mm
        around = np.exp(-2j * np.pi * turn / len(wall) * np.arange(len(wall)))
        return float(np.angle(around @ wall @ np.exp(-2j * np.pi * frequency * at_mm)))
