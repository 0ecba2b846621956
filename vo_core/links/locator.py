"""One frame against one reference: phase correlation for the start, alignment for the pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vo_core.geometry.motion import (
    MOUNT,
    MOVING,
    OF_MOVING,
    OF_REFERENCE,
    PARAMETERS,
    POSE,
    REFERENCE,
    WallMotion,
    moved_by_content,
)
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.wall import Pose
from vo_core.image.filters import taper
from vo_core.image.resample import double, resample, resample_mask
from vo_core.links.fix import Fix, Outlook
from vo_core.links.picture import Picture, Reference, View
from vo_core.links.priors import Priors
from vo_core.links.rivals import best_of, explains_all, off_mm
from vo_core.matching.align import LOCK, OPEN_PX, Alignment, Prior, align
from vo_core.matching.blocks import BlockGrid
from vo_core.matching.correlate import (
    LOBE_PX,
    LOCK_PSR,
    Peak,
    best_peaks,
    correlation,
    polar_spectrum,
    rotation_between,
    spectrum,
    window_of,
)
from vo_core.matching.template import Likeness, agree
from vo_core.state import UNKNOWN_RATE, State, tilt_sigma_rad
from vo_core.types import ByteImage, GrayImage, Matrix

FAINT_PSR = 6.5
"""Like `LOCK_PSR`, where a wrong peak costs only an alignment that fails: as the wall comes nearer
it is seen more sharply, and the peak is fainter."""

SETTLED_AHEAD = 6
"""Plain steps of an alignment before the rest is extrapolated, where the camera looks along the
pipe: an offset from the axis that is hardly known converges slowly."""

OPEN_AHEAD_PX = 3.0
"""Like `OPEN_PX`, where the camera looks along the pipe.

