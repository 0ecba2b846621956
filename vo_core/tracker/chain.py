"""The chain of links: each frame is tied to a reference, and adds to what is known of the way."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vo_core.geometry.bed import Bed
from vo_core.geometry.doubt import together_mm
from vo_core.geometry.height import scale_sigma
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.wall import Pose
from vo_core.geometry.waves import Waves
from vo_core.links.fix import Fix
from vo_core.links.locator import CERTAIN, Locator
from vo_core.links.picture import Picture, Reference
from vo_core.lookout import Lookout
from vo_core.matching.skipped import Skipping
from vo_core.mixing import Mixing
from vo_core.smoother import STATE, Apart, Link, Smoother
from vo_core.track import Estimate, Status
from vo_core.tracker.course import Course
from vo_core.tracker.fidelity import Fidelity, widening
from vo_core.tracker.references import References
from vo_core.types import Matrix


@dataclass(frozen=True, eq=False)
class Step:
    """How a frame was added to the chain."""

    status: Status
    quality: float
    link: Link
    widening: Matrix = field(default_factory=lambda: np.zeros(STATE))
    """(8,) variance that the frame's state gains as a reference; 0 for a frame that is none."""


class Chain:
    """Adds frames to the way: `begin`, `take` or `reckon` one, then `end` it."""

    def __init__(
        self, rectify: Rectifier, locator: Locator, skipping: Skipping, lookout: Lookout | None
    ) -> None:
        rig, grid = rectify.rig, rectify.grid
        self._skipping, self._lookout = skipping, lookout
        self._scale_sigma = scale_sigma(rig)
        self._mixing = Mixing(locator)
        self.course = Course(rig, grid, lookout)
        self.references = References(rig, skipping, self._mixing)
        self.fidelity = Fidelity(rectify)
        self._bed = Bed(rig, (grid.shape[1] * grid.mm_per_px, grid.shape[0] * grid.mm_per_px))
        self.waves = Waves(rig, grid)
        self._smoother = Smoother()
        self.records = self._smoother.records
        """What `smoothed` needs of each frame."""
        self.frame = 0
        """Number of frames so far."""

    def smoothed(self) -> list[Estimate]:
        """Return the estimates of all frames so far, each by all of the pictures."""
        return self._smoother.estimates(self._scale_sigma)

    @property
    def bed_mm(self) -> float:
        """Part of `sigma_distance_mm` by beds and by waves, signed like the way on them."""
        return together_mm(self._bed.doubt, self.waves.doubt)

    def begin(self, picture: Picture) -> Step:
        """Take the first keyframe; after a pose was given up its distance is uncertain."""
        course, widens = self.course, widening()
        link = course.unseen(self.frame)
        course.begin()
        self.references.begin(Reference(picture, course.state.widened(widens), self.frame))
        is_zero = course.state.pose.x_mm == 0.0
        return Step("ok" if is_zero else "weak", float(is_zero), link, widens)

    def take(self, fix: Fix, picture: Picture, *, may_be_dirt: bool) -> Step:
        """Go on from a fix, and choose the references of the next frames.

        `may_be_dirt` is whether a standstill may be that of dirt on the lens.
        """
        course, way, last = self.course, self.course.way, self.course.fixed
        fix = self._mixing.resolve(fix, picture, way)
        if self._lookout is not None:
            fix = self._lookout.follow(fix, last, course.gone)
        self.fidelity.take(fix, last.pose.x_mm)
        course.motion.learn(fix.anew, fix.pose, fix.joint[:-2, :-2])
        self._bed.take(fix.change, last.pose.x_mm, fix.pose.x_mm)
        link = course.take(
            fix,
            self.frame,
            shows_speed=not (fix.is_doubtful and may_be_dirt),
            is_coarse=self._skipping.is_coarse,
        )
        widens = widening(fix)
        newest = Reference(picture, fix.state.widened(widens), self.frame)
        newest = self._mixing.rated(newest, fix, way)
        is_new_keyframe = self.references.take(fix, newest, is_around=course.is_around)
        if is_new_keyframe and self.references.is_coarse_ahead:
            self.fidelity.add_ghost(fix)
        is_sure = fix.alignment.significance >= CERTAIN and not fix.is_ambiguous
        quality = float(np.clip(fix.alignment.agreement, 0.0, 1.0))
        return Step("ok" if is_sure else "weak", quality, link, widens)

    def reckon(self, picture: Picture, *, is_new: bool) -> Step:
        """Continue the motion before; take a new reference once the old wall is out of sight.

        `is_new` is whether the picture shows anything new.
        """
        course = self.course
        if course.is_held:
            course.hold()
            return Step("weak", 0.0, course.unseen(self.frame))
        course.reckon()
        if not (is_new and course.is_out_of_sight):
            return Step("lost", 0.0, course.unseen(self.frame))
        widens = widening()
        self.references.reckon(Reference(picture, course.state.widened(widens), self.frame))
        return Step("lost", 0.0, course.unseen(self.frame), widens)

    def end(self, t_s: float, step: Step) -> Estimate:
        """Add a step for the smoothing at the end, and return its estimate."""
        course, state, status = self.course, self.course.state, step.status
        pose, bed_mm = Pose.of(state.pose.vector - state.start), self.bed_mm
        variance_mm2 = float(state.covariance[0, 0])
        sigma_mm = float(np.sqrt(variance_mm2 + self.fidelity.systematic_mm**2))
        if not self.fidelity.has_moved:
            status = "weak" if status == "ok" and self.frame > 0 else status
            sigma_mm = float(np.hypot(sigma_mm, course.unknown_way_mm))
        scale_mm = np.hypot(self._scale_sigma * pose.x_mm, bed_mm)
        estimate = Estimate.of(
            pose,
            frame=self.frame,
            time_s=t_s,
            sigma_distance_mm=float(np.hypot(sigma_mm, scale_mm)),
            quality=step.quality,
            status=status,
            sigma_registration_mm=sigma_mm,
            looking_around=float(course.is_around),
        )
        beside_mm2 = sigma_mm**2 - variance_mm2
        doubted = float(np.hypot(self._bed.doubt.share, self.waves.doubt.share))
        apart = Apart(step.widening, beside_mm2, abs(bed_mm), doubted)
        self._smoother.add(step.link, estimate, apart)
        self.frame += 1
        return estimate

    def shift(self, x_mm: float, y_mm: float) -> None:
        """Shift all poses by a move of the zero point."""
        for part in (self.course, self.references, self._smoother):
            part.shift(x_mm, y_mm)
