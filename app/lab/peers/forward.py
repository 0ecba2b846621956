"""Peers for a camera that looks along the pipe.

An essential matrix gives the rotation and the direction of a step, never its length.  These peers
are given the true length of every step, so that only their directions and rotations are tested; no
crew has such a peer.  Joint counting knows only the length of a pipe segment.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from app.lab.evaluation import Truth
from app.lab.peers.features import LEAST_MATCHES, Matches, OrbMatcher, klt_matches
from vo_core.errors import InvalidRig
from vo_core.geometry.wall import (
    NOMINAL,
    enclose,
    pixel_rays,
    robot_pixels,
    rotation_robot_camera,
    sight,
)
from vo_core.image.resample import to_grey
from vo_core.rig import Rig
from vo_core.track import Estimate, Track
from vo_core.types import Image, Matrix

LEAST_FLOW_PX = 0.5
"""If the matches move less than this (median), the camera stands; without this rule a standing
camera would turn at random."""

_THRESHOLD_PX = 1.0
"""Largest distance of an inlier from its epipolar line."""

_FARTHEST_STEPS = 1e5
"""Points farther away than so many steps do not decide which of the four motions is the right one.

OpenCV's default of 50 leaves out all of the wall when a step is short, and then the camera
turns upside down at random."""

_LEAST_AHEAD = 0.2
"""Rays with a smaller part along the optical axis are left out; a pinhole sees none of them."""

Motion = tuple[Matrix, Matrix]
"""(3, 3) R and (3,) t with x_now = R x_before + s t, where only the sign of the length s is known;
t has the length 1, or 0 for a standing camera."""

_STANDING: Motion = np.eye(3), np.zeros(3)


class ForwardPeer(ABC):
    """A method whose track needs the whole film.

    Raises:
        InvalidRig: The camera does not look along the pipe.
    """

    def __init__(self, rig: Rig) -> None:
        if rig.mount.view != "forward":
            raise InvalidRig("mount.view: this method needs a camera that looks along the pipe.")
        self._frame = 0

    @abstractmethod
    def step(self, image: Image, t_s: float) -> Estimate:
        """Look at the next frame; its distance is known only at the end."""

    @abstractmethod
    def finish(self, track: Track, truth: Truth) -> Track:
        """Give the distances to the track of all steps."""

    def _estimate(
        self, t_s: float, position: Matrix, attitude: Matrix, *, is_lost: bool
    ) -> Estimate:
        """State (3,) position and (3, 3) attitude R_z(yaw) R_y(pitch) R_x(roll)."""
        x, y, z = position.tolist()
        yaw, pitch, roll = np.degrees(
            [
                np.arctan2(attitude[1, 0], attitude[0, 0]),
                -np.arcsin(np.clip(attitude[2, 0], -1, 1)),
                np.arctan2(attitude[2, 1], attitude[2, 2]),
            ]
        ).tolist()
        self._frame += 1
        return Estimate(
            frame=self._frame - 1,
            time_s=t_s,
            x_mm=x,
            y_mm=y,
            yaw_deg=yaw,
            distance_mm=x,
            sigma_distance_mm=0.0,
            quality=0.0 if is_lost else 1.0,
            status="lost" if is_lost else "ok",
            sigma_registration_mm=0.0,
            z_mm=z,
            pitch_deg=pitch,
            roll_deg=roll,
        )


class EssentialMatrix(ForwardPeer):
    """Chains rotation and direction between consecutive frames, by the five-point algorithm.

    The contrast is equalised locally, because the wall is dim.  The matches are undistorted with
    the lens that the rig states.
    """

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self._camera = rig.camera
        self._robot_camera = rotation_robot_camera(rig.mount)
        self._equaliser = cv2.createCLAHE(4.0, (8, 8))
        self._before: Image | None = None
        self._position = np.zeros(3)
        self._start_camera = self._robot_camera

    @abstractmethod
    def matches(self, before: Image, now: Image) -> Matches:
        """Match points of two (H, W) pictures."""

    def step(self, image: Image, t_s: float) -> Estimate:
        """Chain a step of length 1, or 0 for a standing camera; `lost` if there is none."""
        now = self._equaliser.apply(to_grey(image))
        motion: Motion | None = _STANDING
        if self._before is not None:
            motion = self._motion(*self.matches(self._before, now))
        turn, direction = motion or _STANDING
        # x_now = R x_before + t, so the camera has moved by -R^T t in the axes before.
        self._position = self._position - self._start_camera @ turn.T @ direction
        self._start_camera = self._start_camera @ turn.T
        self._before = now
        attitude = self._start_camera @ self._robot_camera.T
        return self._estimate(t_s, self._position, attitude, is_lost=motion is None)

    def finish(self, track: Track, truth: Truth) -> Track:
        """Give each step its true length."""
        steps = np.diff([track.x_mm, track.y_mm, track.z_mm])
        true = [truth.x_mm, truth.y_mm, np.zeros(len(truth)) if truth.z_mm is None else truth.z_mm]
        steps = steps * np.linalg.norm(np.diff(true), axis=0)
        x_mm, y_mm, z_mm = np.cumsum(np.pad(steps, ((0, 0), (1, 0))), axis=1)
        return replace(track, x_mm=x_mm, distance_mm=x_mm, y_mm=y_mm, z_mm=z_mm)

    def _motion(self, before_px: Matrix, now_px: Matrix) -> Motion | None:
        """Rotation and direction; None with too few matches."""
        if not len(before_px):
            return None
        if np.median(np.linalg.norm(now_px - before_px, axis=1)) < LEAST_FLOW_PX:
            return _STANDING
        rays, rays_now = (pixel_rays(self._camera, pixels) for pixels in (before_px, now_px))
        ahead = (rays[:, 2] > _LEAST_AHEAD) & (rays_now[:, 2] > _LEAST_AHEAD)
        before, now = (_plane(some[ahead]) for some in (rays, rays_now))
        if len(before) < LEAST_MATCHES:
            return None
        matrix, inliers = cv2.findEssentialMat(
            before, now, np.eye(3), cv2.RANSAC, 0.999, _THRESHOLD_PX / self._camera.focal_px
        )
        if matrix is None or matrix.shape != (3, 3) or int(np.sum(inliers)) < LEAST_MATCHES:
            return None
        _, turn, direction, _, _ = cv2.recoverPose(
            matrix, before, now, np.eye(3), distanceThresh=_FARTHEST_STEPS, mask=inliers
        )
        return np.asarray(turn, np.float64), np.asarray(direction, np.float64).ravel()


def _plane(rays: Matrix) -> Matrix:
    """Undistorted coordinates at the distance 1 of (N, 3) rays, (N, 2)."""
    return np.ascontiguousarray(rays[:, :2] / rays[:, 2:])


class KltEssential(EssentialMatrix):
    """Corners tracked by pyramidal Lucas-Kanade."""

    def matches(self, before: Image, now: Image) -> Matches:
        """Track corners."""
        return klt_matches(before, now)


class OrbEssential(EssentialMatrix):
    """Matched ORB features."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self._matcher = OrbMatcher()

    def matches(self, before: Image, now: Image) -> Matches:
        """Match features."""
        return self._matcher.matches(before, now)


