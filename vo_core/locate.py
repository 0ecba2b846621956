"""One frame against one reference: phase correlation for the start, alignment for the pose."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vo_core.geometry.motion import (
    MOUNT,
    MOVING,
    PARAMETERS,
    POSE,
    RATES,
    REFERENCE,
    CodedMotion,
    RollingMotion,
    WallMotion,
    moved_by_content,
    parameters,
    relief_modes,
    ring_modes,
    shear_mode,
)
from vo_core.geometry.motion_prior import MotionPrior
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.wall import Pose, apart_mm
from vo_core.image.filters import taper
from vo_core.image.resample import double, halve, resample, resample_mask
from vo_core.matching.align import (
    LOCK,
    OPEN_PX,
    START_PX,
    Alignment,
    Likeness,
    Prior,
    Template,
    agree,
    align,
    inverse,
)
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
)
from vo_core.state import RATE_SIGMA, UNKNOWN_RATE, State, tilt_sigma_rad
from vo_core.types import ByteImage, GrayImage, Matrix

ASIDE = 0.15
"""Distance of a camera that looks ahead from where the rig states it, one sigma, as a share of the
diameter."""

FAINT_PSR = 6.5
"""Like `LOCK_PSR`, where a wrong peak costs only an alignment that fails: as the wall comes nearer
it is seen more sharply, and the peak is fainter."""

SETTLED = 6
"""Plain steps of an alignment before the rest is extrapolated, where the camera looks along the
pipe: an offset from the axis that is hardly known converges slowly."""

OPEN_AHEAD_PX = 3.0
"""Like `OPEN_PX`, where the camera looks along the pipe.

The share of a shift that driving, an offset from the axis and coding have in it is less certain
there. A link over a longer way is uncertain by 1 to 2 px, and is right; straight lines leave 100 px
open."""

STANDS_MM = 0.3
"""Way of a robot that stands, one sigma."""

CODING_PX = 0.15
"""Displacement by coding, px of the patch, one sigma, where the camera looks along the pipe.

