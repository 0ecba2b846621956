"""The named inspections that `chainage simulate` can render."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from typing import Any

from app.lab.simulation.defects import Defect
from app.lab.simulation.scenario import Look, Scenario, Shaking, Silt
from vo_core.rig import Rig


def _rig(
    *,
    camera: Mapping[str, Any] | None = None,
    mount: Mapping[str, Any] | None = None,
    pipe: Mapping[str, Any] | None = None,
) -> Rig:
    """Change the paper's rig (30 degrees, 230 mm above the invert of a 300 mm culvert)."""
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

_AHEAD: Mapping[str, Any] = {"view": "forward", "height_mm": 150.0}
_FORWARD = replace(
    _NOMINAL,
    name="forward",
    description="A camera on the axis of the pipe that looks ahead, as on a CCTV crawler.",
    rig=_rig(camera={"fx": 400.0, "fy": 400.0}, mount=_AHEAD),
)

_CREW = replace(_FORWARD, light_follows_view=True)
"""The forward view as crews have it."""

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
    _FORWARD,
    replace(
        _NOMINAL,
        name="forward_wide",
        description="The same with a fisheye lens that sees the wall beside it.",
        rig=_rig(camera=_FISHEYE, mount=_AHEAD),
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
        description="A dirty lens in a film that begins when the robot is already moving.",
        seed=2,
        cut_frames=10,
    ),
    replace(
        _DIRTY,
        name="late_return",
        description="The same, 1.9 m out and back.",
        seed=2,
        cut_frames=10,
        length_mm=3800.0,
        legs=(0.5, -0.5),
        rest_s=0.5,
    ),
    replace(
        _NOMINAL,
        name="stop_dead",
        description="The robot hits a joint five times: it stops dead for a second each time.",
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
        description="The camera is mounted with its nose up by 3 degrees; the rig states 0.",
        true_rig=_rig(mount={"pitch_deg": 3.0}),
    ),
    replace(
        _NOMINAL,
        name="tape_height",
        description="A height measured by tape: the rig states 2 mm too much.",
        rig=_rig(mount={"height_mm": 232.0}),
        true_rig=_rig(),
    ),
    replace(
        _NOMINAL,
        name="data_sheet_lens",
        description="A focal length from a data sheet: the rig states 1 % too much.",
        rig=_rig(camera={"fx": 1205.94, "fy": 1205.94}),
        true_rig=_rig(),
    ),
    replace(
        _NOMINAL,
        name="silt",
        description="25 mm of silt lie flat on the invert, and the rig does not state it.",
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
        description="A fisheye lens 2 mm below the height that the rig states.",
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
    replace(
        _CREW,
        name="forward_crooked",
        description="A camera 20 mm off the axis that looks 3 degrees down, neither in the rig.",
        true_rig=_rig(
            camera={"fx": 400.0, "fy": 400.0},
            mount={"view": "forward", "height_mm": 134.0, "lateral_mm": 12.0, "pitch_deg": -3.0},
        ),
        aside_deg=1.5,
        length_mm=7850.0,
        text=True,
        crf=30,
    ),
    replace(
        _CREW,
        name="forward_looking_around",
        description="The operator stops twice and turns the camera by 50 degrees and back.",
        legs=(0.35, 0.35, 0.3),
        rest_s=6.0,
        looks=(Look(yaw_deg=50.0, pitch_deg=10.0), Look(yaw_deg=-50.0, pitch_deg=-20.0)),
    ),
    replace(
        _CREW,
        name="forward_stream",
        description="A stream of a hand's width runs along the invert.",
        water=True,
        water_half_mm=60.0,
    ),
    replace(
        _CREW,
        name="forward_slow",
        description="One picture a second, as archives keep them: half a diameter between two.",
        length_mm=9000.0,
        speed_mm_s=150.0,
        frames_per_s=1,
        text=True,
        crf=23,
    ),
    replace(
        _CREW,
        name="forward_parts",
        description="A skid, a lamp's frame and text hide parts of the picture, mud half a ring.",
        parts=True,
        text=True,
        defects=(Defect("mud", x_mm=3200, arc_mm=180, length_mm=1600, width_mm=470),),
    ),
    replace(
        _CREW,
        name="forward_pumping",
        description="A smooth plastic pipe; the exposure swings by a factor of 2 in five seconds.",
        contrast=0.3,
        pumping=2.0,
    ),
    replace(
        _CREW,
        name="forward_wobble",
        description="A phone on a rod: it turns by 8 degrees and moves by 25 mm to every side.",
        speed_mm_s=200.0,
        acceleration_mm_s2=100.0,
        shaking=Shaking(
            frequencies_hz=(0.17, 0.41),
            y_mm=25.0,
            z_mm=25.0,
            yaw_deg=8.0,
            pitch_deg=8.0,
            roll_deg=4.0,
        ),
    ),
)

SCENARIOS: Mapping[str, Scenario] = {scenario.name: scenario for scenario in _ALL}
"""Scenarios by name, in the order in which they are listed and run."""
