"""Proposes the scale of a run from the joints seen so far, during the drive and after it.

Joints are a tape that lies in every culvert: from the second joint on they determine the scale.  In
a corrugated pipe the crests of its waves are another one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from vo_core.geometry.height import Height, implied_height
from vo_core.joints.sightings import Sighting, numbered, rings
from vo_core.rig import Rig
from vo_core.scale.correction import Correction, Stretch, correct, joint_spacing
from vo_core.scale.crests import crest_spacing
from vo_core.scale.evidence import (
    CrestSpacing,
    Evidence,
    JointSpacing,
    KnownLength,
    rig_scale,
)
from vo_core.track import Track

LEAST_JOINTS = 2
"""Least number of different joints that determine a scale."""


@dataclass(frozen=True)
class ScaleProposal:
    """The scale by joints or by crests, and what it implies for the rig."""

    spacing: JointSpacing | CrestSpacing
    """The counted joints, or crests where there are no joints, as evidence for `correct`."""
    correction: Correction
    """The track so far, corrected by the joints and all other evidence."""
    joints: int
    """Number of different joints, or places of crests; one that was passed twice counts once."""
    scale: float
    """True length over that of the raw track; the mean where the scale changes along the run."""
    sigma: float
    """Standard uncertainty of `scale`."""
    stated_height_mm: float
    """Camera height by the rig."""
    height: Height | None
    """Camera height that explains the scale if all else in the rig is right.

    None where the height hardly matters, where no camera could sit at that height, or where the
    scale changes along the run."""

    @classmethod
    def of(
        cls, spacing: JointSpacing | CrestSpacing, correction: Correction, rig: Rig
    ) -> ScaleProposal:
        """Derive the proposal from the joints, the track corrected by them, and its rig."""
        scale, sigma = correction.scale, correction.sigma
        return cls(
            spacing=spacing,
            correction=correction,
            joints=spacing.places,
            scale=scale,
            sigma=sigma,
            stated_height_mm=rig.mount.height_mm,
            height=None if correction.stretches else implied_height(rig, scale, sigma),
        )

    @property
    def ruler(self) -> Literal["joints", "crests"]:
        """What the scale is by."""
        return "joints" if isinstance(self.spacing, JointSpacing) else "crests"

    @property
    def doubts_rig(self) -> bool:
        """Whether the joints imply a scale that the rig's tolerances do not explain."""
        return self.correction.doubts_rig

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """The scale from joint to joint if it changes along the run, as over silt; else empty."""
        return self.correction.stretches

    @property
    def lengths(self) -> int:
        """Number of known lengths, such as taped ones, that set the scale with the joints."""
        return sum(isinstance(found.evidence, KnownLength) for found in self.correction.findings)

    @property
    def lower_mm(self) -> float | None:
        """By how much the camera sits lower than the rig states, if only the height is wrong."""
        return None if self.height is None else self.stated_height_mm - self.height.height_mm

    def __str__(self) -> str:
        """A sentence such as "5 joints: scale 0.9914 ± 0.0033; your camera sits 2 mm lower".

        Where a length was measured the height is no finding of the joints, and not said.
        """
        lengths = f" and {self.lengths} measured length{'s'[: self.lengths != 1]}"
        is_joints = self.ruler == "joints"
        places = f"{self.joints} joints" if is_joints else f"crests at {self.joints} places"
        sources = f"{places}{lengths if self.lengths else ''}"
        by_joints = f"{sources}: scale {self.scale:.4f} ± {self.sigma:.4f}"
        if scales := self.correction.changing_scales:
            return (
                f"{by_joints}, and it changes along the run from {scales[0]:.3f} to "
                f"{scales[-1]:.3f}; silt or water in the invert is a likely cause"
            )
        lower_mm = self.lower_mm
        if self.doubts_rig:
            wrong = (
                "picture and rig disagree"
                if lower_mm is None
                else f"the camera would have to sit {_beside(lower_mm)} than the rig says"
            )
            return (
                f"{by_joints}; {wrong}: check height and lens; silt or water in the invert is a "
                "likely cause"
            )
        if lower_mm is None or abs(lower_mm) < 0.5 or self.lengths:
            return by_joints
        return f"{by_joints}; your camera sits {_beside(lower_mm)}"


def propose(
    track: Track, sightings: Sequence[Sighting], rig: Rig, others: Sequence[Evidence] = ()
) -> ScaleProposal | None:
    """Propose the scale of a run from its joints and crests; cheap enough to repeat at each.

    Args:
        track: As it was measured so far.
        sightings: Sightings made with `track`; those beyond its end are left out.
        rig: The rig of the track; its tolerances help to count the segments.
        others: Further evidence, such as taped lengths.
    Returns:
        None if the rig states neither the length of a segment nor a pitch, or joints and crests
        were seen at fewer than two places.
    Raises:
        InvalidCorrection: The sightings cannot be counted as joints (yet), or they contradict each
            other or a taped length; the message states which.
    """
    segment_mm = rig.pipe.segment_length_mm
    seen = [sighting for sighting in sightings if sighting.frame in track.frame]
    crests, by_joints = crest_spacing(track, seen, rig.pipe.corrugation), None
    evidence: list[Evidence] = [*others, *rig_scale(rig), *([crests] if crests else [])]
    if segment_mm is not None and len(set(numbered(track, rings(seen)))) >= LEAST_JOINTS:
        by_joints = joint_spacing(
            track, seen, segment_mm, evidence, segment_sigma_mm=rig.tolerance.segment_length_mm
        )
    spacing = by_joints or crests
    if spacing is None:
        return None
    done = correct(track, [*evidence, *([by_joints] if by_joints else [])])
    return ScaleProposal.of(spacing, done, rig)


def _beside(lower_mm: float) -> str:
    return f"{abs(lower_mm):.0f} mm {'lower' if lower_mm > 0 else 'higher'}"
