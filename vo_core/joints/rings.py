"""Detects rings in a part of the developed wall, by what most of its sectors show.

The arc is divided into sectors, each with its own profile along the pipe, to separate rings from
cracks and stains: a ring shows in most sectors, or in most of those on both flanks where silt hides
the invert.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.image.resample import reduce_to
from vo_core.types import GrayImage, Matrix

ROUND = 0.6
"""Share of the sectors that must show a ring at least half as strong as the median sector does.

Water over a third of the picture may hide the rest."""

ROUND_ON_FLANKS = 0.75
"""The same for the sectors on both flanks, where silt hides the middle half: a line on one flank
alone is no ring."""

SIGNIFICANCE = 6.0
"""Least contrast of a ring, in robust standard deviations of the wall around it."""

LEAST_RING_CONTRAST = 0.003
"""Added to the wall's deviation, so that a contrast of less than some percent is no ring."""

COVERED = 0.9
"""Least share of a filter's surround that was seen as often as the rest."""

BINNING_PX = 0.1
"""Position error by binning pixels, one sigma."""

_LEAST_SIGMA_PX = 4.0
"""Least sigma of a Gaussian on fewer columns."""

_SURROUND = 3.0
"""Width of a filter's surround over that of its centre."""


@dataclass(frozen=True, slots=True)
class Ring:
    """A ring in a part of the wall."""

    at_px: float
    """Column, counted from the left border of the first one."""
    sigma_px: float
    contrast: float


def find_rings(total: GrayImage, count: GrayImage, widths_px: Iterable[float]) -> list[Ring]:
    """Detect rings in a part of the developed wall, most significant first.

    A ring is a ridge at one of several widths (difference of Gaussians along the axis, Lindeberg
    1998) that most sectors show with the same sign, significant against the deviation of the part.

    Args:
        total, count: (sectors, columns), sum of the brightness about 1 and number of samples.
        widths_px: Sigmas of the filters, raised to at least 1.5 px.
    """
    rows = np.arange(len(total))
    flanks = np.abs(rows - rows.mean()) > len(rows) / 4
    layers = []
    for width in sorted({max(w, 1.5) for w in widths_px}):
        answers, covered = _filtered(total, count, width)
        layers.append(_Layer.of(answers, covered, width, ROUND))
        layers.append(_Layer.of(answers[flanks], covered[flanks], width, ROUND_ON_FLANKS))
    significance = np.stack([layer.significance for layer in layers])
    strongest = significance.max(axis=0)
    # A gap and the mortar beside it are one joint, and the surround has the opposite sign.
    reach = int(np.ceil(2 * _SURROUND * layers[-1].width_px))
    rings = []
    while (peak := int(strongest.argmax())) >= 0 and strongest[peak] >= SIGNIFICANCE:
        layer = layers[int(significance[:, peak].argmax())]
        rings.append(layer.ring(peak))
        strongest[max(peak - reach, 0) : peak + reach + 1] = 0
    return rings


Covered = NDArray[np.bool_]
"""(sectors, columns) where a filter's surround was seen."""


@dataclass(frozen=True)
class _Layer:
    """Responses of one filter."""

    width_px: float
    answers: Matrix
    """(sectors, columns) response of each sector."""
    median: Matrix
    """(columns,) median over the sectors, 0 where too few were seen."""
    significance: Matrix
    """(columns,) median relative to its deviation along the wall, 0 where too few sectors agree."""

    @classmethod
    def of(cls, answers: Matrix, covered: Covered, width_px: float, share: float) -> _Layer:
        """Combine the responses of some sectors, a share of which must agree."""
        ordered = np.sort(np.where(covered, answers, np.nan), axis=0)  # nan comes last
        seen = covered.sum(axis=0)
        columns = np.arange(answers.shape[1])

        def quantile(share: float) -> Matrix:
            rank = np.rint(share * np.maximum(seen - 1, 0)).astype(int)
            return np.where(seen >= len(answers) / 2, ordered[rank, columns], 0.0)

        low, median, high = quantile(1 - share), quantile(0.5), quantile(share)
        size = np.abs(median)
        is_round = np.where(median > 0, low, -high) >= size / 2
        measured = size[seen >= len(answers) / 2]
        noise = 1.4826 * float(np.median(measured)) if measured.size else np.inf
        return cls(width_px, answers, median, is_round * size / (noise + LEAST_RING_CONTRAST))

    def ring(self, peak: int) -> Ring:
        """Locate the ring near a column by the median's peak and the scatter of the sectors."""
        sign = np.sign(self.median[peak])
        reach = int(np.ceil(1.5 * self.width_px))
        left, right = max(peak - reach, 1), min(peak + reach, len(self.median) - 2)
        at = np.array([_peak(sign * row, left, right) for row in self.answers])
        # A chipped edge covers two sectors, so only half of them are independent.
        scatter = 1.4826 * np.median(np.abs(at - np.median(at))) / np.sqrt(len(at) / 2)
        return Ring(
            _peak(sign * self.median, left, right) + 0.5,
            float(np.hypot(scatter, BINNING_PX)),
            float(self.median[peak]),
        )


def _filtered(total: GrayImage, count: GrayImage, width_px: float) -> tuple[Matrix, Covered]:
    """(sectors, columns) centre minus surround, and where the surround was seen completely."""
    centre, surround = (
        _blurred(total, sigma) / np.maximum(_blurred(count, sigma), 1e-9)
        for sigma in (width_px, _SURROUND * width_px)
    )
    # At the ends of a run the wall passed only a part of the view, and shading remains.
    samples = count.sum(axis=0, keepdims=True)
    whole = (count > 0) & (samples >= 0.5 * np.median(samples[samples > 0]))
    covered = _blurred(whole.astype(np.float32), _SURROUND * width_px) > COVERED
    return centre - surround, covered


def _peak(values: Matrix, left: int, right: int) -> float:
    """Position of the largest value in [left, right], by a parabola through its neighbours."""
    k = left + int(values[left : right + 1].argmax())
    before, at, after = values[k - 1 : k + 2]
    bend = 2 * at - before - after
    return k + float(np.clip((after - before) / (2 * bend), -0.5, 0.5)) if bend > 0 else float(k)


def _blurred(image: GrayImage, sigma_px: float) -> GrayImage:
    """Smooth along the rows, with zeros beyond the border.

    A wide Gaussian is computed on fewer columns, r to one: averaging them and interpolating between
    them adds r^2 / 12 and r^2 / 6 to its variance, less 1/4 for the pixels themselves.
    """
    columns, reduction = image.shape[1], 1
    while 2 * reduction * _LEAST_SIGMA_PX <= sigma_px and columns % (2 * reduction) == 0:
        reduction *= 2
    few = reduce_to(image, (columns // reduction, len(image)))
    sigma = float(np.sqrt(sigma_px**2 - (reduction**2 - 1) / 4)) / reduction
    side = 2 * int(np.ceil(3 * sigma)) + 1
    smooth = cv2.GaussianBlur(few, (side, 1), sigma, sigmaY=1.0, borderType=cv2.BORDER_CONSTANT)
    if reduction > 1:
        smooth = cv2.resize(smooth, image.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(smooth, np.float32)
