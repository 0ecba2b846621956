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


def _variant(name: str, description: str, like: Scenario = _NOMINAL, **changes: Any) -> Scenario:
    return replace(like, name=name, description=description, **changes)


_DIRTY = _variant(
    "dirty_lens",
    "Drops and dust on the glass hide and veil a good part of the picture.",
    contrast=0.6,
    dirt_share=0.18,
)

_FISHEYE = {"model": "fisheye", "fx": 210.0, "fy": 210.0}

_WIDE = _variant(
    "wide_lens",
    "A fisheye lens on the axis of the pipe.",
    rig=_rig(camera=_FISHEYE, mount={"height_mm": 150.0}),
)

_AHEAD: Mapping[str, Any] = {"view": "forward", "height_mm": 150.0}
_FORWARD = _variant(
    "forward",
    "A camera on the axis of the pipe that looks ahead, as on a CCTV crawler.",
    rig=_rig(camera={"fx": 400.0, "fy": 400.0}, mount=_AHEAD),
)

_CREW = replace(_FORWARD, light_follows_view=True)
"""The forward view as crews have it."""

_ALL = (
    _NOMINAL,
    _variant(
        "photo_wall",
        "A photograph of gravel is the wall: washed concrete with stones of 12 mm.",
        photo="gravel",
    ),
    _variant(
        "brick_wall",
        "A photograph of brickwork is the wall: straight lines that nearly repeat.",
        photo="brick",
        photo_mm=400.0,
    ),
    _variant(
        "low_texture", "A very smooth wall: about two grey levels of contrast.", contrast=0.15
    ),
    _variant("dim", "Weak light: a dark, noisy picture.", brightness=0.25, noise_grey=3.5),
    _variant(
        "spot_light",
        "A narrow lamp that lights the middle of a weakly textured wall.",
        contrast=0.4,
        lamp_width=0.4,
    ),
    _variant(
        "burnt_in_text",
        "A name and a running clock are burnt into the picture.",
        contrast=0.6,
        text=True,
    ),
    _DIRTY,
    _variant("blur", "A long exposure: about nine pixels of motion blur.", exposure_s=0.006),
    _variant(
        "fast",
        "Half the picture is new in each frame.",
        speed_mm_s=1850.0,
        acceleration_mm_s2=3700.0,
        exposure_s=0.0002,
    ),
    _variant(
        "reverse",
        "Stops on the way, and a stretch driven backwards.",
        legs=(0.35, -0.2, 0.25, 0.2),
        rest_s=1.0,
    ),
    _variant(
        "there_and_back",
        "Three metres in, a stop, and back to the start.",
        legs=(0.5, -0.5),
        rest_s=0.5,
    ),
    _variant("drop_outs", "Black and frozen stretches of up to eight frames.", drop_out_frames=8),
    _variant("flicker", "The lamp's brightness jumps from frame to frame.", flicker=0.2),
    _variant(
        "turned_camera",
        "A lens with distortion, turned 30 degrees about its axis.",
        rig=_rig(
            camera={"distortion": [-0.25, 0.05, 0.0, 0.0], "cx": 327.0, "cy": 233.0},
            mount={"rotation_deg": 30.0},
        ),
    ),
    _variant(
        "large_sway",
        "The robot climbs 14 mm up either side and turns by up to 6 degrees.",
        sway_mm=14.0,
        yaw_deg=6.0,
    ),
    _variant(
        "tiled_floor",
        "A flat floor of 200 mm tiles with a weak texture, as in the paper's trials.",
        rig=_rig(camera={"fx": 700.0, "fy": 700.0}, pipe={"shape": "flat"}),
        contrast=0.35,
        tile_mm=200.0,
    ),
    _WIDE,
    _FORWARD,
    _variant(
        "forward_wide",
        "The same with a fisheye lens that sees the wall beside it.",
        rig=_rig(camera=_FISHEYE, mount=_AHEAD),
    ),
    _variant(
        "running_water", "Water runs along the invert, over a third of the picture.", water=True
    ),
    _variant(
        "crawl",
        "1.2 mm a frame under a spot of light, with dust on the glass, for 0.7 m.",
        length_mm=700.0,
        speed_mm_s=36.0,
        acceleration_mm_s2=72.0,
        lamp_width=0.8,
        dirt_share=0.015,
    ),
    _variant(
        "network_burst",
        "A network camera: one frame comes 30 ms late, 3 ms before the next.",
        burst_frame=60,
    ),
    _variant(
        "network_jitter",
        "A network camera: every frame is late by 0 to 40 ms at random.",
        late_s=0.040,
    ),
    _variant(
        "late_start",
        "A dirty lens in a film that begins when the robot is already moving.",
        like=_DIRTY,
        seed=2,
        cut_frames=10,
    ),
    _variant(
        "late_return",
        "The same, 1.9 m out and back.",
        like=_DIRTY,
        seed=2,
        cut_frames=10,
        length_mm=3800.0,
        legs=(0.5, -0.5),
        rest_s=0.5,
    ),
    _variant(
        "stop_dead",
        "The robot hits a joint five times: it stops dead for a second each time.",
        length_mm=3000.0,
        legs=(0.13, 0.19, 0.16, 0.2, 0.15, 0.17),
        rest_s=1.0,
        acceleration_mm_s2=inf,
    ),
    _variant(
        "bounce",
        "Soft wheels: the camera goes 4 mm up and down and nods by 1 degree.",
        shaking=Shaking(z_mm=4.0, pitch_deg=1.0),
    ),
    _variant(
        "climb",
        "The robot climbs the wall by 6 degrees to either side and leans with it.",
        climb_deg=6.0,
    ),
    _variant(
        "pitched_mount",
        "The camera is mounted with its nose up by 3 degrees; the rig states 0.",
        true_rig=_rig(mount={"pitch_deg": 3.0}),
    ),
    _variant(
        "tape_height",
        "A height measured by tape: the rig states 2 mm too much.",
        rig=_rig(mount={"height_mm": 232.0}),
        true_rig=_rig(),
    ),
    _variant(
        "data_sheet_lens",
        "A focal length from a data sheet: the rig states 1 % too much.",
        rig=_rig(camera={"fx": 1205.94, "fy": 1205.94}),
        true_rig=_rig(),
    ),
    _variant(
        "silt",
        "25 mm of silt lie flat on the invert, and the rig does not state it.",
        silt=Silt(start_mm=25.0),
    ),
    _variant(
        "silt_rising",
        "Silt that rises from nothing to 25 mm in six metres.",
        silt=Silt(slope=25.0 / 6000.0),
    ),
    _variant(
        "silt_wide_lens",
        "25 mm of silt under a fisheye lens that sees the clean wall beside it, too.",
        like=_WIDE,
        silt=Silt(start_mm=25.0),
    ),
    _variant(
        "tape_height_wide_lens",
        "A fisheye lens 2 mm below the height that the rig states.",
        like=_WIDE,
        rig=_rig(camera=_FISHEYE, mount={"height_mm": 152.0}),
        true_rig=_WIDE.rig,
    ),
    _variant(
        "interlaced",
        "An old camera: each frame is woven of two fields, 20 ms apart.",
        frames_per_s=25,
        interlaced=True,
    ),
    _variant(
        "rolling_shutter",
        "A robot that shakes, seen by a camera that reads its rows in 24 ms.",
        rig=_rig(camera={"readout_ms": 24.0}),
        shaking=Shaking(
            frequencies_hz=(2.3, 6.1), y_mm=0.5, yaw_deg=0.4, pitch_deg=0.3, roll_deg=0.3
        ),
    ),
    _variant("low_bit_rate", "A film of poor quality: H.264 at crf 38.", crf=38),
    _variant(
        "weak_spot_light", "A weak texture under a narrow lamp.", contrast=0.15, lamp_width=0.4
    ),
    _variant(
        "forward_crooked",
        "A camera 20 mm off the axis that looks 3 degrees down, neither in the rig.",
        like=_CREW,
        true_rig=_rig(
            camera={"fx": 400.0, "fy": 400.0},
            mount={"view": "forward", "height_mm": 134.0, "lateral_mm": 12.0, "pitch_deg": -3.0},
        ),
        aside_deg=1.5,
        length_mm=7850.0,
        text=True,
        crf=30,
    ),
    _variant(
        "forward_looking_around",
        "The operator stops twice and turns the camera by 50 degrees and back.",
        like=_CREW,
        legs=(0.35, 0.35, 0.3),
        rest_s=6.0,
        looks=(Look(yaw_deg=50.0, pitch_deg=10.0), Look(yaw_deg=-50.0, pitch_deg=-20.0)),
    ),
    _variant(
        "forward_stream",
        "A stream of a hand's width runs along the invert.",
        like=_CREW,
        water=True,
        water_half_mm=60.0,
    ),
    _variant(
        "forward_slow",
        "One picture a second, as archives keep them: half a diameter between two.",
        like=_CREW,
        length_mm=9000.0,
        speed_mm_s=150.0,
        frames_per_s=1,
        text=True,
        crf=23,
    ),
    _variant(
        "forward_parts",
        "A skid, a lamp's frame and text hide parts of the picture, mud half a ring.",
        like=_CREW,
        parts=True,
        text=True,
        defects=(Defect("mud", x_mm=3200, arc_mm=180, length_mm=1600, width_mm=470),),
    ),
    _variant(
        "forward_pumping",
        "A smooth plastic pipe; the exposure swings by a factor of 2 in five seconds.",
        like=_CREW,
        contrast=0.3,
        pumping=2.0,
    ),
    _variant(
        "forward_wobble",
        "A phone on a rod: it turns by 8 degrees and moves by 25 mm to every side.",
        like=_CREW,
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
