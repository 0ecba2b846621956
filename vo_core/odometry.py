"""Visual odometry on the developed wall: one pose a frame, with its uncertainty.

The path of a frame through `Odometry.step`: divide out bands of a pulsed lamp -> rectify ->
low-pass -> normalise -> remove the fixed pattern -> predict -> locate against the keyframe, else
the newest frame -> pose and status -> update the fixed pattern. Frames that show nothing new
(black, repeated, unrecognised) get the status `lost`, and the motion before them goes on. Time
stamps only guide the search: they move no pose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import cv2
import numpy as np

from vo_core.clock import Clock
from vo_core.dead_reckoning import UNKNOWN_SPEED, reckoned
from vo_core.errors import InvalidTime
from vo_core.geometry.bed import Bed
from vo_core.geometry.doubt import together_mm
from vo_core.geometry.height import scale_sigma
from vo_core.geometry.motion import POSE, RATES, parameters
from vo_core.geometry.motion_prior import MotionPrior
from vo_core.geometry.rectify import BOTTOM, COARSEST, TOP, WHOLE, Rectifier, Rows
from vo_core.geometry.stance import AS_STATED, Stance
from vo_core.geometry.tilt import MountTilt
from vo_core.geometry.wall import Pose, apart_mm
from vo_core.geometry.waves import Waves
from vo_core.image.filters import low_pass, normalise
from vo_core.image.health import NO_HEALTH, Health, HealthGauge
from vo_core.image.overlay import Overlay
from vo_core.image.pattern import FixedPattern
from vo_core.image.resample import grey_frame, kept_apart, reduce_to
from vo_core.image.rows import RowGains
from vo_core.locate import CERTAIN, LEAST_OVERLAP, Fix, Locator, Outlook, Picture, Reference
from vo_core.lookout import Lookout
from vo_core.matching.blocks import BlockGrid
from vo_core.matching.fields import Interlacing
from vo_core.matching.skipped import Skipping, blank
from vo_core.mixing import PURE, Mixing
from vo_core.records import Records
from vo_core.rig import Rig
from vo_core.smoother import STATE, Apart, Link, Smoother, joined
from vo_core.state import State
from vo_core.track import Estimate, Status
from vo_core.types import GrayImage, Image, Matrix

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

GHOST_PX = 0.25
"""Systematic error of a keyframe's link in such a film, px of the patch.

What a coder leaves of the picture before pulls each registration back a little: by 0.1 to 0.3 px on
H.264 at crf 30, much the same over one frame and over six."""

STOPPED_PX = 1.0
"""Motion of the content below which the newest picture seems to be repeated."""

HELD_MM = 2.0
"""Way of a robot that stands while its camera looks around, one sigma."""

USUAL_AGREEMENT = 0.7
"""A fix is as usual if it agrees at least by this share of the mean agreement."""

SLOW_S = 0.2
"""Frame period from which the robot may leave the near wall from one frame to the next."""

FAR = 9.0
"""`COARSEST` for such a film: the patch reaches to three times the distance of its near end."""

HELD_S = 5.0
"""After this time without a fix nothing shows that the robot still stands."""

MOVED_PX = 6.0
"""Motion of the content since the reference from which the wall has certainly moved."""

OPENING_FRAMES = 60
"""Most first frames that are kept, to track them again."""

OPENING_BYTES = 64_000_000
"""Most memory for them."""

LEAST_CONTRAST = 0.5
"""A frame with a smaller deviation in grey levels, after averaging out noise, shows nothing."""

ACCELERATION_MM_S2 = 2000.0
"""Largest acceleration of a robot; a picture that shows more does not show the robot's motion."""

REACH_PX = 2.0
"""Largest error of a good prediction, in pixels of the patch."""

APART = 4.0
"""Two guesses are both tried if they differ by more than this, in pixels of the patch."""

REPEATED_LIMIT_S = 0.3
"""A picture repeated for longer than this shows a robot that stands still."""

STOPPED = 0.5
"""The robot stood still during repeated pictures if it went less than this share of the
prediction."""

LOST_LIMIT_S = 1.0
"""After this time without a fix the newest picture becomes a reference, at the predicted pose."""

PATTERN_STEP = 0.1
"""The fixed pattern learns from a frame once the wall has moved by this share of the patch."""

RELIABILITY_GAIN = 0.05
"""Weight of the newest frame in the mean reliability of a block."""

