"""Correct a track by what people state about distances.

The raw track stays unchanged. Least squares derive the corrected track anew from the raw one, the
rig, the joints that were seen and what was stated (see `vo_core.scale.correction`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from app.survey.adjustment.adjusted_track import Adjusted, Carrier, Refusal
from app.survey.adjustment.closure import Closure
from app.survey.adjustment.joint_evidence import (
    chosen_joints,
    crests_as_evidence,
    joints_as_evidence,
    joints_to_show,
    marked_joints,
    require_certainty,
)
from app.survey.adjustment.joints import fitted_joints, uncounted_marks
from app.survey.distances.stated import Length, RigSigma, Stated
from app.survey.distances.track_rows import is_unmeasured
from vo_core import Rig, Track
from vo_core.drift import row_of
from vo_core.errors import InvalidCorrection, InvalidRig
from vo_core.joints.sightings import Sighting
from vo_core.scale.carrying import Carried, Readings, are_better, carried_wholly, carry
from vo_core.scale.correction import Correction, correct, zeroed
from vo_core.scale.crests import seen_pitch_mm
from vo_core.scale.evidence import (
    CrestSpacing,
    Evidence,
    KnownLength,
    StatedScale,
    rig_scale,
)

_MOST_FOCAL_PERCENT = 20.0
"""Largest tolerance of the focal length that a rig file states."""


TYPED_SIGMA_MM = 50.0
"""Standard uncertainty of a distance that a person types: read off to a decimetre."""


def adjust(
    raw: Track,
    rig: Rig,
    stated: Stated,
    sightings: Sequence[Sighting],
    counter: Readings | None = None,
) -> Adjusted:
    """Correct a track by all that was stated, by the tolerances of the rig and by the joints.

    Where the camera did not measure, typed distances carry it, or else the counter.

    An implausible known length is not used, unless it is forced; then the rig's own scale is not
    used, as the length contradicts it. Joints that nobody switched on or off count if their
    segments can be counted and they contradict nothing, and crests of a corrugated wall likewise.

    Args:
        raw: The measured track; row i is frame i.
        rig: The rig of that measurement.
        stated: What people stated.
        sightings: The joints seen in the run of `raw`.
        counter: What the counter of the film says, if it has one.
    Raises:
        InvalidCorrection: A frame is not in the track, or evidence cannot be used or contradicts
        other evidence.
    """
    rig = _as_known(rig, stated.rig_sigma)
    typed = _typed(raw, stated)
    if typed is not None:
        return _read(raw, rig, stated, carried_wholly(raw, typed), "typed")
    if counter is None or not len(raw) or is_unmeasured(raw):
        return _by_camera(raw, rig, stated, sightings)
    carried = carry(raw, counter)
    if carried is not None and carried.is_whole:
        return _read(raw, rig, stated, carried, "counter")
    way = raw if carried is None else carried.measured
    adjusted = _by_camera(way, rig, stated, sightings)
    if not stated.lengths and are_better(
        counter, adjusted.track, has_ruler=bool(adjusted.measured)
    ):
        return _read(raw, rig, stated, carried_wholly(raw, counter), "counter")
    return _of_run(adjusted, raw, carried)


def _read(raw: Track, rig: Rig, stated: Stated, carried: Carried, carrier: Carrier) -> Adjusted:
    """Correct a track whose distances are all read: neither its joints nor the rig say anything
    about them.
    """
    adjusted = _adjusted(carried.measured, rig, stated, [], [], [], [], joints_count=False)
    return replace(_of_run(adjusted, raw, carried), carrier=carrier)


def _of_run(adjusted: Adjusted, raw: Track, carried: Carried | None) -> Adjusted:
    """Return a correction of a carried track as one of the track of the run."""
    track = replace(adjusted.track, status=raw.status)
    return replace(adjusted, raw=raw, track=track, carried=carried)


def _typed(raw: Track, stated: Stated) -> Readings | None:
    """Return what a person typed as readings; None if nothing was."""
    if not stated.typed:
        return None
    typed = sorted(stated.typed, key=lambda each: each.frame)
    rows = np.array([row_of(raw, each.frame) for each in typed])
    distance_mm = np.array([1000 * each.distance_m for each in typed])
    rows, last = np.unique(rows[::-1], return_index=True)  # the last word on a frame counts
    return Readings(rows, distance_mm[::-1][last], TYPED_SIGMA_MM, share=0.0)


def _by_camera(raw: Track, rig: Rig, stated: Stated, sightings: Sequence[Sighting]) -> Adjusted:
    """Correct a track that the camera measured."""
    adjusted = _with_crests(raw, rig, stated, sightings)
    waves_mm = seen_pitch_mm(sightings)
    return replace(adjusted, waves_mm=waves_mm and adjusted.scale * waves_mm)


def _with_crests(raw: Track, rig: Rig, stated: Stated, sightings: Sequence[Sighting]) -> Adjusted:
    """Correct a track with the crests of a corrugated wall, unless these contradict the rest."""
    refusal = None
    try:
        if crests := crests_as_evidence(raw, stated.joints, rig, sightings, _by_rig(raw, rig)):
            return _with_joints(raw, rig, stated, sightings, [crests])
    except InvalidCorrection as error:
        refusal = Refusal.of(error)
    adjusted = _with_joints(raw, rig, stated, sightings, [])
    return replace(adjusted, joints_refusal=adjusted.joints_refusal or refusal)


def _with_joints(
    raw: Track,
    rig: Rig,
    stated: Stated,
    sightings: Sequence[Sighting],
    crests: Sequence[CrestSpacing],
) -> Adjusted:
    """Correct a track with or without joints, as was stated or as they can be counted."""
    marked = marked_joints(raw, rig, stated.joints)
    seen = chosen_joints(stated.joints, marked, sightings, len(raw))
    adjusted = partial(_adjusted, raw, rig, stated, _by_rig(raw, rig), seen, marked, crests)
    if stated.joints.use is not None:
        return adjusted(joints_count=stated.joints.use)
    if rig.pipe.segment_length_mm is None or not seen:
        return adjusted(joints_count=False)
    try:
        by_joints = adjusted(joints_count=True)
        require_certainty(by_joints, seen)
    except InvalidCorrection as refusal:
        without = adjusted(joints_count=False)
        return replace(without, joints_refusal=Refusal.of(refusal))
    return by_joints


def _adjusted(
    raw: Track,
    rig: Rig,
    stated: Stated,
    by_rig: Sequence[StatedScale],
    seen: Sequence[Sighting],
    marked: Sequence[Sighting],
    crests: Sequence[CrestSpacing],
    *,
    joints_count: bool,
) -> Adjusted:
    tapes = [_known_length(length) for length in stated.lengths if length.kind == "tape"]
    known = [_known_length(length) for length in stated.lengths if length.kind == "known"]
    by_joints = (
        [joints_as_evidence(raw, rig, seen, [*tapes, *crests, *by_rig], known)]
        if joints_count
        else []
    )
    closures = tuple(
        Closure.of(raw, length, [*tapes, *crests, *by_joints, *by_rig]) for length in known
    )
    implausible = next((closure for closure in closures if not closure.is_plausible), None)
    lengths, own = [*tapes, *known], list(by_rig)
    if implausible is not None and stated.forced:
        own = []
    elif implausible is not None:
        lengths = tapes
    evidence: list[Evidence] = [*lengths, *crests, *by_joints, *own]
    zero_frame = stated.zero.frame if stated.zero else None
    done = correct(raw, evidence, zero_frame=zero_frame) if evidence and len(raw) else None
    track = done.track if done else _counted_from(raw, zero_frame)
    if stated.zero is not None:
        track = _shifted(track, 1000 * stated.zero.offset_m)
    spacing = by_joints[0] if by_joints else joints_to_show(raw, rig, seen, evidence)
    return Adjusted(
        raw=raw,
        track=track,
        rig=rig,
        zero=stated.zero,
        scale=done.scale if done else 1.0,
        scale_sigma=_scale_sigma(raw, done, by_rig),
        correction=done,
        sighted=fitted_joints(track, spacing, done, marked, joints_count=joints_count),
        uncounted_marks=uncounted_marks(track, spacing, done, marked),
        closures=closures,
        refused=None if stated.forced else implausible,
        source="joint" if by_joints else "closure" if len(lengths) > len(tapes) else "odometry",
        spacing=by_joints[0] if by_joints else None,
        crests=crests[0] if crests else None,
        rings=len(seen),
    )


def _scale_sigma(
    raw: Track, done: Correction | None, by_rig: Sequence[StatedScale]
) -> float | None:
    if done is not None:
        return done.sigma
    if by_rig:
        return by_rig[0].sigma
    return None if len(raw) and is_unmeasured(raw) else 0.0


def _known_length(length: Length) -> KnownLength:
    return KnownLength(
        length.first_frame, length.last_frame, 1000 * length.length_m, length.sigma_mm
    )


def _as_known(rig: Rig, sigma: RigSigma | None) -> Rig:
    """Return the rig with the stated tolerances in place of those of its file."""
    if sigma is None:
        return rig
    focal_percent = 100 * sigma.focal_px / rig.camera.focal_px
    return rig.known_to(
        height_mm=sigma.height_mm, focal_percent=min(focal_percent, _MOST_FOCAL_PERCENT)
    )


def _by_rig(raw: Track, rig: Rig) -> list[StatedScale]:
    """Return the scale of the rig as evidence, or nothing.

    A rig says nothing about distances that another program measured, and a rig that sees no wall
    measures none.
    """
    if len(raw) and is_unmeasured(raw):
        return []
    try:
        return rig_scale(rig)
    except InvalidRig:
        return []


def _counted_from(raw: Track, frame: int | None) -> Track:
    return raw if frame is None else zeroed(raw, frame)


def _shifted(track: Track, offset_mm: float) -> Track:
    return replace(track, x_mm=track.x_mm + offset_mm, distance_mm=track.distance_mm + offset_mm)
