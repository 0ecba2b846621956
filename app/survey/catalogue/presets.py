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
    name: str, size_wh: tuple[int, int], view_deg: float, height_mm: float, **pipe: object
) -> Preset:
    """Build a centred pinhole camera: focal length = (width / 2) / tan(horizontal field of view /
    2).
    """
    width, height = size_wh
    focal_px = round(width / 2 / math.tan(math.radians(view_deg / 2)), 1)
    centre = {"cx": (width - 1) / 2, "cy": (height - 1) / 2}
    size = {"width": width, "height": height}
    camera = {"model": "pinhole", **size, "fx": focal_px, "fy": focal_px, **centre}
    mount = {"view": "down", "height_mm": height_mm, "rotation_deg": 0.0}
    title = f"{name}, {width} x {height}, {view_deg:g}° lens"
    return Preset(title, Rig.parse({"camera": camera, "mount": mount, "pipe": pipe}))


def _in_culvert(
    diameter_mm: float,
    segment_mm: float,
    size_wh: tuple[int, int],
    view_deg: float,
    height_mm: float,
) -> Preset:
    pipe = {"diameter_mm": diameter_mm, "segment_length_mm": segment_mm}
    name = f"{diameter_mm:g} mm culvert, camera looking down"
    return _looking_down(name, size_wh, view_deg, height_mm, shape="circular", **pipe)


PRESETS = (
    _in_culvert(300, 1500, (640, 480), 30, 230),
    _in_culvert(600, 2400, (1280, 720), 60, 400),
    _in_culvert(1200, 2400, (1920, 1080), 60, 600),
    _looking_down(
        "Box culvert or floor, camera 500 mm above it", (1280, 720), 60, 500, shape="flat"
    ),
)