From one picture to the next the wall moves by a pixel or two, and coding would place the camera
tens of millimetres beside the axis, with a small uncertainty."""

RELIEF_PX = 1.0
"""Way, px of the patch, over which the relief of a corrugated wall shows even at a standstill: the
start of an alignment may be wrong by as much."""

MOTIONS_KEPT = 16
"""Motion models that are kept: each costs as much as some steps of an alignment."""

LEAST_OVERLAP = 0.15
"""A reference that shares less wall than this with a frame is out of reach."""

STANDS_PX = 3.0
"""Below this motion of the content the robot counts as standing still."""

APART_PX = 6.0
"""A second peak counts as separate motion beside a standstill only beyond this."""

RIVAL = 0.9
"""A pose with at least this share of the best support counts as equally good."""

CLEARER = 0.3
"""A block votes for one motion against another if its normalised correlation is higher by this."""

LEAST_CLEARER = 0.01
"""Share of blocks voting against a standstill from which it counts as a fixed pattern."""

SURPRISE = 2.0
"""A picture of which this many times as much is unexplained as of the last one may show more than
the predicted motion."""

CERTAIN = 14.0
"""Significance (see `LOCK`) from which an alignment gets the status `ok`."""

_DIFFERENCE = np.zeros((POSE, PARAMETERS))
_DIFFERENCE[:, MOVING], _DIFFERENCE[:, REFERENCE] = np.eye(POSE), -np.eye(POSE)
_GAZE = [MOVING.start + 2, MOVING.start + 4]
_BY_GAZE = np.zeros((2, PARAMETERS))
_BY_GAZE[[0, 1, 1], [*_GAZE, MOUNT.start]] = 1.0
_KNOWN = [*range(MOUNT.stop)[REFERENCE], *range(MOUNT.stop)[MOUNT]]
_KEPT = [*range(MOUNT.stop)[MOVING], *range(MOUNT.stop)[MOUNT]]
"""Indices of the parameters with a prior, and of those kept in the state."""


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
        self.coarse_valid = (halve(self.valid.astype(np.float32)) > 0.99).astype(np.uint8)


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
        coarse, seen = self.picture.coarse, self.picture.view.coarse_valid
        own = spectrum(coarse, taper(seen, max(4, min(seen.shape) // 5)))
        return best_peaks(correlation(own, own), 2)[1].psr >= LOCK_PSR


@dataclass(frozen=True, eq=False)
class Fix:
    """A pose measured against a reference."""

    state: State
    """Includes the uncertainty of the reference."""
    reference: Reference
    alignment: Alignment
    moved_px: float
    """Median displacement of the blocks from where the reference shows them."""
    change: Matrix
    """(6,) change of the pose since the reference, without the prior of the motion."""
    change_variance: Matrix
    """(6,) variances of `change`."""
    anew: Pose
    """Pose of the reference as the picture shows it."""
    joint: Matrix
    """(14, 14) covariance of the pose, of `anew` and of the mount."""
    is_ambiguous: bool = False
    """Whether another pose fits equally well, as on a wall that repeats itself."""
    is_doubtful: bool = False
    """Whether this standstill would count as a fixed pattern if the other motion were in reach."""
    found: tuple[Fix, ...] = ()
    """All fixes that may show the wall, if there are several."""
    share: float = 0.0
    """Share of another exposure in the picture, see `Mixing`."""
    offset: Matrix = field(default_factory=lambda: np.zeros(POSE))
    """(6,) from the pose, at one exposure, to that at the time of the picture, between two."""

    @property
    def likeness(self) -> Likeness:
        """How the picture agrees with the reference."""
        return self.alignment.ncc, self.alignment.agreement

    @property
    def mean(self) -> State:
        """The state at the time of the picture."""
        return replace(self.state, pose=Pose.of(self.pose.vector + self.offset))

    @property
    def pose(self) -> Pose:
        """Pose of the camera in the located frame."""
        return self.state.pose

    @property
    def unheld(self) -> Fix:
        """The same, at the place along the pipe that follows without the prior of the motion."""
        x_mm = self.reference.pose.x_mm + float(self.change[0])
        return replace(self, state=replace(self.state, pose=replace(self.pose, x_mm=x_mm)))


@dataclass(frozen=True)
class Outlook:
    """What is known about the robot and the lens before a picture is located."""

    reach_mm: float
    """Largest distance of the robot from the guess; inf if unknown."""
    last: Pose
    """Pose at the last fix."""
    since_s: float
    """Time since the last fix."""
    ncc_weights: Matrix | None
    """(blocks,) mean normalised correlation of each block while the robot moved: low where dirt or
    water lies. None before the robot has moved."""
    motion: MotionPrior
    """How far this robot leaves its way."""
    rate: Matrix | None
    """(3,) change of x, y and yaw per second between the last two fixes."""
    shear_rad: float = 0.0
    """Standard deviation of the shear by coding; 0 in a film that is not coarsely coded."""
    gaze: Matrix | None = None
    """(2,) yaw and pitch of the camera in the pipe by the axis in the picture; None if unknown."""
    gaze_rad: float = 0.0
    """Standard deviation of each."""
    unexplained: float = 1.0
    """Share of the last picture that its pose did not explain."""
    is_held: bool = False
    """Whether the robot stands, so that nothing but its camera turns."""
    is_bound: bool = False
    """Whether every pose out of reach is rejected, even a standstill."""


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
        self._relief_modes = relief_modes(self._rig, self._grid.to_mm(self._blocks.nodes()))
        self._ring_modes: Matrix | None = None
        self._aside_mm, self._least_psr = np.inf, LOCK_PSR
        self._settled: int | None = None
        self._open_px = OPEN_PX
        if self._rig.looks_along_pipe:
            self._ring_modes = ring_modes(self._rig, self._grid, self._blocks.nodes())
            self._aside_mm = ASIDE * (self._rig.pipe.diameter_mm or np.inf)
            self._least_psr, self._settled = FAINT_PSR, SETTLED
            self._open_px = OPEN_AHEAD_PX
        self._motions: dict[tuple[Pose, Pose, bool], WallMotion] = {}
        """Motion models in use, by the vantages of reference and picture."""
        self._doubled: tuple[Picture, GrayImage] | None = None
        """The last picture that was aligned, at twice the size."""

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_doubled": None}

    def view(self, rectifier: Rectifier, hidden: ByteImage | None = None) -> View:
        """What a camera at the vantage of this rectifier shows."""
        return View(rectifier, self._blocks, hidden)

    def _motion(self, reference: Reference, picture: Picture, *, coarse: bool) -> WallMotion:
        """The motion model between two patches, at the nodes of the fine or the coarse blocks."""
        vantages = reference.picture.view.vantage, picture.view.vantage
        key = (*vantages, coarse)
        if key not in self._motions:
            if len(self._motions) >= MOTIONS_KEPT:
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

    def locate(
        self, reference: Reference, picture: Picture, guess: Pose, outlook: Outlook
    ) -> Fix | None:
        """Find the pose of a picture near a guess, within the reach of the coarse correlation.

        Two peaks can both be good: dirt on the lens shows a standstill, and running water its own
        speed.  A standstill is rejected where the robot cannot stop that hard or where it is a
        fixed pattern (see `_is_pattern`); otherwise those blocks decide that have shown the wall
        before.
        """
        fixes = self._fixes(reference, picture, guess, outlook)
        in_reach = [fix for fix in fixes if _off_mm(fix, guess) <= outlook.reach_mm]
        return self._best(in_reach if outlook.is_bound else fixes, in_reach, outlook, guess)

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
        return self._best(fixes, fixes, outlook, outlook.last)

    def _fixes(
        self, reference: Reference, picture: Picture, guess: Pose, outlook: Outlook
    ) -> list[Fix]:
        # Where the guess explains all blocks as well as before, another motion is possible on a
        # repeating wall only.
        near = None if outlook.is_held else self._align(reference, picture, guess, outlook)
        if near and _explains_all(near, outlook) and not reference.repeats:
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
            if outlook.is_held:
                start = replace(start, x_mm=guess.x_mm)
            aligned.append(self._align(reference, picture, start, outlook))
        # The peaks of wall and water may merge into one lobe whose top is neither.  So the guess
        # counts too, unless one motion explains all blocks.
        is_lobe = any(1 < np.hypot(peak.dx_px, peak.dy_px) < LOBE_PX for peak in peaks)
        if outlook.is_held:
            aligned.append(self._align(reference, picture, guess, outlook))
        elif is_lobe and not any(fix and _explains_all(fix, outlook) for fix in aligned):
            aligned.append(near)
        return [fix for fix in aligned if fix]

    def _best(
        self, found: list[Fix], in_reach: list[Fix], outlook: Outlook, guess: Pose
    ) -> Fix | None:
        """The fix that shows the wall: of equally good ones the nearest to the guess.

        Its variance includes the distance to the other good ones.
        """
        fixes = [fix for fix in found if self._is_credible(fix, found, in_reach, outlook)]
        if not fixes:
            return None
        weights = outlook.ncc_weights
        if weights is None:
            weights = np.ones(self._blocks.rows * self._blocks.columns)
        supports = [fix.alignment.support(weights) for fix in fixes]
        as_good = [
            fix
            for fix, support in zip(fixes, supports, strict=True)
            if support >= RIVAL * max(supports)
        ]
        best = fixes[int(np.argmax(supports))]
        if np.isfinite(outlook.reach_mm):
            best = min(as_good, key=lambda fix: _off_mm(fix, guess))
        best = replace(best, found=tuple(fixes) if len(fixes) > 1 else ())
        if _stands(best) and any(_is_pattern(best, other) for other in found):
            best = replace(best, is_doubtful=True)
        rivals = [abs(fix.pose.x_mm - best.pose.x_mm) for fix in as_good]
        if max(rivals) < self._grid.mm_per_px:
            return best
        uncertain = best.state.covariance.copy()
        uncertain[0, 0] += max(rivals) ** 2
        state = replace(best.state, covariance=uncertain)
        return replace(best, state=state, is_ambiguous=True)

    def _is_credible(
        self, fix: Fix, found: list[Fix], in_reach: list[Fix], outlook: Outlook
    ) -> bool:
        """Whether a fix shows the wall and not a standstill of the lens only.

        Dirt stands still against every reference.  A robot that stops dead stands still against
        the newest picture only; against an older one it would have had to jump back.
        """
        if not _stands(fix):
            return True
        if fix in in_reach:
            return not any(_is_pattern(fix, other) for other in in_reach)
        back_mm = apart_mm(fix.pose, outlook.last)
        if in_reach or back_mm > APART_PX * self._grid.mm_per_px:
            return False
        return not any(_is_pattern(fix, other) for other in found)

    def overlap(self, reference: Reference, pose: Pose) -> float:
        """Approximate share of the reference's wall that a camera at `pose` sees."""
        return self._grid.common(reference.pose, pose)

    def likeness(self, reference: Reference, picture: Picture, pose: Matrix) -> Likeness:
        """How a picture agrees with a reference if it was taken at a pose, (6,)."""
        motion = self._motion(reference, picture, coarse=False)
        positions = motion.positions(_parameters(reference, Pose.of(pose)))
        return agree(reference.template, self._twice(picture), picture.view.whole, positions)

    def _peaks(self, reference: Reference, picture: Picture, guess: Pose) -> list[Peak]:
        """Peaks of the phase correlation after moving the picture by the guess, coarse px."""
        moved = self._motion(reference, picture, coarse=True).positions(
            _parameters(reference, guess)
        )
        positions = (moved - 0.5) / 2  # of the half-size picture
        maps = self._coarse_blocks.dense(positions)
        seen = resample(picture.coarse, maps)
        shown = self._coarse_blocks.crop(reference.picture.view.coarse_valid)
        common = resample_mask(picture.view.coarse_valid, maps) & shown
        if np.count_nonzero(common) < LEAST_OVERLAP * np.count_nonzero(shown):
            return []
        window = taper(common, max(4, min(common.shape) // 5))
        original = self._coarse_blocks.crop(reference.picture.coarse)
        surface = correlation(spectrum(original, window), spectrum(seen, window))
        return [peak for peak in best_peaks(surface, 2) if peak.psr >= self._least_psr]

    def _align(
        self, reference: Reference, picture: Picture, start: Pose, outlook: Outlook
    ) -> Fix | None:
        parameters = _parameters(reference, start)
        exact: WallMotion | RollingMotion
        exact = wall = self._motion(reference, picture, coarse=False)
        scales, known = wall.scales, _known(reference, parameters, outlook, self._aside_mm)
        reach_mm = STANDS_MM if outlook.is_held else START_PX * self._grid.mm_per_px
        usual = _motion_prior(reference, start, parameters, outlook.motion, reach_mm)
        if self._rig.camera.readout_ms > 0:
            exact = RollingMotion(wall)
            rate_before = reference.state.rate
            rates = np.append(
                _rate(start, outlook) if outlook.rate is None else outlook.rate, rate_before.mean
            )
            information = np.zeros((2 * RATES, 2 * RATES))
            information[:RATES, :RATES] = np.diag(1 / np.square(RATE_SIGMA))
            information[RATES:, RATES:] = rate_before.information
            parameters, scales = (
                np.append(parameters, rates),
                np.append(scales, [*RATE_SIGMA, *RATE_SIGMA]),
            )
            known = _widened(known, Prior(rates, information))
            usual = _widened(usual, Prior(rates, 0 * information))
        motion: WallMotion | RollingMotion | CodedMotion = exact
        modes, sigma = self._modes(outlook, abs(start.x_mm - reference.pose.x_mm))
        if len(sigma) > 0:
            motion, none = CodedMotion(exact, modes), np.zeros(len(sigma))
            certain = np.diag(sigma**-2)
            known = _widened(known, Prior(none, certain))
            usual = _widened(usual, Prior(none, 0 * certain))
            parameters, scales = np.append(parameters, none), np.append(scales, motion.scales)
        fit = align(
            reference.template,
            self._twice(picture),
            picture.view.whole,
            motion.positions,
            parameters,
            scales,
            linearise=motion.linearise,
            prior=known,
            motion=usual,
            settled=self._settled,
        )
        covariance = fit.covariance[np.ix_(_KEPT, _KEPT)]
        is_open = fit.uncertainty_px[0] > self._open_px
        if not fit.converged or is_open or fit.significance < LOCK or fit.overlap < LEAST_OVERLAP:
            return None
        moved_px = np.hypot(*(self._blocks.centres(fit.positions) - self._centres).T)
        pose = Pose.of(fit.parameters[MOVING])
        # What the picture shows about the reference it also shows about the first frame, as far as
        # their errors are correlated (fixed-point smoothing; Meditch 1967).
        before = reference.state
        gain = before.with_start.T @ reference.information
        news = fit.parameters[_KNOWN] - parameters[_KNOWN]
        state = State(
            pose=pose,
            mount_rad=fit.parameters[MOUNT],
            covariance=covariance,
            rate=Prior(_rate(pose, outlook), UNKNOWN_RATE.information),
            start=before.start + gain @ news,
            with_start=fit.covariance[np.ix_(_KEPT, _KNOWN)] @ gain.T,
        )
        return Fix(
            state=state.known_to(self._tilt_rad),
            reference=reference,
            alignment=fit,
            moved_px=_median(moved_px[np.isfinite(moved_px)]),
            anew=Pose.of(fit.parameters[REFERENCE]),
            joint=fit.covariance[:PARAMETERS, :PARAMETERS],
            change=fit.free[MOVING] - fit.free[REFERENCE],
            change_variance=np.diag(
                _DIFFERENCE @ fit.free_covariance[:PARAMETERS, :PARAMETERS] @ _DIFFERENCE.T
            ),
        )

    def _modes(self, outlook: Outlook, way_mm: float) -> tuple[Matrix, Matrix]:
        """(k, 2, N) displacements that are no motion, and (k,) sigmas of their parameters.

        They are those by the relief over a way, and those by coding.
        """
        relief, way_px = self._relief_modes, way_mm / self._grid.mm_per_px
        sigma = np.full(len(relief), way_px + RELIEF_PX)
        if self._ring_modes is not None:
            coding, coding_sigma = self._ring_modes, CODING_PX
        elif outlook.shear_rad > 0:
            coding, coding_sigma = shear_mode(self._blocks.nodes()), outlook.shear_rad
        else:
            return relief, sigma
        sigma = np.append(sigma, np.full(len(coding), coding_sigma))
        return np.concatenate([relief, coding]), sigma


def _median(values: Matrix) -> float:
    """One of the middle values: `np.median` costs as much as a step of an alignment."""
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])


