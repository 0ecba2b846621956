"""Pictures of the wall, prepared for comparison, and those that others are measured against."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vo_core.geometry.motion import POSE, parameters
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.wall import Pose
from vo_core.image.resample import halve, halve_mask
from vo_core.matching.align import inverse
from vo_core.matching.blocks import BlockGrid
from vo_core.matching.correlate import LOCK_PSR, best_peaks, correlation, spectrum, window_of
from vo_core.matching.template import Template
from vo_core.state import State
from vo_core.types import ByteImage, GrayImage, Matrix


class View:
    """What cameras at one vantage show of the wall."""

    def __init__(
        self, rectify: Rectifier, blocks: BlockGrid, hidden: ByteImage | None = None
    ) -> None:
        """`hidden` is 1 where something else hides the wall, in a frame of any size."""
        self.rectify, self.vantage = rectify, rectify.vantage
        self.valid = rectify.valid
        if hidden is not None:
            self.valid = self.valid & (1 - rectify.shows(hidden))
        """(H, W), 1 where the patch shows the wall."""
        self.whole = blocks.whole(self.valid)
        self.coarse_valid = halve_mask(self.valid)


@dataclass(frozen=True)
class Picture:
    """A frame prepared for comparison: low-passed, normalised, without the fixed pattern."""

    fine: GrayImage
    view: View

    @cached_property
    def coarse(self) -> GrayImage:
        """The picture at half the size, for the correlation."""
        return halve(self.fine)


@dataclass(frozen=True)
class Reference:
    """A frame against which others are located."""

    picture: Picture
    state: State
    frame: int = 0
    """Index of the frame in the film."""
    impurity: float = 0.0
    """Share of another exposure in the picture, see `Mixing`."""
    offset: Matrix = field(default_factory=lambda: np.zeros(POSE))
    """See `Fix.offset`."""

    @property
    def pose(self) -> Pose:
        """Pose of the camera at the exposure that this frame shows."""
        return self.state.pose

    def shifted(self, x_mm: float, y_mm: float) -> Reference:
        """The same reference after a move of the zero point."""
        return replace(self, state=self.state.shifted(x_mm, y_mm))

    def parameters(self, pose: Pose) -> Matrix:
        """(14,) q of `WallMotion` for a camera at a pose."""
        return parameters(pose, self.pose, self.state.mount_rad)

    @cached_property
    def information(self) -> Matrix:
        """(8, 8) inverse covariance of the state."""
        return inverse(self.state.covariance)

    @cached_property
    def template(self) -> Template:
        """Gradients and tensors for the alignment, computed when first needed."""
        return Template.of(self.picture.fine, self.picture.view.valid, row_step=2)

    @cached_property
    def repeats(self) -> bool:
        """Whether the wall looks alike at several places of the picture, by autocorrelation."""
        own = spectrum(self.picture.coarse, window_of(self.picture.view.coarse_valid))
        return best_peaks(correlation(own, own), 2)[1].psr >= LOCK_PSR
