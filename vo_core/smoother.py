"""The poses of a film that has ended, each with what all of its pictures show.

A live pose knows the pictures before it.  Each frame was located against a reference, which leaves
the joint Gaussian of both poses and of the mount, so the frames form a tree.  The path from the
root to the last frame is a Markov chain, and the pass from its end back to the root is that of
Rauch, Tung & Striebel (1965):

    s_r <- s_r + C_rt P_t^-1 (s_t' - s_t),   P_r <- P_r + G (P_t' - P_t) G',   G = C_rt P_t^-1,

with s = (pose, mount).  Every other frame is a leaf: it follows from the smoothed state of its
reference by its own link.  Frames that show no wall lie between those that do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.motion import OF_MOVING, OF_REFERENCE, PARAMETERS, POSE
from vo_core.geometry.wall import Pose
from vo_core.records import Records
from vo_core.track import Estimate, Status
from vo_core.types import Matrix

STATE = POSE + 2
"""Number of parameters of a state: pose and mount."""

_STATUSES: tuple[Status, ...] = get_args(Status)
_UPPER = np.triu_indices(PARAMETERS)

_RECORD = np.dtype(
    [
        ("reference", np.int64),
        ("mean", np.float64, PARAMETERS),
        ("joint", np.float32, len(_UPPER[0])),
        ("widening", np.float64, STATE),
        ("is_seen", np.bool_),
        ("time_s", np.float64),
        ("quality", np.float32),
        ("status", np.int8),
        ("looking_around", np.float32),
        ("systematic_mm2", np.float64),
        ("doubt_mm", np.float64),
        ("doubted", np.float32),
    ]
)


@dataclass(frozen=True)
class Link:
    """How a frame was located: against which frame, and what that shows of both."""

    reference: int
    """Frame of the reference; -1 where nothing before it is known."""
    mean: Matrix
    """(14,) pose of the frame, of its reference, and the mount, as `WallMotion` takes them."""
    joint: Matrix
    """(14, 14) their covariance."""
    is_seen: bool
    """Whether the frame shows the wall; else its pose goes on from the reference."""


@dataclass(frozen=True)
class Apart:
    """What is no part of the state of a frame."""

    widening: Matrix
    """(8,) variance that the state gains where the frame becomes a reference."""
    systematic_mm2: float
    """Variance of the distance."""
    doubt_mm: float
    """Standard deviation of the distance by the shape of the wall, so far."""
    doubted: float
    """Share by which the way that ends with this frame may be wrong."""


def joined(moving: Matrix, reference: Matrix) -> Matrix:
    """(14, 14) covariance of a state that goes on from another one, both (8, 8)."""
    joint = np.zeros((PARAMETERS, PARAMETERS))
    joint[np.ix_(OF_REFERENCE, OF_MOVING)] = reference
    joint[np.ix_(OF_MOVING, OF_REFERENCE)] = reference
    joint[np.ix_(OF_REFERENCE, OF_REFERENCE)] = reference
    joint[np.ix_(OF_MOVING, OF_MOVING)] = moving
    return joint


class Smoother:
    """Keeps how each frame of a film was located, and smooths them at its end."""

    def __init__(self) -> None:
        self.records = Records(_RECORD)

    def add(self, link: Link, estimate: Estimate, apart: Apart) -> None:
        """Add the next frame: how it was located, and its live estimate."""
        self.records.append(
            (
                link.reference,
                link.mean,
                link.joint[_UPPER],
                apart.widening,
                link.is_seen,
                estimate.time_s,
                estimate.quality,
                _STATUSES.index(estimate.status),
                estimate.looking_around,
                apart.systematic_mm2,
                apart.doubt_mm,
                apart.doubted,
            )
        )

    def shift(self, x_mm: float, y_mm: float) -> None:
        """Move the zero point: all frames but the first one shift."""
        rows = self.records.rows
        rows["mean"][1:, :2] += (x_mm, y_mm)
        rows["mean"][rows["reference"] > 0, POSE : POSE + 2] += (x_mm, y_mm)
        self.records.changed()

    def estimates(self, scale_sigma: float) -> list[Estimate]:
        """Smooth all frames so far; `scale_sigma` is relative, by the rig's tolerances."""
        records = self.records.rows
        if not len(records):
            return []
        mean, covariance = _smoothed(records)
        start = mean[0, :POSE]
        variance = np.maximum(covariance[:, 0, 0], 0.0) + records["systematic_mm2"]
        poses = mean[:, :POSE] - start
        doubt_mm = _known_later(records["doubt_mm"], records["doubted"], poses[:, 0])
        scale = np.square(doubt_mm) + np.square(scale_sigma * poses[:, 0])
        return [
            Estimate.of(
                Pose.of(pose),
                frame=frame,
                time_s=float(record["time_s"]),
                sigma_distance_mm=float(np.sqrt(variance[frame] + scale[frame])),
                quality=float(record["quality"]),
                status=_STATUSES[record["status"]],
                sigma_registration_mm=float(np.sqrt(variance[frame])),
                looking_around=float(record["looking_around"]),
            )
            for frame, (record, pose) in enumerate(zip(records, poses, strict=True))
        ]