def _known(reference: Reference, parameters: Matrix, outlook: Outlook, aside_mm: float) -> Prior:
    """Prior of the reference pose and the mount, and of the gaze: pitch is pose and mount."""
    information = np.zeros((PARAMETERS, PARAMETERS))
    information[np.ix_(_KNOWN, _KNOWN)] = reference.information
    if np.isfinite(aside_mm):
        parameters = parameters.copy()
        parameters[[1, 3]] = 0.0
        information[[1, 3], [1, 3]] += aside_mm**-2
    if outlook.gaze is None:
        return Prior(parameters, information)
    mean = parameters.copy()
    mean[_GAZE] = outlook.gaze - (0.0, mean[MOUNT][0])
    information += _BY_GAZE.T @ _BY_GAZE / outlook.gaze_rad**2
    return Prior(mean, information)


def _motion_prior(
    reference: Reference, start: Pose, parameters: Matrix, motion: MotionPrior, reach_mm: float
) -> Prior:
    """Prior of the step from the reference to the picture, see `MotionPrior`.

    Along the pipe the standard deviation is `reach_mm`.
    """
    way_mm = start.x_mm - reference.pose.x_mm
    kept = motion.kept(way_mm)
    follows = np.zeros((POSE, PARAMETERS))
    follows[:, MOVING], follows[:, REFERENCE] = np.eye(POSE), -np.diag(kept)
    mean = parameters.copy()
    before = parameters[REFERENCE] - motion.mean(reference.pose)
    mean[MOVING] = motion.mean(start) + kept * before
    mean[0] = start.x_mm
    weight = np.zeros((POSE, POSE))
    weight[0, 0] = reach_mm**-2
    weight[1:, 1:] = inverse(motion.covariance(way_mm))
    return Prior(mean, follows.T @ weight @ follows)


