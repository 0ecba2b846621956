"""The accuracy and speed table: every method on every rendered scenario, in one run."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Protocol

import cv2
import numpy as np

from app.evaluation import Evaluation, Truth, evaluate
from app.peers import PEERS
from app.simulation import SCENARIOS, Scenario, simulate
from app.simulation.motion import Trajectory
from vo_core.odometry import Odometry
from vo_core.paper import PaperOdometry
from vo_core.rig import Rig
from vo_core.sources import VideoFile
from vo_core.track import Estimate, Track
from vo_core.types import Image

LENGTH_MM = 2000.0
"""Path of each scenario: the paper's method takes a tenth of a second for every frame."""

QUICK_LENGTH_MM = 450.0
QUICK_NAMES = (
    "nominal",
    "burnt_in_text",
    "dirty_lens",
    "drop_outs",
    "large_sway",
    "wide_lens",
)


class Method(Protocol):
    """What is compared: one estimate a frame."""

    def step(self, image: Image, t_s: float) -> Estimate:
        """Take the next frame."""


METHODS: Mapping[str, Callable[[Rig], Method]] = {
    "chainage": Odometry,
    "paper": PaperOdometry,
    **PEERS,
}


@dataclass(frozen=True)
class BenchRow:
    """One method on one scenario."""

    scenario: str
    method: str
    evaluation: Evaluation
    ms_per_frame: float
    """Median time of one step, on one OpenCV thread, without decoding."""
    ms_per_frame_p95: float


def all_scenarios() -> list[Scenario]:
    """Every scenario, over at most `LENGTH_MM`."""
    return [scenario.shortened(LENGTH_MM) for scenario in SCENARIOS.values()]


def quick_scenarios() -> list[Scenario]:
    """Six telling scenarios over a short path: less than two minutes of work."""
    return [SCENARIOS[name].shortened(QUICK_LENGTH_MM) for name in QUICK_NAMES]


def bench(
    scenarios: Sequence[Scenario],
    *,
    methods: Mapping[str, Callable[[Rig], Method]] = METHODS,
    on_progress: Callable[[str, int, int], None] | None = None,
) -> list[BenchRow]:
    """Render each scenario, run every method on its video file and compare with the truth.

    Args:
        scenarios: What to render.
        methods: Name and maker of what is compared.
        on_progress: Called after every frame with a sentence, steps done and steps in all; a
            frame counts one step for its rendering and one for each method.
    """
    rows: list[BenchRow] = []
    done = 0
    steps = sum(Trajectory(scenario).frames for scenario in scenarios) * (1 + len(methods))

    def count_frame(what: str) -> None:
        nonlocal done
        done += 1
        if on_progress is not None:
            on_progress(what, done, steps)

    for scenario in scenarios:
        with TemporaryDirectory(prefix="chainage-bench-") as folder:
            rendering = f"rendering {scenario.name}"
            run = simulate(scenario, Path(folder), lambda *_, what=rendering: count_frame(what))
            truth = Truth.from_csv(run.truth.read_text(encoding="utf-8"))
            rig = Rig.load(run.rig)
            for name, make in methods.items():
                method = make(rig)
                estimates: list[Estimate] = []
                times_ms: list[float] = []
                for estimate, time_ms in _timed_steps(method, run.video):
                    estimates.append(estimate)
                    times_ms.append(time_ms)
                    count_frame(f"{name} on {scenario.name}")
                rows.append(
                    BenchRow(
                        scenario=scenario.name,
                        method=name,
                        evaluation=evaluate(Track.from_estimates(estimates), truth),
                        ms_per_frame=float(np.median(times_ms)),
                        ms_per_frame_p95=float(np.percentile(times_ms, 95)),
                    )
                )
    return rows


def _timed_steps(method: Method, video: Path) -> Iterator[tuple[Estimate, float]]:
    """The estimates of a video, each with the milliseconds that its step took."""
    with VideoFile(video) as frames, _one_opencv_thread():
        for frame in frames:
            start_s = perf_counter()
            estimate = method.step(frame.image, frame.t_s)
            yield estimate, (perf_counter() - start_s) * 1000


@contextmanager
def _one_opencv_thread() -> Iterator[None]:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def to_markdown(rows: Sequence[BenchRow]) -> str:
    """Two tables: accuracy with a line a scenario, and the time of one step."""
    methods = list(dict.fromkeys(row.method for row in rows))
    scenarios = list(dict.fromkeys(row.scenario for row in rows))
    by_key = {(row.scenario, row.method): row for row in rows}
    lines = [
        "End error in % of the path · ATE in mm, without any alignment · yaw rms in degrees:",
        "",
        f"| scenario | path (m) | {' | '.join(methods)} |",
        f"|---|---|{'---|' * len(methods)}",
    ]
    for scenario in scenarios:
        cells = [_accuracy(by_key[scenario, method].evaluation) for method in methods]
        path_m = by_key[scenario, methods[0]].evaluation.path_mm / 1000
        lines.append(f"| {scenario} | {path_m:.1f} | {' | '.join(cells)} |")
    lines += [
        "",
        f"Milliseconds for one frame, median of all scenarios ({environment()}):",
        "",
        f"| {' | '.join(methods)} |",
        f"|{'---|' * len(methods)}",
    ]
    medians = [
        f"{np.median([row.ms_per_frame for row in rows if row.method == method]):.1f}"
        for method in methods
    ]
    lines.append(f"| {' | '.join(medians)} |")
    return "\n".join(lines) + "\n"


def _accuracy(evaluation: Evaluation) -> str:
    return (
        f"{evaluation.end_error_percent:+.3f} · {evaluation.ate_mm:.1f} · "
        f"{evaluation.yaw_rms_deg:.2f}"
    )


def to_json(rows: Sequence[BenchRow]) -> str:
    """All figures of all rows, and what they were measured on."""
    return json.dumps(
        {"environment": environment(), "rows": [asdict(row) for row in rows]},
        indent=2,
        allow_nan=False,
    )


def environment() -> str:
    """What the times were measured on, in a phrase."""
    return (
        f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, "
        f"OpenCV {cv2.__version__}, numpy {np.__version__}"
    )
