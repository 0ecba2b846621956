"""How good the pictures are to measure on, and what is wrong with them in a word.

Nothing here changes the odometry: it shows the operator what to do while there is still time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.types import ByteImage, GrayImage

TOO_FAST = 0.57
"""Common wall below which one frame that fails leaves the next with less than `LEAST_OVERLAP` of
the odometry (0.15): 1 - (1 - 0.15) / 2."""

TOO_DARK = 0.18
"""Mean grey level over white. Rendered and coded: weak light 0.16, a narrow lamp 0.25, else 0.3."""

TOO_BRIGHT = 0.1
"""A tenth of the wall without a picture."""

BLURRED = 0.5
"""Rendered and coded: 9 px of motion blur in 640 give 0.45, a Gaussian of 3 px 0.4, sharp pictures
0.6 and more."""

LENS_DIRTY = 0.1
"""Rendered: drops over 18 % of the glass give 0.3; burnt-in text, a little dust and lamps 0.05."""

WHITE_GREY = 230.0
"""Studio-range video ends at 235."""

_SPARSE = 8
"""Of the rows (and of the columns) every so many is looked at."""

_LAGS_PX = (2, 4, 8)
_BLOCK_PX = 32

_LEAST_SHARP = 0.35
"""Detail that every wall has in a sharp picture: a lens out of focus from the start shows too."""

_RISE, _FALL = 0.2, 1 / 1000
"""Share of a measurement in the best detail seen lately: a minute at 30 Hz forgets most of it."""

_STEADY = 0.2
"""Share of a measurement in the detail of now: one joint or stain is no blur."""


@dataclass(frozen=True, slots=True)
class Health:
    """Of one frame, all in [0, 1]."""

    overlap: float
    """Share of the wall that the frame before showed too, by their poses."""
    brightness: float
    """Mean grey level of the wall over white."""
    overexposed: float
    """Share of the wall that is white."""
    sharpness: float
    """Fine detail over the best seen lately; see `HealthGauge`."""
    fixed_pattern: float
    """Share of the texture's energy that moves with the camera: dirt, drops, burnt-in text."""


NO_HEALTH = Health(1.0, 0.0, 0.0, 0.0, 0.0)
"""Before the first frame."""


def complaints(health: Health) -> tuple[str, ...]:
    """What to show the operator: too_fast, too_dark, too_bright, blurred, lens_dirty."""
    found = complained({name: np.float64(value) for name, value in asdict(health).items()})
    return tuple(name for name, is_so in found.items() if is_so)


def complained(
    columns: Mapping[str, NDArray[np.floating] | np.floating],
) -> dict[str, NDArray[np.bool_]]:
    """Which frames each complaint is about; `columns` are the fields of `Health`, each (N,)."""
    overlap, brightness, overexposed, sharpness, fixed_pattern = (
        np.asarray(columns[field.name], np.float64) for field in fields(Health)
    )
    return {
        "too_fast": overlap < TOO_FAST,
        "too_dark": brightness < TOO_DARK,
        "too_bright": overexposed > TOO_BRIGHT,
        "blurred": sharpness < BLURRED,
        "lens_dirty": fixed_pattern > LENS_DIRTY,
    }


class HealthGauge:
    """Takes the patches of a run; it remembers how sharp the best of them were.

    Sharpness is the detail over the best lately, in the worse of the two directions; and because
    blur by motion has a direction, which a change of the wall seldom has, times the worse over the
    better direction.
    """

    def __init__(self, valid: ByteImage) -> None:
        self._valid = valid[::4, ::4] > 0
        self._turn = 1
        self._detail = [0.0, 0.0]
        """Along the pipe and around it; 0 before the first."""
        self._best = [_LEAST_SHARP, _LEAST_SHARP]

    def take(self, patch: GrayImage, *, overlap: float, fixed_pattern: float) -> Health:
        """Health of a frame.

        Args:
            patch: (rows, columns), as it was rectified.
            overlap, fixed_pattern: As in `Health`; the odometry knows them.
        """
        grey = patch[::4, ::4][self._valid]
        return Health(
            overlap=float(np.clip(overlap, 0, 1)),
            brightness=float(np.clip(grey.mean() / 255, 0, 1)),
            overexposed=float((grey >= WHITE_GREY).mean()),
            sharpness=self._sharpness(patch),
            fixed_pattern=float(np.clip(fixed_pattern, 0, 1)),
        )

    def _sharpness(self, patch: GrayImage) -> float:
        # One direction a frame: twice as quick.
        turn = self._turn = 1 - self._turn
        rows = patch[:, _SPARSE // 2 :: _SPARSE].T if turn else patch[_SPARSE // 2 :: _SPARSE]
        new = detail(np.ascontiguousarray(rows))
        known = self._detail[turn]
        if np.isfinite(new):
            known += _STEADY * (new - known) if known else new
        share = _RISE if known > self._best[turn] else _FALL
        self._detail[turn] = known
        self._best[turn] = max(self._best[turn] + share * (known - self._best[turn]), _LEAST_SHARP)
        shares = (now / best for now, best in zip(self._detail, self._best, strict=True))
        worse, better = sorted(shares)
        if worse <= 0:  # nothing to compare with yet, or no texture: others complain of that
            return 1.0
        return min(worse * worse / better, 1.0)


def detail(rows: GrayImage) -> float:
    """How much finer than 4 px the texture along the rows is, about 1; nan without any texture.

    With T(l) the mean square of the second difference 2 a(x) - a(x - l) - a(x + l), it is
    (T(4) - T(2)) / (T(8) - T(4)): noise adds the same to each T and shading nothing.  Texture whose
    scales are alike gives the same whatever its contrast; blur takes the finest away first.  The
    median over blocks leaves out dirt, text and joints.
    """
    height, width = rows.shape
    reach = _LAGS_PX[-1]
    if width < 3 * reach:
        return float("nan")
    size_wh = (max(1, (width - 2 * reach) // _BLOCK_PX), max(1, height * _SPARSE // _BLOCK_PX))

    def energy(lag: int) -> GrayImage:
        """T(lag) of each block."""
        before, at, after = (rows[:, reach + k : width - reach + k] for k in (-lag, 0, lag))
        difference = 2 * at - before - after
        square = difference * difference
        return np.asarray(cv2.resize(square, size_wh, interpolation=cv2.INTER_AREA), np.float32)

    fine, mid, coarse = (energy(lag) for lag in _LAGS_PX)
    gain = coarse - mid
    clear = gain > 0.02 * coarse
    if clear.sum() <= clear.size / 4:
        return float("nan")
    return float(np.median((mid - fine)[clear] / gain[clear]))