RELIABILITY_FLOOR = 0.05
"""Least reliability of a block, so that it can recover after the lens was wiped."""

LINK_ERROR = (0.0, 0.0, 0.0, 0.01, np.radians(0.003), np.radians(0.003), 0.0, 0.0)
"""Standard deviation that each keyframe adds to z, pitch and roll beyond its covariance, mm and
rad."""

TURN_ERROR = np.radians([0.03, 1.0])
"""Systematic error of a keyframe's turn, rad: a constant and a noise term, see `_systematic`.

Video coding and the rest of the lamp's light turn each registration a little, with the same sign
over many keyframes. Without this term the chained yaw would outweigh the shear, which shows where
the axis of a cylinder is, and would drift (yaw rms on coded video: 0.05 degrees with it, 0.15 to
1.2 without).
"""

SHEAR_ERROR = float(np.radians(0.5))
"""Standard deviation of the shear by coarse coding (see `CodedMotion`) at a fidelity of 0, rad.

Measured from I frames to the P frames that follow: 0.12 degrees at crf 38 (fidelity 0.8 to 0.6),
with one sign, where the scatter of the blocks states 0.05. At crf 30 it is 0.07 degrees, and one
more unknown in each frame would cost more accuracy than it gains.
"""

FIDELITY_GAIN = 0.1
"""Weight of the newest frame in the mean fidelity."""

SCALE_ERROR = np.array([5e-5, 9e-4])
"""Systematic error of the distance, relative: a constant and a noise term, see `_systematic`.

It is multiplied by the unevenness of the picture, because blur and coding vary with the resolution.
"""


@dataclass(frozen=True)
class Traits:
    """What shows somewhere in a film and counts from there to its end."""

    is_coarse: bool = False
    """Its coding repeats blocks, see `Skipping`."""
    is_noiseless: bool = False
    """A standstill shows as equal pictures, without noise."""


