"""Builds the unrolled wall, one picture of all that a run has shown, during the run.

Every few millimetres a frame is painted onto tiles of the developed wall, each pixel at the place
that the exact pose of the frame gives it. Frames are averaged with weights that favour what the
camera resolves best (`optics`), so that about three frames contribute to each place and no seam
shows. The light that moves with the camera is divided out (`lamp`).
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

import cv2
import numpy as np

from vo_core.geometry.rectify import WHOLE, Rectifier, Rows
from vo_core.image.resample import resample, resample_colour
from vo_core.mosaic.lamp import Lamp, evened
from vo_core.mosaic.layout import UNSEEN_GREY, Layout
from vo_core.mosaic.optics import PEAK, Canvas, Optics
from vo_core.rig import Rig
from vo_core.track import Estimate
from vo_core.types import ByteImage, GrayImage

STEPS_PER_VIEW = 8
"""Frames that are painted while the wall passes through the view."""

FULL = 1.5 * PEAK
"""Sum of weights at which a place is complete; later frames no longer change it."""

WELL_SEEN = 0.02 * PEAK
"""Sum of weights from which a place counts as well seen."""

LEAST_WEIGHT = 1e-6 * PEAK
"""A place with a smaller sum of weights was not seen."""

WEAK = 0.1
"""Factor of the weights of a frame with status `weak`; other frames paint over it."""

JUMP_MM = 1.0
"""The wall continues at another place if the position becomes more uncertain by this at once."""

GAIN_LEAK = 0.1
"""Share by which a frame's gain is pulled towards 1, so that errors of the light add up tenfold at
most."""

OPEN_S = 1.0
"""How often a growing tile is published, in seconds of the video."""

SHELF = 32
"""Number of unfinished tiles that are kept compressed for the robot's return."""

SPARSE = 8
"""Brightness is compared on every 8th pixel in each direction."""


@dataclass(frozen=True)
class Tile:
    """The current picture of one part of the mosaic."""

    index: int
    picture: ByteImage
    """(height_px, width_px, 3) BGR."""
    weight: GrayImage
    """(height_px, width_px) how well each place was seen, 1 completely; 0 where it was not."""


