"""Tracks a video file without a server, for `chainage track`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from vo_core import Estimate, Odometry, Rig, Track, VideoFile
from vo_core.geometry.initial_pose import InitialPose
from vo_core.joints.finder import JointFinder
from vo_core.paper import PaperOdometry
from vo_core.types import Image


class Method(StrEnum):
    """Methods of measuring the motion."""

    CHAINAGE = "chainage"
    PAPER = "paper"


class Stepper(Protocol):
    """The interface of every method."""

    @property
    def initial_pose(self) -> InitialPose:
        """Pose of the camera in the pipe at the first frame, by the frames so far."""

    def step(self, image: Image, t_s: float) -> Estimate:
        """Return the estimate of the next frame."""


METHODS: Mapping[Method, Callable[[Rig], Stepper]] = {
    Method.CHAINAGE: Odometry,
    Method.PAPER: PaperOdometry,
}


@dataclass(frozen=True)
class TrackedVideo:
    """The track of a whole video."""

    track: Track
    problem: str | None
    """A sentence that says why the video ended early or what was skipped."""


def track_video(
    video: Path,
    rig: Rig,
    method: Method,
    on_progress: Callable[[int, int | None], None] | None = None,
    *,
    finder: JointFinder | None = None,
) -> TrackedVideo:
    """Track every frame of a video; at its end the track is smoothed, if the method can do that.

    Args:
        finder: Receives every frame with its pose.
        on_progress: Called after each frame with frames done and the total, if known.
    Raises:
        UnreadableVideo: The video cannot be opened or holds no picture.
        RigVideoMismatch: The rig's camera has another picture size.
        InvalidRig: The method cannot use the rig.
    """
    stepper = METHODS[method](rig)
    smoothed = stepper.smoothed if isinstance(stepper, Odometry) else None
    estimates: list[Estimate] = []
    with VideoFile(video) as frames:
        rig.require_picture_size(frames.info.width, frames.info.height)
        for frame in frames.read_ahead():
            estimates.append(stepper.step(frame.image, frame.t_s))
            if finder is not None:
                finder.add(
                    frame.image, estimates[-1], initial_pose=stepper.initial_pose, smoothed=smoothed
                )
            if on_progress is not None:
                on_progress(len(estimates), frames.info.frames)
    if smoothed is not None:
        estimates = smoothed() or estimates
    return TrackedVideo(Track.from_estimates(estimates), frames.problem)
