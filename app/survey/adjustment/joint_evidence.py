"""Which joints that were seen or marked, and which crests, are evidence for distances."""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.survey.adjustment.adjusted_track import Adjusted
from app.survey.distances.stated import Joints, Mark
from app.survey.distances.track_rows import estimate_at, wall_point_of
from vo_core import Rig, Track
from vo_core.drift import Bed
from vo_core.errors import InvalidCorrection
from vo_core.joints.sightings import Sighting, rings
from vo_core.scale.correction import DOUBT, correct, joint_spacing
from vo_core.scale.crests import crest_spacing
from vo_core.scale.evidence import (
    CrestSpacing,
    Evidence,
    JointSpacing,
    KnownLength,
)
from vo_core.track import Estimate

CLICK_PX = 3.0
"""Standard deviation of a person's click on a joint, along either side of the picture."""
_LEAST_COUNTED = 0.7
"""Least share of the seen rings that must be joints to set the scale, since rings anywhere are no
joints; a smaller share is enough where three joints agree with the rig."""
_LEAST_AGAINST_RIG = 3
"""Joints that overrule the rig without a person: two segments that agree. Fewer are enough
where the wall itself shows that the rig is wrong."""
_MOST_AGAINST_RIG = 0.15
"""Largest relative change of the scale that joints make without a person: 25 mm of silt need 11 %,
a segment length of another pipe more. A bed that the wall shows may be deeper."""


def marked_joints(raw: Track, rig: Rig, joints: Joints) -> list[Sighting]:
    """Return the marked joints as sightings, unless joints are switched off.

    Raises:
        InvalidCorrection: No wall is seen at a mark, or its frame is not tracked or is lost.
    """
    return [_sighted(raw, rig, mark) for mark in joints.marked] if joints.use is not False else []


def _sighted(raw: Track, rig: Rig, mark: Mark) -> Sighting:
    """Place a click on the wall, as if a joint had been detected there."""
    estimate = estimate_at(raw, mark.frame)
    if estimate is None:
        raise InvalidCorrection(
            f"A joint was marked in frame {mark.frame}, which is not tracked.",
            "untracked_mark",
            frame=mark.frame,
        )
    if estimate.status == "lost":
        raise InvalidCorrection(
            f"The wall was not recognised in frame {mark.frame}; mark the joint in one beside it.",
            "lost_mark",
            frame=mark.frame,
        )
    u, v = mark.pixel
    ahead_mm, right_mm, below_mm = (
        _ahead_mm(rig, estimate, pixel) for pixel in ((u, v), (u + 1, v), (u, v + 1))
    )
    sigma_mm = CLICK_PX * math.hypot(right_mm - ahead_mm, below_mm - ahead_mm)
    return Sighting(mark.frame, ahead_mm, sigma_mm, 0.0)


def _ahead_mm(rig: Rig, estimate: Estimate, pixel: tuple[float, float]) -> float:
    point = wall_point_of(rig, pixel, estimate)
    if point is None:
        raise InvalidCorrection(
            f"No wall is seen in frame {estimate.frame} at the pixel ({pixel[0]:g}, {pixel[1]:g}).",
            "mark_off_the_wall",
            frame=estimate.frame,
        )
    return point.distance_mm - estimate.x_mm


def chosen_joints(
    joints: Joints, marked: Sequence[Sighting], sightings: Sequence[Sighting], rows: int
) -> list[Sighting]:
    """Return the marked joints, then the seen ones of the first `rows` frames that nobody left
    out.
    """
    left_out = {sighting.frame for sighting in joints.left_out}
    found = [s for s in rings(sightings) if s.frame < rows and s.frame not in left_out]
    return [*marked, *found]


