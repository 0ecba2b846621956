"""The joints of a corrected track: where they were seen or are expected, and their numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.survey.adjustment.closure import CLOSURE_LIMIT
from app.survey.places.spans import SAME_MM
from vo_core import Track
from vo_core.drift import row_of
from vo_core.joints.lattice import Joint
from vo_core.joints.sightings import Sighting
from vo_core.scale.correction import Correction
from vo_core.scale.evidence import JointSpacing

NEAR_JOINT_MM = 200.0
"""Distance within which an observation counts as at a joint: the rule of one coding family, 8
inches."""


@dataclass(frozen=True)
class FittedJoint:
    """A joint at the corrected distance where it was seen."""

    number: int | None
    """Number from the zero, whose next joint is 1; None where the segments cannot be counted."""
    distance_mm: float
    sigma_mm: float
    residual_mm: float | None
    """Known less measured distance when the track is only scaled; None if no joint counts."""
    frame: int
    is_marked: bool
    others: tuple[int, ...] = ()
    """Further frames in which the same joint was seen or clicked on."""


@dataclass(frozen=True)
class UncountedMark:
    """A click, in corrected distance, that lies on none of the counted joints."""

    frame: int
    distance_mm: float


@dataclass(frozen=True)
class ExpectedJoint:
    """A place where a joint is expected but was not seen; it is shown as such and never
    reported.
    """

    number: int
    distance_mm: float


@dataclass(frozen=True)
class NearJoint:
    """A seen joint near a place."""

    number: int | None
    """Number from the zero; None where the segments cannot be counted."""


def fitted_joints(
    track: Track,
    spacing: JointSpacing | None,
    done: Correction | None,
    marked: Sequence[Sighting],
    *,
    joints_count: bool,
) -> tuple[FittedJoint, ...]:
    """Return every sighting of a joint in the corrected track, in the order of the evidence."""
    if spacing is None or done is None:
        return ()
    joints, scale = spacing.joints, done.scale
    rows = [row_of(track, joint.sighting.frame) for joint in joints]
    at_mm = [
        float(track.distance_mm[row]) + scale * joint.sighting.ahead_mm
        for row, joint in zip(rows, joints, strict=True)
    ]
    sigma_mm = [
        math.hypot(float(track.sigma_distance_mm[row]), scale * joint.sighting.sigma_mm)
        for row, joint in zip(rows, joints, strict=True)
    ]
    # Residuals follow the order of the evidence; those of joints come last.
    left_mm = (
        [left.residual_mm for left in done.residuals[-len(joints) :]]
        if joints_count
        else [None] * len(joints)
    )
    return tuple(
        FittedJoint(
            number=number,
            distance_mm=distance_mm,
            sigma_mm=sigma,
            residual_mm=residual_mm,
            frame=joint.sighting.frame,
            is_marked=joint.sighting in marked,
        )
        for joint, number, distance_mm, sigma, residual_mm in zip(
            joints,
            _numbers(joints, at_mm, sigma_mm, spacing.segment_mm),
            at_mm,
            sigma_mm,
            left_mm,
            strict=True,
        )
    )


def uncounted_marks(
    track: Track,
    spacing: JointSpacing | None,
    done: Correction | None,
    marked: Sequence[Sighting],
) -> tuple[UncountedMark, ...]:
    """Return the clicks that lie on none of the counted joints."""
    counted = [joint.sighting for joint in spacing.joints] if spacing else []
    scale = done.scale if done else 1.0
    return tuple(
        UncountedMark(
            mark.frame,
            float(track.distance_mm[row_of(track, mark.frame)]) + scale * mark.ahead_mm,
        )
        for mark in marked
        if mark not in counted
    )


def each_once(sighted: Sequence[FittedJoint], segment_mm: float | None) -> tuple[FittedJoint, ...]:
    """Return each joint once.

    A click takes precedence over a detected ring; otherwise the surest sighting does.
    """
    groups: list[list[FittedJoint]] = []
    for joint in sighted:
        same = next((group for group in groups if _are_one(group[0], joint, segment_mm)), None)
        if same is None:
            groups.append([joint])
        else:
            same.append(joint)
    return tuple(_one_of(group) for group in groups)


def _are_one(one: FittedJoint, other: FittedJoint, segment_mm: float | None) -> bool:
    """Return whether two sightings are of the same joint."""
    if one.number is not None or other.number is not None:
        return one.number == other.number
    return abs(one.distance_mm - other.distance_mm) < (segment_mm or 0.0) / 2


def _one_of(group: Sequence[FittedJoint]) -> FittedJoint:
    """Choose the sighting that represents a joint."""
    best = min(group, key=lambda joint: (not joint.is_marked, joint.sigma_mm))
    others = sorted({joint.frame for joint in group} - {best.frame})
    return replace(best, others=tuple(others))


def expected_joints(
    track: Track, sighted: Sequence[FittedJoint], segment_mm: float, *, has_zero: bool
) -> tuple[ExpectedJoint, ...]:
    """Return the places along the track where a joint is expected but none was seen.

    They lie whole segments from the nearest seen joint, or from a stated zero where none was
    seen.
    """
    seen = [(joint.number, joint.distance_mm) for joint in sighted]
    known = [(number, at_mm) for number, at_mm in seen if number is not None]
    if not seen and has_zero:
        known = [(0, 0.0)]
    if not known:
        return ()
    first_mm, last_mm = (float(end(track.distance_mm)) for end in (np.min, np.max))
    expected = []
    first, at_mm = known[0]
    end = 1 + first + math.ceil((last_mm + SAME_MM - at_mm) / segment_mm)
    for number in range(1, end):
        base, base_mm = min(known, key=lambda joint: abs(joint[0] - number))
        at_mm = base_mm + (number - base) * segment_mm
        is_seen = any(abs(there_mm - at_mm) < segment_mm / 2 for _, there_mm in seen)
        if first_mm - SAME_MM <= at_mm <= last_mm + SAME_MM and not is_seen:
            expected.append(ExpectedJoint(number, at_mm))
    return tuple(expected)


def _numbers(
    joints: Sequence[Joint], at_mm: Sequence[float], sigma_mm: Sequence[float], segment_mm: float
) -> list[int | None]:
    """Number the joints from the zero; None in a count whose first joint is ambiguous.

    A seam at the zero itself is the start of the pipe, not a joint.
    """
    begin_mm = min(NEAR_JOINT_MM, segment_mm / 2)
    first: dict[int, int | None] = {}
    """Number from the zero of the joint that its count calls 0."""
    reference: tuple[float, int] | None = None
    """The previous joint whose number is known."""
    for joint, at, sigma in zip(joints, at_mm, sigma_mm, strict=True):
        if joint.count in first:
            base = first[joint.count]
            reference = reference if base is None else (at, base + joint.number)
            continue
        if CLOSURE_LIMIT * sigma > segment_mm / 2:
            first[joint.count] = None
            continue
        if reference is None:
            number = math.ceil((at - begin_mm) / segment_mm)
        else:
            number = reference[1] + _segments_between(at - reference[0], segment_mm)
        reference = (at, number)
        first[joint.count] = number - joint.number
    return [
        None if (base := first[joint.count]) is None else base + joint.number for joint in joints
    ]


def _segments_between(way_mm: float, segment_mm: float) -> int:
    """Count segments; one of odd length counts too, so that two joints never share a
    number.
    """
    segments = round(way_mm / segment_mm)
    if segments == 0 and abs(way_mm) > NEAR_JOINT_MM:
        return 1 if way_mm > 0 else -1
    return segments
