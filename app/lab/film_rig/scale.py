"""The focal length by what is known of the pipe's length.

The way driven is proportional to the focal length (r = f R / x).  So the film is tracked with the
rig found so far, and the true length over the measured one is the factor of the focal length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import gcd
from pathlib import Path

import numpy as np

from vo_core import Odometry, Rig, Track, VideoFile
from vo_core.errors import InvalidCorrection
from vo_core.joints.finder import JointFinder
from vo_core.joints.lattice import Joint
from vo_core.joints.sightings import Sighting
from vo_core.scale.evidence import KnownLength
from vo_core.scale.proposal import propose

LENGTH_SIGMA = 0.005
"""Relative standard uncertainty of a stated inspected length."""

MOST_LOST = 0.2
"""Largest share of lost frames of a film whose length means anything."""


CONTRADICTION = 3.0
"""A length is not used if the film excludes it by so many standard uncertainties, ..."""

WORTH_CHECKING = 2.0
"""... and from so many on it is used with a doubt."""


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
    with VideoFile(video) as frames:
        for done, frame in enumerate(frames.read_ahead(), 1):
            estimate = odometry.step(frame.image, frame.t_s)
            finder.add(
                frame.image,
                estimate,
                initial_pose=odometry.initial_pose,
                smoothed=odometry.smoothed,
            )
            on_progress(done, frames.info.frames)
    return factors_of(Track.from_estimates(odometry.smoothed()), finder.finish(), rig, length_mm)


def factors_of(
    track: Track, sightings: Sequence[Sighting], rig: Rig, length_mm: float | None
) -> Factors:
    """Compare a track and its joints with the inspected length and the rig's segments.

    A source that contradicts the film is left out.  Doubts say so, and what looks unlikely.
    """
    lost = float((track.status == "lost").mean())
    if lost > MOST_LOST:
        return Factors((), (f"the film cannot be tracked ({lost:.0%} of the frames are lost): "
                            "its length says nothing of the lens",))  # fmt: skip
    found: list[Factor] = []
    doubts: list[str] = []
    lengths: list[KnownLength] = []
    if length_mm is not None:
        furthest = int(np.abs(track.distance_mm).argmax())
        by_length = _by_length(track, furthest, length_mm)
        doubts += _doubts(by_length, rig, "the length")
        if _off(by_length, rig) < CONTRADICTION:
            found.append(by_length)
            # Inspected lengths are positive, also of a robot that drives backwards.
            way_mm = float(np.copysign(length_mm, track.distance_mm[furthest]))
            first, last = (int(track.frame[row]) for row in (0, furthest))
            lengths.append(KnownLength(first, last, way_mm, LENGTH_SIGMA * length_mm))
    if rig.pipe.segment_length_mm is None:
        return Factors(tuple(found), tuple(doubts))
    try:
        # A length shows which of several counts of the segments is right.
        proposal = propose(track, sightings, rig, lengths)
    except InvalidCorrection as error:
        doubts.append(f"the joints are not used: {error}")
    else:
        if proposal is None:
            doubts.append("fewer than two joints were seen: their spacing says nothing")
        else:
            joints = f"{proposal.joints} joints"
            name = f"the inspected length and {joints}" if lengths else joints
            by_joints = Factor(name, proposal.scale, proposal.sigma)
            doubts += _seldom(proposal.spacing.joints)
            doubts += [] if lengths else _doubts(by_joints, rig, "the length of a segment")
            if _off(by_joints, rig) < CONTRADICTION:
                found = [by_joints]
    return Factors(tuple(found), tuple(doubts))


def _by_length(track: Track, furthest: int, length_mm: float) -> Factor:
    measured_mm = max(abs(float(track.distance_mm[furthest])), 1e-3)
    registration = float(track.sigma_registration_mm[furthest]) / measured_mm
    value = length_mm / measured_mm
    return Factor(
        "the inspected length", value, value * float(np.hypot(LENGTH_SIGMA, registration))
    )


def _seldom(joints: Sequence[Joint]) -> list[str]:
    """A sentence if each gap is several segments, as it is where a shorter one is stated."""
    places = sorted({(joint.count, joint.number) for joint in joints})
    step = gcd(*(after - before for (one, before), (other, after) in pairwise(places)
                 if one == other))  # fmt: skip
    if step < 2:
        return []
    return [f"only one joint in {step} was seen: check the length of a segment"]


def _off(factor: Factor, rig: Rig) -> float:
    """How far a source moves the focal length, in standard uncertainties."""
    film = rig.tolerance.focal_percent / 100
    return abs(float(np.log(factor.value))) / float(np.hypot(film, factor.sigma / factor.value))


def _doubts(factor: Factor, rig: Rig, stated: str) -> list[str]:
    """A sentence if the film makes the focal length that a source implies unlikely."""
    off = _off(factor, rig)
    if off < WORTH_CHECKING:
        return []
    focal_px, percent = rig.camera.fx, rig.tolerance.focal_percent
    used = "is not used" if off >= CONTRADICTION else "is used all the same"
    return [
        f"{factor.source} implies a focal length of {factor.value * focal_px:.0f} px, but the film "
        f"alone shows {focal_px:.0f} px ± {percent:.1f} %: it {used}; check {stated} and the "
        "diameter"
    ]
