"""Correct a track by what people state about distances.

The raw track stays unchanged. Least squares derive the corrected track anew from the raw one, the
rig, the joints that were seen and what was stated (see `vo_core.scale.correction`).
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from app.survey.interval import half_width_m
from app.survey.stated import Joints, Length, Mark, RigSigma, Stated, Zero
from app.survey.track_rows import estimate_at, is_unmeasured, wall_point_of
from vo_core import Rig, Track
from vo_core.drift import Bed, row_of
from vo_core.errors import InvalidCorrection, InvalidRig
from vo_core.geometry.height import Height, implied_height
from vo_core.joints.finder import Sighting
from vo_core.joints.lattice import SCALE_SIGMA, Joint
from vo_core.scale.correction import (
    DOUBT,
    Correction,
    Residual,
    correct,
    joint_spacing,
    zeroed,
)
from vo_core.scale.evidence import Evidence, JointSpacing, KnownLength, StatedScale, rig_scale
from vo_core.scale.proposal import ScaleProposal
from vo_core.track import Estimate
from vo_core.types import Matrix

NEAR_JOINT_MM = 200.0
"""Distance within which an observation counts as at a joint: the rule of one coding family, 8
inches."""
CLOSURE_LIMIT = 3.0
"""Standard deviations beyond which a known length contradicts the run."""
CLICK_PX = 3.0
"""Standard deviation of a person's click on a joint, along either side of the picture."""
UNCALIBRATED = SCALE_SIGMA
"""Relative standard uncertainty of the scale where nothing else is known about it."""
_LEAST_COUNTED = 0.7
"""Least share of the seen rings that must be joints to set the scale, since rings anywhere are no
joints; a smaller share is enough where three joints agree with the rig."""
_LEAST_AGAINST_RIG = 3
"""Joints that overrule the rig without a person: two segments that agree. Fewer are enough
where the wall itself shows that the rig is wrong."""
_MOST_AGAINST_RIG = 0.15
"""Largest relative change of the scale that joints make without a person: 25 mm of silt need 11 %,
a segment length of another pipe more. A bed that the wall shows may be deeper."""
_MOST_FOCAL_PERCENT = 20.0
"""Largest tolerance of the focal length that a rig file states."""
CLASSES_PERCENT = (0.5, 1.0, 5.0)
CLASS_FLOOR_MM = 300.0
"""Floor of the limit of a class: contracts ask for a per cent of the length, but for no less than a
foot."""

Source = Literal["odometry", "joint", "closure", "typed"]


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


@dataclass(frozen=True)
class Closure:
    """A known length compared with the length measured without it."""

    known_mm: float
    measured_mm: float
    sigma_mm: float
    """Standard deviation of the residual."""

    @property
    def residual_mm(self) -> float:
        """Measured less known length."""
        return self.measured_mm - self.known_mm

    @property
    def residual_percent(self) -> float:
        """The residual in percent of the known length."""
        return 100 * self.residual_mm / self.known_mm

    @property
    def is_plausible(self) -> bool:
        """Whether chance explains the residual."""
        return abs(self.residual_mm) <= CLOSURE_LIMIT * self.sigma_mm

    def refusal(self) -> str:
        """The sentence that says why an implausible length is not used."""
        return (
            f"The known length of {self.known_mm / 1000:.3f} m does not fit: "
            f"{self.measured_mm / 1000:.3f} m were measured, {self.residual_mm:+.0f} mm "
            f"({self.residual_percent:+.2f} %), where {CLOSURE_LIMIT * self.sigma_mm:.0f} mm can "
            "be explained. Likely causes are the wrong asset, the wrong end, or a stretch where "
            "the wall was lost. If the length is right all the same, force it with a remark."
        )


@dataclass(frozen=True)
class Refusal:
    """The reason why what is known of distances cannot be used."""

    sentence: str
    reason: str | None
    """Name of the reason, for pages in other languages; `values` holds what varies in it."""
    values: Mapping[str, float | str]

    @classmethod
    def of(cls, error: InvalidCorrection) -> Refusal:
        """Return the refusal without the traceback that an exception holds."""
        return cls(str(error), error.reason, error.values)


@dataclass(frozen=True)
class DistanceClass:
    """The percentage of the length within which distances are known."""

    percent: float | None
    """0.5, 1 or 5; None if not even 5 is met."""
    half_width_m: float
    """Half of the 95 % interval at the far end."""
    residual_mm: float | None
    """Residual of the closure; None if the length is not known."""
    length_mm: float


