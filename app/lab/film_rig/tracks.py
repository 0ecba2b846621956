"""Follows points of the wall through parts of a film.

Corners of the locally normalised picture are followed from frame to frame (Lucas and Kanade), and
measured at keyframes, between which the picture has moved by a certain share of its width.  A point
counts if it is found again backwards in time.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.image.filters import BLACK_GREY, LIGHT_PX, NEIGHBOURHOOD_PX, low_pass, smooth
from vo_core.types import ByteImage, Matrix

STEP = 0.02
"""Motion from keyframe to keyframe, as a share of the picture's width."""

MOST_KEYFRAMES = 10
"""A part of the film ends with this keyframe."""

MOST_POINTS = 500
"""Largest number of points that are followed at once."""

SPACING = 1 / 50
"""Least distance of two new points, as a share of the picture's width."""

LEAST_CORNER = 0.003
"""Least strength of a corner, relative to the strongest."""

WINDOW_PX = 21
"""Side of the neighbourhood by which a point is found again."""

LEVELS = 4
"""Levels of the pyramid: a step of 8 x 21 px is found."""

RETURN_PX = 0.5
"""Largest distance from its start of a point that was followed there and back."""

FASTER_SHARE = 0.15
"""Share of the points that must have moved by `STEP`: burnt-in text and the far end hardly move."""

LOST_SHARE = 0.5
"""A keyframe is made, too, when this share of the points of the one before is lost."""

SLOW = 0.25
"""A point slower than this share of the fast ones is left out: it is text, dirt on the lens or the
robot, or a block that a coder did not renew, and the far wall shows little of the lens."""

LEAST_VIEWS = 3
"""Least number of keyframes that show a point: two views agree on almost any point."""

NOISE_GREY = 2.5
"""Grey levels of coding noise: weaker texture is not lifted."""

_CONTRAST_GREY = 40.0
"""Grey levels per standard deviation of the normalised picture."""


@dataclass(frozen=True)
class Tracks:
    """Points followed through one part of a film."""

    t_s: Matrix
    """(K,) times of the keyframes."""
    images: tuple[ByteImage, ...]
    """K pictures, (H, W) grey."""
    keyframe: NDArray[np.intp]
    """(N,) keyframe of each observation."""
    point: NDArray[np.intp]
    """(N,) point of each observation, ascending, counted from 0 without gaps."""
    uv_px: Matrix
    """(N, 2) observed pixels."""
    frames: int
    """Number of frames that were read."""
    moved_px: float
    """How far the fastest points have moved from the first keyframe to the last, on their way."""
    followed: int
    """Largest number of points that were found again in the next frame, moved or not."""

    @cached_property
    def starts(self) -> NDArray[np.intp]:
        """(P,) first observation of each point."""
        return np.flatnonzero(np.diff(self.point, prepend=-1))

    @property
    def points(self) -> int:
        """Number of points."""
        return int(self.point.max()) + 1 if len(self.point) else 0

    def only(self, kept: NDArray[np.bool_]) -> tuple[Tracks, NDArray[np.bool_]]:
        """Keep the observations in a mask, (N,), of points that still have `LEAST_VIEWS`.

        Returns:
            The tracks, and which of the points are still in them, (P,).
        """
        still = np.bincount(self.point[kept], minlength=self.points) >= LEAST_VIEWS
        kept = kept & still[self.point]
        _, point = np.unique(self.point[kept], return_inverse=True)
        return (
            Tracks(
                self.t_s, self.images, self.keyframe[kept], point, self.uv_px[kept],
                self.frames, self.moved_px, self.followed,
            ),
            still,
        )  # fmt: skip


@dataclass
class _Following:
    """Points that are being followed: their numbers and places in the newest picture."""

    numbers: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, np.intp))
    uv: NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 2), np.float32))
    born: int = 0

    def keep(self, good: NDArray[np.bool_]) -> None:
        self.numbers, self.uv = self.numbers[good], self.uv[good]

    def add(self, uv: NDArray[np.float32]) -> None:
        self.numbers = np.concatenate([self.numbers, self.born + np.arange(len(uv))])
        self.uv = np.concatenate([self.uv, uv])
        self.born += len(uv)