def _known_later(doubt_mm: Matrix, doubted: Matrix, x_mm: Matrix) -> Matrix:
    """(N,) doubts of the distance, each with what later frames show of the way up to it.

    A bed, or waves, are certain only after some way, which then counts by them as a whole: the
    doubt jumps at one frame.  Looking back it rose by the share that is known there.
    """
    known_mm, share = doubt_mm.tolist(), 0.0
    steps_mm = np.abs(np.diff(x_mm)).tolist()
    for frame in reversed(range(len(steps_mm))):
        if known_mm[frame + 1] <= doubt_mm[frame + 1]:
            share = float(doubted[frame + 1])
        known_mm[frame] = max(known_mm[frame], known_mm[frame + 1] - share * steps_mm[frame])
    return np.array(known_mm)


def _smoothed(records: NDArray[Any]) -> tuple[Matrix, Matrix]:
    """(N, 8) states and (N, 8, 8) covariances of all frames."""
    count = len(records)
    reference = np.asarray(records["reference"])
    mean = np.array(records["mean"][:, OF_MOVING])
    covariance = np.empty((count, STATE, STATE))
    is_done = np.zeros(count, np.bool_)
    for last in _ends(reference):
        frame = last
        mean[frame], covariance[frame] = _moving(records[frame])
        is_done[frame] = True
        while (parent := int(reference[frame])) >= 0:
            mean[parent], covariance[parent] = _back(
                records[frame], records[parent], mean[frame], covariance[frame]
            )
            is_done[parent] = True
            frame = parent
    for frame in np.flatnonzero(~is_done).tolist():
        parent = int(reference[frame])
        mean[frame], covariance[frame] = _forth(records[frame], mean[parent], covariance[parent])
    hidden = ~np.asarray(records["is_seen"]) & ~is_done
    _fill(hidden, mean, covariance)
    return mean, covariance


def _ends(reference: NDArray[np.int64]) -> list[int]:
    """The last frame of each tree."""
    root = np.arange(len(reference))
    for frame, parent in enumerate(reference.tolist()):
        if parent >= 0:
            root[frame] = root[parent]
    return [int(np.flatnonzero(root == each)[-1]) for each in np.unique(root)]


def _joint(record: Any) -> Matrix:
    upper = np.zeros((PARAMETERS, PARAMETERS))
    upper[_UPPER] = record["joint"]
    return np.asarray(upper + np.triu(upper, 1).T)


def _moving(record: Any) -> tuple[Matrix, Matrix]:
    """State of a frame by the pictures up to it."""
    return record["mean"][OF_MOVING], _joint(record)[np.ix_(OF_MOVING, OF_MOVING)]


def _back(record: Any, parent: Any, mean: Matrix, covariance: Matrix) -> tuple[Matrix, Matrix]:
    """State of the reference of a frame whose smoothed state is known."""
    joint = _joint(record)
    now, across = joint[np.ix_(OF_MOVING, OF_MOVING)], joint[np.ix_(OF_REFERENCE, OF_MOVING)]
    gain = _divided(across, now)
    before = record["mean"][OF_REFERENCE] + gain @ (mean - record["mean"][OF_MOVING])
    spread = joint[np.ix_(OF_REFERENCE, OF_REFERENCE)] + gain @ (covariance - now) @ gain.T
    # As a reference it was taken to be less certain than it was as a frame.
    own_mean, own = _moving(parent)
    wide = own + np.diag(parent["widening"])
    gain = _divided(own, wide)
    return own_mean + gain @ (before - own_mean), own + gain @ (spread - wide) @ gain.T


def _forth(record: Any, mean: Matrix, covariance: Matrix) -> tuple[Matrix, Matrix]:
    """State of a leaf whose reference is known."""
    joint = _joint(record)
    before, across = (
        joint[np.ix_(OF_REFERENCE, OF_REFERENCE)],
        joint[np.ix_(OF_MOVING, OF_REFERENCE)],
    )
    gain = _divided(across, before)
    now = record["mean"][OF_MOVING] + gain @ (mean - record["mean"][OF_REFERENCE])
    return now, joint[np.ix_(OF_MOVING, OF_MOVING)] + gain @ (covariance - before) @ gain.T


def _divided(matrix: Matrix, by: Matrix) -> Matrix:
    """A B^-1 of a symmetric B whose units are mixed, and which may be singular."""
    size = 1 / np.sqrt(np.maximum(np.diag(by), 1e-30))
    scaled = by * np.outer(size, size)
    return np.asarray((matrix * size) @ np.linalg.pinv(scaled, rcond=1e-6, hermitian=True) * size)


def _fill(hidden: NDArray[np.bool_], mean: Matrix, covariance: Matrix) -> None:
    """Place frames that show no wall evenly between their neighbours that do."""
    if not hidden.any():
        return
    shown, open_ended = np.flatnonzero(~hidden), covariance.copy()
    for frame in np.flatnonzero(hidden).tolist():
        after = int(np.searchsorted(shown, frame))
        if after == len(shown):
            return
        a, b = int(shown[after - 1]), int(shown[after])
        share = (frame - a) / (b - a)
        mean[frame] = (1 - share) * mean[a] + share * mean[b]
        gone, left = (open_ended[at] - covariance[a] for at in (frame, a + b - frame))
        ends = (1 - share) * covariance[a] + share * covariance[b]
        covariance[frame] = ends + (gone if gone[0, 0] < left[0, 0] else left)