@dataclass(frozen=True)
class Adjusted:
    """A track corrected by all that was stated, with the evidence used."""

    raw: Track
    track: Track
    """The corrected track, with one row for each of `raw`."""
    rig: Rig
    """The rig, with the stated tolerances if there are any."""
    zero: Zero | None = None
    scale: float = 1.0
    """True length over the length of the raw track."""
    scale_sigma: float | None = None
    """None if nothing is known about the scale: another program measured the track."""
    correction: Correction | None = None
    sighted: tuple[FittedJoint, ...] = ()
    """Every sighting of a joint, in the order of the evidence, including a seam at the zero."""
    uncounted_marks: tuple[UncountedMark, ...] = ()
    """Clicks that match no joint and are not used."""
    closures: tuple[Closure, ...] = ()
    refused: Closure | None = None
    """An implausible known length that was not forced; the track does not use it."""
    source: Source = "odometry"
    spacing: JointSpacing | None = None
    """The joints that set the scale of the track; None if they do not count."""
    joints_refusal: Refusal | None = None
    """Why seen joints do not count although nobody switched them off."""
    rings: int = 0
    """Number of sightings of something like a joint."""

    def extended(self, raw: Track) -> Track:
        """Return the corrected track of a run that has grown since."""
        rows = len(self.track)
        if len(raw) <= rows:
            return self.track
        new = slice(rows, None)
        way_mm, variance = raw.distance_mm[new], np.square(raw.sigma_registration_mm[new])
        distance_mm = self._onward_mm(way_mm)
        sigma_mm = np.sqrt(self._onward_variance(way_mm, variance))
        own = self.track
        return replace(
            raw,
            x_mm=np.concatenate([own.x_mm, distance_mm]),
            y_mm=self.scale * raw.y_mm,
            distance_mm=np.concatenate([own.distance_mm, distance_mm]),
            sigma_distance_mm=np.concatenate([own.sigma_distance_mm, sigma_mm]),
        )

    def estimate(self, raw: Estimate) -> Estimate:
        """Return the corrected estimate of a frame, also of one added since."""
        found = estimate_at(self.track, raw.frame)
        if found is not None:
            return found
        way_mm = np.array([raw.distance_mm])
        distance_mm = float(self._onward_mm(way_mm)[0])
        variance = self._onward_variance(way_mm, np.array([raw.sigma_registration_mm**2]))
        return replace(
            raw,
            x_mm=distance_mm,
            y_mm=self.scale * raw.y_mm,
            distance_mm=distance_mm,
            sigma_distance_mm=math.sqrt(variance[0]),
        )

    def chainage_mm(self, raw_mm: float) -> float:
        """Return the corrected distance of a raw one; the mean where the robot passed several
        times.
        """
        raw, corrected = self._by_distance
        if not len(raw):
            return raw_mm
        nearest = min(max(raw_mm, float(raw[0])), float(raw[-1]))
        return float(np.interp(nearest, raw, corrected)) + self.scale * (raw_mm - nearest)

    @cached_property
    def _by_distance(self) -> tuple[Matrix, Matrix]:
        """Return rising raw distances and the mean corrected distance at each, to a millimetre."""
        millimetre = np.rint(self.raw.distance_mm)
        _, place, count = np.unique(millimetre, return_inverse=True, return_counts=True)
        raw = np.bincount(place, self.raw.distance_mm) / count
        return raw, np.bincount(place, self.track.distance_mm) / count

    @property
    def _last_scale(self) -> float:
        """The scale at the last row; it may vary along the run."""
        stretches = self.correction.stretches if self.correction else ()
        return stretches[-1].scale if stretches else self.scale

    def _onward_mm(self, way_mm: Matrix) -> Matrix:
        """Return corrected distances for raw distances beyond the last row."""
        if not len(self.track):
            return way_mm
        last_mm, raw_mm = float(self.track.distance_mm[-1]), float(self.raw.distance_mm[-1])
        return last_mm + self._last_scale * (way_mm - raw_mm)

    def _onward_variance(self, way_mm: Matrix, variance: Matrix) -> Matrix:
        """Return the variance beyond the last row: that of the last row plus what registration and
        scale added since.
        """
        scale_variance = (self.scale_sigma or 0.0) ** 2
        if not len(self.track):
            return variance + scale_variance * way_mm**2
        zero_mm = float(self.raw.distance_mm[self.zero.frame]) if self.zero else 0.0
        last_mm = float(self.raw.distance_mm[-1])
        last = float(self.raw.sigma_registration_mm[-1] ** 2)
        by_scale = scale_variance * ((way_mm - zero_mm) ** 2 - (last_mm - zero_mm) ** 2)
        known = float(self.track.sigma_distance_mm[-1] ** 2)
        # Where the raw variance falls again (a lock after a loss), so does the corrected one.
        drift = np.maximum(known + variance - last, np.minimum(known, variance))
        return np.asarray(np.maximum(drift + by_scale, 0.0))

    @cached_property
    def joints(self) -> tuple[FittedJoint, ...]:
        """The seen joints of the pipe, as every drawing shows them.

        A seam at the zero is the start of the pipe, not a joint.
        """
        return tuple(joint for joint in self.evidence if joint.number is None or joint.number >= 1)

    @cached_property
    def evidence(self) -> tuple[FittedJoint, ...]:
        """The evidence for the joints, each joint once: tables show it and people may leave it out.

        A click takes precedence over a detected ring; otherwise the surest sighting does.
        """
        groups: list[list[FittedJoint]] = []
        for joint in self.sighted:
            same = next((group for group in groups if self._are_one(group[0], joint)), None)
            if same is None:
                groups.append([joint])
            else:
                same.append(joint)
        return tuple(_one_of(group) for group in groups)

    def _are_one(self, one: FittedJoint, other: FittedJoint) -> bool:
        """Return whether two sightings are of the same joint."""
        if one.number is not None or other.number is not None:
            return one.number == other.number
        segment_mm = self.rig.pipe.segment_length_mm or 0.0
        return abs(one.distance_mm - other.distance_mm) < segment_mm / 2

    def joint_near(self, distance_mm: float) -> NearJoint | None:
        """The joint that was seen within 200 mm of a corrected distance."""
        ordered, places_mm = self._joints_by_place
        after = bisect_left(places_mm, distance_mm)
        beside = ordered[max(after - 1, 0) : after + 1]
        nearest = min(beside, key=lambda joint: abs(joint.distance_mm - distance_mm), default=None)
        if nearest is None or abs(nearest.distance_mm - distance_mm) > NEAR_JOINT_MM:
            return None
        return NearJoint(nearest.number)

    @cached_property
    def _joints_by_place(self) -> tuple[list[FittedJoint], list[float]]:
        """The joints in the order of their corrected distances, and these."""
        ordered = sorted(self.joints, key=lambda joint: joint.distance_mm)
        return ordered, [joint.distance_mm for joint in ordered]

    @cached_property
    def by_joints(self) -> ScaleProposal | None:
        """The scale that the joints give; None if they do not count."""
        done, spacing = self.correction, self.spacing
        if done is None or spacing is None:
            return None
        return ScaleProposal(
            spacing=spacing,
            correction=done,
            joints=len({(joint.count, joint.number) for joint in spacing.joints}),
            scale=done.scale,
            sigma=done.sigma,
            stated_height_mm=self.rig.mount.height_mm,
            height=self.height,
        )

    @cached_property
    def expected_joints(self) -> tuple[ExpectedJoint, ...]:
        """Places along the track where a joint is expected but none was seen.

        They lie whole segments from the nearest seen joint, or from a stated zero where none was
        seen.
        """
        segment_mm = self.rig.pipe.segment_length_mm
        if segment_mm is None or not len(self.track):
            return ()
        seen = [(joint.number, joint.distance_mm) for joint in self.sighted]
        known = [(number, at_mm) for number, at_mm in seen if number is not None]
        if not seen and self.zero is not None:
            known = [(0, 0.0)]
        if not known:
            return ()
        first_mm, last_mm = (float(end(self.track.distance_mm)) for end in (np.min, np.max))
        expected = []
        for number in range(1, 1 + math.ceil((last_mm - known[0][1]) / segment_mm) + known[0][0]):
            base, base_mm = min(known, key=lambda joint: abs(joint[0] - number))
            at_mm = base_mm + (number - base) * segment_mm
            is_seen = any(abs(there_mm - at_mm) < segment_mm / 2 for _, there_mm in seen)
            if first_mm <= at_mm <= last_mm and not is_seen:
                expected.append(ExpectedJoint(number, at_mm))
        return tuple(expected)

    @property
    def measured(self) -> tuple[KnownLength | JointSpacing, ...]:
        """The known lengths and joints that set the scale, besides the rig."""
        findings = self.correction.findings if self.correction else ()
        return tuple(
            found.evidence for found in findings if not isinstance(found.evidence, StatedScale)
        )

    @property
    def can_change(self) -> bool:
        """Whether joints or lengths let new rows change the existing ones."""
        return self.rig.pipe.segment_length_mm is not None or bool(self.measured)

    @cached_property
    def height(self) -> Height | None:
        """The camera height that explains the scale; None if only the rig supports it or the scale
        varies.
        """
        done = self.correction
        if done is None or not self.measured or done.stretches:
            return None
        return implied_height(self.rig, done.scale, done.sigma)

    @property
    def closure(self) -> Closure | None:
        """The closure of the longest known length."""
        return max(self.closures, key=lambda closure: closure.known_mm, default=None)

    def distance_class(self) -> DistanceClass | None:
        """The accuracy class of the distances; None without a track.

        Of a track that another program measured it is None too, unless a length was stated.
        """
        if not len(self.track) or (self.correction is None and is_unmeasured(self.raw)):
            return None
        far = int(self.track.distance_mm.argmax())
        length_mm = float(self.track.distance_mm[far])
        half_m = half_width_m(float(self.track.sigma_distance_mm[far]))
        residual_mm = self.closure.residual_mm if self.closure else None
        error_mm = max(1000 * half_m, abs(residual_mm or 0.0))
        met = (p for p in CLASSES_PERCENT if error_mm <= max(p / 100 * length_mm, CLASS_FLOOR_MM))
        return DistanceClass(next(met, None), half_m, residual_mm, length_mm)

    def residuals(self) -> list[Residual]:
        """The residuals of lengths, then of joints, which are named by their number from the
        zero.
        """
        if self.correction is None:
            return []
        left = self.correction.residuals
        counted = self.sighted if self.source == "joint" else ()
        lengths = len(left) - len(counted)
        return [*left[:lengths], *map(_renamed, left[lengths:], counted)]

    def metadata(self) -> dict[str, str]:
        """The header lines of a track file: what was corrected by what."""
        lines = {}
        if self.zero is not None:
            lines["zero"] = f"frame {self.zero.frame} at {self.zero.offset_m:.3f} m"
        return lines | (self.correction.metadata() if self.correction else {})


