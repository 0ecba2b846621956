"""Against which references and from which guesses a picture is measured, and which fix counts."""

from __future__ import annotations

from itertools import product

from vo_core.links.fix import Fix, Outlook
from vo_core.links.locator import LEAST_OVERLAP, Locator
from vo_core.links.picture import Picture
from vo_core.lookout import Lookout
from vo_core.matching.skipped import Skipping
from vo_core.tracker.chain import Chain
from vo_core.types import Matrix

STOPPED_PX = 1.0
"""Motion of the content below which the newest picture seems to be repeated."""


class Measuring:
    """Measures pictures against the references of a chain; it keeps no state of its own."""

    def __init__(
        self, locator: Locator, chain: Chain, skipping: Skipping, lookout: Lookout | None
    ) -> None:
        self._locator, self._chain = locator, chain
        self._skipping, self._lookout = skipping, lookout

    def __call__(
        self, picture: Picture, ncc_weights: Matrix | None, *, is_torn: bool
    ) -> Fix | None:
        """Locate a picture against the keyframe, else against the newest frame.

        The search starts from the predicted pose, then from the last one, then without a guess.  A
        fix that agrees less than usual is kept in case no other agrees better: a turned camera sees
        rings as another camera sees them from another place.

        Args:
            picture: The picture.
            ncc_weights: (blocks,) see `Dirt.ncc_weights`.
            is_torn: Whether blocks were skipped: texture that was skipped for some frames lies
                whole frame steps from its place.
        """
        outlook = self._outlook(ncc_weights, is_torn=is_torn)
        references = self._chain.references.all(is_around=outlook.is_around)
        guesses = self._chain.course.guesses()
        unusual = []
        for guess, reference in product(guesses[:1] if is_torn else guesses, references):
            if self._locator.overlap(reference, guess) < LEAST_OVERLAP:
                continue
            fix = self._locator.locate(reference, picture, guess, outlook)
            if fix is None or self._is_coded_standstill(fix):
                continue
            if self._lookout is None or self._chain.fidelity.is_usual(fix):
                return fix
            unusual.append(fix)
        if unusual:
            return max(unusual, key=lambda fix: fix.alignment.significance)
        for reference in () if is_torn else references:
            if (fix := self._locator.search(reference, picture, outlook)) is not None:
                return fix
        return None

    def _outlook(self, ncc_weights: Matrix | None, *, is_torn: bool) -> Outlook:
        course, fidelity, lookout = self._chain.course, self._chain.fidelity, self._lookout
        return Outlook(
            reach_mm=course.reach_mm,
            last=course.fixed.pose,
            since_s=course.gone_s,
            ncc_weights=ncc_weights,
            motion=course.motion,
            rate=course.rate,
            shear_rad=fidelity.shear_rad if self._skipping.is_coarse else 0.0,
            gaze=None if lookout is None else lookout.gaze,
            gaze_rad=0.0 if lookout is None else lookout.gaze_rad,
            unexplained=fidelity.unexplained,
            is_around=course.is_around,
            is_bound=is_torn,
        )

    def _is_coded_standstill(self, fix: Fix) -> bool:
        """Whether a coarse coding may have repeated the newest picture, as the keyframe denies it.

        A robot that stands is recognised from the keyframe, too.
        """
        is_newest = fix.reference is not self._chain.references.keyframe
        is_coarse_ahead = self._chain.references.is_coarse_ahead
        return is_coarse_ahead and is_newest and fix.moved_px < STOPPED_PX
