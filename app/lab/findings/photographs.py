"""Photographs with masks: how well crests agree with cracks that people have drawn.

A folder holds each picture (`NAME.jpg`, `.jpeg` or `.png`) beside its mask, `NAME_mask.png`: grey,
cracks above 127, of the picture's size. A pixel of the picture counts as one millimetre.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from vo_core.findings.patches import WallPatch
from vo_core.findings.ridges import components, crests, ridges
from vo_core.findings.surface import Mask, Surface
from vo_core.types import ByteImage, GrayImage

TOLERANCES_PX = (5, 2)
THRESHOLDS = 16
"""Thresholds among which a filter of scikit-image has its best one."""

Filter = Callable[..., GrayImage]


class NoPictures(ValueError):
    """A folder holds no picture with a mask."""


def pictures(folder: Path) -> list[tuple[ByteImage, Mask]]:
    """Read the pictures of a folder with their masks.

    Raises:
        NoPictures: There are none, or one is unreadable or has another size than its mask.
    """
    read = []
    for mask_file in sorted(folder.glob("*_mask.png")):
        name = mask_file.name.removesuffix("_mask.png")
        files = [mask_file.with_name(name + end) for end in (".jpg", ".jpeg", ".png")]
        image = next((cv2.imread(str(file)) for file in files if file.exists()), None)
        mask = cv2.imread(str(mask_file), cv2.IMREAD_GRAYSCALE)
        if image is None or mask is None or image.shape[:2] != mask.shape:
            raise NoPictures(f"{mask_file}: its picture is missing, unreadable or of another size")
        read.append((np.asarray(image, np.uint8), np.asarray(mask > 127)))
    if not read:
        raise NoPictures(f"{folder} holds no picture with a mask: NAME.jpg beside NAME_mask.png")
    return read


def crests_of(image: ByteImage) -> Mask:
    """Pixels of the crests that the search would propose as cracks."""
    weight = np.ones(image.shape[:2], np.float32)
    surface = Surface.of(WallPatch(image, weight, 0.0, 0.0, 1.0, 1.0, None))
    drawn = np.zeros(weight.shape, bool)
    for pixels in components(crests(*ridges(surface)), 1.0):
        drawn[pixels[:, 1], pixels[:, 0]] = True
    return drawn


def f1(pairs: list[tuple[Mask, Mask]], tolerance_px: float) -> float:
    """F1 of drawn against true pixels, each right within a tolerance of the other."""
    right = said = seen = there = 0
    for drawn, true in pairs:
        right += int((drawn & _near(true, tolerance_px)).sum())
        seen += int((true & _near(drawn, tolerance_px)).sum())
        said, there = said + int(drawn.sum()), there + int(true.sum())
    precision, recall = right / max(said, 1), seen / max(there, 1)
    return 2 * precision * recall / max(precision + recall, 1e-9)


def _near(mask: Mask, px: float) -> Mask:
    away = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5)
    return np.asarray(mask.any() & (away <= px))


def rows(folder: Path) -> Iterator[tuple[str, list[float]]]:
    """Yield each method with its F1 at each of `TOLERANCES_PX`.

    A filter of scikit-image has its best threshold over these very pictures.
    """
    read = pictures(folder)
    ours = [(crests_of(image), true) for image, true in read]
    yield "chainage", [f1(ours, px) for px in TOLERANCES_PX]
    for name, apply in skimage_filters().items():
        answers = [
            apply(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) / 255.0, sigmas=(1, 2, 3))
            for image, _ in read
        ]
        limits = np.quantile(np.concatenate([a.ravel() for a in answers]), _quantiles())
        drawn = [
            [(answer >= limit, true) for answer, (_, true) in zip(answers, read, strict=True)]
            for limit in limits.tolist()
        ]
        yield name, [max(f1(pairs, px) for pairs in drawn) for px in TOLERANCES_PX]


def _quantiles() -> GrayImage:
    return np.asarray(1 - np.geomspace(0.002, 0.4, THRESHOLDS), np.float32)


def skimage_filters() -> dict[str, Filter]:
    """Ridge filters of scikit-image by name; empty if it is not installed."""
    if importlib.util.find_spec("skimage") is None:
        return {}
    from skimage import filters

    return {name: getattr(filters, name) for name in ("frangi", "sato", "meijering")}