def adjust(raw: Track, rig: Rig, stated: Stated, sightings: Sequence[Sighting]) -> Adjusted:
    """Correct a track by all that was stated, by the tolerances of the rig and by the joints.

    An implausible known length is not used, unless it is forced; then the rig's own scale is not
    used, as the length contradicts it. Joints that nobody switched on or off count if their
    segments can be counted and they contradict nothing.

    Args:
        raw: The measured track; row i is frame i.
        rig: The rig of that measurement.
        stated: What people stated.
        sightings: The joints seen in the run of `raw`.
    Raises:
        InvalidCorrection: A frame is not in the track, or evidence cannot be used or contradicts
        other evidence.
    """
    rig = _as_known(rig, stated.rig_sigma)
    marked = _marked(raw, rig, stated.joints)
    seen = _chosen(stated.joints, marked, sightings, len(raw))
    if stated.joints.use is not None:
        return _adjusted(raw, rig, stated, seen, marked, joints_count=stated.joints.use)
    if rig.pipe.segment_length_mm is None or not seen:
        return _adjusted(raw, rig, stated, seen, marked, joints_count=False)
    try:
        by_joints = _adjusted(raw, rig, stated, seen, marked, joints_count=True)
        _require_certainty(by_joints, seen)
    except InvalidCorrection as refusal:
        without = _adjusted(raw, rig, stated, seen, marked, joints_count=False)
        return replace(without, joints_refusal=Refusal.of(refusal))
    return by_joints


