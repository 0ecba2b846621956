"""The effect of stated distances, in figures for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from app.survey.adjustment.adjusted_track import Adjusted, Refusal
from app.survey.adjustment.joints import FittedJoint
from app.survey.distances.interval import half_width_m
from app.survey.distances.notices import notices_of
from app.survey.distances.stated import Stated
from app.survey.rounding import metres, rounded
from app.survey.versions import version_of
from vo_core.geometry.tilt import MountTilt


@dataclass(frozen=True)
class Corrected:
    """What was stated, the track that follows, and what is wrong with it."""

    stated: Stated
    adjusted: Adjusted | None
    """The corrected track; None for a preview of statements that cannot be applied.

    Stored statements that no longer apply are left out of it.
    """
    error: dict[str, str] | None
    """Code and detail of the error; None if the statements can be applied."""
    refusal: Refusal | None = None
    """The same error for pages in other languages, if it has a name."""
    tilt: MountTilt | None = None
    """Tilt of the mount against the rig, over the run so far; None if it was not measured."""

    @property
    def version(self) -> str:
        """Version of what was stated."""
        return version_of(self.stated.to_json())


def reason_of(refusal: Refusal) -> dict[str, Any] | None:
    """Return name and values of a refusal, for other languages; None if it has no name."""
    if refusal.reason is None:
        return None
    return {"code": refusal.reason, "params": dict(refusal.values)}


def result_of(corrected: Corrected) -> dict[str, Any] | None:
    """Return the result for people: distances in metres, residuals in mm."""
    adjusted = corrected.adjusted
    if adjusted is None:
        return None
    met = adjusted.distance_class()
    if met is None:
        return None
    done, refusal = adjusted.correction, adjusted.joints_refusal
    return {
        "scale": _rounded(adjusted.scale, 6),
        "scale_sigma": _rounded(adjusted.scale_sigma, 6),
        "findings": [
            {
                "evidence": str(found.evidence),
                "scale": _rounded(found.scale, 6),
                "sigma": _rounded(found.sigma, 6),
            }
            for found in (done.findings if done else ())
        ],
        "residuals": [
            {
                "name": left.name,
                "measured_m": _metres(left.measured_mm),
                "residual_mm": _rounded(left.residual_mm, 2),
            }
            for left in adjusted.residuals()
        ],
        "joints": [_joint(joint) for joint in adjusted.evidence],
        "uncounted_marks": [
            {"frame": mark.frame, "distance_m": _metres(mark.distance_mm)}
            for mark in adjusted.uncounted_marks
        ],
        "expected_joints": [
            {"number": joint.number, "distance_m": _metres(joint.distance_mm)}
            for joint in adjusted.expected_joints
        ],
        "joints_refusal": None if refusal is None else refusal.sentence,
        "joints_reason": None if refusal is None else reason_of(refusal),
        "by_joints": _by_joints(adjusted),
        "notices": [
            {"code": notice.code, "params": notice.params}
            for notice in notices_of(adjusted, corrected.tilt)
        ],
        "closure": _closure(adjusted),
        "height": _height(adjusted),
        "distance_class": {
            "percent": met.percent,
            "half_width_m": met.half_width_m,
            "residual_m": _metres(met.residual_mm),
            "length_m": _metres(met.length_mm),
        },
    }


def _joint(joint: FittedJoint) -> dict[str, Any]:
    return {
        "number": joint.number,
        "distance_m": _metres(joint.distance_mm),
        "u95_m": half_width_m(joint.sigma_mm),
        "residual_mm": _rounded(joint.residual_mm, 2),
        "frame": joint.frame,
        "is_marked": joint.is_marked,
        "other_frames": list(joint.others),
    }


def _closure(adjusted: Adjusted) -> dict[str, Any] | None:
    closure = adjusted.closure
    if closure is None:
        return None
    return {
        "known_length_m": _metres(closure.known_mm),
        "measured_m": _metres(closure.measured_mm),
        "residual_mm": _rounded(closure.residual_mm, 1),
        "residual_percent": _rounded(closure.residual_percent, 3),
        "sigma_mm": _rounded(closure.sigma_mm, 1),
    }


def _height(adjusted: Adjusted) -> dict[str, Any] | None:
    height = adjusted.height
    if height is None:
        return None
    return {
        "height_mm": _rounded(height.height_mm, 2),
        "sigma_mm": _rounded(height.sigma_mm, 2),
    }


def _by_joints(adjusted: Adjusted) -> dict[str, Any] | None:
    """Return how the joints or crests changed the scale; None if they do not count."""
    found = adjusted.by_joints
    if found is None:
        return None
    return {
        "of": found.ruler,
        "joints": found.joints,
        "lengths": found.lengths,
        "scale": _rounded(found.scale, 4),
        "sigma": _rounded(found.sigma, 4),
        "lower_mm": _rounded(found.lower_mm, 3),
    }


def _metres(mm: float | None) -> float | None:
    return None if mm is None else metres(mm)


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else rounded(float(value), digits)
