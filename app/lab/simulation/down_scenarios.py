"""The named inspections of a camera that looks down."""

from __future__ import annotations

from math import inf

from app.lab.simulation.scenario import Conversion, Pulse, Shaking, Silt
from app.lab.simulation.variants import (
    CORRUGATED,
    FISHEYE,
    NOMINAL,
    SMOOTH_METAL,
    paper_rig,
    variant,
)

_DIRTY = variant(
    "dirty_lens",
    "Drops and dust on the glass hide and veil a good part of the picture.",
    contrast=0.6,
    dirt_share=0.18,
)

_WIDE = variant(
    "wide_lens",
    "A fisheye lens on the axis of the pipe.",
    rig=paper_rig(camera=FISHEYE, mount={"height_mm": 150.0}),
)


DOWN = (
    NOMINAL,
    variant(
        "photo_wall",
        "A photograph of gravel is the wall: washed concrete with stones of 12 mm.",
        photo="gravel",
    ),
    variant(
        "brick_wall",
        "A photograph of brickwork is the wall: straight lines that nearly repeat.",
        photo="brick",
        photo_mm=400.0,
    ),
    variant("low_texture", "A very smooth wall: about two grey levels of contrast.", contrast=0.15),
    variant("dim", "Weak light: a dark, noisy picture.", brightness=0.25, noise_grey=3.5),
    variant(
        "spot_light",
        "A narrow lamp that lights the middle of a weakly textured wall.",
        contrast=0.4,
        lamp_width=0.4,
    ),
    variant(
        "burnt_in_text",
        "A name and a running clock are burnt into the picture.",
        contrast=0.6,
        text=True,
    ),
    _DIRTY,
    variant("blur", "A long exposure: about nine pixels of motion blur.", exposure_s=0.006),
    variant(
        "fast",
        "Half the picture is new in each frame.",
        speed_mm_s=1850.0,
        acceleration_mm_s2=3700.0,
        exposure_s=0.0002,
    ),
    variant(
        "reverse",
        "Stops on the way, and a stretch driven backwards.",
        legs=(0.35, -0.2, 0.25, 0.2),
        rest_s=1.0,
    ),
    variant(
        "there_and_back",
        "Three metres in, a stop, and back to the start.",
        legs=(0.5, -0.5),
        rest_s=0.5,
    ),
    variant("drop_outs", "Black and frozen stretches of up to eight frames.", drop_out_frames=8),
    variant("flicker", "The lamp's brightness jumps from frame to frame.", flicker=0.2),
    variant(
        "turned_camera",
        "A lens with distortion, turned 30 degrees about its axis.",
        rig=paper_rig(
            camera={"distortion": [-0.25, 0.05, 0.0, 0.0], "cx": 327.0, "cy": 233.0},
            mount={"rotation_deg": 30.0},
        ),
    ),
    variant(
        "large_sway",
        "The robot climbs 14 mm up either side and turns by up to 6 degrees.",
        sway_mm=14.0,
        yaw_deg=6.0,
    ),
    variant(
        "tiled_floor",
        "A flat floor of 200 mm tiles with a weak texture, as in the paper's trials.",
        rig=paper_rig(camera={"fx": 700.0, "fy": 700.0}, pipe={"shape": "flat"}),
        contrast=0.35,
        tile_mm=200.0,
    ),
    _WIDE,
    variant(
        "running_water", "Water runs along the invert, over a third of the picture.", water=True
    ),
    variant(
        "crawl",
        "1.2 mm a frame under a spot of light, with dust on the glass, for 0.7 m.",
        length_mm=700.0,
        speed_mm_s=36.0,
        acceleration_mm_s2=72.0,
        lamp_width=0.8,
        dirt_share=0.015,
    ),
    variant(
        "network_burst",
        "A network camera: one frame comes 30 ms late, 3 ms before the next.",
        burst_frame=60,
    ),
    variant(
        "network_jitter",
        "A network camera: every frame is late by 0 to 40 ms at random.",
        late_s=0.040,
    ),
    variant(
        "late_start",
        "A dirty lens in a film that begins when the robot is already moving.",
        like=_DIRTY,
        seed=2,
        cut_frames=10,
    ),
    variant(
        "late_return",
        "The same, 1.9 m out and back.",
        like=_DIRTY,
        seed=2,
        cut_frames=10,
        length_mm=3800.0,
        legs=(0.5, -0.5),
        rest_s=0.5,
    ),
    variant(
        "stop_dead",
        "The robot hits a joint five times: it stops dead for a second each time.",
        length_mm=3000.0,
        legs=(0.13, 0.19, 0.16, 0.2, 0.15, 0.17),
        rest_s=1.0,
        acceleration_mm_s2=inf,
    ),
    variant(
        "bounce",
        "Soft wheels: the camera goes 4 mm up and down and nods by 1 degree.",
        shaking=Shaking(z_mm=4.0, pitch_deg=1.0),
    ),
    variant(
        "climb",
        "The robot climbs the wall by 6 degrees to either side and leans with it.",
        climb_deg=6.0,
    ),
    variant(
        "pitched_mount",
        "The camera is mounted with its nose up by 3 degrees; the rig states 0.",
        true_rig=paper_rig(mount={"pitch_deg": 3.0}),
    ),
    variant(
        "tape_height",
        "A height measured by tape: the rig states 2 mm too much.",
        rig=paper_rig(mount={"height_mm": 232.0}),
        true_rig=paper_rig(),
    ),
    variant(
        "data_sheet_lens",
        "A focal length from a data sheet: the rig states 1 % too much.",
        rig=paper_rig(camera={"fx": 1205.94, "fy": 1205.94}),
        true_rig=paper_rig(),
    ),
    variant(
        "silt",
        "25 mm of silt lie flat on the invert, and the rig does not state it.",
        silt=Silt(start_mm=25.0),
    ),
    variant(
        "silt_rising",
        "Silt that rises from nothing to 25 mm in six metres.",
        silt=Silt(slope=25.0 / 6000.0),
    ),
    variant(
        "silt_wide_lens",
        "25 mm of silt under a fisheye lens that sees the clean wall beside it, too.",
        like=_WIDE,
        silt=Silt(start_mm=25.0),
    ),
    variant(
        "tape_height_wide_lens",
        "A fisheye lens 2 mm below the height that the rig states.",
        like=_WIDE,
        rig=paper_rig(camera=FISHEYE, mount={"height_mm": 152.0}),
        true_rig=_WIDE.rig,
    ),
    variant(
        "interlaced",
        "An old camera: each frame is woven of two fields, 20 ms apart.",
        frames_per_s=25,
        interlaced=True,
    ),
    variant(
        "rolling_shutter",
        "A robot that shakes, seen by a camera that reads its rows in 24 ms.",
        rig=paper_rig(camera={"readout_ms": 24.0}),
        shaking=Shaking(
            frequencies_hz=(2.3, 6.1), y_mm=0.5, yaw_deg=0.4, pitch_deg=0.3, roll_deg=0.3
        ),
    ),
    variant("low_bit_rate", "A film of poor quality: H.264 at crf 38.", crf=38),
    variant(
        "weak_spot_light", "A weak texture under a narrow lamp.", contrast=0.15, lamp_width=0.4
    ),
    variant(
        "pulsed_lamp",
        "A lamp dimmed by pulses: dark bands run over the rows of a rolling shutter.",
        rig=paper_rig(camera={"readout_ms": 30.0}),
        pulse=Pulse(),
    ),
    variant(
        "corrugated",
        "A corrugated metal pipe: waves of 67.7 mm, 13 mm deep.",
        rig=paper_rig(pipe=CORRUGATED),
        contrast=0.6,
    ),
    variant(
        "corrugated_unstated",
        "The same, but the rig states a smooth wall.",
        rig=paper_rig(pipe=SMOOTH_METAL),
        true_rig=paper_rig(pipe=CORRUGATED),
        contrast=0.6,
    ),
    variant(
        "mixed_frames",
        "25 pictures a second were made 30 by mixing neighbours.",
        conversion=Conversion(frames_per_s=25, is_mixed=True),
    ),
    variant(
        "pull_down",
        "24 pictures a second were made 30 by repeating every fourth.",
        conversion=Conversion(frames_per_s=24, is_mixed=False),
    ),
    variant(
        "standing",
        "The robot stands for ten seconds before a noisy camera.",
        length_mm=0.0,
        legs=(0.5, 0.5),
        rest_s=10.0,
        noise_grey=3.0,
        flicker=0.02,
        crf=30,
    ),
)
