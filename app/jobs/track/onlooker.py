"""Finds what frames show beside their poses: joints, the unrolled wall, how good they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING

import cv2
import msgspec

from app.jobs.track.batches import Batch, WallPicture
from vo_core.image.health import Health
from vo_core.joints.finder import JointFinder
from vo_core.mosaic.layers import png_of
from vo_core.mosaic.mosaic import Mosaic

if TYPE_CHECKING:
    from vo_core import Estimate, Rig
    from vo_core.geometry.initial_pose import InitialPose
    from vo_core.geometry.rectify import Rows
    from vo_core.joints.sightings import Sighting
    from vo_core.sources import Frame
    from vo_core.types import ByteImage

PREVIEW_JPEG_QUALITY = 72
WALL_JPEG_QUALITY = 85


@dataclass(frozen=True)
class Sight:
    """A tracked frame, with what the odometry knew after it."""

    frame: Frame
    estimate: Estimate
    """The odometry's pose at the distance that it has in the run."""
    rows: Rows
    """Rows of the picture that were exposed at that pose."""
    origin: InitialPose
    """Where the camera stood in the pipe at the pose 0."""
    measure_health: Callable[[], Health]
    smoothed: Callable[[], Sequence[Estimate]]
    """Of the odometry, which must stand still meanwhile: see `Onlooker.needs_smoothing`."""


class Onlooker:
    """Looks at the frames of one run in order; the odometry may be some frames ahead."""

    def __init__(self, rig: Rig, preview_width_px: int, *, is_chunk: bool) -> None:
        self._rig = rig
        self._preview_width_px = preview_width_px
        self._is_chunk = is_chunk
        self._joints = JointFinder(rig)
        self._wall = Mosaic(rig)
        self._sightings: list[Sighting] = []
        self._health: list[tuple[int, Health]] = []
        self._shown_s = -math.inf
        """Time of the frame whose picture was sent last."""
        self.paints_wall = True
        self.picture_every_s = 0.0
        """Least time between two frames whose pictures are sent."""

    @property
    def needs_smoothing(self) -> bool:
        """Whether the next look may call `Sight.smoothed`."""
        return self._joints.holds

    def look(self, at: Sight) -> None:
        """Look at the next frame."""
        frame, estimate = at.frame, at.estimate
        health = Health(*(round(each, 4) for each in astuple(at.measure_health())))
        self._health.append((estimate.frame, health))
        self._joints.add(
            frame.image, estimate, at.rows, initial_pose=at.origin, smoothed=at.smoothed
        )
        in_pipe = at.origin.added_to(estimate)
        if self.paints_wall and self._wall.wants(in_pipe):
            self._wall.add(frame.to_bgr(), in_pipe, at.rows)

    def begin_part(self) -> None:
        """Begin another part: no joint goes on."""
        self._joints.finish()
        self._sightings += self._joints.take()
        self._joints = JointFinder(self._rig)

    def completed(self, batch: Batch, last: Frame | None, *, is_last: bool) -> Batch:
        """Add everything since the last batch to a batch, with the picture of its last frame.

        The last batch of a run gets what is held back until then.
        """
        tiles, layers = self._wall_pictures(is_last=is_last)
        if is_last:
            self._joints.finish()
        health, self._health = self._health, []
        sightings, self._sightings = [*self._sightings, *self._joints.take()], []
        jpeg = b""
        if last is not None and last.t_s >= self._shown_s + self.picture_every_s:
            jpeg, self._shown_s = _preview(last, self._preview_width_px), last.t_s
        return msgspec.structs.replace(
            batch,
            jpeg=jpeg,
            health=health,
            sightings=sightings,
            tiles=tiles,
            layers=layers,
        )

    def _wall_pictures(self, *, is_last: bool) -> tuple[list[WallPicture], list[WallPicture]]:
        """Return the changed tiles; for a chunk those that it has left."""
        if not self._is_chunk:
            tiles = self._wall.finish() if is_last else self._wall.changed()
            return [wall_tile(tile.index, tile.picture) for tile in tiles], []
        left = self._wall.finish() if is_last else self._wall.left()
        return [], [WallPicture(tile.index, png_of(tile)) for tile in left]


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
