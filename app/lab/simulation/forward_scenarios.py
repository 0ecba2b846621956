"""The named inspections of a camera that looks along the pipe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from app.lab.simulation.defects import Defect
from app.lab.simulation.scenario import Look, Shaking
from app.lab.simulation.variants import CORRUGATED, FISHEYE, SMOOTH_METAL, paper_rig, variant

_LENS = {"fx": 400.0, "fy": 400.0}
_AHEAD: Mapping[str, Any] = {"view": "forward", "height_mm": 150.0}
_FORWARD = variant(
    "forward",
    "A camera on the axis of the pipe that looks ahead, as on a CCTV crawler.",
    rig=paper_rig(camera=_LENS, mount=_AHEAD),
)

_CREW = replace(_FORWARD, light_follows_view=True)
"""The forward view as crews have it."""

FORWARD = (
    _FORWARD,
    variant(
        "forward_wide",
        "The same with a fisheye lens that sees the wall beside it.",
        rig=paper_rig(camera=FISHEYE, mount=_AHEAD),
    ),
    variant(
        "forward_crooked",
        "A camera 20 mm off the axis that looks 3 degrees down, neither in the rig.",
        like=_CREW,
        true_rig=paper_rig(
            camera=_LENS,
            mount={"view": "forward", "height_mm": 134.0, "lateral_mm": 12.0, "pitch_deg": -3.0},
        ),
        aside_deg=1.5,
        length_mm=7850.0,
        text=True,
        crf=30,
    ),
    variant(
        "forward_looking_around",
        "The operator stops twice and turns the camera by 50 degrees and back.",
        like=_CREW,
        legs=(0.35, 0.35, 0.3),
        rest_s=6.0,
        looks=(Look(yaw_deg=50.0, pitch_deg=10.0), Look(yaw_deg=-50.0, pitch_deg=-20.0)),
    ),
    variant(
        "forward_stream",
        "A stream of a hand's width runs along the invert.",
        like=_CREW,
        water=True,
        water_half_mm=60.0,
    ),
    variant(
        "forward_slow",
        "One picture a second, as archives keep them: half a diameter between two.",
        like=_CREW,
        length_mm=9000.0,
        speed_mm_s=150.0,
        frames_per_s=1,
        text=True,
        crf=23,
    ),
    variant(
        "forward_parts",
        "A skid, a lamp's frame and text hide parts of the picture, mud half a ring.",
        like=_CREW,
        parts=True,
        text=True,
        defects=(Defect("mud", x_mm=3200, arc_mm=180, length_mm=1600, width_mm=470),),
    ),
    variant(
        "forward_pumping",
        "A smooth plastic pipe; the exposure swings by a factor of 2 in five seconds.",
        like=_CREW,
        contrast=0.3,
        pumping=2.0,
    ),
    variant(
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
    variant(
        "corrugated_forward",
        "A corrugated metal pipe: waves of 67.7 mm, 13 mm deep.",
        like=_CREW,
        rig=paper_rig(camera=_LENS, mount=_AHEAD, pipe=CORRUGATED),
        contrast=0.6,
    ),
    variant(
        "corrugated_forward_unstated",
        "The same, but the rig states a smooth wall.",
        like=_CREW,
        rig=paper_rig(camera=_LENS, mount=_AHEAD, pipe=SMOOTH_METAL),
        true_rig=paper_rig(camera=_LENS, mount=_AHEAD, pipe=CORRUGATED),
        contrast=0.6,
    ),
    variant(
        "mist",
        "Mist drifts through the picture and replaces up to 70 % of the wall's light.",
        like=_CREW,
        mist=0.7,
    ),
    variant(
        "fast_turns",
        "The operator stops twice and turns 50 degrees aside and back within two seconds.",
        like=_CREW,
        legs=(0.35, 0.35, 0.3),
        rest_s=3.0,
        looks=(
            Look(yaw_deg=50.0, pitch_deg=5.0, turn_s=0.9, hold_s=0.2),
            Look(yaw_deg=-50.0, pitch_deg=-5.0, turn_s=0.9, hold_s=0.2),
        ),
    ),
    variant(
        "wrong_diameter",
        "The rig states a diameter that is 3 mm too large.",
        like=_CREW,
        rig=paper_rig(
            camera=_LENS,
            mount=_AHEAD,
            pipe={"shape": "circular", "diameter_mm": 303.0, "segment_length_mm": 1500.0},
        ),
        true_rig=paper_rig(camera=_LENS, mount=_AHEAD),
    ),
    variant("swinging_cable", "The robot's cable swings before the lens.", like=_CREW, cable=True),
    variant(
        "late_stabiliser",
        "A phone whose stabiliser moves its crop by 8 px, later than the phone shakes.",
        like=_CREW,
        crop_px=8.0,
    ),
    variant(
        "drops_on_the_glass",
        "Drops and dust on the glass of a camera that looks ahead.",
        like=_CREW,
        dirt_share=0.1,
    ),
)