class Odometry:
    """Tracks the camera through a film; `step` takes one frame after the other."""

    def __init__(self, rig: Rig, known: Traits = Traits()) -> None:
        """`known` is what frames of the film have shown that come before the first one here."""
        camera = rig.camera
        self._known = known
        self._gains = RowGains()
        overlay = Overlay((camera.width, camera.height)) if rig.looks_along_pipe else None
        self._start(rig, COARSEST, overlay)

    def _start(self, rig: Rig, coarsest: float, overlay: Overlay | None) -> None:
        """Start with a patch that reaches as far as `coarsest` allows, see `Rectifier`.

        `overlay` is what is known of text and parts of the robot; None for a camera that looks
        down, or over a floor.
        """
        self.rig = rig
        self._scale_sigma = scale_sigma(rig)
        self._rectify = Rectifier(rig, coarsest=coarsest)
        self._interlacing = Interlacing(self._rectify)
        self._first: tuple[Image, Rows] | None = None
        """Picture at the zero point and the rows that were read, until the order of fields is
        certain."""
        self._blocks = BlockGrid.over(self._rectify.grid.shape)
        self._skipping = Skipping(self._blocks, is_coarse=self._known.is_coarse)
        self._is_torn = False
        """Whether the last frame holds skipped blocks."""
        self._locator = Locator(self._rectify)
        self._coarsest = coarsest
        self._view = self._locator.view(self._rectify)
        self._overlay = overlay
        self._lookout: Lookout | None = None
        if overlay is not None:
            self._lookout = Lookout(self._locator, self._rectify, overlay)
        self._opening: list[tuple[Image, float]] | None = []
        """The first frames with their times, until it is known what is fixed in them."""
        self._ahead: Reference | None = None
        """Newest keyframe of a camera that looked ahead."""
        self._pattern = FixedPattern()
        self._gauge = HealthGauge(self._rectify.valid)
        self._pattern_pose = Pose()
        self._reliability: Matrix | None = None
        """(blocks,) running mean of the ncc in each block over frames that showed motion."""
        self._keyframe: Reference | None = None
        self._fallback: Reference | None = None
        """Newest frame with a fix; after a long loss the newest frame, at its predicted pose."""
        self._state = self._fixed = State.at_start(rig)
        """State at the last frame, and at the last frame with a fix."""
        rows, columns = self._rectify.grid.shape
        side_mm = self._rectify.grid.mm_per_px
        self._motion = MotionPrior(rig)
        self._bed = Bed(rig, (columns * side_mm, rows * side_mm))
        self._waves = Waves(rig, self._rectify.grid)
        self._mixing = Mixing(self._locator)
        self._unexplained = 1.0
        """`Alignment.unexplained` of the last fix."""
        self._fidelity = 1.0
        """Running mean of `Alignment.fidelity`."""
        self._agreement = 0.0
        """Running mean of `Alignment.agreement`."""
        self._has_moved = not rig.looks_along_pipe
        """Whether the wall has been seen to move.

        Before, a camera that looks ahead may show nothing but its own lamp on a smooth wall, which
        stands still however far the robot drives."""
        self._model_mm = 0.0
        """Systematic error that may have accumulated, signed like the distance."""
        self._velocity: Matrix | None = None
        """(3,) mm along, mm across and rad per frame period; None before the second fix."""
        self._clock = Clock()
        self._smoother = Smoother()
        self._link: Link
        """How the last frame was located."""
        self._widening = np.zeros(STATE)
        """Variance that the last frame's state gained as a reference."""
        self._fixed_frame = -1
        """Frame of `_fixed`; -1 before the first one."""
        self._fix_periods = 0.0
        """`Clock.periods` at the last fix."""
        self._frame = 0
        self._is_noiseless = self._known.is_noiseless
        """Whether the film has shown a standstill as equal pictures, without noise."""
        self._is_held = False
        """Whether the last picture only repeated the one before."""
        self._pose_before = Pose()
        self._health: Health | None = NO_HEALTH
        """Health of the last frame; None until it is measured."""
        self.patch: GrayImage | None = None
        """The last frame on the developed wall, as `Rectifier` makes it."""
        self.rows = WHOLE
        """Rows of the last frame that were exposed at its own time."""

    def step(self, image: Image, t_s: float) -> Estimate:
        """Estimate the pose of the camera in the next frame.

        Args:
            image: (H, W) or (H, W, 3), of the rig's size; left unchanged.
            t_s: Presentation or arrival time, a hint of how far the robot may have gone.
        Returns:
            Estimate: The pose; its status is `lost` if the wall was not recognised.
        Raises:
            ShapeMismatch: The size of the image is not the one that the rig states.
            InvalidTime: The time is not a finite number.
        """
        if not np.isfinite(t_s):
            raise InvalidTime(f"Frame {self._frame} has the time {t_s} s; it must be finite.")
        image = grey_frame(self.rig.camera, image)
        self._learn_gains(image)
        if self._overlay is not None:
            self._learn_overlay(self._overlay, image)
        if self._opening is not None:
            self._keep_opening(self._opening, image, t_s)
        return self._track(image, t_s)

    def _track(self, image: Image, t_s: float) -> Estimate:
        """Estimate the pose in the next frame, (H, W) grey, with what is known of the film."""
        self._clock.tick(t_s)
        image = self._gains.divide_out(image)
        self._widening = np.zeros(STATE)
        before = self._state.pose
        if self._lookout is not None:
            self._aim(self._lookout, image)
        self.rows = self._interlacing(image)
        self._keep_zero(self.rows)
        patch = self._view.rectify(image, self.rows)
        normal = normalise(low_pass(patch))
        way_mm = (self._predict().vector - self._state.pose.vector)[:2]
        skipped = self._skipping(normal, way_mm / self._rectify.grid.mm_per_px)
        self._is_torn = bool(skipped.any())
        picture = Picture(blank(self._blocks, self._pattern.remove(normal), skipped), self._view)
        was_repeated, self._is_held = self._is_held, self._is_repeated(patch)
        is_new = _contrast(patch) >= LEAST_CONTRAST and not self._is_held
        fix = self._measure(picture) if is_new else None
        if self._keyframe is None:
            is_zero = self._state.pose.x_mm == 0.0
            status, quality = self._begin(picture, is_new=is_new, is_zero=is_zero)
            if is_zero and self._keyframe is not None and not self._interlacing.is_certain:
                self._first = image, self.rows
        elif fix is not None:
            if was_repeated:
                self._judge_repeats(fix)
            status, quality = self._take(fix, picture)
            self._learn(normal, fix)
            if not self._is_around:
                self._waves.take(patch, self._view.valid, fix.pose.x_mm)
        else:
            status, quality = self._bridge(picture, is_new=is_new)
        estimate = self._estimate(t_s, status, quality)
        beside_mm2 = estimate.sigma_registration_mm**2 - float(self._state.covariance[0, 0])
        apart = Apart(self._widening, beside_mm2, self.bed_mm**2)
        self._smoother.add(self._link, estimate, apart)
        if self._link.is_seen or self._link.reference < 0:
            self._fixed_frame = self._frame
        self.patch, self._pose_before, self._health = patch, before, None
        self._frame += 1
        return estimate

    def smoothed(self) -> list[Estimate]:
        """Return the estimates of all frames so far, each by all of the pictures.

        Call it at the end of a recorded film; one that is too long (`Records`) has none.
        """
        return self._smoother.estimates(self._scale_sigma)

    @property
    def records(self) -> Records:
        """What `smoothed` needs of each frame."""
        return self._smoother.records

    def measure_health(self) -> Health:
        """Measure how good the last frame is to track on.

        Sharpness is relative: the frame is compared with the frames that were measured before it,
        and joins them.  A second call for the same frame returns the same result.
        """
        if self._health is None and self.patch is not None:
            self._health = self._gauge.take(
                self.patch,
                overlap=self._rectify.grid.common(self._pose_before, self._state.pose),
                fixed_pattern=self._pattern.share,
            )
        return self._health or NO_HEALTH

    @property
    def tilt(self) -> MountTilt:
        """Tilt of the mount against the rig, estimated from all frames so far."""
        pitch, roll = np.degrees(self._state.mount_rad).tolist()
        variance = np.diag(self._state.covariance)[POSE:]
        pitch_sigma, roll_sigma = np.degrees(np.sqrt(variance)).tolist()
        return MountTilt(pitch, roll, pitch_sigma, roll_sigma)

    @property
    def stance(self) -> Stance:
        """Pose of the camera in the pipe at the first frame, estimated from all frames so far.

        A camera that looks down stands as its rig states; `tilt` reports if it does not.
        """
        if not self.rig.looks_along_pipe:
            return AS_STATED
        _, y_mm, yaw, z_mm, pitch, roll = self._state.start.tolist()
        turns = np.degrees([yaw, *self._state.mount_rad + (pitch, roll)])
        yaw_deg, pitch_deg, roll_deg = turns.tolist()
        return Stance(y_mm, yaw_deg, z_mm, pitch_deg, roll_deg)

    @property
    def start(self) -> Stance:
        """Pose of the camera in the pipe at the first frame, whichever way it looks.

        `stance` leaves it out for a camera that looks down: its rays are cast from the rig's pose.
        """
        if self.rig.looks_along_pipe:
            return self.stance
        _, y_mm, yaw, z_mm, pitch, roll = self._state.start.tolist()
        yaw_deg, pitch_deg, roll_deg = np.degrees([yaw, pitch, roll]).tolist()
        return Stance(y_mm, yaw_deg, z_mm, pitch_deg, roll_deg)

    @property
    def traits(self) -> Traits:
        """What the film has shown so far."""
        return Traits(self._skipping.is_coarse, self._is_noiseless)

    @property
    def systematic_mm(self) -> float:
        """Part of `sigma_registration_mm` that keeps its sign along the way, signed."""
        return self._model_mm

    @property
    def bed_mm(self) -> float:
        """Part of `sigma_distance_mm` by beds and by waves, signed like the way on them."""
        return together_mm(self._bed.doubt_mm, self._waves.doubt_mm)

    @property
    def _gone(self) -> float:
        """Frame periods since the last fix."""
        return self._clock.periods - self._fix_periods

    @property
    def _gone_s(self) -> float:
        """Seconds since the last fix."""
        return self._gone * self._clock.period_s

    @property
    def _is_around(self) -> bool:
        """Whether the camera looks around while the robot stands."""
        return self._lookout is not None and self._lookout.is_around

    def _aim(self, lookout: Lookout, image: Image) -> None:
        """Choose the vantage from which the next picture is resampled."""
        lookout.see(image, self._state, self._clock.period_s)
        if self._keyframe is None or lookout.is_astray:
            self._stand_anew(lookout)
        if lookout.aim(self._predict(), self._state):
            self._pattern = FixedPattern()
            self._skipping.forget()
        self._view = lookout.view

    def _stand_anew(self, lookout: Lookout) -> None:
        """Place the camera by the axis in the picture; only its distance is kept."""
        at, anew = self._state, lookout.begin()
        covariance = anew.covariance.copy()
        covariance[0, 0] += at.covariance[0, 0]
        pose = replace(anew.pose, x_mm=at.pose.x_mm)
        start = np.concatenate([at.start[:1], anew.start[1:]])
        self._state = self._fixed = replace(anew, pose=pose, covariance=covariance, start=start)
        self._fix_periods, self._fixed_frame = self._clock.periods - 1, -1
        self._keyframe = self._fallback = self._ahead = None

    def _learn_gains(self, image: Image) -> None:
        """Look for bands of a pulsed lamp, and track the first frames again without them."""
        had_bands = self._gains.has_bands
        self._gains.learn(image)
        if self._opening and self._gains.has_bands and not had_bands:
            self._begin_anew(self._overlay, self._coarsest)

    def _learn_overlay(self, overlay: Overlay, image: Image) -> None:
        """Mask what is fixed in the picture, and track the first frames again with the mask."""
        was_clear = overlay.mask is None
        if overlay.add(image):
            if was_clear and self._opening:
                self._begin_anew(overlay, self._coarsest)
            elif self._lookout is not None:
                self._lookout.mask()

    def _keep_opening(self, opening: list[tuple[Image, float]], image: Image, t_s: float) -> None:
        """Keep the first frames; a film of few frames a second begins anew with a longer patch."""
        if len(opening) == 1 and self._overlay is not None and t_s - opening[0][1] > SLOW_S:
            self._begin_anew(self._overlay, FAR)
        opening.append((kept_apart(image), t_s))
        is_full = len(opening) >= OPENING_FRAMES or len(opening) * image.nbytes >= OPENING_BYTES
        self._opening = None if is_full else opening

    def _begin_anew(self, overlay: Overlay | None, coarsest: float) -> None:
        """Track the first frames again, now that more is known of the film.

        Text that stands still places the camera beside the axis, and the wall that it shows there
        agrees with that place for a long time.
        """
        opening = self._opening or []
        self._start(self.rig, coarsest, overlay)
        self._opening = None
        for image, t_s in opening:
            self._track(image, t_s)

    def _keep_zero(self, rows: Rows) -> None:
        """Move the zero point if the wrong field of the first picture was read.

        The poses since then are then off by the motion between the two fields, half a frame.
        """
        if self._first is None:
            return
        image, before = self._first
        if {before, rows} == {TOP, BOTTOM}:
            read, anew = (
                Picture(normalise(low_pass(self._rectify(image, field))), self._view)
                for field in (before, rows)
            )
            at_start = replace(State.at_start(self.rig), mount_rad=self._fixed.mount_rad)
            reference = Reference(read, at_start)
            outlook = Outlook(np.inf, Pose(), self._clock.period_s / 2, None, self._motion, None)
            fix = self._locator.locate(reference, anew, Pose(), outlook)
            if fix is not None:
                self._shift(-fix.pose.x_mm, -fix.pose.y_mm)
            self._first = image, rows
        if self._interlacing.is_certain:
            self._first = None

    def _shift(self, x_mm: float, y_mm: float) -> None:
        """Shift all poses by a move of the zero point."""

        def shifted(pose: Pose) -> Pose:
            return replace(pose, x_mm=pose.x_mm + x_mm, y_mm=pose.y_mm + y_mm)

        self._pattern_pose = shifted(self._pattern_pose)
        self._state, self._fixed = (
            replace(state, pose=shifted(state.pose)) for state in (self._state, self._fixed)
        )
        keyframe, fallback = self._keyframe, self._fallback
        self._keyframe, self._fallback = (
            r and replace(r, state=replace(r.state, pose=shifted(r.pose)))
            for r in (keyframe, fallback)
        )
        if keyframe is fallback:
            self._fallback = self._keyframe
        self._smoother.shift(x_mm, y_mm)

    def _is_repeated(self, patch: GrayImage) -> bool:
        """Whether a recorder repeated the last picture although the robot was moving.

        Sensor noise differs from picture to picture, and coding keeps a little of it even at a
        standstill.  A picture that a recorder repeats is equal to the bit, but not for long.  In a
        film that has shown a standstill as equal pictures, equal pictures are a standstill again.
        """
        if self.patch is None or self._velocity is None:
            return False
        if not np.array_equal(patch, self.patch):
            return False
        if np.hypot(*self._velocity[:2]) <= self._rectify.grid.mm_per_px:
            self._is_noiseless = True
        return not self._is_noiseless and self._gone_s <= REPEATED_LIMIT_S

    def _judge_repeats(self, fix: Fix) -> None:
        """Check whether the repeated pictures before this one were a standstill."""
        way_mm = apart_mm(self._predict(), self._fixed.pose)
        self._is_noiseless |= apart_mm(fix.pose, self._fixed.pose) < STOPPED * way_mm

    def _predict(self) -> Pose:
        """Continue the motion as before, but not beyond the wall seen at the last fix."""
        at = self._fixed.pose
        if self._lookout is not None:
            at = self._lookout.turned(self._fixed, self._gone)
            if self._lookout.is_around:
                return replace(at, x_mm=self._lookout.held_mm)
        if self._velocity is None:
            return at
        x, y, yaw = self._velocity * self._gone * min(1.0, self._most_periods / self._gone)
        return replace(at, x_mm=at.x_mm + x, y_mm=at.y_mm + y, yaw_rad=at.yaw_rad + yaw)

    @property
    def _most_periods(self) -> float:
        """Frame periods in which the robot leaves the wall that it saw at the last fix."""
        if self._velocity is None:
            return 0.0
        columns = self._rectify.grid.shape[1]
        view_mm = columns * self._rectify.grid.mm_per_px
        return float(view_mm / max(abs(self._velocity[0]), 1e-9))

    def _outlook(self) -> Outlook:
        """What is known of the next frame before it is located."""
        reach_mm, gone_s = np.inf, self._gone_s
        if self._velocity is not None:
            way_mm = float(np.hypot(*self._velocity[:2])) * self._gone
            reach_mm = ACCELERATION_MM_S2 * gone_s**2 + REACH_PX * self._rectify.grid.mm_per_px
            reach_mm += self._clock.jitter * way_mm
        shear_rad = SHEAR_ERROR * (1 - self._fidelity) if self._skipping.is_coarse else 0.0
        rate = None if self._velocity is None else self._velocity / self._clock.period_s
        return Outlook(
            reach_mm,
            self._fixed.pose,
            gone_s,
            self._reliability,
            self._motion,
            rate,
            shear_rad,
            None if self._lookout is None else self._lookout.gaze,
            0.0 if self._lookout is None else self._lookout.gaze_rad,
            self._unexplained,
            is_held=self._is_around,
        )

    def _measure(self, picture: Picture) -> Fix | None:
        """Locate a picture against the keyframe, else against the newest frame.

        The search starts from the predicted pose, then from the last one, then without a guess.
        """
        outlook, predicted = self._outlook(), self._predict()
        references = [r for r in (self._keyframe, self._fallback) if r is not None]
        if self._is_around and self._ahead is not None:
            references.insert(0, self._ahead)
        guesses = [predicted]
        if self._is_torn:
            # Texture that was skipped for some frames lies whole frame steps from its place.
            outlook = replace(outlook, is_bound=True)
        elif apart_mm(predicted, self._fixed.pose) > APART * self._rectify.grid.mm_per_px or (
            predicted.yaw_rad,
            predicted.pitch_rad,
        ) != (self._fixed.pose.yaw_rad, self._fixed.pose.pitch_rad):
            guesses.append(self._fixed.pose)
        doubtful = []
        for guess, reference in product(guesses, references):
            if self._locator.overlap(reference, guess) >= LEAST_OVERLAP:
                fix = self._locator.locate(reference, picture, guess, outlook)
                if fix is not None and self._is_coded_standstill(fix):
                    continue
                if fix is not None and self._is_usual(fix):
                    return fix
                doubtful += [fix] if fix is not None else []
        if doubtful:
            return max(doubtful, key=lambda fix: fix.alignment.significance)
        for reference in () if self._is_torn else references:
            if (fix := self._locator.search(reference, picture, outlook)) is not None:
                return fix
        return None

    def _is_coded_standstill(self, fix: Fix) -> bool:
        """Whether a coarse coding may have repeated the newest picture, as the keyframe denies it.

        A robot that stands is recognised from the keyframe, too.
        """
        is_newest = fix.reference is not self._keyframe
        return self._is_coarse_ahead and is_newest and fix.moved_px < STOPPED_PX

    def _is_usual(self, fix: Fix) -> bool:
        """Whether a fix agrees nearly as well as those before; else other guesses are tried, too.

        A turned camera sees rings as another camera sees them from another place.
        """
        if self._lookout is None:
            return True
        return fix.alignment.agreement > USUAL_AGREEMENT * self._agreement

    def _begin(self, picture: Picture, *, is_new: bool, is_zero: bool) -> tuple[Status, float]:
        """Take the first keyframe; after a pose was given up its distance is uncertain."""
        if not is_new:
            return self._bridge(picture, is_new=False)
        self._link = self._unseen()
        self._fix_periods, self._fixed = self._clock.periods, self._state
        self._keyframe = self._fallback = self._reference(picture, self._state)
        return ("ok", 1.0) if is_zero else ("weak", 0.0)

    def _take(self, fix: Fix, picture: Picture) -> tuple[Status, float]:
        way = None if self._velocity is None else self._velocity * self._gone
        fix = self._mixing.resolve(fix, picture, way)
        if self._lookout is not None:
            fix = self._lookout.follow(fix, self._fixed, self._gone)
        share = _systematic(SCALE_ERROR, fix) * self._rectify.unevenness
        self._model_mm += share * (fix.pose.x_mm - self._fixed.pose.x_mm)
        self._unexplained = fix.alignment.unexplained
        self._agreement += FIDELITY_GAIN * (fix.alignment.agreement - self._agreement)
        self._fidelity += FIDELITY_GAIN * (fix.alignment.fidelity - self._fidelity)
        self._has_moved |= fix.moved_px > MOVED_PX and fix.alignment.significance > CERTAIN
        self._motion.learn(fix.anew, fix.pose, fix.joint[:-2, :-2])
        self._bed.take(fix.change, self._fixed.pose.x_mm, fix.pose.x_mm)
        # A standstill that may be dirt sets no speed, so that the next frame can disprove it.
        if fix.is_doubtful and self._reliability is None:
            self._velocity = None
        else:
            velocity = (fix.mean.pose.vector - self._fixed.pose.vector)[:RATES] / self._gone
            if self.rig.looks_along_pipe:
                velocity[1:] = 0.0
            if self._skipping.is_coarse and self._velocity is not None:
                # A bridge would extrapolate the noise of a single step.
                velocity = np.array([(velocity[0] + self._velocity[0]) / 2, 0.0, 0.0])
            self._velocity = velocity
        if not self._is_around:
            self._ahead = fix.reference
        before = Pose.of(fix.anew.vector + fix.reference.offset)
        mean = parameters(fix.mean.pose, before, fix.state.mount_rad)
        self._link = Link(fix.reference.frame, mean, fix.joint, is_seen=True)
        self._state = self._fixed = fix.mean
        self._fix_periods = self._clock.periods
        newest = self._reference(picture, fix.state, turn_rad=_systematic(TURN_ERROR, fix))
        newest = self._mixing.rated(newest, fix, way)
        self._fallback = self._mixing.fallback(newest, self._fallback)
        if self._is_outlived(fix, newest):
            self._keyframe = self._fallback
            if self._is_coarse_ahead:
                ghost_mm = GHOST_PX * self._rectify.grid.mm_per_px
                self._model_mm += float(np.copysign(ghost_mm, fix.change[0]))
        sure = fix.alignment.significance >= CERTAIN and not fix.is_ambiguous
        return "ok" if sure else "weak", float(np.clip(fix.alignment.agreement, 0.0, 1.0))

    def _is_outlived(self, fix: Fix, newest: Reference) -> bool:
        """Whether another picture becomes the keyframe."""
        if newest.impurity > PURE:
            return fix.alignment.overlap < 2 * LEAST_OVERLAP
        is_out = fix.reference is not self._keyframe or fix.alignment.overlap < self._least_overlap
        is_purer = newest.impurity < fix.reference.impurity - PURE
        return is_out or is_purer or self._skipping.is_fresh

    @property
    def _least_overlap(self) -> float:
        """Common wall of keyframe and frame below which the frame becomes the keyframe."""
        if self.rig.looks_along_pipe:
            return AHEAD_OVERLAP
        return COARSE_OVERLAP if self._skipping.is_coarse else KEYFRAME_OVERLAP[self.rig.pipe.shape]

    @property
    def _is_coarse_ahead(self) -> bool:
        """Whether the film is coarsely coded and its camera looks along the pipe."""
        return self._lookout is not None and self._skipping.is_coarse

    def _bridge(self, picture: Picture, *, is_new: bool) -> tuple[Status, float]:
        """Continue the motion before; take a new reference once the old wall is out of sight."""
        self._state = reckoned(
            self._fixed,
            self._predict(),
            self._velocity,
            self._motion,
            periods=self._gone,
            most_periods=self._most_periods,
            period_s=self._clock.period_s,
        )
        if self._is_around and self._gone_s < HELD_S:
            return self._hold()
        self._link = self._unseen()
        if is_new and self._keyframe is not None:
            out_of_sight = self._gone > (1 - LEAST_OVERLAP) * self._most_periods > 0
            if out_of_sight or self._gone_s > LOST_LIMIT_S:
                self._fallback = self._reference(picture, self._state)
        return "lost", 0.0

    def _hold(self) -> tuple[Status, float]:
        """Keep the distance of a robot that stands, while its camera looks elsewhere."""
        covariance = self._fixed.covariance.copy()
        covariance[0, 0] += HELD_MM**2
        self._state = replace(self._fixed, pose=self._predict(), covariance=covariance)
        self._link = self._unseen()
        return "weak", 0.0

    def _unseen(self) -> Link:
        """How a frame follows from the last one with a fix, which its picture does not show."""
        now, before = self._state, self._fixed
        mean = parameters(now.pose, before.pose, now.mount_rad)
        joint = joined(now.covariance, before.covariance)
        return Link(self._fixed_frame, mean, joint, is_seen=False)

    def _reference(self, picture: Picture, state: State, turn_rad: float = 0.0) -> Reference:
        self._widening = np.square(LINK_ERROR)
        self._widening[2] += turn_rad**2
        covariance = state.covariance + np.diag(self._widening)
        return Reference(picture, replace(state, covariance=covariance), self._frame)

    def _learn(self, normal: GrayImage, fix: Fix) -> None:
        """Update the fixed pattern and the reliability, once for each piece of new wall."""
        step_mm = PATTERN_STEP * max(normal.shape) * self._rectify.grid.mm_per_px
        moved_mm = apart_mm(self._state.pose, self._pattern_pose)
        if self._pattern.count > 0 and moved_mm < step_mm:
            return
        if self._pattern.count > 0:
            ncc = fix.alignment.ncc + RELIABILITY_FLOOR
            known = ncc if self._reliability is None else self._reliability
            seen = fix.alignment.ncc > 0
            self._reliability = np.where(seen, known + RELIABILITY_GAIN * (ncc - known), known)
        self._pattern.add(normal)
        self._pattern_pose = self._state.pose

    def _estimate(self, t_s: float, status: Status, quality: float) -> Estimate:
        pose = Pose.of(self._state.pose.vector - self._state.start)
        sigma_mm = float(np.sqrt(self._state.covariance[0, 0] + self._model_mm**2))
        scale_mm = np.hypot(self._scale_sigma * pose.x_mm, self.bed_mm)
        if not self._has_moved:
            status = "weak" if status == "ok" and self._frame > 0 else status
            sigma_mm = float(
                np.hypot(sigma_mm, self._clock.periods * self._clock.period_s * UNKNOWN_SPEED[0])
            )
        return Estimate(
            frame=self._frame,
            time_s=t_s,
            x_mm=pose.x_mm,
            y_mm=pose.y_mm,
            yaw_deg=float(np.degrees(pose.yaw_rad)),
            distance_mm=pose.x_mm,
            sigma_distance_mm=float(np.hypot(sigma_mm, scale_mm)),
            quality=quality,
            status=status,
            sigma_registration_mm=sigma_mm,
            z_mm=pose.z_mm,
            pitch_deg=float(np.degrees(pose.pitch_rad)),
            roll_deg=float(np.degrees(pose.roll_rad)),
            looking_around=float(self._is_around),
        )


def _systematic(error: Matrix, fix: Fix) -> float:
    """Systematic error of a fix: error[0] + error[1] * (1 - fidelity).

    Noise in the pictures shifts each registration a little, always with the same sign.
    """
    return float(error[0] + error[1] * (1 - fix.alignment.fidelity))


def _contrast(patch: GrayImage) -> float:
    """Standard deviation in grey levels at an eighth of the size, where noise averages out."""
    rows, columns = (max(side // 8, 1) for side in patch.shape)
    small = reduce_to(patch[: rows * 8, : columns * 8], (columns, rows))
    return float(cv2.meanStdDev(small)[1].item())
