"""A video file through the odometry without a server: what `chainage track` does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from vo_core import Estimate, Odometry, Rig, Track, VideoFile
from vo_core.joints.finder import JointFinder
from vo_core.paper import PaperOdometry
from vo_core.types import Image


class Method(StrEnum):
    """How the motion is measured."""

    CHAINAGE = "chainage"
    PAPER = "paper"


class Stepper(Protocol):
    """What every method offers."""

    def step(self, image: Image, t_s: float) -> Estimate:
        """One estimate a frame."""


METHODS: Mapping[Method, Callable[[Rig], Stepper]] = {
    Method.CHAINAGE: Odometry,
    Method.PAPER: PaperOdometry,
}


@dataclass(frozen=True)
class TrackedVideo:
    """The track of a whole video."""

    track: Track
    problem: str | None
    """Why the video ended early or what was skipped, in a sentence."""


def track_video(
    video: Path,
    rig: Rig,
    method: Method,
    on_progress: Callable[[int, int | None], None] | None = None,
    *,
    finder: JointFinder | None = None,
) -> TrackedVideo:
    """Track every frame of a video.

    Args:
        finder: Is shown every frame with its pose.
        on_progress: Called after each frame with frames done and frames in all, if that is known.
    Raises:
        UnreadableVideo: The video cannot be opened or holds no picture.
        RigVideoMismatch: The rig's camera has another picture size.
        InvalidRig: The method cannot use the rig.
    """
    stepper = METHODS[method](rig)
    estimates: list[Estimate] = []
    with VideoFile(video) as frames:
        rig.require_picture_size(frames.info.width, frames.info.height)
        for frame in frames.read_ahead():
            estimates.append(stepper.step(frame.image, frame.t_s))
            if finder is not None:
                finder.add(frame.image, estimates[-1])
            if on_progress is not None:
                on_progress(len(estimates), frames.info.frames)
    return TrackedVideo(Track.from_estimates(estimates), frames.problem)
