"""The short sequences of `chainage bench --quick`, one for each mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from app.lab.simulation import SCENARIOS, Scenario

_LENGTH_MM = 1300.0
"""Usual path: some 145 frames, past one joint."""

_PAST_TWO_JOINTS: Mapping[str, Any] = {
    "length_mm": 1800.0,
    "first_joint_mm": 150.0,
    "speed_mm_s": 600.0,
    "acceleration_mm_s2": 1200.0,
}

(_MUD,) = SCENARIOS["forward_parts"].defects

_CHANGES: Mapping[str, Mapping[str, Any]] = {
    "nominal": {},
    "low_texture": {},
    "dim": {},
    "spot_light": {},
    "weak_spot_light": {},
    "burnt_in_text": {},
    "dirty_lens": {},
    "late_start": {},
    "late_return": {},
    "blur": {},
    "fast": {"length_mm": 4000.0},
    "reverse": {"rest_s": 0.5},
    "there_and_back": {},
    "drop_outs": {"length_mm": 1400.0},  # it does not end with one
    "flicker": {},
    "turned_camera": {},
    "large_sway": {},
    "tiled_floor": {},
    "wide_lens": {},
    "running_water": {},
    "crawl": {"length_mm": 200.0},
    "network_jitter": {},
    "stop_dead": {"length_mm": 1200.0, "rest_s": 0.4},
    "bounce": {},
    "climb": {},
    "pitched_mount": _PAST_TWO_JOINTS,
    "tape_height": _PAST_TWO_JOINTS,
    "silt": _PAST_TWO_JOINTS,
    "interlaced": {},
    "rolling_shutter": {},
    "low_bit_rate": {},
    "pulsed_lamp": {},
    "corrugated": {},
    "corrugated_unstated": {},
    "mixed_frames": {},
    "pull_down": {},
    "standing": {"length_mm": 0.0, "rest_s": 5.0},
    "forward": {},
    "forward_wide": {},
    "forward_crooked": {},
    "forward_looking_around": {
        "length_mm": 900.0,
        "legs": (0.5, 0.5),
        "rest_s": 5.5,
        "looks": SCENARIOS["forward_looking_around"].looks[:1],
    },
    "fast_turns": {
        "length_mm": 1500.0,
        "legs": (0.7, 0.3),
        "looks": SCENARIOS["fast_turns"].looks[:1],
    },
    "forward_stream": {},
    "forward_slow": {"length_mm": 6000.0},
    "forward_parts": {"defects": (replace(_MUD, x_mm=900, length_mm=600),)},
    "forward_pumping": {},
    "forward_wobble": {"length_mm": 1000.0},
    "corrugated_forward": {"length_mm": 1000.0},
    "corrugated_forward_unstated": {"length_mm": 1000.0},
    "mist": {},
    "wrong_diameter": _PAST_TWO_JOINTS,
    "swinging_cable": {},
    "drops_on_the_glass": {},
    "late_stabiliser": {},
}
"""What differs from the scenario of the same name, beside the length."""

SEQUENCES: Mapping[str, Scenario] = {
    name: replace(SCENARIOS[name], **{"length_mm": _LENGTH_MM, **changes})
    for name, changes in _CHANGES.items()
}
