"""One frame against one reference: phase correlation for the start, alignment for the pose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vo_core.align import Alignment, Template, align
from vo_core.blocks import BlockGrid
from vo_core.correlate import (
    LOCK_PSR,
    best_peaks,
    correlation,
    polar_spectrum,
    rotation_between,
    spectrum,
)
from vo_core.filters import taper
from vo_core.motion import WallMotion, moved_by_content
from vo_core.rectify import Rectifier
from vo_core.resample import double, halve, resample, resample_mask
from vo_core.types import ByteImage, GrayImage, Matrix
from vo_core.wall import Pose

LEAST_OVERLAP = 0.15
"""Below this share of common wall a reference is out of reach."""

OPEN_PX = 1.0
"""Above this uncertainty along the pipe the picture does not show the motion (straight lines)."""

LOCK, CERTAIN = 6.0, 14.0
"""Agreement in standard deviations of what unrelated walls reach by chance: a lock, a sure one."""


@dataclass(frozen=True)
class Picture:
    """A frame as it is compared: normalised, free of the fixed pattern, low-passed."""

    fine: GrayImage

    @cached_property
    def coarse(self) -> GrayImage:
        """Half the size, for the correlation."""
        return halve(self.fine)

    @cached_property
    def doubled(self) -> GrayImage:
        """Twice the size, for the alignment."""
        return double(self.fine)


@dataclass(frozen=True)
class Reference:
    """A frame that others are located against."""

    picture: Picture
    whole: ByteImage
    """1 where the picture shows all of a block around the pixel."""
    pose: Pose
    covariance: Matrix
    """(3, 3) of x mm, y mm, yaw rad."""

    @cached_property
    def template(self) -> Template:
        """Gradients and tensors, made when first needed."""
        return Template.of(self.picture.doubled, self.whole)


@dataclass(frozen=True)
class Fix:
    """A pose measured against a reference."""

    pose: Pose
    covariance: Matrix
    """(3, 3) of x mm, y mm, yaw rad, the reference's own included."""
    reference: Reference
    alignment: Alignment


