"""Processes every tracked frame, from a file or from a camera."""

from __future__ import annotations

import pickle
import zlib
from dataclasses import astuple, fields, replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Self

from app.jobs.track.batches import Batch, Evidence, Tie
from app.jobs.track.in_order import InOrder
from app.jobs.track.onlooker import Onlooker, Sight
from app.jobs.track.rows import RowPlan, Rows
from vo_core import Odometry, Rig
from vo_core.geometry.initial_pose import InitialPose
from vo_core.odometry import Traits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import TracebackType

    from app.jobs.track.messages import FrameRange
    from app.jobs.track.parts import Between
    from vo_core.sources import Frame
    from vo_core.track import Estimate

PREVIEW_WIDTH_PX = 960
_SMOOTHED_AT_ONCE = 2000
"""Most rows of a batch of smoothed rows, some 200 bytes each."""


class Follower:
    """Tracks the frames of one run in order and collects the results for the server.

    Poses are found in the thread of the caller, and what else the frames show in a second one, some
    frames behind.  Whatever fails there is raised by one of the next calls.
    """

    def __init__(
        self,
        rig: Rig,
        *,
        start: Estimate | None = None,
        between: Between | None = None,
        preview_width_px: int = PREVIEW_WIDTH_PX,
        frames: FrameRange | None = None,
    ) -> None:
        """Start a run; one that continues another begins at `start`, else at (0, 0, 0).

        Args:
            rig: Camera, mount and pipe.
            start: The last frame of the run before.
            between: The robot's movement since then, if another part of the recording begins.
            preview_width_px: Width of the pictures in the batches.
            frames: The frames of a chunk; None for the whole film.
        """
        self._rig = rig
        known = Traits() if frames is None else Traits(frames.is_coarse, frames.is_noiseless)
        self._odometry = Odometry(rig, known)
        self._onlooker = Onlooker(rig, preview_width_px, is_chunk=frames is not None)
        """Used by the second thread alone, unless it waits."""
        self._behind = InOrder()
        self._rows, self._plan = Rows(start, between), RowPlan(start, between)
        self._frames = frames
        self._ties: list[Tie] = []
        self._estimates: list[Estimate] = []
        self._last: Frame | None = None
        self._is_finished = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._behind.stop()

    def add(self, frame: Frame, skipped: Sequence[tuple[int, float]] = ()) -> None:
        """Track the next frame; `skipped` holds number and time of frames left out before it."""
        # The odometry counts the frames it receives; those of a camera may have gaps.
        estimate = replace(self._odometry.step(frame.image, frame.t_s), frame=frame.index)
        before, in_run = self._rows.place(estimate, skipped)
        self._plan.add(frame.index, skipped)
        if self._frames is not None:
            self._ties.append(self._tie(frame, self._frames))
        self._look(frame, _along(estimate, in_run))
        self._estimates += [*before, in_run]
        self._last = frame

    def begin_part(self, between: Between | None) -> None:
        """Start a new part: the film does not show what the robot did before the next frame."""
        self._behind.wait()
        self._onlooker.begin_part()
        self._rows.begin_part(between)
        self._plan.begin_part(between, self._odometry.smoothed())
        self._odometry = Odometry(self._rig)

    def spare(self, *, paints_wall: bool, picture_every_s: float) -> None:
        """Leave out the unrolled wall, and pictures that come sooner, from now on."""
        self._onlooker.paints_wall = paints_wall
        self._onlooker.picture_every_s = picture_every_s

    def leave_out(self, frames: Sequence[tuple[int, float]]) -> None:
        """Add number and time of frames at the end that the film does not show."""
        self._estimates += self._rows.leave_out(frames)
        self._plan.leave_out(frames)

    def reach(self, frames: FrameRange) -> None:
        """Go on as a chunk of these frames, which begin where its frames begin."""
        self._frames = frames

    def finish(self) -> None:
        """End the run: the next batch holds everything held back, possibly no frame."""
        self._is_finished = True

    def hand_on(self, send: Callable[[Batch], None]) -> None:
        """Have everything since the last call sent, with the newest picture, unless there is
        nothing; `send` is called in the second thread.
        """
        if self._last is None and not self._is_finished:
            return
        batch = Batch(
            self._estimates,
            tilt=self._odometry.tilt,
            initial_pose=self._initial_pose(),
            ties=self._ties,
            start=None if self._frames is None else self._odometry.start,
        )
        last, is_last = self._last, self._is_finished
        self._estimates, self._ties, self._last = [], [], None
        self._behind.do(lambda: send(self._onlooker.completed(batch, last, is_last=is_last)))

    def wait(self) -> None:
        """Wait until everything that was handed on is sent."""
        self._behind.wait()

    def smoothed(self) -> Iterator[Batch]:
        """Return the rows of a run anew, at its end, each by what all frames of its part show.

        All other results are sent before. It takes about a tenth of a millisecond a frame. There
        are none where the run is too long for the memory of the process: its rows stay as they are.
        """
        self._behind.wait()
        try:
            rows = self._plan.rows(self._odometry.smoothed())
        except MemoryError:
            return iter(())
        some = iter(lambda: list(islice(rows, _SMOOTHED_AT_ONCE)), [])
        return (Batch([], smoothed=each) for each in some)

    def evidence(self) -> Evidence:
        """Return what smoothing needs of the frames since the last call."""
        return Evidence(*self._odometry.records.drained())

    def state(self) -> bytes:
        """Return the state needed to resume, once all results are sent that were handed on before;
        `evidence` has returned what belongs to it.
        """
        self._behind.wait()
        return pickle.dumps(self, pickle.HIGHEST_PROTOCOL)

    @classmethod
    def from_state(cls, state: bytes, evidence: bytes | bytearray) -> Self:
        """Resume from a state and all evidence before it; only a tracker may call this.

        Results are the same to the bit: arrays and numbers are stored exactly. See `Checkpoint` for
        the danger of a state.
        """
        follower = pickle.loads(state)  # noqa: S301  (in a process that decodes hostile media)
        assert isinstance(follower, cls)  # noqa: S101  (the stamp fits: the same program made it)
        follower._odometry.records.restore(evidence)
        return follower

    def _initial_pose(self) -> InitialPose | None:
        """Return the initial pose of the run, as the longest part shows it."""
        initial_pose = self._odometry.initial_pose
        start, last = self._rows.start, self._rows.last
        if start is None or last is None or self._rig.mount.view == "down":
            return initial_pose
        if last.frame - start.frame < start.frame:
            return None
        own = {
            each.name: getattr(initial_pose, each.name) - getattr(start, each.name)
            for each in fields(InitialPose)
        }
        return InitialPose(**own)

    def _origin(self) -> InitialPose:
        """Return where the camera stood in the pipe at the pose 0.

        A later chunk begins anywhere on the way of the robot, and its wall is joined to others.
        """
        if self._frames is None or self._frames.first == 0:
            return self._odometry.initial_pose
        return self._odometry.start

    def _tie(self, frame: Frame, frames: FrameRange) -> Tie:
        """Note what the join of chunks needs of a frame that was just tracked."""
        last = frames.end is not None and frame.index >= frames.end - frames.shared
        first = frames.first > 0 and frame.index < frames.first + frames.shared
        picture = (zlib.crc32(frame.image.tobytes()) or 1) if first or last else 0
        odometry = self._odometry
        return Tie(
            frame.index,
            odometry.systematic_mm,
            odometry.bed_mm,
            picture,
            *astuple(odometry.traits),
        )

    def _look(self, frame: Frame, estimate: Estimate) -> None:
        """Have the other results of a tracked frame found."""
        odometry, needs_smoothing = self._odometry, self._onlooker.needs_smoothing
        sight = Sight(
            frame,
            estimate,
            odometry.rows,
            self._origin(),
            odometry.measuring_health(),
            odometry.smoothed,
        )
        self._behind.do(partial(self._onlooker.look, sight))
        if needs_smoothing:
            self._behind.wait()


def _along(estimate: Estimate, in_run: Estimate) -> Estimate:
    """Return the odometry's pose at the distance that it has in the run."""
    return replace(
        estimate,
        x_mm=in_run.x_mm,
        distance_mm=in_run.distance_mm,
        sigma_distance_mm=in_run.sigma_distance_mm,
        sigma_registration_mm=in_run.sigma_registration_mm,
    )
