"""Detects pipe joints: dark or bright rings on the developed wall, while a video is tracked.

Every few millimetres a frame is added to strips of the wall, each pixel at the place that the exact
pose of the frame gives it. There a joint is a straight line at one axial coordinate, for any yaw
and lateral offset of the robot. The arc is divided into sectors, each with its own profile (see
`rings`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace

import cv2
import numpy as np

from vo_core.geometry.height import scale_sigma
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.geometry.rectify import WHOLE, Rectifier, Rows
from vo_core.geometry.wall import NOMINAL, Pose, cast, develop, enclose, sight
from vo_core.geometry.waves import Waves
from vo_core.joints.rings import find_rings
from vo_core.joints.sightings import CREST_EVERY_MM, SAME_JOINT_MM, Sighting
from vo_core.matching.blocks import BlockGrid
from vo_core.rig import Rig
from vo_core.track import Estimate
from vo_core.types import GrayImage, Image, Matrix

HELD_DIAMETERS = 3.0
"""Way, in diameters, after which a camera that looks along the pipe knows where it stands in it.

Until then the pose changes by some mm and degrees from frame to frame, which would smear rings."""

SECTORS = 16
"""Number of sectors of the visible arc; each has its own profile."""

RING_WIDTHS_MM = (1.5, 3.0, 6.0, 12.0)
"""Sigmas of the ring filters, for gaps of 3 mm to bands of mortar of 30 mm."""

MISPLACED_MM = 3.0
"""A frame whose position relative to the strips is more uncertain than this, one sigma, starts new
strips; a smaller uncertainty only widens a ring."""

STRIP_BINS = 2048
"""Columns of a strip of wall; only a few strips are held at a time."""

WAVES = (0.3, 0.99, 8.0)
"""Least share of the wall's brightness, least probability and least number of the waves whose
crests are noted: a corrugated wall has a share of 0.5 to 0.9, others up to 0.2."""

_ASIDE = tuple(field.name for field in fields(InitialPose))

_STEPS_PER_VIEW = 8
"""Frames that are added to the wall while it passes through the view."""

_NODE_PX = 8
"""Places on the wall are computed at every 8th pixel, and interpolated between."""


class JointFinder:
    """Detects rings and waves in the frames of a run, one after the other.

    Memory does not grow with the run.
    Strips of wall that the camera has left are searched and dropped, so a ring that is passed again
    gives a new sighting.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._scale_sigma = scale_sigma(rig)
        self._rectify = Rectifier(rig)
        grid = self._rectify.grid
        self._bin_mm = grid.mm_per_px
        rows, columns = grid.shape
        self._pooled = max(1, rows // (4 * SECTORS))
        y = (np.arange(rows // self._pooled) + 0.5) * self._pooled - 0.5
        xy = np.stack(np.meshgrid(np.arange(columns), y), -1)
        valid = cv2.erode(self._rectify.valid, np.ones((self._pooled, 1), np.uint8))
        self._valid = valid[y.astype(int)] > 0
        self._wall_mm = grid.to_mm(xy).astype(np.float32)
        """(rows, columns, 2) axial and arc coordinate of each pooled pixel, from the usual pose."""
        self._blocks = BlockGrid(-(-len(y) // _NODE_PX), -(-columns // _NODE_PX), _NODE_PX, 0, 0)
        column, row = self._blocks.nodes().T
        nodes = np.stack([column, (row + 0.5) * self._pooled - 0.5], 1)
        self._nodes_mm = grid.to_mm(nodes)
        self._rays = sight(rig, NOMINAL, enclose(rig, self._nodes_mm))
        self._arc_mm = grid.arc_mm + np.array([-0.5, rows - 0.5]) * grid.mm_per_px
        self._middle_mm = grid.axial_mm + columns / 2 * grid.mm_per_px
        self._step_mm = columns * grid.mm_per_px / _STEPS_PER_VIEW
        self._last: Estimate | None = None
        """Estimate of the last frame that was added."""
        self._was_unsure = False
        """Whether the wall was not surely recognised since."""
        self._initial_pose = AS_STATED
        self._frames = 0
        self._smoothed: Callable[[], Sequence[Estimate]] | None = None
        self._held: list[tuple[int, GrayImage, Estimate]] | None = None
        """The first frames of a camera that looks along the pipe, with their numbers."""
        if rig.looks_along_pipe:
            self._held = []
        self._waves = Waves(rig, grid)
        self._crest_mm: float | None = None
        """Distance of the camera at the last sighting of a crest, or where the wall began."""
        self._strips: dict[int, _Strip] = {}
        self._open: set[int] = set()
        """Strips not searched yet; other strips are kept only as their neighbours."""
        self._places_mm: dict[int, list[float]] = {}
        """Rings found in the strips that are kept."""
        self._found: list[Sighting] = []
        self._taken = 0

    def add(
        self,
        image: Image,
        estimate: Estimate,
        rows: Rows = WHOLE,
        *,
        initial_pose: InitialPose = AS_STATED,
        smoothed: Callable[[], Sequence[Estimate]] | None = None,
    ) -> None:
        """Add a frame, in the order of the video; also one without a lock.

        Args:
            image: (H, W) or (H, W, 3), of the rig's size.
            estimate: Its pose, against the first frame.
            rows: Rows of the picture that were exposed at that pose.
            initial_pose: Pose of the camera in the pipe at the first frame, as it is known by now.
            smoothed: `Odometry.smoothed`: the estimates of all frames so far, by all of them.
        Raises:
            ShapeMismatch: The size of the image is not the one that the rig states.
        """
        last, self._initial_pose = self._last, initial_pose
        self._smoothed = smoothed if self._held is not None else None
        self._frames += 1
        self._was_unsure |= estimate.status != "ok"
        if estimate.status == "lost":
            return
        if last is not None:
            if abs(estimate.distance_mm - last.distance_mm) < self._step_mm:
                return
            # What keeps its sign along the way also adds to the variance, but displaces nothing.
            if self._was_unsure and estimate.variance_since(last) > MISPLACED_MM**2:
                self._release()
                self._close(self._open)  # after a loss the wall continues at another place
                self._waves, self._crest_mm = Waves(self._rig, self._rectify.grid), None
        self._was_unsure = False
        patch = self._rectify(image, rows)
        self._add(self._pooled_of(patch), estimate)
        if not estimate.looking_around:
            self._waves.take(patch, self._rectify.valid, estimate.distance_mm)
            self._note_crest(estimate)
        self._last = estimate

    @property
    def holds(self) -> bool:
        """Whether frames are held until the camera's place in the pipe is known, by `smoothed`."""
        return self._held is not None

    def take(self) -> list[Sighting]:
        """Return the sightings since the last call, on wall that the camera has left."""
        found, self._taken = self._found[self._taken :], len(self._found)
        return found

    def finish(self) -> list[Sighting]:
        """Search the rest, and return all sightings in the order of their frames."""
        self._release()
        self._close(self._open)
        return sorted(self._found, key=lambda sighting: sighting.frame)

    def _pooled_of(self, patch: GrayImage) -> GrayImage:
        """Reduce a patch around the pipe, without lamp, vignette and gain."""
        columns = patch.shape[1]
        rows = patch.shape[0] // self._pooled
        relative = _relative(patch)[: rows * self._pooled]
        pooled = cv2.resize(relative, (columns, rows), interpolation=cv2.INTER_AREA)
        return np.asarray(pooled, np.float32)

    def _add(self, pooled: GrayImage, estimate: Estimate) -> None:
        """Add a frame to the wall, or hold it until the camera's place in the pipe is known."""
        if self._held is None:
            self._spread(pooled, estimate)
            return
        self._held.append((self._frames - 1, pooled, estimate))
        way_mm = abs(estimate.distance_mm - self._held[0][2].distance_mm)
        if way_mm > HELD_DIAMETERS * (self._rig.pipe.diameter_mm or 0.0):
            self._release()

    def _release(self) -> None:
        """Add the frames that are held, beside the axis and turned as all of them show."""
        held, self._held = self._held, None
        if not held:
            return
        known = [] if self._smoothed is None else self._smoothed()
        for number, pooled, estimate in held:
            if number < len(known):
                turns = {name: getattr(known[number], name) for name in _ASIDE}
                estimate = replace(estimate, **turns)
            self._spread(pooled, estimate)

    def _spread(self, pooled: GrayImage, estimate: Estimate) -> None:
        """Add each pixel of a reduced patch to the strips at its place on the wall."""
        # Axial coordinates are taken from the camera, to keep their precision far into a pipe.
        pose = replace(self._initial_pose.added_to(estimate).pose, x_mm=0.0)
        axial, arc = np.moveaxis(self._places_from(pose), -1, 0)
        low_mm, high_mm = self._arc_mm
        sector = np.floor((arc - low_mm) / (high_mm - low_mm) * SECTORS)
        inside = self._valid & (sector >= 0) & (sector < SECTORS)
        if not inside.any():
            return
        from_zero_mm = axial[inside].astype(np.float64) + estimate.distance_mm
        bins = np.floor(from_zero_mm / self._bin_mm).astype(np.int64)
        first, last = int(bins.min()), int(bins.max())
        width = last - first + 1
        cell = sector[inside].astype(np.int64) * width + bins - first
        total, count = (
            np.asarray(np.bincount(cell, weights, SECTORS * width), np.float64).reshape(-1, width)
            for weights in (pooled[inside], None)
        )
        touched = range(first // STRIP_BINS, last // STRIP_BINS + 1)
        self._close({k for k in self._open if k < touched.start - 1 or k >= touched.stop + 1})
        for k in touched:
            if k not in self._open:
                self._strips[k] = _Strip()
                self._open.add(k)
            middle = (estimate.distance_mm + self._middle_mm) / self._bin_mm
            self._strips[k].add(
                total, count, estimate, first - k * STRIP_BINS, middle - k * STRIP_BINS
            )

    def _note_crest(self, estimate: Estimate) -> None:
        """Note the crest nearest to the middle of the seen wall, if it is certainly one of many."""
        wave, at_mm = self._waves.wave, estimate.distance_mm
        if self._crest_mm is None:
            self._crest_mm = at_mm
        share, probability, count = WAVES
        is_sure = (
            wave is not None
            and wave.share > share
            and wave.probability > probability
            and wave.length_mm > count * wave.pitch_mm
        )
        if wave is None or not is_sure or abs(at_mm - self._crest_mm) < CREST_EVERY_MM:
            return
        self._crest_mm = at_mm
        ahead_mm = wave.crest_mm - at_mm
        self._found.append(
            Sighting(estimate.frame, ahead_mm, wave.sigma_mm, wave.share, wave.pitch_mm)
        )

    def _places_from(self, pose: Pose) -> GrayImage:
        """(rows, columns, 2) axial and arc coordinate of each pooled pixel seen from a pose."""
        moved = develop(self._rig, cast(self._rig, pose, self._rays)) - self._nodes_mm
        if self._rig.pipe.radius_mm is not None:
            around_mm = 2 * np.pi * self._rig.pipe.radius_mm
            moved[:, 1] -= around_mm * np.rint(moved[:, 1] / around_mm)  # the arc ends at the crown
        rows, columns = self._valid.shape
        places = self._wall_mm + self._blocks.dense(moved)[:rows, :columns]
        blind = np.isnan(moved).any(1)
        if blind.any():  # no interpolation between a place on the wall and none
            near_blind = self._blocks.dense(np.column_stack([blind, blind]).astype(np.float64))
            places[near_blind[:rows, :columns, 0] > 0] = np.nan
        if self._rig.pipe.radius_mm is not None:
            places[..., 1] -= around_mm * np.rint(places[..., 1] / around_mm)
        return places

    def _close(self, leaving: set[int]) -> None:
        """Search complete strips, and drop those that are no longer needed as neighbours."""
        for k in sorted(leaving):
            beside = [self._strips.get(k + i, _EMPTY) for i in (-1, 0, 1)]
            total = np.hstack([strip.total for strip in beside])
            count = np.hstack([strip.count for strip in beside])
            for ring in find_rings(total, count, [w / self._bin_mm for w in RING_WIDTHS_MM]):
                column = ring.at_px - STRIP_BINS
                at_mm = (k * STRIP_BINS + column) * self._bin_mm
                # A ring on the border of two strips may be found in both.
                beside_mm = [at for i in (-1, 1) for at in self._places_mm.get(k + i, ())]
                is_known = any(abs(at_mm - at) < SAME_JOINT_MM for at in beside_mm)
                if 0 <= column < STRIP_BINS and not is_known:
                    self._places_mm.setdefault(k, []).append(at_mm)
                    frame, camera_mm = self._strips[k].seen_from(int(column))
                    ahead_mm = at_mm - camera_mm
                    # Where the rig is wrong, places away from the middle have another scale.
                    off_mm = self._scale_sigma * (ahead_mm - self._middle_mm)
                    sigma_mm = float(np.hypot(ring.sigma_px * self._bin_mm, off_mm))
                    self._found.append(Sighting(frame, ahead_mm, sigma_mm, ring.contrast))
        self._open = self._open - leaving
        needed = {k + i for k in self._open for i in (-1, 0, 1)}
        self._strips = {k: strip for k, strip in self._strips.items() if k in needed}
        self._places_mm = {k: at for k, at in self._places_mm.items() if k in needed}


class _Strip:
    """A piece of wall: sums and counts of relative brightness, sector by column."""

    def __init__(self) -> None:
        self.total = np.zeros((SECTORS, STRIP_BINS), np.float32)
        self.count = np.zeros((SECTORS, STRIP_BINS), np.float32)
        self._off = np.full(STRIP_BINS, np.inf)
        self._frame = np.zeros(STRIP_BINS, np.int64)
        self._camera_mm = np.zeros(STRIP_BINS)

    def add(
        self, total: Matrix, count: Matrix, estimate: Estimate, first: int, middle: float
    ) -> None:
        """Add what lies in the strip; `first` and the view's `middle` are its columns."""
        begin, end = max(first, 0), min(first + total.shape[1], STRIP_BINS)
        here, there = slice(begin, end), slice(begin - first, end - first)
        self.total[:, here] += total[:, there]
        self.count[:, here] += count[:, there]
        off = np.abs(np.arange(begin, end) - middle)
        nearer = begin + np.flatnonzero(off < self._off[here])
        self._off[nearer] = off[nearer - begin]
        self._frame[nearer] = estimate.frame
        self._camera_mm[nearer] = estimate.distance_mm

    def seen_from(self, column: int) -> tuple[int, float]:
        """Frame and camera distance at which a column was nearest to the middle of the view."""
        return int(self._frame[column]), float(self._camera_mm[column])


_EMPTY = _Strip()


def _relative(patch: GrayImage) -> GrayImage:
    """Divide by the brightness of the surroundings, which removes lamp, vignette and gain."""
    height, width = patch.shape
    small_wh = (max(width // 8, 1), max(height // 8, 1))
    small = cv2.resize(patch, small_wh, interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), max(small_wh) / 6, borderType=cv2.BORDER_REPLICATE)
    around = cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(patch / np.maximum(around, 1.0), np.float32)