def _rate(pose: Pose, outlook: Outlook) -> Matrix:
    """(3,) change of x, y and yaw per second since the last fix."""
    way = (pose.vector - outlook.last.vector)[:RATES]
    return np.asarray(way / max(outlook.since_s, 1e-3))


def _widened(prior: Prior, further: Prior) -> Prior:
    """A prior extended by that of further parameters."""
    count = len(prior.mean)
    wide = np.zeros((count + len(further.mean),) * 2)
    wide[:count, :count], wide[count:, count:] = prior.information, further.information
    return Prior(np.append(prior.mean, further.mean), wide)


def _stands(fix: Fix) -> bool:
    """Whether the picture lies on the reference, within the pull of a fixed pattern."""
    return fix.moved_px < STANDS_PX


def _is_pattern(fix: Fix, other: Fix) -> bool:
    """Whether `fix` is the standstill of dirt on the lens, and `other` the motion of the wall.

    A wall that stands still agrees in all blocks, even where a repeating texture also agrees one
    period off.  Dirt agrees only where it lies: some other blocks agree with the motion and not
    with the standstill.
    """
    if other.moved_px < APART_PX:
        return False
    clearer = other.alignment.ncc - fix.alignment.ncc > CLEARER
    return float(clearer.mean()) > LEAST_CLEARER


