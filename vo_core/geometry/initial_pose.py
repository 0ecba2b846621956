"""Where the camera stands in the pipe, estimated from the pictures of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np

from vo_core.geometry.wall import Pose
from vo_core.track import Estimate, Track

Poses = TypeVar("Poses", Estimate, Track)


@dataclass(frozen=True)
class InitialPose:
    """Pose of the camera in the pipe at the first frame, against the rig's.

    A track begins at this pose and does not contain it, so rays are cast from their sum.
    """

    y_mm: float = 0.0
    """To the right, like the next fields with the axes and signs of `Pose`."""
    yaw_deg: float = 0.0
    z_mm: float = 0.0
    pitch_deg: float = 0.0
    """With the tilt of the mount, like the roll."""
    roll_deg: float = 0.0

    @property
    def pose(self) -> Pose:
        """Pose of the camera in the pipe at the first frame."""
        yaw, pitch, roll = np.radians([self.yaw_deg, self.pitch_deg, self.roll_deg]).tolist()
        return Pose(0.0, self.y_mm, yaw, self.z_mm, pitch, roll)

    def added_to(self, poses: Poses) -> Poses:
        """Return an estimate, or a track, with poses in the pipe."""
        sums = {
            each.name: getattr(poses, each.name) + getattr(self, each.name) for each in fields(self)
        }
        return replace(poses, **sums)

    def metadata(self) -> dict[str, str]:
        """Lines for the head of a track file; a camera that stands as its rig states has none.

        Files have the older name `stance` for it.
        """
        if self == AS_STATED:
            return {}
        return {f"stance_{each.name}": f"{getattr(self, each.name):.3f}" for each in fields(self)}

    @classmethod
    def from_metadata(cls, lines: Mapping[str, str]) -> InitialPose:
        """Parse the lines of `metadata`; zero where they are missing, as in older files."""
        try:
            return cls(*(float(lines[f"stance_{each.name}"]) for each in fields(cls)))
        except (KeyError, ValueError):
            return AS_STATED


AS_STATED = InitialPose()
"""A camera that stands as its rig states, like any that looks down."""