class Mosaic:
    """Paints the frames of a run one after the other; memory does not grow with the run.

    A tile is open while the camera is near it. A tile that was complete when the camera left it
    does not change when the robot returns; a tile with gaps is continued.
    """

    def __init__(self, rig: Rig) -> None:
        grid = Rectifier(rig).grid
        self.layout = layout = Layout.over(rig, grid)
        self._optics = Optics(rig, layout.mm_per_px)
        self._canvas = Canvas(
            rig,
            self._optics,
            (layout.arc_from_mm, layout.arc_to_mm),
            layout.height_px,
            layout.mm_per_px,
        )
        self._lamp = Lamp(self._optics)
        self._step_mm = grid.shape[1] * grid.mm_per_px / STEPS_PER_VIEW
        self._gain = 1.0
        """Gain of the last painted frame against the mosaic."""
        self._last: Estimate | None = None
        """Estimate of the last painted frame."""
        self._published_s = -np.inf
        self._open: dict[int, _Painted] = {}
        self._shelf: OrderedDict[int, _Packed] = OrderedDict()
        self._done: set[int] = set()
        self._left: list[Tile] = []
        """Changed tiles that the camera left since the last call of `changed`."""

    def wants(self, estimate: Estimate) -> bool:
        """Whether `add` would paint a frame with this pose."""
        last = self._last
        if estimate.status == "lost":
            return False
        if last is not None and abs(estimate.distance_mm - last.distance_mm) < self._step_mm:
            return False
        return not self._done.issuperset(self._touched(estimate))

    def add(self, picture: ByteImage, estimate: Estimate, rows: Rows = WHOLE) -> None:
        """Paint a frame if it is wanted.

        Args:
            picture: (H, W) grey or (H, W, 3) BGR, of the rig's size.
            estimate: Its pose in the pipe.
            rows: Rows of the picture that were exposed at that pose.
        """
        if not self.wants(estimate):
            return
        self._turn_to(estimate)
        colour = self._optics.reduce(_alone(rows, picture))
        light = self._lamp.learn(colour)
        positions = self._canvas.positions(estimate.pose)
        weight = resample(light.weight, positions)
        if estimate.status == "weak":
            weight *= np.float32(WEAK)
        pieces = self._pieces(estimate, weight)
        self._gain = self._matched(colour, light.factor, positions, pieces)
        even = evened(colour, light.factor * np.float32(self._gain), light.tint)
        seen = resample_colour(even, positions)
        for piece in pieces:
            piece.tile.blend(piece.here, seen[:, piece.there], piece.weight)

    def changed(self) -> list[Tile]:
        """Return the tiles changed since the last call, growing ones only every `OPEN_S`."""
        tiles = self.left()
        now_s = self._last.time_s if self._last is not None else 0.0
        if not self._published_s <= now_s < self._published_s + OPEN_S:
            self._published_s = now_s
            tiles += [tile.published(k) for k, tile in self._open.items() if tile.is_changed]
        return tiles

    def left(self) -> list[Tile]:
        """Return the changed tiles that the camera has left since the last call."""
        tiles, self._left = self._left, []
        return tiles

    def finish(self) -> list[Tile]:
        """End the run, and return the tiles that changed since the last call."""
        for k in list(self._open):
            self._leave(k)
        return self.changed()

    def _touched(self, estimate: Estimate) -> range:
        """Indices of the tiles under the canvas of a frame."""
        first = self._canvas.first_column(estimate.distance_mm)
        width = self.layout.width_px
        return range(first // width, (first + self._canvas.columns - 1) // width + 1)

    def _turn_to(self, estimate: Estimate) -> None:
        """Close the tiles that are out of view, and open those under the frame."""
        last = self._last
        if last is not None and estimate.variance_since(last) > JUMP_MM**2:
            for tile in self._open.values():
                tile.freeze()
        self._last = estimate
        touched = self._touched(estimate)
        for k in [k for k in self._open if not touched.start - 1 <= k <= touched.stop]:
            self._leave(k)
        for k in touched:
            if k not in self._open and k not in self._done:
                packed = self._shelf.pop(k, None)
                self._open[k] = _Painted.empty(self.layout) if packed is None else packed.unpack()

    def _leave(self, k: int) -> None:
        tile = self._open.pop(k)
        if tile.is_changed:
            self._left.append(tile.published(k))
        if tile.is_whole():
            self._done.add(k)
            return
        self._shelf[k] = _Packed.of(tile)
        while len(self._shelf) > SHELF:
            self._done.add(self._shelf.popitem(last=False)[0])

    def _pieces(self, estimate: Estimate, weight: GrayImage) -> list[_Piece]:
        """Divide the canvas among the open tiles under it."""
        first, width = self._canvas.first_column(estimate.distance_mm), self.layout.width_px
        pieces = []
        for k in self._touched(estimate):
            if (tile := self._open.get(k)) is not None:
                begin = max(first, k * width)
                end = min(first + self._canvas.columns, (k + 1) * width)
                there = slice(begin - first, end - first)
                here = slice(begin - k * width, end - k * width)
                pieces.append(_Piece(tile, here, there, weight[:, there]))
        return pieces

    def _matched(
        self, colour: ByteImage, factor: GrayImage, positions: GrayImage, pieces: list[_Piece]
    ) -> float:
        """Gain that matches the brightness of a frame to the mosaic, as the lamp may flicker.

        It is pulled a little towards 1, so that the gain does not drift from frame to frame.
        """
        lit = np.asarray(colour[..., 0] * factor, np.float32)
        painted = coming = 0.0
        for piece in pieces:
            there = piece.there.start + np.arange(0, piece.weight.shape[1], SPARSE)
            here = there - piece.there.start + piece.here.start
            few = np.ascontiguousarray(positions[::SPARSE, there])
            both = piece.tile.weight[::SPARSE, here] * piece.weight[::SPARSE, ::SPARSE]
            painted += float((both * piece.tile.colour[::SPARSE, here, 0]).sum())
            coming += float((both * resample(lit, few)).sum())
        if not (painted and coming):
            return self._gain
        return float(np.clip(painted / coming, 0.3, 3.0) ** (1 - GAIN_LEAK))


@dataclass(frozen=True)
class _Piece:
    """A part of a frame that falls on one tile."""

    tile: _Painted
    here: slice
    """Columns of the tile."""
    there: slice
    """Columns of the canvas."""
    weight: GrayImage
    """Weights of these columns."""


@dataclass
class _Painted:
    """A tile in progress: weighted mean of the frames, and the sum of their weights."""

    colour: ByteImage
    """(height_px, width_px, 3) Y Cr Cb."""
    weight: GrayImage
    is_changed: bool = field(default=False)

    @classmethod
    def empty(cls, layout: Layout) -> _Painted:
        shape = (layout.height_px, layout.width_px)
        return cls(np.full((*shape, 3), 128, np.uint8), np.zeros(shape, np.float32))

    def blend(self, here: slice, new: ByteImage, new_weight: GrayImage) -> None:
        """Blend new columns into the tile."""
        weight = self.weight[:, here]
        share = new_weight * (1 - weight / np.float32(FULL))
        self.colour[:, here] = cv2.blendLinear(self.colour[:, here], new, weight, share)
        weight += share
        self.is_changed = True

    def freeze(self) -> None:
        """Keep what is painted, except for its thin borders."""
        self.weight = np.asarray(FULL * np.minimum(self.weight / WELL_SEEN, 1), np.float32)

    def is_whole(self) -> bool:
        """Whether the tile was well seen along its whole length."""
        return bool((self.weight.max(axis=0) > WELL_SEEN).all())

    def published(self, index: int) -> Tile:
        """Return the current picture as tile `index`, and mark it as published."""
        self.is_changed = False
        shown = cv2.cvtColor(self.colour, cv2.COLOR_YCrCb2BGR)
        seen = (self.weight >= LEAST_WEIGHT).astype(np.uint8)
        picture = cv2.copyTo(shown, seen, np.full_like(shown, UNSEEN_GREY))
        weight = self.weight * (seen / np.float32(FULL))
        return Tile(index, np.asarray(picture, np.uint8), np.asarray(weight, np.float32))


@dataclass(frozen=True)
class _Packed:
    """A tile with gaps, compressed until the robot returns."""

    colour: ByteImage
    weight: ByteImage

    @classmethod
    def of(cls, tile: _Painted) -> _Packed:
        tile.freeze()
        level = np.rint(tile.weight * (255 / FULL)).astype(np.uint8)
        fast = [cv2.IMWRITE_PNG_COMPRESSION, 1]
        _, colour = cv2.imencode(".png", tile.colour, fast)
        _, weight = cv2.imencode(".png", level, fast)
        return cls(np.asarray(colour, np.uint8), np.asarray(weight, np.uint8))

    def unpack(self) -> _Painted:
        colour = np.asarray(cv2.imdecode(self.colour, cv2.IMREAD_COLOR), np.uint8)
        level = np.asarray(cv2.imdecode(self.weight, cv2.IMREAD_GRAYSCALE), np.float32)
        return _Painted(colour, level * np.float32(FULL / 255))


def _alone(rows: Rows, picture: ByteImage) -> ByteImage:
    """Interpolate the other rows of a picture from these rows."""
    if rows == WHOLE:
        return picture
    shown = rows.of(picture)
    place = np.clip((np.arange(len(picture)) - rows.first) / rows.step, 0, len(shown) - 1)
    above, below = shown[np.floor(place).astype(int)], shown[np.ceil(place).astype(int)]
    return np.asarray(cv2.addWeighted(above, 0.5, below, 0.5, 0.0), np.uint8)
