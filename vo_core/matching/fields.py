"""Interlaced films: which rows of a picture were exposed at the picture's own time.

A woven picture holds two fields, its even and its odd rows, half a frame apart.  When the camera
moves they show two places of the wall and the picture combs: neighbouring rows differ more than
every second one does.  Noise and texture do not comb; fine lines and lamps that flicker can.  So
where a picture combs the shift from field to field is measured, by phase correlation on the
developed wall: in the order in which the fields were exposed every shift is like the one before,
in the other every second one goes three times as far, and the other way.  The container's flags
are not asked: they are often missing or wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vo_core.geometry.rectify import BOTTOM, TOP, WHOLE, Rectifier, Rows
from vo_core.image.filters import low_pass, normalise, taper
from vo_core.image.resample import halve
from vo_core.matching.correlate import LOCK_PSR, best_peaks, correlation, spectrum
from vo_core.types import GrayImage, Image, Matrix

COMBED = 1.2
"""Energy of the second differences of neighbouring rows over that of every second row's, where a
picture combs; 1 for noise, less for texture."""

SHARE = 0.25
"""Of the picture that must comb: text, dirt and what lies far ahead do not."""

COLUMNS, ROWS, BLOCKS = 80, 100, 6
"""Combing is looked for in so many columns and rows, about, spread over the picture, and judged in
6 by 6 blocks."""

BLANK = 0.01
"""Square of grey levels: a block whose rows differ by less shows nothing."""

LEAST_PX = 0.7
"""Shift from field to field, in pixels of the correlated pictures, that shows an order."""

ALIKE = 0.25
"""Change of the shift from field to field, over the shift, that a robot can bring about."""

SURE = 3
"""Frames more for one order than for the other, by which it is certain."""

LONG = 25
"""After so many frames that comb and show no shift from field to field, the film is not interlaced.
"""


class Interlacing:
    """Finds out, frame by frame, whether a film is interlaced and which of its fields is first.

    Until the second frame of motion shows it, a picture that combs is read by the field that is
    first in most such films, the top one.  Once it is certain nothing is looked at any more.
    """

    def __init__(self, rectify: Rectifier) -> None:
        self._rectify = rectify
        self._certain: Rows | None = None
        self._top_first = 0
        """Frames that spoke for it so far, less those that spoke for the other order."""
        self._unmoved = 0
        """Frames that combed and showed no shift from field to field."""
        self._before: _Fields | None = None
        """Of the frame before, if that one combed."""

    @property
    def is_certain(self) -> bool:
        """Will all frames from now on be read by the same rows?"""
        return self._certain is not None

    def __call__(self, image: Image) -> Rows:
        """The rows of the next frame, (H, W) grey, that were exposed at the frame's own time."""
        if self._certain is not None:
            return self._certain
        before, self._before = self._before, None
        if not combs(image):
            return WHOLE
        now = _Fields(self._rectify, image)
        is_woven = before is None or self._weigh(before, now)
        if self._certain is None:
            self._before = now
            return (TOP if self._top_first >= 0 else BOTTOM) if is_woven else WHOLE
        return self._certain

    def _weigh(self, before: _Fields, now: _Fields) -> bool:
        """Take the evidence of two frames that follow each other; are they woven?

        Bottom of the one and top of the next are neighbours in time when the top is first, and
        three fields apart when it is not; and the other way round.
        """
        within = [s for s in _shifts_px(before.top, before.bottom) if np.hypot(*s) > LEAST_PX]
        if not within:
            self._unmoved += 1
            if self._unmoved >= LONG:
                self._certain = WHOLE
            return False  # fine lines, or a lamp that flickers from field to field
        if_top = _goes_on(within, _shifts_px(before.bottom, now.top))
        if_bottom = _goes_on(within, [-s for s in _shifts_px(before.top, now.bottom)])
        self._top_first += if_top - if_bottom
        if abs(self._top_first) >= SURE:
            self._certain = TOP if self._top_first > 0 else BOTTOM
        return True


def _goes_on(shifts: list[Matrix], later: list[Matrix]) -> bool:
    """Is there one among the later shifts like one before?"""
    return any(
        np.hypot(*(b - a)) < ALIKE * np.hypot(*a) + LEAST_PX / 2 for a in shifts for b in later
    )


def combs(image: Image) -> bool:
    """Does a good part of a picture, (H, W) grey, comb?"""
    height, width = image.shape
    columns = image[:, :: max(1, width // COLUMNS)].astype(np.float32)
    step = height // ROWS // 2 * 2 + 1  # odd, for even and odd rows
    centre = 2 * columns[2:-2:step]
    near = columns[1:-3:step] + columns[3:-1:step] - centre
    far = columns[:-4:step] + columns[4::step] - centre
    near_energy, far_energy = (_blocks_energy(part) for part in (near, far))
    return bool((near_energy > COMBED * far_energy + BLANK).mean() > SHARE)


def _blocks_energy(values: GrayImage) -> GrayImage:
    """Mean square in `BLOCKS` by `BLOCKS` blocks of a picture."""
    rows, columns = (side // BLOCKS for side in values.shape)
    blocks = values[: BLOCKS * rows, : BLOCKS * columns].reshape(BLOCKS, rows, BLOCKS, columns)
    return np.asarray(np.einsum("aibj,aibj->ab", blocks, blocks) / (rows * columns))


@dataclass(frozen=True)
class _Fields:
    """The spectra of the two fields of a frame on the developed wall, at half the size."""

    rectify: Rectifier
    image: Image

    @cached_property
    def top(self) -> GrayImage:
        """Of the even rows."""
        return self._spectrum(TOP)

    @cached_property
    def bottom(self) -> GrayImage:
        """Of the odd rows."""
        return self._spectrum(BOTTOM)

    def _spectrum(self, rows: Rows) -> GrayImage:
        patch = halve(normalise(low_pass(self.rectify(self.image, rows))))
        seen = (halve(self.rectify.valid.astype(np.float32)) > 0.99).astype(np.uint8)
        return spectrum(patch, taper(seen, max(4, min(seen.shape) // 5)))


def _shifts_px(one: GrayImage, other: GrayImage) -> list[Matrix]:
    """How far the content goes from one to the other, (2,) each; two where dirt stands still."""
    peaks = best_peaks(correlation(one, other), 2)
    return [np.array([p.dx_px, p.dy_px]) for p in peaks if p.psr >= LOCK_PSR]