_SECTORS = 24
_LEAST_SECTORS = 8
"""A joint shows in at least this many of the sectors of its ring."""

_SAMPLES = 8
"""Samples along the arc of a sector."""

_WINDOW_MM = 300.0
"""Greatest length of wall, from the nearest whole ring on, in which joints are looked for."""

_AXIAL_STEP_MM = 1.0
_BESIDE_MM = 20
"""A joint is darker than the wall so far before and behind it."""

_LEAST_DIP = 0.2
"""Least share of the light of the wall that a joint lacks."""

_GONE_FRAMES = 3
"""A joint has passed when it has not been seen in so many frames."""


class JointCounting(ForwardPeer):
    """Counts the rings of joints that pass the nearest whole ring of the picture.

    Each joint adds the length of a segment.  Between joints, before the first and after the last,
    the frames share the distance evenly.
    """

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        if rig.pipe.segment_length_mm is None:
            raise InvalidRig("pipe.segment_length_mm: needed for the counting of joints.")
        self._segment_mm = rig.pipe.segment_length_mm
        self._maps = _ring_maps(rig)
        self._seen: list[bool] = []

    def step(self, image: Image, t_s: float) -> Estimate:
        """Look for a joint; the pose stays at the start."""
        u, v = self._maps
        window = cv2.remap(to_grey(image).astype(np.float32), u, v, cv2.INTER_LINEAR)
        profiles = window.reshape(len(u), _SECTORS, _SAMPLES).mean(axis=2)
        self._seen.append(_shows_joint(profiles))
        return self._estimate(t_s, np.zeros(3), np.eye(3), is_lost=False)

    def finish(self, track: Track, truth: Truth) -> Track:
        """Interpolate between the frames at which joints have passed; it is given nothing."""
        passed = np.array(_passed(self._seen))
        if len(passed) < 2:
            return replace(track, status=np.full(len(track), "lost"))
        frames = np.arange(len(track))
        gap = np.clip(np.searchsorted(passed, frames) - 1, 0, len(passed) - 2)
        joints = gap + (frames - passed[gap]) / (passed[gap + 1] - passed[gap])
        x_mm = self._segment_mm * (joints - joints[0])
        return replace(track, x_mm=x_mm, distance_mm=x_mm)


