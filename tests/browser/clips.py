"""Small videos whose every picture carries its own frame number."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from numpy.typing import NDArray

BLOCK_PX = 16
BITS = 16
SIZE = (320, 240)
MILLISECOND = Fraction(1, 1000)


WIDE_PIXELS = Fraction(4, 3)
NARROWED = (int(SIZE[0] / WIDE_PIXELS), SIZE[1])


def numbered_clip(
    path: Path,
    codec: str,
    *,
    frames: int = 90,
    rate_step_ms: int = 7,
    is_upside_down: bool = False,
) -> Path:
    """A moving texture with the frame number as 16 black or white blocks in the first rows.

    The rate is variable: the intervals go through 20, 20 + step, ... ms and start again at 70 ms.
    A film upside down says so, and has pixels that are wider than high; it is shown alike.
    """
    texture = _texture()
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=30)
        stream.width, stream.height = NARROWED if is_upside_down else SIZE
        if is_upside_down:
            stream.set_display_rotation(180)
            stream.codec_context.sample_aspect_ratio = WIDE_PIXELS
        stream.pix_fmt = "yuv420p"
        stream.time_base = MILLISECOND
        stream.codec_context.time_base = MILLISECOND
        time_ms = 0
        for number in range(frames):
            shown = _numbered(texture, number)
            if is_upside_down:
                shown = np.rot90(cv2.resize(shown, NARROWED, interpolation=cv2.INTER_AREA), 2)
            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(shown), format="gray")
            picture.pts = time_ms
            picture.time_base = MILLISECOND
            container.mux(stream.encode(picture))
            time_ms += 20 + (number * rate_step_ms) % 50
        container.mux(stream.encode(None))
    return path


def rig_for_clip(path: Path, size: tuple[int, int] = SIZE) -> Path:
    width, height = size
    rig = {
        "camera": {
            "model": "pinhole", "width": width, "height": height,
            "fx": 600.0 * width / SIZE[0], "fy": 600.0,
            "cx": (width - 1) / 2, "cy": (height - 1) / 2,
        },
        "mount": {"view": "down", "height_mm": 230.0, "rotation_deg": 0.0},
        "pipe": {"shape": "circular", "diameter_mm": 300.0, "segment_length_mm": 1500.0},
    }  # fmt: skip
    path.write_text(json.dumps(rig))
    return path


def wide_rig(path: Path) -> Path:
    """Of a culvert so wide that the short clip drives two metres."""
    rig = json.loads(rig_for_clip(path).read_text())
    rig["mount"]["height_mm"] = 8000.0
    rig["pipe"] |= {"diameter_mm": 10000.0}
    path.write_text(json.dumps(rig))
    return path


def _texture() -> NDArray[np.uint8]:
    noise = np.random.default_rng(1).normal(0, 40, (SIZE[1], SIZE[0] * 4))
    return np.clip(cv2.GaussianBlur(noise, (0, 0), 2) * 3 + 128, 0, 255).astype(np.uint8)


def _numbered(texture: NDArray[np.uint8], number: int) -> NDArray[np.uint8]:
    shift = 4 * number
    picture = texture[:, shift : shift + SIZE[0]].copy()
    for bit in range(BITS):
        grey = 235 if number >> bit & 1 else 16
        picture[:BLOCK_PX, bit * BLOCK_PX : (bit + 1) * BLOCK_PX] = grey
    return picture
