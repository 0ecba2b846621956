"""The wall as the searches see it: brightness against its surroundings, in millimetres."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.findings.patches import WallPatch
from vo_core.types import GrayImage, Matrix

WORK_MM = 1.0
"""Pixel of the search, unless the wall is coarser: a crack of 1 mm is as wide as one pixel, and its
darkness there does not depend on how fine the wall is."""

SURROUND_MM = 12.0
"""Sigma of the surroundings whose brightness is the wall's own."""

DEVIATION_MM = 24.0
"""Sigma of the surroundings whose texture is the wall's own."""

SMOOTHEST = 0.02
"""Least deviation of a texture, relative: what noise and coding leave of an even wall."""

DARKEST, BRIGHTEST = -1.0, 0.4
"""Range of the logarithm of the brightness: a gap is darker than 1/e of the wall, and a
reflection beside it must not hide it."""

LEAST_SEEN = 0.02
"""Least weight of a place that was seen well enough to be judged."""

BORDER_MM = 5.0
"""What lies as near to unseen wall is not judged: there one frame alone shows it."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Surface:
    """A patch at the resolution of the search."""

    patch: WallPatch
    image: NDArray[np.float32]
    """(h, w, 3) BGR."""
    log: GrayImage
    """(h, w) logarithm of the brightness, of the surroundings where nothing was seen."""
    contrast: GrayImage
    """`log` against its surroundings, within `DARKEST` and `BRIGHTEST`; 0 where not seen."""
    relief: GrayImage
    """`contrast` in deviations of the texture there."""
    seen: Mask
    """(h, w) what can be judged."""
    step_mm: Matrix
    """(2,) mm per column and per row."""

    @classmethod
    def of(cls, patch: WallPatch) -> Surface:
        """Reduce a patch, and compare it with its surroundings."""
        height, width = patch.weight.shape
        reduction = max(WORK_MM / patch.mm_per_px, 1.0)
        size_wh = (max(round(width / reduction), 1), max(round(height / reduction), 1))
        step_mm = np.array([width / size_wh[0], height / size_wh[1]])
        step_mm *= [patch.mm_per_px, patch.arc_mm_per_px]
        was_seen = (patch.weight >= LEAST_SEEN).astype(np.float32)
        share = cv2.resize(was_seen, size_wh, interpolation=cv2.INTER_AREA)
        image = cv2.resize(patch.image.astype(np.float32), size_wh, interpolation=cv2.INTER_AREA)
        whole = (share > 0.999).astype(np.uint8)
        reach_px = int(np.ceil(BORDER_MM / step_mm.min()))
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach_px + 1,) * 2)
        seen = cv2.erode(whole, disc, borderType=cv2.BORDER_CONSTANT, borderValue=1) > 0
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        log = np.log(grey + np.float32(1))
        smooth = blurred(log, whole.astype(np.float32), SURROUND_MM / step_mm)
        contrast = np.clip(log - smooth, DARKEST, BRIGHTEST) * whole
        power = blurred(contrast**2, whole.astype(np.float32), DEVIATION_MM / step_mm)
        relief = contrast / np.maximum(np.sqrt(np.maximum(power, 0)), SMOOTHEST)
        return cls(
            patch=patch,
            image=np.asarray(image, np.float32),
            log=np.asarray(np.where(whole > 0, log, smooth), np.float32),
            contrast=np.asarray(contrast, np.float32),
            relief=np.asarray(relief, np.float32),
            seen=seen,
            step_mm=step_mm,
        )

    def to_mm(self, pixels: Matrix) -> Matrix:
        """Axial and arc (n, 2) of pixels (n, 2) as column and row."""
        from_mm = np.array([self.patch.axial_from_mm, self.patch.arc_from_mm])
        return np.asarray(from_mm + (pixels + 0.5) * self.step_mm)


def blurred(image: GrayImage, weight: GrayImage, sigma_px: Matrix) -> GrayImage:
    """Gaussian mean of what was seen; `sigma_px` is along columns and rows.

    A wide mean is computed on a reduced picture.
    """
    reduction = max(int(sigma_px.min() / 3), 1)
    height, width = image.shape
    size_wh = (-(-width // reduction), -(-height // reduction))

    def mean_of(values: GrayImage) -> GrayImage:
        few = cv2.resize(values, size_wh, interpolation=cv2.INTER_AREA)
        sigmas = (sigma_px / reduction).tolist()
        return np.asarray(
            cv2.GaussianBlur(
                few, (0, 0), sigmas[0], sigmaY=sigmas[1], borderType=cv2.BORDER_REFLECT
            )
        )

    mean = mean_of(image * weight) / np.maximum(mean_of(weight), 1e-6)
    return np.asarray(cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR), np.float32)
