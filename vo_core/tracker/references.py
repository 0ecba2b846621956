"""Frames against which the next ones are located: the keyframe, and the newest frame."""

from __future__ import annotations

from vo_core.links.fix import Fix
from vo_core.links.locator import LEAST_OVERLAP
from vo_core.links.picture import Reference
from vo_core.matching.skipped import Skipping
from vo_core.mixing import PURE, Mixing
from vo_core.rig import Rig

KEYFRAME_OVERLAP = {"circular": 0.68, "flat": 0.5}
"""The current frame becomes the keyframe once it shares less wall than this with the old one.

On a floor only the chain of keyframes shows the heading, so fewer and longer links drift less (yaw
rms 0.28 degrees at 0.68, 0.08 at 0.5).  In a pipe the shear shows the heading too, and more overlap
is better."""

COARSE_OVERLAP = 0.35
"""Like `KEYFRAME_OVERLAP`, for a coarsely coded film.

There a picture that was coded as a whole (an I frame) becomes the keyframe at once, so that links
are few and lead from I frame to I frame.  Two I frames agree to 0.02 degrees up to six frames apart
(crf 38), other pictures to 0.16 degrees only."""

AHEAD_OVERLAP = 0.5
"""Like `KEYFRAME_OVERLAP`, for a camera that looks along the pipe.

From one end of the patch to the other the wall comes from the dark to near the lamp, and further
apart the pictures have little in common (correlation 0.56 at 0.35)."""


class References:
    """Keeps the references, and chooses which frame becomes the keyframe."""

    def __init__(self, rig: Rig, skipping: Skipping, mixing: Mixing) -> None:
        self._rig, self._skipping, self._mixing = rig, skipping, mixing
        self.keyframe: Reference | None = None
        self._newest: Reference | None = None
        """Newest frame with a fix; after a long loss the newest frame, at its predicted pose."""
        self._ahead: Reference | None = None
        """Newest reference of a camera that looked ahead."""

    @property
    def is_coarse_ahead(self) -> bool:
        """Whether the film is coarsely coded and its camera looks along the pipe."""
        return self._rig.looks_along_pipe and self._skipping.is_coarse

    def all(self, *, is_around: bool) -> list[Reference]:
        """All references, best first; `is_around` is whether the camera looks around."""
        ahead = self._ahead if is_around else None
        return [each for each in (ahead, self.keyframe, self._newest) if each is not None]

    def begin(self, first: Reference) -> None:
        """Take the first keyframe."""
        self.keyframe = self._newest = first

    def reckon(self, newest: Reference) -> None:
        """Take a frame without a fix, because the wall seen before is out of sight."""
        self._newest = newest

    def take(self, fix: Fix, newest: Reference, *, is_around: bool) -> bool:
        """Take a frame with a fix, and return whether another picture becomes the keyframe."""
        if not is_around:
            self._ahead = fix.reference
        self._newest = self._mixing.fallback(newest, self._newest)
        is_outlived = self._is_outlived(fix, newest)
        if is_outlived:
            self.keyframe = self._newest
        return is_outlived

    def forget(self) -> None:
        """Drop all references, because their poses are given up."""
        self.keyframe = self._newest = self._ahead = None

    def shift(self, x_mm: float, y_mm: float) -> None:
        """Shift the poses by a move of the zero point."""
        keyframe, newest = self.keyframe, self._newest
        self.keyframe = keyframe and keyframe.shifted(x_mm, y_mm)
        is_same = newest is keyframe
        self._newest = self.keyframe if is_same else newest and newest.shifted(x_mm, y_mm)

    def _is_outlived(self, fix: Fix, newest: Reference) -> bool:
        if newest.impurity > PURE:
            return fix.alignment.overlap < 2 * LEAST_OVERLAP
        is_out = fix.reference is not self.keyframe or fix.alignment.overlap < self._least_overlap
        is_purer = newest.impurity < fix.reference.impurity - PURE
        return is_out or is_purer or self._skipping.is_fresh

    @property
    def _least_overlap(self) -> float:
        """Common wall of keyframe and frame below which the frame becomes the keyframe."""
        if self._rig.looks_along_pipe:
            return AHEAD_OVERLAP
        is_coarse = self._skipping.is_coarse
        return COARSE_OVERLAP if is_coarse else KEYFRAME_OVERLAP[self._rig.pipe.shape]
