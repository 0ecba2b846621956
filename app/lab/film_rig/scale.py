"""The focal length by what is known of the pipe's length.

The way driven is proportional to the focal length (r = f R / x).  So the film is tracked with the
rig found so far, and the true length over the measured one is the factor of the focal length.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vo_core import Odometry, Rig, Track, VideoFile
from vo_core.errors import InvalidCorrection
from vo_core.joints.finder import JointFinder
from vo_core.scale.proposal import propose

LENGTH_SIGMA = 0.005
"""Relative standard uncertainty of a stated inspected length."""

MOST_LOST = 0.2
"""Largest share of lost frames of a film whose length means anything."""


@dataclass(frozen=True)
class Factor:
    """The true focal length over that of the rig, by one source."""

    source: str
    value: float
    sigma: float


@dataclass(frozen=True)
class Factors:
    """What a tracked film says of the focal length."""

    found: tuple[Factor, ...]
    doubts: tuple[str, ...]
    """Sentences on sources that could not be used."""


def focal_factors(
    video: Path,
    rig: Rig,
    length_mm: float | None,
    on_progress: Callable[[int, int | None], None],
) -> Factors:
    """Track the film, and compare with the inspected length and with the rig's joints.

    Args:
        video: The film.
        rig: The rig found so far, with the length of a pipe segment if that is known.
        length_mm: The inspected length, from the first frame to the furthest place.
        on_progress: Called after each frame with frames done and the total, if known.
    """
    odometry, finder = Odometry(rig), JointFinder(rig)
    estimates = []
    with VideoFile(video) as frames:
        for frame in frames.read_ahead():
            estimates.append(odometry.step(frame.image, frame.t_s))
            finder.add(frame.image, estimates[-1])
            on_progress(len(estimates), frames.info.frames)
    track = Track.from_estimates(estimates)
    lost = float((track.status == "lost").mean())
    if lost > MOST_LOST:
        return Factors((), (f"the film cannot be tracked ({lost:.0%} of the frames are lost): "
                            "its length says nothing of the lens",))  # fmt: skip
    found, doubts = [], []
    if length_mm is not None:
        found.append(_by_length(track, length_mm))
    if rig.pipe.segment_length_mm is not None:
        try:
            proposal = propose(track, finder.finish(), rig)
        except InvalidCorrection as error:
            doubts.append(f"the joints cannot be counted: {error}")
        else:
            if proposal is None:
                doubts.append("fewer than two joints were seen: their spacing says nothing")
            else:
                found.append(Factor(f"{proposal.joints} joints", proposal.scale, proposal.sigma))
    return Factors(tuple(found), tuple(doubts))


def _by_length(track: Track, length_mm: float) -> Factor:
    furthest = int(np.abs(track.distance_mm).argmax())
    measured_mm = max(abs(float(track.distance_mm[furthest])), 1e-3)
    registration = float(track.sigma_registration_mm[furthest]) / measured_mm
    value = length_mm / measured_mm
    return Factor(
        "the inspected length", value, value * float(np.hypot(LENGTH_SIGMA, registration))
    )
