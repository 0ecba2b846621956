"""A film of a passing floor whose burnt-in counter has known faults, and its rig."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT, RATE = 320, 240, 25
HEIGHT_MM, FOCAL_PX = 400.0, 250.0
STEP_PX = 8
STEP_MM = STEP_PX * HEIGHT_MM / FOCAL_PX
"""12.8 mm: the camera drives 0.32 m/s."""
BAND_PX = 28
"""Height of the black band with the text, at the bottom."""


@dataclass(frozen=True)
class CounterDrive:
    """The counter counts `scale` times what the camera drives, except for its faults."""

    frames: int = 220
    scale: float = 0.98
    unit: str = "m"
    """m, ft, or empty to show none."""
    stuck: tuple[int, int] | None = (80, 112)
    """Frames from and to which it does not count: the camera drives 0.41 m."""
    reset_at: int | None = 150
    """Frame in which it is set to 0."""
    has_counter: bool = True
    date: str = ""
    """Text at the right of the band."""
    is_snow: bool = False
    """Whether the signal of the camera is bad, so that the wall cannot be tracked."""

    def counter_mm(self) -> NDArray[np.float64]:
        """(N,) what the counter has counted in each frame."""
        step = np.full(self.frames, self.scale * STEP_MM)
        step[0] = 0
        if self.stuck is not None:
            step[self.stuck[0] : self.stuck[1]] = 0
        counted = np.cumsum(step)
        if self.reset_at is not None:
            counted[self.reset_at :] -= counted[self.reset_at]
        return counted

    def shown(self) -> list[str]:
        """Return the text of each frame, to a hundredth of the unit."""
        mm = 304.8 if self.unit == "ft" else 1000.0
        hundredths = np.floor(self.counter_mm() / mm * 100 + 1e-6) / 100
        return [f"{value:06.2f} {self.unit}".rstrip() for value in hundredths]


def rig() -> dict[str, Any]:
    """The rig of the film: a camera above a flat floor."""
    return {
        "camera": {
            "model": "pinhole",
            "width": WIDTH,
            "height": HEIGHT,
            "fx": FOCAL_PX,
            "fy": FOCAL_PX,
            "cx": (WIDTH - 1) / 2,
            "cy": (HEIGHT - 1) / 2,
        },
        "mount": {"view": "down", "height_mm": HEIGHT_MM, "rotation_deg": 0.0},
        "pipe": {"shape": "flat"},
    }


def write(drive: CounterDrive, path: Path) -> Path:
    """Write the film as H.264 and return its path."""
    rng = np.random.default_rng(11)
    size = (HEIGHT, WIDTH + STEP_PX * drive.frames)
    wall = cv2.GaussianBlur(rng.integers(0, 256, size, np.uint8), (0, 0), 2)
    wall = cv2.normalize(wall, None, 30, 225, cv2.NORM_MINMAX).astype(np.uint8)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=RATE)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.options = {"preset": "ultrafast", "crf": "18"}
        for n, text in enumerate(drive.shown()):
            picture = wall[:, STEP_PX * n : STEP_PX * n + WIDTH].copy()
            if drive.is_snow:
                picture = rng.integers(0, 256, picture.shape, np.uint8)
            picture[-BAND_PX:] = 8
            for words, left, scale in ((text * drive.has_counter, 12, 0.7), (drive.date, 190, 0.6)):
                at = (left, HEIGHT - 7)
                cv2.putText(
                    picture, words, at, cv2.FONT_HERSHEY_SIMPLEX, scale, 235, 2, cv2.LINE_AA
                )
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
            frame.pts = n
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path
