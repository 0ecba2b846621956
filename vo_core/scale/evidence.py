"""Evidence about the scale of a track: known lengths, counted joints and crests, the rig itself."""

from __future__ import annotations

from dataclasses import dataclass

from vo_core.geometry.height import scale_sigma
from vo_core.joints.chains import PRIOR_SCATTER_MM
from vo_core.joints.lattice import Joint
from vo_core.rig import Rig

TAPE_SIGMA_MM = 5.0
"""Default uncertainty of a taped length, one sigma, including the choice of the two frames."""

SEGMENT_SIGMA_MM = 5.0
"""Default uncertainty of the stated length of a segment, one sigma, common to all segments."""


@dataclass(frozen=True)
class KnownLength:
    """Known way of the camera along the axis between two frames, by a tape or from drawings."""

    first_frame: int
    last_frame: int
    length_mm: float
    sigma_mm: float = TAPE_SIGMA_MM

    def __str__(self) -> str:
        return (
            f"{self.length_mm / 1000:g} m ± {self.sigma_mm:g} mm between frames "
            f"{self.first_frame} and {self.last_frame}"
        )


@dataclass(frozen=True)
class Spacing:
    """Counted places on the wall, and the length of a segment from one to the next."""

    joints: tuple[Joint, ...]
    segment_mm: float
    segment_sigma_mm: float = SEGMENT_SIGMA_MM
    scatter_mm: float = PRIOR_SCATTER_MM
    """Usual scatter of single segments, one sigma."""

    @property
    def places(self) -> int:
        """Number of different places."""
        return len({(joint.count, joint.number) for joint in self.joints})


@dataclass(frozen=True)
class JointSpacing(Spacing):
    """Counted joints, and the length of a segment from joint to joint."""

    def __str__(self) -> str:
        return f"{self.places} joints {self.segment_mm:g} mm apart"


@dataclass(frozen=True)
class CrestSpacing(Spacing):
    """Counted crests of a corrugated wall, and their pitch."""

    def __str__(self) -> str:
        return f"crests {self.segment_mm:g} mm apart at {self.places} places"


@dataclass(frozen=True)
class StatedScale:
    """The scale 1 of the rig, with its uncertainty, see `height.scale_sigma`."""

    sigma: float
    """Relative standard uncertainty."""

    def __str__(self) -> str:
        return f"the rig, to {100 * self.sigma:.2g} %"


Evidence = KnownLength | JointSpacing | CrestSpacing | StatedScale


def rig_scale(rig: Rig) -> list[StatedScale]:
    """The rig's own scale as evidence, by its tolerances; empty for a rig stated as exact."""
    sigma = scale_sigma(rig)
    return [StatedScale(sigma)] if sigma > 0 else []
