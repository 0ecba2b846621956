"""Writes a rendered inspection to disk: video.mp4, rig.json and truth.csv."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from app.lab.simulation.motion import Trajectory
from app.lab.simulation.render import render
from app.lab.simulation.scenario import Scenario
from app.lab.simulation.time_stamps import TICKS_PER_S

TRUTH_HEADER = "frame,time_s,x_mm,y_mm,yaw_deg,distance_mm,z_mm,pitch_deg,roll_deg"

# Studio range, as players expect; the chroma is that of a warm lamp.
_LUMA = np.rint(16 + np.arange(256) * (219 / 255)).astype(np.uint8)
_CHROMA_BLUE, _CHROMA_RED = 123, 131


@dataclass(frozen=True)
class SimulatedRun:
    """The files of one rendered inspection."""

    video: Path
    rig: Path
    truth: Path


def simulate(
    scenario: Scenario,
    folder: Path,
    on_progress: Callable[[int, int], None] | None = None,
) -> SimulatedRun:
    """Render a scenario into `folder`, which is created if it is missing.

    Args:
        scenario: The inspection to render.
        folder: For video.mp4 (H.264), rig.json and truth.csv; existing files are replaced.
        on_progress: Called after each frame with frames done and frames in all.
    """
    folder.mkdir(parents=True, exist_ok=True)
    run = SimulatedRun(folder / "video.mp4", folder / "rig.json", folder / "truth.csv")
    run.rig.write_text(
        json.dumps(scenario.rig.model_dump(mode="json"), indent=2) + "\n", encoding="utf-8"
    )
    frames = Trajectory(scenario).frames
    rows = [TRUTH_HEADER]
    with _video_writer(run.video, scenario) as write:
        for frame in render(scenario):
            write(frame.image, frame.t_s)
            numbers = (
                frame.t_s, frame.x_mm, frame.y_mm, frame.yaw_deg,
                frame.x_mm, frame.z_mm, frame.pitch_deg, frame.roll_deg,
            )  # fmt: skip
            rows.append(",".join([str(frame.index), *(f"{number:.6f}" for number in numbers)]))
            if on_progress is not None:
                on_progress(frame.index + 1, frames)
    run.truth.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return run


@contextmanager
def _video_writer(
    path: Path, scenario: Scenario
) -> Iterator[Callable[[NDArray[np.uint8], float], None]]:
    """Open an H.264 file; yields a function that appends grey pictures with time stamps."""
    camera = scenario.rendered_rig.camera
    with av.open(str(path), "w", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=scenario.frames_per_s)
        stream.width, stream.height = camera.width, camera.height
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = Fraction(1, TICKS_PER_S)
        # A fixed number of threads gives equal files on all machines.
        stream.options = {
            "crf": str(scenario.crf), "preset": "veryfast", "g": "30", "threads": "2",
        }  # fmt: skip
        planes = np.empty((camera.height * 3 // 2, camera.width), np.uint8)
        chroma_rows = camera.height // 4
        planes[camera.height : camera.height + chroma_rows] = _CHROMA_BLUE
        planes[camera.height + chroma_rows :] = _CHROMA_RED

        def write(image: NDArray[np.uint8], t_s: float) -> None:
            cv2.LUT(image, _LUMA, dst=planes[: camera.height])
            frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
            frame.pts = round(t_s * TICKS_PER_S)
            frame.time_base = Fraction(1, TICKS_PER_S)
            container.mux(stream.encode(frame))

        yield write
        container.mux(stream.encode(None))
