"""Rates how suitable the pictures are for tracking, and names their faults.

Nothing here affects the odometry; it lets the operator correct a fault during the drive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields

import numpy as np
from numpy.typing import NDArray

from vo_core.image.resample import reduce_to
from vo_core.types import ByteImage, GrayImage

TOO_FAST = 0.57
"""Least share of common wall.  Below it, one failed frame would leave the next with less than the
odometry's `LEAST_OVERLAP` (0.15): 1 - (1 - 0.15) / 2."""

TOO_DARK = 0.18
"""Least mean grey level over white.  Rendered and coded films: weak light 0.16, a narrow lamp 0.25,
others 0.3."""

TOO_BRIGHT = 0.1
"""Largest share of the wall that may be overexposed."""

BLURRED = 0.5
"""Least sharpness. Rendered and coded films: 9 px of motion blur in 640 give 0.45, a Gaussian of 3
px 0.4, sharp pictures 0.6 and more."""

LENS_DIRTY = 0.1
"""Largest share of the fixed pattern. Rendered films: drops over 18 % of the glass give 0.3;
burnt-in text, a little dust and lamps 0.05."""

WHITE_GREY = 230.0
"""A pixel at or above this grey level is overexposed; studio-range video ends at 235."""

_SPARSE = 8
"""Sharpness is measured on every 8th row, and on every 8th column."""

_LEAST_SHARP = 0.35
"""Detail of any wall in a sharp picture, so that a lens out of focus from the start is detected."""


@dataclass(frozen=True, slots=True)
class Health:
    """How suitable one frame is for tracking; all values are in [0, 1]."""

    overlap: float
    """Share of the wall that the frame before also showed, by their poses."""
    brightness: float
    """Mean grey level of the wall, relative to white."""
    overexposed: float
    """Share of the wall that is white."""
    sharpness: float
    """Fine detail relative to the recent best; see `HealthGauge`."""
    fixed_pattern: float
    """Share of the texture's energy that moves with the camera: dirt, drops, burnt-in text."""


def complaints(health: Health) -> tuple[str, ...]:
    """Names of the faults: too_fast, too_dark, too_bright, blurred, lens_dirty."""
    found = complained({name: np.float64(value) for name, value in asdict(health).items()})
    return tuple(name for name, is_so in found.items() if is_so)


def complained(
    columns: Mapping[str, NDArray[np.floating] | np.floating],
) -> dict[str, NDArray[np.bool_]]:
    """Detect the faults of each frame; `columns` are the fields of `Health`, each (N,)."""
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
    """Measures the health of the patches of a run, with a memory of the recent best detail.

    Sharpness is the detail over the recent best, in the worse of the two directions. Motion blur
    has a direction, which a change of the wall seldom has, so it is multiplied by the ratio of the
    worse to the better direction.
    """

    def __init__(self, valid: ByteImage) -> None:
        self._valid = valid[::4, ::4] > 0
        self._turn = 1
        self._detail = [0.0, 0.0]
        """Current detail along the pipe and around it; 0 before the first measurement."""
        self._best = [_LEAST_SHARP, _LEAST_SHARP]

    def take(self, patch: GrayImage, *, overlap: float, fixed_pattern: float) -> Health:
        """Measure the health of a frame.

        Args:
            patch: (rows, columns), the rectified frame.
            overlap, fixed_pattern: As in `Health`, from the odometry.
        """
        grey = patch[::4, ::4][self._valid]
        return Health(
            overlap=float(np.clip(overlap, 0, 1)),
            brightness=float(np.clip(grey.mean() / 255, 0, 1)),
            overexposed=np.count_nonzero(grey >= WHITE_GREY) / len(grey),
            sharpness=self._sharpness(patch),
            fixed_pattern=float(np.clip(fixed_pattern, 0, 1)),
        )

    def _sharpness(self, patch: GrayImage) -> float:
        steady = 0.2  # weight of a measurement in the current detail: one joint is no blur
        # Weights of a measurement above the recent best detail, and below: a minute at 30 Hz
        # forgets most of it.
        rise, fall = 0.2, 1 / 1000
        # One direction per frame, at half the cost.
        turn = self._turn = 1 - self._turn
        rows = patch[:, _SPARSE // 2 :: _SPARSE].T if turn else patch[_SPARSE // 2 :: _SPARSE]
        new = detail(np.ascontiguousarray(rows))
        known = self._detail[turn]
        if np.isfinite(new):
            known += steady * (new - known) if known else new
        share = rise if known > self._best[turn] else fall
        self._detail[turn] = known
        self._best[turn] = max(self._best[turn] + share * (known - self._best[turn]), _LEAST_SHARP)
        shares = (now / best for now, best in zip(self._detail, self._best, strict=True))
        worse, better = sorted(shares)
        if worse <= 0:  # nothing to compare with yet, or no texture, which other values show
            return 1.0
        return min(worse * worse / better, 1.0)


def detail(rows: GrayImage) -> float:
    """Texture finer than 4 px along the rows, relative to coarser texture, about 1; nan without
    any.

    With T(l) the mean square of the second difference 2 a(x) - a(x - l) - a(x + l), it is
    (T(4) - T(2)) / (T(8) - T(4)): noise adds the same to each T, and shading adds nothing.  The
    result does not depend on the contrast; blur removes the finest texture first.  The median over
    blocks ignores dirt, text and joints.
    """
    lags_px = (2, 4, 8)
    block_px = 32
    height, width = rows.shape
    reach = lags_px[-1]
    if width < 3 * reach:
        return float("nan")
    across, down = max(1, (width - 2 * reach) // block_px), max(1, height * _SPARSE // block_px)
    at = 2 * rows[:, reach : width - reach]
    differences = [
        at - rows[:, reach - lag : width - reach - lag] - rows[:, reach + lag : width - reach + lag]
        for lag in lags_px
    ]
    below = np.concatenate(differences)
    # T of each block, for all lags at once.
    energies = reduce_to(below * below, (across, len(lags_px) * down))
    fine, mid, coarse = energies.reshape(len(lags_px), -1)
    gain = coarse - mid
    clear = gain > 0.02 * coarse
    ratios = np.sort((mid - fine)[clear] / gain[clear])
    count = len(ratios)
    if count <= clear.size / 4:
        return float("nan")
    return float(ratios[(count - 1) // 2] + ratios[count // 2]) / 2
