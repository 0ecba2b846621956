"""The tilt of the camera against its rig, estimated from the pictures of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class MountTilt:
    """Turns of the mount beyond the rig's, constant over the run; poses do not contain them."""

    pitch_deg: float
    """Nose up positive: a camera that looks down looks further forward."""
    roll_deg: float
    """Right side down positive: a camera that looks down looks further left."""
    pitch_sigma_deg: float
    """One sigma, like the next: the rig's tolerance until the pictures show more."""
    roll_sigma_deg: float

    def metadata(self) -> dict[str, str]:
        """Lines for the head of a track file."""
        return {
            "mount_pitch_deg": f"{self.pitch_deg:.3f} ± {self.pitch_sigma_deg:.3f}",
            "mount_roll_deg": f"{self.roll_deg:.3f} ± {self.roll_sigma_deg:.3f}",
        }

    @classmethod
    def from_metadata(cls, lines: Mapping[str, str]) -> MountTilt | None:
        """Parse the lines of `metadata`; None where they are missing, as in older files."""
        try:
            pitch, roll = (lines[f"mount_{turn}_deg"].split(" ± ") for turn in ("pitch", "roll"))
            return cls(float(pitch[0]), float(roll[0]), float(pitch[1]), float(roll[1]))
        except (KeyError, IndexError, ValueError):
            return None
