"""The named inspections that `chainage simulate` can render."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.simulation.defects import Defect
from vo_core.rig import Rig

BURST_S = 0.003
"""Between the time stamps of two frames that a network delivers at once."""


def _rig(
    *,
    camera: Mapping[str, Any] | None = None,
    mount: Mapping[str, Any] | None = None,
    pipe: Mapping[str, Any] | None = None,
) -> Rig:
    """The rig of the paper (30 degrees, 230 mm above the invert of a 300 mm culvert), changed."""
    return Rig.parse(
        {
            "camera": {
                "model": "pinhole",
                "width": 640,
                "height": 480,
                "fx": 1194.0,
                "fy": 1194.0,
                "cx": 319.5,
                "cy": 239.5,
                **(camera or {}),
            },
            "mount": {"view": "down", "height_mm": 230.0, "rotation_deg": 0.0, **(mount or {})},
            "pipe": pipe
            or {"shape": "circular", "diameter_mm": 300.0, "segment_length_mm": 1500.0},
        }
    )


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
    def is_available(self) -> bool:
        """Can it be rendered here?  The photographs come with scikit-image, an optional package."""
        return self.photo is None or importlib.util.find_spec("skimage") is not None

    def shortened(self, length_mm: float) -> Scenario:
        """The same inspection over a shorter path; one that is short already stays as it is."""
        return replace(self, length_mm=min(length_mm, self.length_mm))


_NOMINAL = Scenario(
    name="nominal",
    description="Six metres of concrete culvert at 300 mm/s with a little sway, well lit.",
    rig=_rig(),
)

_DIRTY = replace(
    _NOMINAL,
    name="dirty_lens",
    description="Drops and dust on the glass hide and veil a good part of the picture.",
    contrast=0.6,
    dirt_share=0.18,
)

_FISHEYE = {"model": "fisheye", "fx": 210.0, "fy": 210.0}

_WIDE = replace(
    _NOMINAL,
    name="wide_lens",
    description="A fisheye lens on the axis of the pipe.",
    rig=_rig(camera=_FISHEYE, mount={"height_mm": 150.0}),
)

_ALL = (
    _NOMINAL,
    replace(
        _NOMINAL,
        name="photo_wall",
        description="A photograph of gravel is the wall: washed concrete with stones of 12 mm.",
        photo="gravel",
    ),
    replace(
        _NOMINAL,
        name="brick_wall",
        description="A photograph of brickwork is the wall: straight lines that nearly repeat.",
        photo="brick",
        photo_mm=400.0,
    ),
    replace(
        _NOMINAL,
        name="low_texture",
        description="A very smooth wall: about two grey levels of contrast.",
        contrast=0.15,
    ),
    replace(
        _NOMINAL,
        name="dim",
        description="Weak light: a dark, noisy picture.",
        brightness=0.25,
        noise_grey=3.5,
    ),
    replace(
        _NOMINAL,
        name="spot_light",
        description="A narrow lamp that lights the middle of a weakly textured wall.",
        contrast=0.4,
        lamp_width=0.4,
    ),
    replace(
        _NOMINAL,
        name="burnt_in_text",
        description="A name and a running clock are burnt into the picture.",
        contrast=0.6,
        text=True,
    ),
    _DIRTY,
    replace(
        _NOMINAL,
        name="blur",
        description="A long exposure: about nine pixels of motion blur.",
        exposure_s=0.006,
    ),
    replace(
        _NOMINAL,
        name="fast",
        description="Half the picture is new in each frame.",
        speed_mm_s=1850.0,
        acceleration_mm_s2=3700.0,
        exposure_s=0.0002,
    ),
    replace(
        _NOMINAL,
        name="reverse",
        description="Stops on the way, and a stretch driven backwards.",
        legs=(0.35, -0.2, 0.25, 0.2),
        rest_s=1.0,
    ),
    replace(
        _NOMINAL,
        name="there_and_back",
        description="Three metres in, a stop, and back to the start.",
        legs=(0.5, -0.5),
        rest_s=0.5,
    ),
    replace(
        _NOMINAL,
        name="drop_outs",
        description="Black and frozen stretches of up to eight frames.",
        drop_out_frames=8,
    ),
    replace(
        _NOMINAL,
        name="flicker",
        description="The lamp's brightness jumps from frame to frame.",
        flicker=0.2,
    ),
    replace(
        _NOMINAL,
        name="turned_camera",
        description="A lens with distortion, turned 30 degrees about its axis.",
        rig=_rig(
            camera={"distortion": [-0.25, 0.05, 0.0, 0.0], "cx": 327.0, "cy": 233.0},
            mount={"rotation_deg": 30.0},
        ),
    ),
    replace(
        _NOMINAL,
        name="large_sway",
        description="The robot climbs 14 mm up either side and turns by up to 6 degrees.",
        sway_mm=14.0,
        yaw_deg=6.0,
    ),
    replace(
        _NOMINAL,
        name="tiled_floor",
        description="A flat floor of 200 mm tiles with a weak texture, as in the paper's trials.",
        rig=_rig(camera={"fx": 700.0, "fy": 700.0}, pipe={"shape": "flat"}),
        contrast=0.35,
        tile_mm=200.0,
    ),
    _WIDE,
    replace(
        _NOMINAL,
        name="forward",
        description="A camera on the axis of the pipe that looks ahead, as on a CCTV crawler.",
        rig=_rig(camera={"fx": 400.0, "fy": 400.0}, mount={"view": "forward", "height_mm": 150.0}),
    ),
    replace(
        _NOMINAL,
        name="forward_wide",
        description="The same with a fisheye lens that sees the wall beside it.",
        rig=_rig(
            camera=_FISHEYE,
            mount={"view": "forward", "height_mm": 150.0},
        ),
    ),
    replace(
        _NOMINAL,
        name="running_water",
        description="Water runs along the invert, over a third of the picture.",
        water=True,
    ),
    replace(
        _NOMINAL,
        name="crawl",
        description="1.2 mm a frame under a spot of light, with dust on the glass, for 0.7 m.",
        length_mm=700.0,
        speed_mm_s=36.0,
        acceleration_mm_s2=72.0,
        lamp_width=0.8,
        dirt_share=0.015,
    ),
    replace(
        _NOMINAL,
        name="network_burst",
        description="A network camera: one frame comes 30 ms late, 3 ms before the next.",
        burst_frame=60,
    ),
    replace(
        _NOMINAL,
        name="network_jitter",
        description="A network camera: every frame is late by 0 to 40 ms at random.",
        late_s=0.040,
    ),
    replace(
        _DIRTY,
        name="late_start",
        description="The film with the dirty lens from its 10th frame on, already on the way.",
        cut_frames=10,
    ),
    replace(
        _DIRTY,
        name="late_return",
        description="The same, 1.9 m out and back.",
        cut_frames=10,
        length_mm=3800.0,
        legs=(0.5, -0.5),
        rest_s=0.5,
    ),
    replace(
        _NOMINAL,
        name="stop_dead",
        description="Runs into a joint five times: stands at once for a second, goes on at once.",
        length_mm=3000.0,
        legs=(0.13, 0.19, 0.16, 0.2, 0.15, 0.17),
        rest_s=1.0,
        acceleration_mm_s2=inf,
    ),
    replace(
        _NOMINAL,
        name="bounce",
        description="Soft wheels: the camera goes 4 mm up and down and nods by 1 degree.",
        shaking=Shaking(z_mm=4.0, pitch_deg=1.0),
    ),
    replace(
        _NOMINAL,
        name="climb",
        description="The robot climbs the wall by 6 degrees to either side and leans with it.",
        climb_deg=6.0,
    ),
    replace(
        _NOMINAL,
        name="pitched_mount",
        description="The camera is mounted with its nose up by 3 degrees; the rig says 0.",
        true_rig=_rig(mount={"pitch_deg": 3.0}),
    ),
    replace(
        _NOMINAL,
        name="tape_height",
        description="A height by the tape: the rig says 2 mm more than there are.",
        rig=_rig(mount={"height_mm": 232.0}),
        true_rig=_rig(),
    ),
    replace(
        _NOMINAL,
        name="data_sheet_lens",
        description="A focal length from a data sheet: the rig says 1 % more than it is.",
        rig=_rig(camera={"fx": 1205.94, "fy": 1205.94}),
        true_rig=_rig(),
    ),
    replace(
        _NOMINAL,
        name="silt",
        description="25 mm of silt lie flat on the invert, and the rig knows nothing of it.",
        silt=Silt(start_mm=25.0),
    ),
    replace(
        _NOMINAL,
        name="silt_rising",
        description="Silt that rises from nothing to 25 mm in six metres.",
        silt=Silt(slope=25.0 / 6000.0),
    ),
    replace(
        _WIDE,
        name="silt_wide_lens",
        description="25 mm of silt under a fisheye lens that sees the clean wall beside it, too.",
        silt=Silt(start_mm=25.0),
    ),
    replace(
        _WIDE,
        name="tape_height_wide_lens",
        description="A fisheye lens 2 mm below the height that the rig says.",
        rig=_rig(camera=_FISHEYE, mount={"height_mm": 152.0}),
        true_rig=_WIDE.rig,
    ),
    replace(
        _NOMINAL,
        name="interlaced",
        description="An old camera: each frame is woven of two fields, 20 ms apart.",
        frames_per_s=25,
        interlaced=True,
    ),
    replace(
        _NOMINAL,
        name="rolling_shutter",
        description="A robot that shakes, seen by a camera that reads its rows in 24 ms.",
        rig=_rig(camera={"readout_ms": 24.0}),
        shaking=Shaking(
            frequencies_hz=(2.3, 6.1), y_mm=0.5, yaw_deg=0.4, pitch_deg=0.3, roll_deg=0.3
        ),
    ),
    replace(
        _NOMINAL,
        name="low_bit_rate",
        description="A film of poor quality: H.264 at crf 38.",
        crf=38,
    ),
    replace(
        _NOMINAL,
        name="weak_spot_light",
        description="A weak texture under a narrow lamp.",
        contrast=0.15,
        lamp_width=0.4,
    ),
)

SCENARIOS: Mapping[str, Scenario] = {scenario.name: scenario for scenario in _ALL}
"""By name, in the order in which they are listed and run."""