def _ring_maps(rig: Rig) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Pixels u and v of the wall from the nearest whole ring on, (axial steps, samples of a ring).

    The camera is taken to stand as the rig states.
    """
    arc_mm = (
        np.pi
        * (rig.pipe.diameter_mm or 0.0)
        * np.arange(_SECTORS * _SAMPLES)
        / (_SECTORS * _SAMPLES)
    )

    def pixels(ahead_mm: NDArray[np.float64]) -> Matrix:
        wall = np.stack(np.meshgrid(ahead_mm, arc_mm, indexing="ij"), -1).reshape(-1, 2)
        seen = robot_pixels(rig, sight(rig, NOMINAL, enclose(rig, wall)))
        return seen.reshape(len(ahead_mm), len(arc_mm), 2)

    far_mm = np.arange(20.0, 2000.0, 10.0)
    size = np.array([rig.camera.width, rig.camera.height])
    rings = pixels(far_mm)
    is_whole = ((rings > 0) & (rings < size - 1)).all(axis=(1, 2))
    if not is_whole.any():
        raise InvalidRig("camera: no whole ring of the wall is in the picture.")
    nearest_mm = far_mm[int(np.argmax(is_whole))]
    # A window of more than half a segment could always show a joint.
    length_mm = min(_WINDOW_MM, (rig.pipe.segment_length_mm or np.inf) / 2)
    window = pixels(nearest_mm + np.arange(0.0, length_mm, _AXIAL_STEP_MM)).astype(np.float32)
    return np.ascontiguousarray(window[..., 0]), np.ascontiguousarray(window[..., 1])


def _shows_joint(profiles: Matrix) -> bool:
    """Whether most sectors have a dark line across; `profiles` is (axial steps, sectors)."""
    beside = round(_BESIDE_MM / _AXIAL_STEP_MM)
    wall = np.minimum(profiles[: -2 * beside], profiles[2 * beside :])
    lacking = 1 - profiles[beside:-beside] / np.maximum(wall, 1.0)
    return int(np.sum(lacking.max(axis=0) > _LEAST_DIP)) >= _LEAST_SECTORS


def _passed(seen: list[bool]) -> list[float]:
    """Frames at which joints have passed: after their last sighting."""
    sightings = np.flatnonzero(seen).tolist()
    passed = [
        frame + 0.5
        for frame, following in pairwise([*sightings, len(seen)])
        if following - frame > _GONE_FRAMES
    ]
    if len(passed) < 3:
        return passed
    between = np.diff(passed)
    is_new = between > between.max() / 4  # otherwise the same joint came into view again
    return [*np.array(passed[:-1])[is_new].tolist(), passed[-1]]