def _off_mm(fix: Fix, guess: Pose) -> float:
    """Distance of the robot from a guess, measured by its motion since the reference.

    A clear picture after poor ones also corrects the pose of the reference, by millimetres beside
    the axis; that is no motion of the robot.
    """
    corrected = Pose.of(fix.alignment.parameters[REFERENCE])
    moved, expected = _since(corrected, fix.pose), _since(fix.reference.pose, guess)
    return float(np.hypot(*(moved - expected)))


def _since(reference: Pose, pose: Pose) -> Matrix:
    """(2,) motion ahead and to the right, mm, in the axes of the reference."""
    cos, sin = np.cos(reference.yaw_rad), np.sin(reference.yaw_rad)
    x_mm, y_mm = pose.x_mm - reference.x_mm, pose.y_mm - reference.y_mm
    return np.array([cos * x_mm + sin * y_mm, cos * y_mm - sin * x_mm])


def _explains_all(fix: Fix, outlook: Outlook) -> bool:
    """Whether all blocks agree so well that none can vote for another motion.

    No block can exceed such a correlation by `CLEARER`; and all blocks agree less in a mixture of
    two motions.
    """
    if fix.alignment.unexplained > SURPRISE * outlook.unexplained:
        return False
    seen = fix.alignment.overlap * np.count_nonzero(fix.reference.template.seen)
    agree = np.count_nonzero(fix.alignment.ncc >= 1 - CLEARER)
    return bool(agree >= (1 - LEAST_CLEARER) * seen)


def _parameters(reference: Reference, pose: Pose) -> Matrix:
    return parameters(pose, reference.pose, reference.state.mount_rad)
