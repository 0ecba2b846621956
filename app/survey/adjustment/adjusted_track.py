"""The corrected track, and what it shows: joints, closures, residuals, accuracy."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from app.survey.adjustment.closure import Closure
from app.survey.adjustment.distance_class import DistanceClass
from app.survey.adjustment.joints import (
    NEAR_JOINT_MM,
    ExpectedJoint,
    FittedJoint,
    NearJoint,
    UncountedMark,
    each_once,
    expected_joints,
)
from app.survey.distances.interval import half_width_m
from app.survey.distances.stated import Zero
from app.survey.distances.track_rows import estimate_at, is_unmeasured
from app.survey.places.spans import SAME_MM
from vo_core import Rig, Track
from vo_core.errors import InvalidCorrection
from vo_core.geometry.height import Height, implied_height
from vo_core.scale.carrying import Carried
from vo_core.scale.correction import Correction, Residual
from vo_core.scale.evidence import CrestSpacing, JointSpacing, KnownLength, StatedScale
from vo_core.scale.proposal import ScaleProposal
from vo_core.track import Estimate
from vo_core.types import Matrix

Source = Literal["odometry", "joint", "closure", "counter", "bridged", "typed"]
"""What a distance rests on: the camera, with or without joints or a known length; a counter, or a
counter and the camera together where one of them fails; a person."""

Carrier = Literal["counter", "typed"]

SOURCES: tuple[Source, ...] = get_args(Source)

BY_CAMERA: frozenset[Source] = frozenset({"odometry", "joint", "closure"})
"""Sources that need no word wherever a distance is shown."""


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
    crests: CrestSpacing | None = None
    """The crests of a corrugated wall that set the scale too."""
    joints_refusal: Refusal | None = None
    """Why seen joints, or else crests, do not count although nobody switched them off."""
    rings: int = 0
    """Number of sightings of something like a joint."""
    carried: Carried | None = None
    """Where readings carry the distance instead of the camera; None if they do nowhere."""
    carrier: Carrier = "counter"
    """Whose readings these are."""
    waves_mm: float | None = None
    """From crest to crest of the waves that the wall shows, in corrected distance; None without."""

    @property
    def is_read(self) -> bool:
        """Whether readings carry the whole film: its zero and its scale are theirs."""
        return self.carried is not None and self.carried.is_whole

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

    @cached_property
    def sources(self) -> NDArray[np.uint8]:
        """(N,) what the distance of each row rests on, as an index into `SOURCES`.

        What another program measured, a person typed.
        """
        first: Source = "typed" if is_unmeasured(self.raw) else self.source
        found = np.full(len(self.track), SOURCES.index(first), np.uint8)
        if self.carried is not None:
            bridged: Source = "bridged" if self.carrier == "counter" else "typed"
            found[self.carried.is_read] = SOURCES.index(self.carrier)
            found[self.carried.is_bridged] = SOURCES.index(bridged)
        return found

    def source_at(self, frame: int) -> Source:
        """Return what the distance of a frame rests on; of one added since like the last one."""
        if not len(self.track):
            return self.source
        return SOURCES[int(self.sources[min(frame, len(self.track) - 1)])]

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
        return float(self.chainages_mm(np.array([raw_mm]))[0])

    def chainages_mm(self, raw_mm: Matrix) -> Matrix:
        """Return the same of many raw distances."""
        raw, corrected = self._by_distance
        if not len(raw):
            return raw_mm
        nearest = np.clip(raw_mm, raw[0], raw[-1])
        return np.asarray(np.interp(nearest, raw, corrected) + self.scale * (raw_mm - nearest))

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
        """The evidence for the joints, each joint once: tables show it and people may leave it
        out.
        """
        return each_once(self.sighted, self.rig.pipe.segment_length_mm)

    def joint_near(self, distance_mm: float) -> NearJoint | None:
        """The joint that was seen within 200 mm of a corrected distance."""
        ordered, places_mm = self._joints_by_place
        after = bisect_left(places_mm, distance_mm)
        beside = ordered[max(after - 1, 0) : after + 1]
        nearest = min(beside, key=lambda joint: abs(joint.distance_mm - distance_mm), default=None)
        if nearest is None or abs(nearest.distance_mm - distance_mm) > NEAR_JOINT_MM + SAME_MM:
            return None
        return NearJoint(nearest.number)

    @cached_property
    def _joints_by_place(self) -> tuple[list[FittedJoint], list[float]]:
        """The joints in the order of their corrected distances, and these."""
        ordered = sorted(self.joints, key=lambda joint: joint.distance_mm)
        return ordered, [joint.distance_mm for joint in ordered]

    @cached_property
    def by_joints(self) -> ScaleProposal | None:
        """The scale that the joints and crests give; None if they do not count."""
        ruler = self.spacing or self.crests
        if self.correction is None or ruler is None:
            return None
        return ScaleProposal.of(ruler, self.correction, self.rig)

    @cached_property
    def expected_joints(self) -> tuple[ExpectedJoint, ...]:
        """Places along the track where a joint is expected but none was seen."""
        segment_mm = self.rig.pipe.segment_length_mm
        if segment_mm is None or not len(self.track):
            return ()
        return expected_joints(self.track, self.sighted, segment_mm, has_zero=self.zero is not None)

    @property
    def measured(self) -> tuple[KnownLength | JointSpacing | CrestSpacing, ...]:
        """The known lengths, joints and crests that set the scale, besides the rig."""
        findings = self.correction.findings if self.correction else ()
        return tuple(
            found.evidence for found in findings if not isinstance(found.evidence, StatedScale)
        )

    @property
    def can_change(self) -> bool:
        """Whether joints, crests or lengths let new rows change the existing ones."""
        pipe = self.rig.pipe
        has_ruler = pipe.segment_length_mm is not None or pipe.corrugation is not None
        return has_ruler or bool(self.measured)

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
        return DistanceClass.of(length_mm, half_m, residual_mm)

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


def _renamed(left: Residual, joint: FittedJoint) -> Residual:
    number = "" if joint.number is None else f" {joint.number}"
    return replace(left, name=f"joint{number} in frame {joint.frame}")