The share of a shift that driving, an offset from the axis and coding have in it is less certain
there. A link over a longer way is uncertain by 1 to 2 px, and is right; straight lines leave 100 px
open."""

LEAST_OVERLAP = 0.15
"""A reference that shares less wall than this with a frame is out of reach."""

CERTAIN = 14.0
"""Significance (see `LOCK`) from which an alignment gets the status `ok`."""

_DIFFERENCE = np.zeros((POSE, PARAMETERS))
_DIFFERENCE[:, MOVING], _DIFFERENCE[:, REFERENCE] = np.eye(POSE), -np.eye(POSE)


class Locator:
    """Locates frames of one rig; it keeps no state between them."""

    def __init__(self, rectifier: Rectifier) -> None:
        self._rig, self._grid = rectifier.rig, rectifier.grid
        self._tilt_rad = tilt_sigma_rad(self._rig)
        """Standard deviation of the mount's tilt by the rig."""
        self._blocks = BlockGrid.over(self._grid.shape)
        self._centres = self._blocks.centres(self._blocks.nodes())
        half = (self._grid.shape[0] // 2, self._grid.shape[1] // 2)
        self._coarse_blocks = BlockGrid.over(half)
        self._priors = Priors(self._rig, self._grid, self._blocks.nodes())
        self._least_psr, self._open_px = LOCK_PSR, OPEN_PX
        self._settled: int | None = None
        if self._rig.looks_along_pipe:
            self._least_psr, self._open_px, self._settled = FAINT_PSR, OPEN_AHEAD_PX, SETTLED_AHEAD
        self._motions: dict[tuple[Pose, Pose, bool], WallMotion] = {}
        """Motion models in use, by the vantages of reference and picture."""
        self._doubled: tuple[Picture, GrayImage] | None = None
        """The last picture that was aligned, at twice the size."""

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_doubled": None}

    def view(self, rectifier: Rectifier, hidden: ByteImage | None = None) -> View:
        """What a camera at the vantage of this rectifier shows."""
        return View(rectifier, self._blocks, hidden)

    def overlap(self, reference: Reference, pose: Pose) -> float:
        """Approximate share of the reference's wall that a camera at `pose` sees."""
        return self._grid.common(reference.pose, pose)

    def likeness(self, reference: Reference, picture: Picture, pose: Matrix) -> Likeness:
        """How a picture agrees with a reference if it was taken at a pose, (6,)."""
        motion = self._motion(reference, picture, coarse=False)
        positions = motion.positions(reference.parameters(Pose.of(pose)))
        return agree(reference.template, self._twice(picture), picture.view.whole, positions)

    def locate(
        self, reference: Reference, picture: Picture, guess: Pose, outlook: Outlook
    ) -> Fix | None:
        """Find the pose of a picture near a guess, within the reach of the coarse correlation.

        A standstill is rejected where the robot cannot stop that hard or where it is a fixed
        pattern, see `rivals`.
        """
        fixes = self._fixes(reference, picture, guess, outlook)
        in_reach = [fix for fix in fixes if off_mm(fix, guess) <= outlook.reach_mm]
        found = in_reach if outlook.is_bound else fixes
        return best_of(found, in_reach, outlook, guess, self._grid.mm_per_px)

    def search(self, reference: Reference, picture: Picture, outlook: Outlook) -> Fix | None:
        """Find the pose without a guess: from no motion, and from the rotation by polar spectra."""
        pictures = (reference.picture, picture)
        before, now = (
            polar_spectrum(p.coarse, taper(p.view.coarse_valid, min(p.coarse.shape) // 2))
            for p in pictures
        )
        # The content turns one way when the camera turns the other.
        turn = rotation_between(before, now)
        at = reference.pose
        guesses = [at, replace(at, yaw_rad=at.yaw_rad - turn)]
        fixes = [fix for at in guesses for fix in self._fixes(reference, picture, at, outlook)]
        return best_of(fixes, fixes, outlook, outlook.last, self._grid.mm_per_px)

    def _fixes(
        self, reference: Reference, picture: Picture, guess: Pose, outlook: Outlook
    ) -> list[Fix]:
        # Where the guess explains all blocks as well as before, another motion is possible on a
        # repeating wall only.
        near = None if outlook.is_around else self._align(reference, picture, guess, outlook)
        if near and explains_all(near, outlook) and not reference.repeats:
            return [near]
        peaks = self._peaks(reference, picture, guess)
        step_mm = 2 * self._grid.mm_per_px
        yaw_rad = reference.pose.yaw_rad
        aligned: list[Fix | None] = []
        for peak in peaks:
            if near and np.hypot(peak.dx_px, peak.dy_px) <= 1:
                aligned.append(near)
                continue
            shift_mm = peak.dx_px * step_mm, peak.dy_px * step_mm
            start = moved_by_content(guess, shift_mm, yaw_rad)
            if outlook.is_around:
                start = replace(start, x_mm=guess.x_mm)
            aligned.append(self._align(reference, picture, start, outlook))
        # The peaks of wall and water may merge into one lobe whose top is neither.  So the guess
        # counts too, unless one motion explains all blocks.
        is_lobe = any(1 < np.hypot(peak.dx_px, peak.dy_px) < LOBE_PX for peak in peaks)
        if outlook.is_around:
            aligned.append(self._align(reference, picture, guess, outlook))
        elif is_lobe and not any(fix and explains_all(fix, outlook) for fix in aligned):
            aligned.append(near)
        return [fix for fix in aligned if fix]

    def _peaks(self, reference: Reference, picture: Picture, guess: Pose) -> list[Peak]:
        """Peaks of the phase correlation after moving the picture by the guess, coarse px."""
        motion = self._motion(reference, picture, coarse=True)
        # In px of the half-size picture.
        positions = (motion.positions(reference.parameters(guess)) - 0.5) / 2
        maps = self._coarse_blocks.dense(positions)
        seen = resample(picture.coarse, maps)
        shown = self._coarse_blocks.crop(reference.picture.view.coarse_valid)
        common = resample_mask(picture.view.coarse_valid, maps) & shown
        if np.count_nonzero(common) < LEAST_OVERLAP * np.count_nonzero(shown):
            return []
        window = window_of(common)
        original = self._coarse_blocks.crop(reference.picture.coarse)
        surface = correlation(spectrum(original, window), spectrum(seen, window))
        return [peak for peak in best_peaks(surface, 2) if peak.psr >= self._least_psr]

    def _align(
        self, reference: Reference, picture: Picture, start: Pose, outlook: Outlook
    ) -> Fix | None:
        motion = self._motion(reference, picture, coarse=False)
        unknowns = self._priors.unknowns(motion, reference, start, outlook)
        doubled, whole = self._twice(picture), picture.view.whole
        fit = align(reference.template, doubled, whole, unknowns, settled=self._settled)
        is_open = fit.uncertainty_px[0] > self._open_px
        if not fit.converged or is_open or fit.significance < LOCK or fit.overlap < LEAST_OVERLAP:
            return None
        news = fit.parameters[OF_REFERENCE] - unknowns.start[OF_REFERENCE]
        moved_px = np.hypot(*(self._blocks.centres(fit.positions) - self._centres).T)
        free_covariance = fit.free_covariance[:PARAMETERS, :PARAMETERS]
        return Fix(
            state=self._state(reference, fit, news, outlook),
            reference=reference,
            alignment=fit,
            moved_px=_median(moved_px[np.isfinite(moved_px)]),
            anew=Pose.of(fit.parameters[REFERENCE]),
            joint=fit.covariance[:PARAMETERS, :PARAMETERS],
            change=fit.free[MOVING] - fit.free[REFERENCE],
            change_variance=np.diag(_DIFFERENCE @ free_covariance @ _DIFFERENCE.T),
        )

    def _state(self, reference: Reference, fit: Alignment, news: Matrix, outlook: Outlook) -> State:
        """State of a picture: `news` is what it shows of the reference, (8,).

        What it shows about the reference it also shows about the first frame, as far as their
        errors are correlated (fixed-point smoothing; Meditch 1967).
        """
        before, pose = reference.state, Pose.of(fit.parameters[MOVING])
        gain = before.with_start.T @ reference.information
        state = State(
            pose=pose,
            mount_rad=fit.parameters[MOUNT],
            covariance=fit.covariance[np.ix_(OF_MOVING, OF_MOVING)],
            rate=Prior(outlook.rate_at(pose), UNKNOWN_RATE.information),
            start=before.start + gain @ news,
            with_start=fit.covariance[np.ix_(OF_MOVING, OF_REFERENCE)] @ gain.T,
        )
        return state.known_to(self._tilt_rad)

    def _motion(self, reference: Reference, picture: Picture, *, coarse: bool) -> WallMotion:
        """The motion model between two patches, at the nodes of the fine or the coarse blocks."""
        # Motion models that are kept: each costs as much as some steps of an alignment.
        motions_kept = 16
        vantages = reference.picture.view.vantage, picture.view.vantage
        key = (*vantages, coarse)
        if key not in self._motions:
            if len(self._motions) >= motions_kept:
                self._motions.clear()
            nodes = 2 * self._coarse_blocks.nodes() + 0.5 if coarse else self._blocks.nodes()
            self._motions[key] = WallMotion(
                self._rig, self._grid, nodes, before=vantages[0], now=vantages[1]
            )
        return self._motions[key]

    def _twice(self, picture: Picture) -> GrayImage:
        """A picture at twice the size, in the memory of the one before."""
        last = self._doubled
        if last is None or last[0] is not picture:
            self._doubled = last = picture, double(picture.fine, last and last[1])
        return last[1]


def _median(values: Matrix) -> float:
    """One of the middle values: `np.median` costs as much as a step of an alignment."""
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])
