"""Processes every tracked frame, from a file or from a camera."""

from __future__ import annotations

import pickle
import zlib
from dataclasses import astuple, fields, replace
from itertools import islice
from typing import TYPE_CHECKING, Self

import cv2

from app.jobs.track.batches import Batch, Evidence, Tie, WallPicture
from app.jobs.track.rows import RowPlan, Rows
from vo_core import Odometry, Rig
from vo_core.geometry.stance import Stance
from vo_core.image.health import Health
from vo_core.joints.finder import JointFinder
from vo_core.mosaic.layers import png_of
from vo_core.mosaic.mosaic import Mosaic
from vo_core.odometry import Traits

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from app.jobs.track.messages import FrameRange
    from app.jobs.track.parts import Between
    from vo_core.joints.sightings import Sighting
    from vo_core.sources import Frame
    from vo_core.track import Estimate
    from vo_core.types import ByteImage

PREVIEW_WIDTH_PX = 960
PREVIEW_JPEG_QUALITY = 72
WALL_JPEG_QUALITY = 85
_SMOOTHED_AT_ONCE = 2000
"""Most rows of a batch of smoothed rows, some 200 bytes each."""


class Follower:
    """Tracks the frames of one run in order and collects the results for the server."""

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
        self._joints = JointFinder(rig)
        self._wall = Mosaic(rig)
        self._rows, self._plan = Rows(start, between), RowPlan(start, between)
        self._preview_width_px = preview_width_px
        self._frames = frames
        self._ties: list[Tie] = []
        self._sightings: list[Sighting] = []
        self._estimates: list[Estimate] = []
        self._health: list[tuple[int, Health]] = []
        self._last: Frame | None = None
        self._is_finished = False

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
        self._joints.finish()
        self._sightings += self._joints.take()
        self._rows.begin_part(between)
        self._plan.begin_part(between, self._odometry.smoothed())
        self._odometry, self._joints = Odometry(self._rig), JointFinder(self._rig)

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

    def batch(self) -> Batch | None:
        """Return everything since the last batch, with the newest picture; None if there is
        nothing.
        """
        if self._last is None and not self._is_finished:
            return None
        tiles, layers = self._wall_pictures()
        if self._is_finished:
            self._joints.finish()
        jpeg = b"" if self._last is None else _preview(self._last, self._preview_width_px)
        batch = Batch(
            self._estimates,
            jpeg,
            health=self._health,
            tiles=tiles,
            sightings=[*self._sightings, *self._joints.take()],
            tilt=self._odometry.tilt,
            stance=self._stance(),
            ties=self._ties,
            start=None if self._frames is None else self._odometry.start,
            layers=layers,
        )
        self._estimates, self._health, self._ties, self._last = [], [], [], None
        self._sightings = []
        return batch

    def smoothed(self) -> Iterator[Batch]:
        """Return the rows of a run anew, at its end, each by what all frames of its part show.

        It takes about a tenth of a millisecond a frame. There are none where the run is too long
        for the memory of the process: its rows stay as they are.
        """
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
        """Return the state needed to resume, after `batch` has returned all results, and `evidence`
        what belongs to it.
        """
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

    def _stance(self) -> Stance | None:
        """Return the stance of the run, as the longest part shows it."""
        stance = self._odometry.stance
        start, last = self._rows.start, self._rows.last
        if start is None or last is None or self._rig.mount.view == "down":
            return stance
        if last.frame - start.frame < start.frame:
            return None
        own = {
            each.name: getattr(stance, each.name) - getattr(start, each.name)
            for each in fields(Stance)
        }
        return Stance(**own)

    def _origin(self) -> Stance:
        """Return where the camera stood in the pipe at the pose 0.

        A later chunk begins anywhere on the way of the robot, and its wall is joined to others.
        """
        if self._frames is None or self._frames.first == 0:
            return self._odometry.stance
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

    def _wall_pictures(self) -> tuple[list[WallPicture], list[WallPicture]]:
        """Return the changed tiles; for a chunk those that it has left."""
        if self._frames is None:
            tiles = self._wall.finish() if self._is_finished else self._wall.changed()
            return [wall_tile(tile.index, tile.picture) for tile in tiles], []
        left = self._wall.finish() if self._is_finished else self._wall.left()
        return [], [WallPicture(tile.index, png_of(tile)) for tile in left]

    def _look(self, frame: Frame, estimate: Estimate) -> None:
        """Collect the other results of a tracked frame."""
        health = Health(*(round(each, 4) for each in astuple(self._odometry.measure_health())))
        self._health.append((estimate.frame, health))
        odometry, origin = self._odometry, self._origin()
        rows = odometry.rows
        self._joints.add(frame.image, estimate, rows, stance=origin, smoothed=odometry.smoothed)
        in_pipe = origin.added_to(estimate)
        if self._wall.wants(in_pipe):
            self._wall.add(frame.to_bgr(), in_pipe, rows)


def _along(estimate: Estimate, in_run: Estimate) -> Estimate:
    """Return the odometry's pose at the distance that it has in the run."""
    return replace(
        estimate,
        x_mm=in_run.x_mm,
        distance_mm=in_run.distance_mm,
        sigma_distance_mm=in_run.sigma_distance_mm,
        sigma_registration_mm=in_run.sigma_registration_mm,
    )


def wall_tile(index: int, picture: ByteImage) -> WallPicture:
    """Encode a tile of the unrolled wall, (height, width, 3) BGR."""
    quality = [cv2.IMWRITE_JPEG_QUALITY, WALL_JPEG_QUALITY]
    _, jpeg = cv2.imencode(".jpg", picture, quality)
    return WallPicture(index, jpeg.tobytes())


def _preview(frame: Frame, width_px: int) -> bytes:
    picture = frame.to_square_bgr()
    height, width = picture.shape[:2]
    scale = min(1.0, width_px / width)
    size_wh = (round(width * scale), round(height * scale))
    small = cv2.resize(picture, size_wh, interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, PREVIEW_JPEG_QUALITY])
    return jpeg.tobytes()