class Locator:
    """Locates frames of one rig; it keeps no state between them."""

    def __init__(self, rectifier: Rectifier) -> None:
        self._rig, self._grid = rectifier.rig, rectifier.grid
        blocks = BlockGrid.over(self._grid.shape)
        self.whole = blocks.whole(rectifier.valid)
        self._motion = WallMotion(self._rig, self._grid, blocks.nodes())
        self._coarse_valid = (halve(rectifier.valid.astype(np.float32)) > 0.99).astype(np.uint8)
        self._coarse_blocks = BlockGrid.over(self._coarse_valid.shape)
        self._coarse_motion = WallMotion(
            self._rig, self._grid, 2 * self._coarse_blocks.nodes() + 0.5
        )

    def locate(
        self, reference: Reference, picture: Picture, guess: Pose, reach_mm: float = np.inf
    ) -> Fix | None:
        """The pose of a picture whose wall lies within the coarse correlation's reach of a guess.

        Two peaks can both be good: dirt on the lens says standstill and running water its own
        speed where the wall says the robot's motion.  What no robot can do (farther than `reach_mm`
        from the guess) is then left out, and so is what only dirt does: see `_is_pattern`.
        """
        fixes = [
            fix
            for start in self._starts(reference, picture, guess)
            if (fix := self._align(reference, picture, start)) is not None
        ]
        fixes = [fix for fix in fixes if _distance_mm(fix.pose, guess) <= reach_mm] or fixes
        walls = [
            fix
            for fix in fixes
            if not any(self._is_pattern(fix, other) for other in fixes if other is not fix)
        ]
        return max(walls, key=lambda fix: fix.alignment.support, default=None)

    def _is_pattern(self, fix: Fix, other: Fix) -> bool:
        """Is `fix` the standstill of what sticks to the lens, and `other` the motion of the wall?

        A wall that stands still agrees everywhere, also where a repeating texture agrees once more
        a period off. Dirt agrees where it lies only: the places that speak for the motion do not
        speak for standstill.
        """
        still = self.overlap(fix.reference, fix.pose) > 1 - 2 / max(self._grid.shape)
        if not still or self.overlap(other.reference, other.pose) > 1 - 6 / max(self._grid.shape):
            return False
        moved, stood = other.alignment.trust, fix.alignment.trust
        return float(np.sum(moved**2 * (moved - stood))) > 0

    def search(self, reference: Reference, picture: Picture) -> Fix | None:
        """The pose without any guess: no motion, and the rotation of the polar spectrum."""
        window = taper(self._coarse_valid, min(self._coarse_valid.shape) // 2)
        pictures = (reference.picture, picture)
        before, now = (polar_spectrum(spectrum(p.coarse, window)) for p in pictures)
        # The content turns one way when the camera turns the other.
        turn = rotation_between(before, now)
        at = reference.pose
        guesses = [at, Pose(at.x_mm, at.y_mm, at.yaw_rad - turn)]
        fixes = [fix for g in guesses if (fix := self.locate(reference, picture, g)) is not None]
        return max(fixes, key=lambda fix: fix.alignment.support, default=None)

    def overlap(self, reference: Reference, pose: Pose) -> float:
        """Share of the reference's wall that a camera at `pose` sees, about."""
        rows, columns = self._grid.shape
        axial = abs(pose.x_mm - reference.pose.x_mm) / (columns * self._grid.mm_per_px)
        arc = abs(pose.y_mm - reference.pose.y_mm) / (rows * self._grid.mm_per_px)
        return max(0.0, 1 - axial) * max(0.0, 1 - arc)

    def _starts(self, reference: Reference, picture: Picture, guess: Pose) -> list[Pose]:
        """Poses at which the phase correlation of the reference with the moved picture peaks."""
        warp = self._coarse_motion.against(reference.pose.x_mm)
        positions = (warp(_parameters(reference, guess)) - 0.5) / 2  # of the half-size picture
        maps = self._coarse_blocks.dense(positions)
        seen = resample(picture.coarse, maps)
        common = resample_mask(self._coarse_valid, maps)
        common &= self._coarse_blocks.crop(self._coarse_valid)
        if common.mean() < LEAST_OVERLAP * self._coarse_valid.mean():
            return []
        window = taper(common, max(4, min(common.shape) // 5))
        original = self._coarse_blocks.crop(reference.picture.coarse)
        surface = correlation(spectrum(original, window), spectrum(seen, window))
        step_mm = 2 * self._grid.mm_per_px
        return [
            moved_by_content(
                guess, (peak.dx_px * step_mm, peak.dy_px * step_mm), reference.pose.yaw_rad
            )
            for peak in best_peaks(surface, 2)
            if peak.psr >= LOCK_PSR
        ]

    def _align(self, reference: Reference, picture: Picture, start: Pose) -> Fix | None:
        # Only x, y, yaw are measured freely; of the reference's y and yaw there is prior knowledge.
        prior = np.zeros((5, 5))
        prior[3:, 3:] = np.linalg.inv(reference.covariance[1:, 1:])
        fit = align(
            reference.template,
            picture.doubled,
            self.whole,
            self._motion.against(reference.pose.x_mm),
            _parameters(reference, start),
            self._motion.scales,
            prior=prior,
        )
        covariance = fit.covariance[:3, :3].copy()
        is_open = covariance[0, 0] > (OPEN_PX * self._grid.mm_per_px) ** 2
        if not fit.converged or is_open or fit.significance < LOCK or fit.overlap < LEAST_OVERLAP:
            return None
        covariance[0, 0] += reference.covariance[0, 0]
        return Fix(Pose(*fit.parameters[:3].tolist()), covariance, reference, fit)


def _distance_mm(a: Pose, b: Pose) -> float:
    return float(np.hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm))


def _parameters(reference: Reference, pose: Pose) -> Matrix:
    """Parameters of `WallMotion`."""
    at = reference.pose
    return np.array([pose.x_mm, pose.y_mm, pose.yaw_rad, at.y_mm, at.yaw_rad])
