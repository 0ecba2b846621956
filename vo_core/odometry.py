"""Visual odometry on the developed wall: one pose a frame, with its uncertainty.

The path of a frame through `Odometry.step`: divide out bands of a pulsed lamp -> rectify ->
low-pass -> normalise -> remove the fixed pattern -> predict -> locate against the keyframe, else
the newest frame -> pose and status -> update the fixed pattern. Frames that show nothing new
(black, repeated, unrecognised) get the status `lost`, and the motion before them goes on. Time
stamps only guide the search: they move no pose.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from vo_core.errors import InvalidTime
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.geometry.rectify import COARSEST, WHOLE, Rectifier
from vo_core.geometry.tilt import MountTilt
from vo_core.geometry.wall import Pose
from vo_core.image.filters import contrast, low_pass, normalise
from vo_core.image.health import Health, HealthGauge
from vo_core.image.overlay import Overlay
from vo_core.image.resample import grey_frame
from vo_core.image.rows import RowGains
from vo_core.links.locator import Locator
from vo_core.links.picture import Picture
from vo_core.lookout import Lookout
from vo_core.matching.blocks import BlockGrid
from vo_core.matching.fields import Interlacing
from vo_core.matching.skipped import Skipping, blank
from vo_core.records import Records
from vo_core.rig import Rig
from vo_core.state import State
from vo_core.track import Estimate
from vo_core.tracker.chain import Chain
from vo_core.tracker.dirt import Dirt
from vo_core.tracker.measuring import Measuring
from vo_core.tracker.opening import Opening
from vo_core.tracker.repeats import Repeats
from vo_core.tracker.zero import ZeroPoint
from vo_core.types import GrayImage, Image

LEAST_CONTRAST = 0.5
"""A frame with a smaller deviation in grey levels, after averaging out noise, shows nothing."""

FAR = 9.0
"""`COARSEST` for a film of few frames a second, whose camera looks along the pipe: the patch
reaches to three times the distance of its near end."""


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
        self.rig, self._known = rig, known
        self._gains = RowGains()
        self._overlay: Overlay | None = None
        """Text and parts of the robot in the picture of a camera that looks along the pipe."""
        if rig.looks_along_pipe:
            self._overlay = Overlay((rig.camera.width, rig.camera.height))
        self._opening = Opening()
        self._start(COARSEST)

    def _start(self, coarsest: float) -> None:
        """Start with a patch that reaches as far as `coarsest` allows, see `Rectifier`."""
        self._coarsest = coarsest
        self._rectify = rectify = Rectifier(self.rig, coarsest=coarsest)
        locator = Locator(rectify)
        self._view = locator.view(rectify)
        self._interlacing = Interlacing(rectify)
        self._zero = ZeroPoint(rectify, locator)
        self._blocks = BlockGrid.over(rectify.grid.shape)
        self._skipping = Skipping(self._blocks, is_coarse=self._known.is_coarse)
        self._repeats = Repeats(rectify.grid, is_noiseless=self._known.is_noiseless)
        self._dirt = Dirt(rectify.grid)
        self._lookout: Lookout | None = None
        if self._overlay is not None:
            self._lookout = Lookout(locator, rectify, self._overlay)
        self._chain = Chain(rectify, locator, self._skipping, self._lookout)
        self._measure = Measuring(locator, self._chain, self._skipping, self._lookout)
        self._gauge = HealthGauge(rectify.valid)
        self._pose_before = Pose()
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
            raise InvalidTime(f"Frame {self._chain.frame} has the time {t_s} s; it must be finite.")
        image = grey_frame(self.rig.camera, image)
        self._learn_gains(image)
        if self._overlay is not None:
            self._learn_overlay(self._overlay, image, t_s)
        self._opening.keep(image, t_s)
        return self._track(image, t_s)

    def smoothed(self) -> list[Estimate]:
        """Return the estimates of all frames so far, each by all of the pictures.

        Call it at the end of a recorded film; one that is too long (`Records`) has none.
        """
        return self._chain.smoothed()

    @property
    def records(self) -> Records:
        """What `smoothed` needs of each frame."""
        return self._chain.records

    def measuring_health(self) -> Callable[[], Health]:
        """Return what measures how good the last frame is to track on, also while the next is.

        Sharpness is relative: the frame is compared with the frames that were measured before it,
        and joins them.  So call what is returned once, in the order of the frames.
        """
        assert self.patch is not None  # noqa: S101  (there is a last frame)
        return partial(
            self._gauge.take,
            self.patch,
            overlap=self._rectify.grid.common(self._pose_before, self._state.pose),
            fixed_pattern=self._dirt.pattern.share,
        )

    @property
    def tilt(self) -> MountTilt:
        """Tilt of the mount against the rig, estimated from all frames so far."""
        return self._state.tilt

    @property
    def initial_pose(self) -> InitialPose:
        """Pose of the camera in the pipe at the first frame, estimated from all frames so far.

        A camera that looks down stands as its rig states; `tilt` reports if it does not.
        """
        return self.start if self.rig.looks_along_pipe else AS_STATED

    @property
    def start(self) -> InitialPose:
        """Pose of the camera in the pipe at the first frame, whichever way it looks.

        `initial_pose` leaves it out for a camera that looks down: its rays are cast from the
        rig's pose.
        """
        return self._state.start_in_pipe(self.rig)

    @property
    def traits(self) -> Traits:
        """What the film has shown so far."""
        return Traits(self._skipping.is_coarse, self._repeats.is_noiseless)

    @property
    def systematic_mm(self) -> float:
        """Part of `sigma_registration_mm` that keeps its sign along the way, signed."""
        return self._chain.fidelity.systematic_mm

    @property
    def bed_mm(self) -> float:
        """Part of `sigma_distance_mm` by beds and by waves, signed like the way on them."""
        return self._chain.bed_mm

    def _learn_gains(self, image: Image) -> None:
        """Look for bands of a pulsed lamp, and track the first frames again without them."""
        had_bands = self._gains.has_bands
        self._gains.learn(image)
        if self._gains.has_bands and not had_bands and len(self._opening) > 0:
            self._track_again(self._coarsest)
            self._opening.close()

    def _learn_overlay(self, overlay: Overlay, image: Image, t_s: float) -> None:
        """Mask what is fixed in the picture, and track the first frames again with the mask.

        Text that stands still places the camera beside the axis, and the wall that it shows there
        agrees with that place for a long time. A film of few frames a second is tracked again with
        a longer patch.
        """
        was_clear = overlay.mask is None
        if overlay.add(image):
            if was_clear and len(self._opening) > 0:
                self._track_again(self._coarsest)
                self._opening.close()
            elif self._lookout is not None:
                self._lookout.mask()
        if self._opening.is_slow(t_s):
            self._track_again(FAR)

    def _track_again(self, coarsest: float) -> None:
        """Track the first frames again, now that more is known of the film."""
        self._start(coarsest)
        for image, t_s in self._opening.frames:
            self._track(image, t_s)

    def _track(self, image: Image, t_s: float) -> Estimate:
        """Estimate the pose in the next frame, (H, W) grey, with what is known of the film."""
        chain, course, before = self._chain, self._chain.course, self._state.pose
        course.clock.tick(t_s)
        image = self._gains.divide_out(image)
        if self._lookout is not None:
            self._aim(self._lookout, image)
        self.rows = self._interlacing(image)
        self._move_zero()
        patch = self._view.rectify(image, self.rows)
        normal = normalise(low_pass(patch))
        skipped = self._skipping(normal, course.step_mm / self._rectify.grid.mm_per_px)
        cleaned = blank(self._blocks, self._dirt.pattern.remove(normal), skipped)
        picture = Picture(cleaned, self._view)
        is_held = self._repeats(patch, self.patch, course)
        is_new = contrast(patch) >= LEAST_CONTRAST and not is_held
        weights = self._dirt.ncc_weights
        fix = self._measure(picture, weights, is_torn=bool(skipped.any())) if is_new else None
        if fix is not None:
            self._repeats.judge(fix.pose, course)
            step = chain.take(fix, picture, may_be_dirt=weights is None)
            self._dirt.learn(normal, fix.alignment.ncc, self._state.pose)
            if not course.is_around:
                chain.waves.take(patch, self._view.valid, fix.pose.x_mm)
        elif is_new and chain.references.keyframe is None:
            step = chain.begin(picture)
            if self._state.pose.x_mm == 0.0 and not self._interlacing.is_certain:
                self._zero.keep(image, self.rows)
        else:
            step = chain.reckon(picture, is_new=is_new)
        self.patch, self._pose_before = patch, before
        return chain.end(t_s, step)

    def _aim(self, lookout: Lookout, image: Image) -> None:
        """Choose the vantage from which the next picture is resampled."""
        course, references = self._chain.course, self._chain.references
        lookout.see(image, course.state, course.clock.period_s)
        if references.keyframe is None or lookout.is_astray:
            course.begin_anew(lookout.begin())
            references.forget()
        if lookout.aim(course.predict(), course.state):
            self._dirt.forget()
            self._skipping.forget()
        self._view = lookout.view

    def _move_zero(self) -> None:
        """Move the zero point if the wrong field of the first picture was read."""
        is_certain, course = self._interlacing.is_certain, self._chain.course
        moved_mm = self._zero.moved_mm(self.rows, self._view, course, is_certain=is_certain)
        if moved_mm is not None:
            for part in (self._chain, self._dirt):
                part.shift(-moved_mm[0], -moved_mm[1])

    @property
    def _state(self) -> State:
        """State at the last frame."""
        return self._chain.course.state
