"""What can be said of an inspection that is to be rendered."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.lab.simulation.defects import Defect
from vo_core.rig import Rig

BURST_S = 0.003
"""Between the time stamps of two frames that a network delivers at once."""


@dataclass(frozen=True, kw_only=True)
class Shaking:
    """How a robot shakes at full speed: the sum of two waves each, none in step with another."""

    frequencies_hz: tuple[float, float] = (1.1, 2.7)
    y_mm: float = 0.0
    z_mm: float = 0.0
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Silt:
    """A flat bed on the invert of a circular pipe, of which the rig knows nothing."""

    start_mm: float = 0.0
    """Depth above the invert where the film begins, x = 0."""
    slope: float = 0.0
    """Rise of the bed over the way along the pipe."""
    joint_share: float = 0.3
    """Contrast of the line in which the bed has sagged above a joint, over that of the joint."""

    @property
    def is_there(self) -> bool:
        """Is the pipe not clean?"""
        return self.start_mm != 0 or self.slope != 0

    def depth_mm(self, x_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Depth above the invert; where it is negative the pipe is clean."""
        return self.start_mm + self.slope * x_mm


NO_SILT = Silt()


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """One inspection to render; what is not said is as in the nominal one."""

    name: str
    description: str
    """One sentence for a person."""
    rig: Rig
    """As it is stated in rig.json."""
    true_rig: Rig | None = None
    """What was really there, if the stated rig is wrong."""
    seed: int = 1
    """Of the wall, the noise, the dirt and the drop-outs: equal seeds give equal files."""

    length_mm: float = 6000.0
    """Length of the path, there and back added up."""
    legs: tuple[float, ...] = (1.0,)
    """Shares of the path between two stops; negative is backwards. Their sizes add up to 1."""
    rest_s: float = 0.0
    """How long the robot stands between two legs."""
    speed_mm_s: float = 300.0
    acceleration_mm_s2: float = 600.0
    sway_mm: float = 4.0
    """Largest sideways offset on the way."""
    yaw_deg: float = 1.0
    """Largest turn to either side."""
    climb_deg: float = 0.0
    """Largest angle about the pipe's axis by which the robot climbs the wall to either side."""
    shaking: Shaking = Shaking()
    frames_per_s: int = 30
    exposure_s: float = 0.0005
    cut_frames: int = 0
    """Frames at the beginning that are missing; the first one that is left is frame 0."""

    late_s: float = 0.0
    """Each frame's time stamp is late by a random time of at most this."""
    burst_frame: int | None = None
    """This frame's time stamp comes `BURST_S` before that of the next."""
    interlaced: bool = False
    """Odd rows are those of a second field, exposed half a frame later."""
    coded_in_fields: bool = False
    """The film says of itself that it is interlaced, upper field first."""
    crf: int = 18
    """Quality of the H.264 film, as libx264 counts: 18 is good, 38 is poor."""

    contrast: float = 1.0
    """Of the wall's texture; 1 is a standard deviation of about 14 grey levels."""
    first_joint_mm: float = 400.0
    """Axial position of one pipe joint; the others lie whole segments away."""
    tile_mm: float | None = None
    """A floor of square tiles of this size instead of concrete."""
    photo: str | None = None
    """Name of a picture in `skimage.data` that covers the wall instead of concrete."""
    photo_mm: float = 250.0
    """Side of the wall that the photograph covers; from there on it is mirrored."""
    defects: tuple[Defect, ...] = ()
    """Things on the wall that an inspector would tag."""
    silt: Silt = NO_SILT
    water: bool = False
    """Water runs along the invert, over about a third of the picture."""

    brightness: float = 1.0
    lamp_width: float = 1.7
    """Radius of the lamp's beam (one sigma) over half the picture's diagonal."""
    flicker: float = 0.005
    """Relative standard deviation of the gain from frame to frame."""
    noise_grey: float = 1.5
    """Standard deviation of the sensor noise in grey levels."""

    text: bool = False
    """A name and a running clock are burnt into the picture."""
    dirt_share: float = 0.0
    """Share of the glass that is covered with dirt."""
    drop_out_frames: int = 0
    """Length of the longest black or frozen stretch in frames."""

    @property
    def rendered_rig(self) -> Rig:
        """The rig that was really there."""
        return self.true_rig or self.rig

    @property
    def is_stated_wrong(self) -> bool:
        """Is the rig, or the pipe in it, not what rig.json says?"""
        return self.true_rig is not None or self.silt.is_there

    @property
    def is_available(self) -> bool:
        """Can it be rendered here?  The photographs come with scikit-image, an optional package."""
        return self.photo is None or importlib.util.find_spec("skimage") is not None

    def shortened(self, length_mm: float) -> Scenario:
        """The same inspection over a shorter path; one that is short already stays as it is."""
        return replace(self, length_mm=min(length_mm, self.length_mm))