def joints_as_evidence(
    raw: Track,
    rig: Rig,
    seen: Sequence[Sighting],
    firm: Sequence[Evidence],
    known: Sequence[KnownLength],
) -> JointSpacing:
    """Return the joints as evidence.

    Known lengths help to count them only where counting fails without, so that the joints reveal a
    wrong length.
    """
    segment_mm = rig.pipe.segment_length_mm
    if segment_mm is None:
        raise InvalidCorrection(
            "The rig does not say how long a segment is; joints need pipe.segment_length_mm.",
            "no_segment",
        )
    sigma_mm = rig.tolerance.segment_length_mm
    try:
        return joint_spacing(raw, seen, segment_mm, firm, segment_sigma_mm=sigma_mm)
    except InvalidCorrection:
        if not known:
            raise
    return joint_spacing(raw, seen, segment_mm, [*firm, *known], segment_sigma_mm=sigma_mm)


def crests_as_evidence(
    raw: Track,
    joints: Joints,
    rig: Rig,
    sightings: Sequence[Sighting],
    by_rig: Sequence[Evidence],
) -> CrestSpacing | None:
    """Return the crests of a corrugated wall as evidence, unless joints are switched off.

    Raises:
        InvalidCorrection: They contradict the rig: nobody can tell a wrong pitch from a wrong rig.
    """
    seen = [sighting for sighting in sightings if sighting.frame < len(raw)]
    spacing = None
    if joints.use is not False:
        spacing = crest_spacing(raw, seen, rig.pipe.corrugation)
    if spacing is None or not by_rig:
        return spacing
    done = correct(raw, [spacing, *by_rig])
    if done.doubts_rig:
        pitch_mm = spacing.segment_mm / done.scale
        raise InvalidCorrection(
            f"The crests are seen {pitch_mm:.1f} mm apart, which {spacing.segment_mm:g} mm and the "
            "rig do not explain; check the pitch, the camera's height and the diameter.",
            "unexplained_pitch",
            seen_mm=round(pitch_mm, 1),
            pitch_mm=spacing.segment_mm,
        )
    return spacing


def joints_to_show(
    raw: Track, rig: Rig, seen: Sequence[Sighting], evidence: Sequence[Evidence]
) -> JointSpacing | None:
    """Return joints that do not count, to show where they are; None if they are uncertain."""
    segment_mm = rig.pipe.segment_length_mm
    if segment_mm is None or not seen or not evidence:
        return None
    try:
        spacing = joint_spacing(
            raw, seen, segment_mm, evidence, segment_sigma_mm=rig.tolerance.segment_length_mm
        )
    except InvalidCorrection:
        return None
    return spacing if len(spacing.joints) >= _LEAST_COUNTED * len(seen) else None


def require_certainty(found: Adjusted, seen: Sequence[Sighting]) -> None:
    """Raise InvalidCorrection unless enough rings are joints: some of any set of rings fit a
    lattice, and nobody asked for their scale.
    """
    spacing, done = found.spacing, found.correction
    if spacing is None or done is None:
        return
    counted = len(spacing.joints)
    different = len({(joint.count, joint.number) for joint in spacing.joints})
    agrees = different >= _LEAST_AGAINST_RIG and not done.doubts_rig
    if counted < _LEAST_COUNTED * len(seen) and not agrees:
        raise InvalidCorrection(
            f"Of {len(seen)} rings that were seen only {counted} lie whole segments of "
            f"{spacing.segment_mm:g} mm apart, so that they do not set the scale by themselves; "
            "check the length of a segment, or tape a length.",
            "few_counted",
            n=len(seen),
            counted=counted,
            segment_mm=spacing.segment_mm,
        )
    by_bed = DOUBT * Bed.of(found.raw).share
    if done.doubts_rig and abs(done.scale - 1) > max(_MOST_AGAINST_RIG, by_bed):
        raise InvalidCorrection(
            f"{different} joints require a scale of {done.scale:.3f}, which neither the rig nor a "
            f"bed of silt explains; check whether a segment has {spacing.segment_mm:g} mm.",
            "unexplained_scale",
            n=different,
            scale=round(done.scale, 3),
            segment_mm=spacing.segment_mm,
        )
    if done.doubts_rig and different < _LEAST_AGAINST_RIG and abs(done.scale - 1) > by_bed:
        raise InvalidCorrection(
            f"{different} joints require a scale of {done.scale:.3f}, which the rig does not "
            "explain; one more joint or a taped length decides.",
            "undecided_scale",
            n=different,
            scale=round(done.scale, 3),
        )
