"""The paper's rig, the nominal inspection, and how others differ from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from app.lab.simulation.scenario import Scenario
from vo_core.rig import Rig


def paper_rig(
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


NOMINAL = Scenario(
    name="nominal",
    description="Six metres of concrete culvert at 300 mm/s with a little sway, well lit.",
    rig=paper_rig(),
)


def variant(name: str, description: str, like: Scenario = NOMINAL, **changes: Any) -> Scenario:
    """Change an inspection and give it a name."""
    return replace(like, name=name, description=description, **changes)


FISHEYE = {"model": "fisheye", "fx": 210.0, "fy": 210.0}

SMOOTH_METAL: Mapping[str, Any] = {"shape": "circular", "diameter_mm": 300.0}
"""A metal pipe, whose sections are too long for joints."""

CORRUGATED = {**SMOOTH_METAL, "corrugation": {"pitch_mm": 67.7, "depth_mm": 13.0}}
