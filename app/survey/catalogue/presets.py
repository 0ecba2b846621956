"""Rigs to begin with: plausible cameras in common pipes, to be replaced by measured values."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vo_core import Rig


@dataclass(frozen=True)
class Preset:
    """A rig with a name that states its use."""

    name: str
    rig: Rig


def _looking_down(
    size_wh: tuple[int, int], view_deg: float, height_mm: float, pipe: dict[str, object]
) -> Rig:
    """Build a centred pinhole camera: focal length = (width / 2) / tan(horizontal field of view /
    2).
    """
    width, height = size_wh
    focal_px = round(width / 2 / math.tan(math.radians(view_deg / 2)), 1)
    return Rig.parse(
        {
            "camera": {
                "model": "pinhole",
                "width": width,
                "height": height,
                "fx": focal_px,
                "fy": focal_px,
                "cx": (width - 1) / 2,
                "cy": (height - 1) / 2,
            },
            "mount": {"view": "down", "height_mm": height_mm, "rotation_deg": 0.0},
            "pipe": pipe,
        }
    )


def _circular(diameter_mm: float, segment_length_mm: float) -> dict[str, object]:
    return {
        "shape": "circular",
        "diameter_mm": diameter_mm,
        "segment_length_mm": segment_length_mm,
    }


PRESETS = (
    Preset(
        "300 mm culvert, camera looking down, 640 x 480, 30° lens",
        _looking_down((640, 480), 30, 230, _circular(300, 1500)),
    ),
    Preset(
        "600 mm culvert, camera looking down, 1280 x 720, 60° lens",
        _looking_down((1280, 720), 60, 400, _circular(600, 2400)),
    ),
    Preset(
        "1200 mm culvert, camera looking down, 1920 x 1080, 60° lens",
        _looking_down((1920, 1080), 60, 600, _circular(1200, 2400)),
    ),
    Preset(
        "Box culvert or floor, camera 500 mm above it, 1280 x 720, 60° lens",
        _looking_down((1280, 720), 60, 500, {"shape": "flat"}),
    ),
)