def follow(frames: Iterable[tuple[float, ByteImage]]) -> Tracks:
    """Follow points through the frames (time in s and grey picture) of one part of a film.

    The frames are read until there are `MOST_KEYFRAMES`.
    """
    following = _Following()
    times: list[float] = []
    images: list[ByteImage] = []
    seen: list[tuple[NDArray[np.intp], NDArray[np.float32]]] = []
    before = key = None
    read, moved_px, followed = 0, 0.0, 0
    anchor: NDArray[np.float32] = following.uv
    for t_s, image in frames:
        read += 1
        now = _prepared(image)
        if before is not None and key is not None:
            # The anchors are where the points were in the last keyframe.
            moved, good = _follow(before, now, following.uv, following.uv)
            following.uv = moved
            following.keep(good)
            anchor = anchor[good]
            followed = max(followed, len(anchor))
            far_px = np.linalg.norm(following.uv - anchor, axis=1)
            step_px = float(np.quantile(far_px, 1 - FASTER_SHARE)) if len(far_px) else 0.0
            is_lost = len(far_px) < LOST_SHARE * len(seen[-1][0])
            if step_px < STEP * image.shape[1] and not is_lost:
                before = now
                continue
            moved_px += step_px
            # Errors of single steps do not add up: measured again from keyframe to keyframe.
            moved, good = _follow(key, now, anchor, following.uv)
            following.uv = moved
            following.keep(good)
        _renew(following, now)
        times.append(t_s)
        images.append(image)
        seen.append((following.numbers.copy(), following.uv.copy()))
        anchor, before, key = following.uv.copy(), now, now
        if len(times) == MOST_KEYFRAMES:
            break
    return _without_slow(_joined(times, images, seen, (read, moved_px, followed)))


def _prepared(image: ByteImage) -> ByteImage:
    """Normalise a picture, as light and contrast change on the way of a lamp.

    `normalise` of the odometry lifts whatever is there; here the noise of a coder must not become
    corners, as it is copied from frame to frame.
    """
    low = low_pass(image.astype(np.float32))
    light = smooth(low, LIGHT_PX) + np.float32(BLACK_GREY)
    detail = low / light
    detail -= smooth(detail, NEIGHBOURHOOD_PX)
    deviation = np.sqrt(smooth(detail * detail, NEIGHBOURHOOD_PX))
    normal = detail / (deviation + np.float32(NOISE_GREY) / light)
    return np.asarray(np.clip(128 + _CONTRAST_GREY * normal, 0, 255), np.uint8)


def _follow(
    before: ByteImage,
    now: ByteImage,
    uv: NDArray[np.float32],
    guess: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Places of points in the next picture, (N, 2), and which of them were found, (N,)."""
    if len(uv) == 0:
        return uv, np.empty(0, np.bool_)
    size, flags = (WINDOW_PX, WINDOW_PX), cv2.OPTFLOW_USE_INITIAL_FLOW
    ahead, found, _ = cv2.calcOpticalFlowPyrLK(
        before, now, uv, guess.copy(), winSize=size, maxLevel=LEVELS, flags=flags
    )
    back, found_back, _ = cv2.calcOpticalFlowPyrLK(
        now, before, ahead, uv.copy(), winSize=size, maxLevel=LEVELS, flags=flags
    )
    returned = np.linalg.norm(back - uv, axis=1) < RETURN_PX
    limit = np.array(now.shape[::-1]) - 1 - WINDOW_PX // 2
    inside = ((ahead >= WINDOW_PX // 2) & (ahead <= limit)).all(axis=1)
    places: NDArray[np.float32] = np.asarray(ahead, np.float32)
    return places, (found.ravel() == 1) & (found_back.ravel() == 1) & returned & inside


def _renew(following: _Following, now: ByteImage) -> None:
    """Add new points where there are none."""
    spacing = SPACING * now.shape[1]
    free = np.full(now.shape, 255, np.uint8)
    for u, v in following.uv:
        cv2.circle(free, (round(float(u)), round(float(v))), round(spacing), 0, -1)
    room = MOST_POINTS - len(following.uv)
    if room <= 0:
        return
    corners = cv2.goodFeaturesToTrack(now, room, LEAST_CORNER, spacing, mask=free, blockSize=7)
    if corners is not None:
        following.add(corners.reshape(-1, 2).astype(np.float32))


def _joined(
    times: list[float],
    images: list[ByteImage],
    seen: list[tuple[NDArray[np.intp], NDArray[np.float32]]],
    totals: tuple[int, float, int],
) -> Tracks:
    numbers = [pair[0] for pair in seen]
    keyframe = np.repeat(np.arange(len(seen)), [len(one) for one in numbers])
    joined = np.concatenate([*numbers, np.empty(0, np.intp)])
    uv = np.concatenate([*(pair[1] for pair in seen), np.empty((0, 2), np.float32)])
    order = np.argsort(joined, kind="stable")
    _, point = np.unique(joined[order], return_inverse=True)
    tracks = Tracks(
        np.array(times), tuple(images), keyframe[order], point, uv[order].astype(np.float64),
        *totals,
    )  # fmt: skip
    return tracks.only(np.ones(len(uv), np.bool_))[0]


def _without_slow(tracks: Tracks) -> Tracks:
    """Leave out points that hardly move although the picture does."""
    if tracks.points == 0:
        return tracks
    low = np.minimum.reduceat(tracks.uv_px, tracks.starts, axis=0)
    high = np.maximum.reduceat(tracks.uv_px, tracks.starts, axis=0)
    steps = np.bincount(tracks.point) - 1
    speed = np.linalg.norm(high - low, axis=1) / steps
    fast = speed >= SLOW * np.quantile(speed, 1 - FASTER_SHARE)
    return tracks.only(fast[tracks.point])[0]
