"""The description of an inspection to be rendered."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, replace
from math import cos, pi

import numpy as np
from numpy.typing import NDArray

from app.lab.simulation.defects import Defect
from vo_core.rig import Rig

BURST_S = 0.003
"""Interval between the time stamps of two frames that a network delivers together."""


@dataclass(frozen=True, kw_only=True)
class Shaking:
    """How a robot shakes at full speed; two waves of different phases share each amplitude."""

    frequencies_hz: tuple[float, float] = (1.1, 2.7)
    y_mm: float = 0.0
    z_mm: float = 0.0
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Look:
    """A standing camera turns about its centre, holds, and turns back, as at a defect."""

    yaw_deg: float = 0.0
    """To the right of its heading; `pitch_deg` is above it."""
    pitch_deg: float = 0.0
    turn_s: float = 2.0
    """Time of the turn out, and of the turn back."""
    hold_s: float = 1.0

    @property
    def duration_s(self) -> float:
        """Time from the first motion to the last."""
        return 2 * self.turn_s + self.hold_s

    def share(self, t_s: float) -> float:
        """Share of the turn at `t_s` after its start; it starts and ends smoothly."""
        nearest_end_s = min(t_s, self.duration_s - t_s)
        turned = min(max(nearest_end_s / self.turn_s, 0.0), 1.0)
        return (1 - cos(pi * turned)) / 2


@dataclass(frozen=True, kw_only=True)
class Silt:
    """A flat bed on the invert of a circular pipe, which the rig does not describe."""

    start_mm: float = 0.0
    """Depth above the invert at x = 0, where the film begins."""
    slope: float = 0.0
    """Rise of the bed per distance along the pipe."""
    joint_share: float = 0.3
    """Contrast of the line in the bed above a joint, relative to the joint."""

    @property
    def is_there(self) -> bool:
        """Whether there is silt."""
        return self.start_mm != 0 or self.slope != 0

    def depth_mm(self, x_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Depth above the invert; where it is negative the pipe is clean."""
        return self.start_mm + self.slope * x_mm


NO_SILT = Silt()