def _require_certainty(found: Adjusted, seen: Sequence[Sighting]) -> None:
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


def _adjusted(
    raw: Track,
    rig: Rig,
    stated: Stated,
    seen: Sequence[Sighting],
    marked: Sequence[Sighting],
    *,
    joints_count: bool,
) -> Adjusted:
    tapes = [_known_length(length) for length in stated.lengths if length.kind == "tape"]
    known = [_known_length(length) for length in stated.lengths if length.kind == "known"]
    by_rig = _by_rig(raw, rig)
    by_joints = [_spacing(raw, rig, seen, [*tapes, *by_rig], known)] if joints_count else []
    closures = tuple(_closure(raw, length, [*tapes, *by_joints, *by_rig]) for length in known)
    implausible = next((closure for closure in closures if not closure.is_plausible), None)
    lengths, own = [*tapes, *known], by_rig
    if implausible is not None and stated.forced:
        own = []
    elif implausible is not None:
        lengths = tapes
    evidence: list[Evidence] = [*lengths, *by_joints, *own]
    zero_frame = stated.zero.frame if stated.zero else None
    done = correct(raw, evidence, zero_frame=zero_frame) if evidence and len(raw) else None
    track = done.track if done else _counted_from(raw, zero_frame)
    if stated.zero is not None:
        track = _shifted(track, 1000 * stated.zero.offset_m)
    spacing = by_joints[0] if by_joints else _seen_spacing(raw, rig, seen, evidence)
    return Adjusted(
        raw=raw,
        track=track,
        rig=rig,
        zero=stated.zero,
        scale=done.scale if done else 1.0,
        scale_sigma=_scale_sigma(raw, done, by_rig),
        correction=done,
        sighted=_fitted(track, spacing, done, marked, joints_count=joints_count),
        uncounted_marks=_uncounted(track, spacing, done, marked),
        closures=closures,
        refused=None if stated.forced else implausible,
        source="joint" if by_joints else "closure" if len(lengths) > len(tapes) else "odometry",
        spacing=by_joints[0] if by_joints else None,
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


def _marked(raw: Track, rig: Rig, joints: Joints) -> list[Sighting]:
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


def _chosen(
    joints: Joints, marked: Sequence[Sighting], sightings: Sequence[Sighting], rows: int
) -> list[Sighting]:
    left_out = {sighting.frame for sighting in joints.left_out}
    found = [s for s in sightings if s.frame < rows and s.frame not in left_out]
    return [*marked, *found]


def _spacing(
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


def _seen_spacing(
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


def _closure(raw: Track, length: KnownLength, others: Sequence[Evidence]) -> Closure:
    evidence = others or [StatedScale(UNCALIBRATED)]
    without = correct(raw, evidence, zero_frame=length.first_frame).track
    row = row_of(without, length.last_frame)
    sigma_mm = math.hypot(float(without.sigma_distance_mm[row]), length.sigma_mm)
    return Closure(length.length_mm, abs(float(without.distance_mm[row])), sigma_mm)


def _counted_from(raw: Track, frame: int | None) -> Track:
    return raw if frame is None else zeroed(raw, frame)


def _shifted(track: Track, offset_mm: float) -> Track:
    return replace(track, x_mm=track.x_mm + offset_mm, distance_mm=track.distance_mm + offset_mm)


def _fitted(
    track: Track,
    spacing: JointSpacing | None,
    done: Correction | None,
    marked: Sequence[Sighting],
    *,
    joints_count: bool,
) -> tuple[FittedJoint, ...]:
    """Return the joints in the corrected track."""
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


def _one_of(group: Sequence[FittedJoint]) -> FittedJoint:
    """Choose the sighting that represents a joint."""
    best = min(group, key=lambda joint: (not joint.is_marked, joint.sigma_mm))
    others = sorted({joint.frame for joint in group} - {best.frame})
    return replace(best, others=tuple(others))


def _uncounted(
    track: Track,
    spacing: JointSpacing | None,
    done: Correction | None,
    marked: Sequence[Sighting],
) -> tuple[UncountedMark, ...]:
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


def _renamed(left: Residual, joint: FittedJoint) -> Residual:
    number = "" if joint.number is None else f" {joint.number}"
    return replace(left, name=f"joint{number} in frame {joint.frame}")


def _segments_between(way_mm: float, segment_mm: float) -> int:
    """Count segments; one of odd length counts too, so that two joints never share a
    number.
    """
    segments = round(way_mm / segment_mm)
    if segments == 0 and abs(way_mm) > NEAR_JOINT_MM:
        return 1 if way_mm > 0 else -1
    return segments


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
