"""Detects interlaced films, and which rows of a picture were exposed at its own time.

A woven picture holds two fields, its even and its odd rows, half a frame apart.  When the camera
moves they show two places of the wall and the picture combs: neighbouring rows differ more than
every second row does.  Noise and texture do not comb, but fine lines and flickering lamps can.  So
where a picture combs, phase correlation on the developed wall measures the shift from field to
field. In the right order of the fields each shift resembles the one before; in the wrong order
every second shift is three times as long and has the opposite direction. The flags of the container
are ignored, because they are often missing or wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vo_core.geometry.rectify import BOTTOM, TOP, WHOLE, Rectifier, Rows
from vo_core.image.filters import low_pass, normalise
from vo_core.image.resample import halve, halve_mask, reduce_to
from vo_core.matching.correlate import LOCK_PSR, best_peaks, correlation, spectrum, window_of
from vo_core.types import GrayImage, Image, Matrix

COMBED = 1.2
"""A block combs if the second differences of neighbouring rows have this many times the energy of
those of every second row.  The ratio is 1 for noise and less for texture."""

LEAST_PX = 0.7
"""Least shift from field to field, in px of the correlated pictures, that shows their order."""


class Interlacing:
    """Detects whether a film is interlaced and which of its fields is first.

    Until the second frame of motion shows the order, the top field of a combing picture is read, as
    it is first in most such films. Once the order is certain, pictures are no longer tested.
    """

    def __init__(self, rectify: Rectifier) -> None:
        self._rectify = rectify
        self._certain: Rows | None = None
        self._top_first = 0
        """Number of frames that support this order, minus those that support the other."""
        self._unmoved = 0
        """Number of frames that combed and showed no shift from field to field."""
        self._before: _Fields | None = None
        """Fields of the frame before, if it combed."""
        self._sample: GrayImage | None = None
        """Columns of the frame before."""
        self._whole = 0
        """Number of frames exposed at one time since the last that combed."""

    @property
    def is_certain(self) -> bool:
        """Whether the same rows are read of all frames from now on."""
        return self._certain is not None

    def __call__(self, image: Image) -> Rows:
        """Detect the rows of the next frame, (H, W) grey, that were exposed at its own time."""
        if self._certain is not None:
            return self._certain
        before, self._before = self._before, None
        if not self._combs(image):
            return WHOLE
        now = _Fields(self._rectify, image)
        is_woven = before is None or self._weigh(before, now)
        if self._certain is None:
            self._before = now
            return (TOP if self._top_first >= 0 else BOTTOM) if is_woven else WHOLE
        return self._certain

    def _combs(self, image: Image) -> bool:
        """Whether a sufficient share of a picture, (H, W) grey, combs.

        If its fields were half a frame apart, each would differ from the other by half of what the
        picture has changed since the one before: their rows, twice the rows between them less
        both, would have at least the energy of that change.
        """
        # A film is not interlaced if this many frames, with none that combs among them, were
        # certainly exposed at one time each.
        whole_frames = 50
        share = 0.25  # share of the blocks that must comb; text, dirt and distant wall do not
        blank = 0.01  # A block whose rows differ by less, in grey levels squared, shows nothing
        tested_rows, tested_columns = 100, 80  # approximate, spread over the picture
        height, width = image.shape
        columns = image[:, :: max(1, width // tested_columns)].astype(np.float32)
        before, self._sample = self._sample, columns
        step = height // tested_rows // 2 * 2 + 1  # odd, for even and odd rows
        centre = 2 * columns[2:-2:step]
        near = columns[1:-3:step] + columns[3:-1:step] - centre
        far = columns[:-4:step] + columns[4::step] - centre
        near_energy, far_energy = (_blocks_energy(part) for part in (near, far))
        combs = bool((near_energy > COMBED * far_energy + blank).mean() > share)
        if before is not None:
            changed = _blocks_energy((columns - before)[2:-2:step])
            is_whole = (changed > 2 * near_energy + blank).mean() > 1 - share
            self._whole = 0 if combs else self._whole + bool(is_whole)
            if self._whole >= whole_frames:
                self._certain, self._sample = WHOLE, None
        return combs

    def _weigh(self, before: _Fields, now: _Fields) -> bool:
        """Weigh two consecutive frames; return whether they are woven.

        The bottom field of one frame and the top field of the next are neighbours in time if the
        top is first, and three fields apart if it is not; the other pair behaves the opposite way.
        """
        sure = 3  # an order is certain when this many more frames support it than the other
        # A film is not interlaced if this many frames comb without a shift from field to field.
        long = 25
        within = [s for s in _shifts_px(before.top, before.bottom) if np.hypot(*s) > LEAST_PX]
        if not within:
            self._unmoved += 1
            if self._unmoved >= long:
                self._certain = WHOLE
            return False  # fine lines, or a lamp that flickers from field to field
        if_top = _goes_on(within, _shifts_px(before.bottom, now.top))
        if_bottom = _goes_on(within, [-s for s in _shifts_px(before.top, now.bottom)])
        self._top_first += if_top - if_bottom
        if abs(self._top_first) >= sure:
            self._certain = TOP if self._top_first > 0 else BOTTOM
        return True


def _goes_on(shifts: list[Matrix], later: list[Matrix]) -> bool:
    """Whether one of the later shifts resembles one of the earlier."""
    alike = 0.25  # largest relative change of the shift from field to field by the robot itself
    return any(
        np.hypot(*(b - a)) < alike * np.hypot(*a) + LEAST_PX / 2 for a in shifts for b in later
    )


def _blocks_energy(values: GrayImage) -> GrayImage:
    """Mean squares of a picture in 6 by 6 blocks."""
    blocks = 6
    rows, columns = (side // blocks * blocks for side in values.shape)
    whole = values[:rows, :columns]
    return reduce_to(whole * whole, (blocks, blocks))


@dataclass(frozen=True)
class _Fields:
    """The spectra of the two fields of a frame on the developed wall, at half the size."""

    rectify: Rectifier
    image: Image

    @cached_property
    def top(self) -> GrayImage:
        """Spectrum of the even rows."""
        return self._spectrum(TOP)

    @cached_property
    def bottom(self) -> GrayImage:
        """Spectrum of the odd rows."""
        return self._spectrum(BOTTOM)

    def _spectrum(self, rows: Rows) -> GrayImage:
        patch = halve(normalise(low_pass(self.rectify(self.image, rows))))
        return spectrum(patch, window_of(halve_mask(self.rectify.valid)))


def _shifts_px(one: GrayImage, other: GrayImage) -> list[Matrix]:
    """Shifts of the content from one to the other, (2,) each; two where dirt stands still."""
    peaks = best_peaks(correlation(one, other), 2)
    return [np.array([p.dx_px, p.dy_px]) for p in peaks if p.psr >= LOCK_PSR]