@dataclass(frozen=True, kw_only=True)
class Pulse:
    """A lamp that is dimmed by pulses, which a rolling shutter shows as bands."""

    hz: float = 245.0
    depth: float = 0.35
    """Light that is missing in the darkest row, as a share."""

    def gain(self, t_s: NDArray[np.float64]) -> NDArray[np.float32]:
        """Gain of rows that are exposed around `t_s`, longer than the edge of a pulse."""
        dark = np.clip(0.5 + np.sin(2 * pi * self.hz * t_s), 0, 1)
        return np.asarray(1 - self.depth * dark, np.float32)


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """A film converted from another frame rate."""

    frames_per_s: int
    """Rate of the camera."""
    is_mixed: bool
    """Whether a picture is a mixture of the two nearest; otherwise the last one is repeated."""


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """One inspection to render; the defaults are those of the nominal one."""

    name: str
    description: str
    """One sentence for a person."""
    rig: Rig
    """The rig that rig.json states."""
    true_rig: Rig | None = None
    """The rig that is rendered, if the stated one is wrong."""
    seed: int = 1
    """Seed of wall, noise, dirt and drop-outs; equal seeds give equal files."""

    length_mm: float = 6000.0
    """Length of the path, there and back added up; 0 for a robot that only rests."""
    legs: tuple[float, ...] = (1.0,)
    """Shares of the path between two stops, negative backwards; their absolute values add up to
    1."""
    rest_s: float = 0.0
    """Time for which the robot stands between two legs."""
    speed_mm_s: float = 300.0
    acceleration_mm_s2: float = 600.0
    sway_mm: float = 4.0
    """Largest sideways offset."""
    yaw_deg: float = 1.0
    """Largest heading to either side."""
    aside_deg: float = 0.0
    """Constant angle by which the camera looks to the right of its heading, which no rig states."""
    climb_deg: float = 0.0
    """Largest angle about the pipe's axis by which the robot climbs the wall to either side."""
    shaking: Shaking = Shaking()
    looks: tuple[Look, ...] = ()
    """What the operator looks at, one in the middle of each rest."""
    frames_per_s: int = 30
    exposure_s: float = 0.0005
    cut_frames: int = 0
    """Number of frames missing at the beginning; the first remaining one is frame 0."""

    late_s: float = 0.0
    """Largest random delay of a frame's time stamp."""
    burst_frame: int | None = None
    """Frame whose time stamp lies `BURST_S` before that of the next."""
    conversion: Conversion | None = None
    """How the film was converted to `frames_per_s`."""
    interlaced: bool = False
    """Whether the odd rows are a second field, exposed half a frame later."""
    crf: int = 18
    """Quality of the H.264 film, as libx264 counts: 18 is good, 38 is poor."""

    light_follows_view: bool = False
    """Whether light and sharpness are worked out anew from each pose.

    A camera that looks along the pipe needs it, because there a small turn moves the dark end and
    the near wall in the picture.  Otherwise they are those of the nominal pose."""
    contrast: float = 1.0
    """Contrast of the wall's texture; 1 is a standard deviation of about 14 grey levels."""
    first_joint_mm: float = 400.0
    """Axial position of one pipe joint; the others lie whole segments away."""
    tile_mm: float | None = None
    """Side of the square tiles of a floor; None for concrete."""
    photo: str | None = None
    """Name of a picture in `skimage.data` that covers the wall instead of concrete."""
    photo_mm: float = 250.0
    """Side of the wall that the photograph covers; beyond it the photograph is mirrored."""
    defects: tuple[Defect, ...] = ()
    """Defects on the wall."""
    silt: Silt = NO_SILT
    water: bool = False
    """Whether water runs along the invert."""
    water_half_mm: float = 16.0
    """Half the width of the stream along the wall; at 16 it covers a third of a view down."""

    brightness: float = 1.0
    lamp_width: float = 1.7
    """Radius of the lamp's beam (one sigma) over half the picture's diagonal."""
    flicker: float = 0.005
    """Relative standard deviation of the gain from frame to frame."""
    pumping: float = 1.0
    """Brightest over darkest exposure of a camera whose exposure control never rests."""
    pulse: Pulse | None = None
    """How the lamp is dimmed; its bands need a `readout_ms` of the camera."""
    mist: float = 0.0
    """Share of the wall's light that the thickest mist replaces by its own."""
    noise_grey: float = 1.5
    """Standard deviation of the sensor noise in grey levels."""
    noise_draw: int = 0
    """Which draw of the sensor noise and the flicker; all else stays as it is."""

    parts: bool = False
    """Whether a skid of the robot and the frame of its lamp hide parts of the picture."""
    text: bool = False
    """Whether a name and a running clock are burnt into the picture."""
    dirt_share: float = 0.0
    """Share of the glass that is covered with dirt."""
    cable: bool = False
    """Whether a cable swings in front of the camera."""
    crop_px: float = 0.0
    """How far a stabiliser that comes too late moves its crop to every side."""
    drop_out_frames: int = 0
    """Length of the longest black or frozen stretch in frames."""

    @property
    def rendered_rig(self) -> Rig:
        """The true rig."""
        return self.true_rig or self.rig

    @property
    def is_stated_wrong(self) -> bool:
        """Whether rig.json is wrong about the rig or the pipe."""
        return self.true_rig is not None or self.silt.is_there

    @property
    def is_available(self) -> bool:
        """Whether it can be rendered here; photographs need the optional package scikit-image."""
        return self.photo is None or importlib.util.find_spec("skimage") is not None

    @property
    def camera_frames_per_s(self) -> int:
        """Rate at which the camera exposes."""
        return self.frames_per_s if self.conversion is None else self.conversion.frames_per_s

    def camera_frame(self, index: int) -> tuple[int, float]:
        """Which of the camera's pictures a frame of the film shows, and the share of the next."""
        number, rest = divmod(index * self.camera_frames_per_s, self.frames_per_s)
        is_mixed = self.conversion is not None and self.conversion.is_mixed
        return number, rest / self.frames_per_s if is_mixed else 0.0

    def shortened(self, length_mm: float) -> Scenario:
        """Limit the length of the path; a shorter one is kept."""
        return replace(self, length_mm=min(length_mm, self.length_mm))
