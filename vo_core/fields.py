"""Interlaced films: which rows of a picture were exposed at the picture's own time.

A woven picture holds two fields, its even and its odd rows, half a frame apart.  When the camera
moves they show two places of the wall and the picture combs: neighbouring rows differ more than
every second one does.  Noise and texture do not comb; fine lines and lamps that flicker can.  So
where a picture combs its fields are compared with those of the next frame: fields that follow each
other differ alike, whether they lie in one frame or in two, and less than those that are three
fields apart, which gives their order.  The container's flags are not asked: they are often missing
or wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vo_core.filters import normalise
from vo_core.resample import reduce_to
from vo_core.types import AnyImage, GrayImage, Image

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

LONGEST_PX = 80
"""Longest side to which fields are reduced before they are compared: the difference of coarse
pictures still grows with the way when that of fine ones is as large as it can be."""

WOVEN = 0.25
"""Difference between the fields of one frame over that to the fields of the next: 1 when each is a
moment of its own, below 0.15 when they are one."""

SURE, MOST = 1.0, 0.3
"""Evidence for an order of the fields, the sum over the frames of the logarithm of one difference
over the other, and what a frame adds at most.  It adds 0.6 to 0.1 as a robot gains speed, and 0.02
of either sign in a progressive film."""

LONG = 25
"""After so many frames that comb and move but speak for no order, the film is not interlaced."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Every `step`-th row of a picture from the row `first` on."""

    first: int
    step: int

    def of(self, image: AnyImage) -> AnyImage:
        """Those rows, (H / step, W, ...)."""
        return image[self.first :: self.step]


WHOLE = Rows(0, 1)
TOP, BOTTOM = Rows(0, 2), Rows(1, 2)
"""The two fields."""


class Interlacing:
    """Finds out, frame by frame, whether a film is interlaced and which of its fields is first.

    Until that is certain, after a few frames of motion, a picture that combs is read by the field
    that is first in most such films, the top one.  Afterwards nothing is looked at any more.
    """

    def __init__(self) -> None:
        self._certain: Rows | None = None
        self._top_first = 0.0
        """Evidence so far; below 0 for the other order."""
        self._frames = 0
        """That moved and combed."""
        self._before: _Fields | None = None
        """Of the frame before, if that one combed."""

    def __call__(self, image: Image) -> Rows:
        """The rows of the next frame, (H, W) grey, that were exposed at the frame's own time."""
        if self._certain is not None:
            return self._certain
        before, self._before = self._before, None
        if not combs(image):
            return WHOLE
        now = _Fields.of(image)
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
        within = (_difference(before.top, before.bottom) + _difference(now.top, now.bottom)) / 2
        if_top = _difference(before.bottom, now.top)
        if_bottom = _difference(before.top, now.bottom)
        if _difference(before.top, now.top) < within / 2:
            return False  # the fields differ but nothing moves: fine lines, or a lamp that flickers
        self._frames += 1
        is_woven = within > WOVEN * min(if_top, if_bottom)
        if is_woven:
            self._top_first += float(np.clip(np.log(if_bottom / if_top), -MOST, MOST))
        if abs(self._top_first) > SURE:
            self._certain = TOP if self._top_first > 0 else BOTTOM
        elif self._frames >= LONG:
            self._certain = WHOLE
        return is_woven


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
    """The two fields of a frame, reduced and normalised."""

    top: GrayImage
    bottom: GrayImage

    @classmethod
    def of(cls, image: Image) -> _Fields:
        height, width = image.shape
        reduction = max(height, width) / LONGEST_PX
        size_wh = (max(3, round(width / reduction)), max(3, round(height / reduction)))
        top, bottom = (normalise(reduce_to(rows.of(image), size_wh)) for rows in (TOP, BOTTOM))
        # The bottom field lies a row lower: both are brought to the middle between them.
        half_row = np.float32(size_wh[1] / height / 2)
        return cls(
            top[1:-1] + half_row * (top[2:] - top[1:-1]),
            bottom[1:-1] + half_row * (bottom[:-2] - bottom[1:-1]),
        )


def _difference(one: GrayImage, other: GrayImage) -> float:
    return float(np.square(one - other).mean()) + 1e-9
