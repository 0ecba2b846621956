"""Runs every method on every rendered scenario, and times it.

Times are processor times, given as a multiple of one windowed `cv2.phaseCorrelate` of the same
frames, measured between the steps of the method, so that a busy or slow machine slows both.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, thread_time
from typing import Protocol

import av
import cv2
import numpy as np

from app.lab.evaluation import Evaluation, Truth, evaluate
from app.lab.peers import DOWN_PEERS, FORWARD_PEERS, ForwardPeer
from app.lab.simulation import Scenario, simulate
from app.lab.simulation.motion import Trajectory
from vo_core.errors import InvalidCorrection, InvalidRig
from vo_core.joints.finder import JointFinder
from vo_core.joints.sightings import Sighting
from vo_core.odometry import Odometry
from vo_core.paper import PaperOdometry
from vo_core.rig import Rig
from vo_core.scale.proposal import ScaleProposal, propose
from vo_core.sources import VideoFile
from vo_core.track import Estimate, Track
from vo_core.types import Image

WARM_UP_FRAMES = 10
"""Frames left out of the times, as caches fill and the robot does not move yet."""


class Method(Protocol):
    """A method in the comparison; it returns one estimate per frame."""

    def step(self, image: Image, t_s: float) -> Estimate:
        """Estimate the pose of the next frame."""


OURS = "chainage"
METHODS: Mapping[str, Callable[[Rig], Method]] = {
    OURS: Odometry,
    "paper": PaperOdometry,
    **DOWN_PEERS,
    **FORWARD_PEERS,
}
Progress = Callable[[str, int, int], None]
"""Called with the current work in words, the steps done and the steps in all."""


_Step = tuple[Image, Estimate, float, float]
"""Picture, estimate, time of the step and time of the unit in ms."""


@dataclass(frozen=True)
class StepTime:
    """Time of one step on one OpenCV thread, without decoding and after the warm-up."""

    ms: float
    """Median; the next two are percentiles."""
    ms_p10: float
    ms_p90: float
    unit_ms: float
    """Median of one windowed `cv2.phaseCorrelate` of the same frames."""

    @property
    def ratio(self) -> float:
        """Ratio of the medians."""
        return self.ms / self.unit_ms


@dataclass(frozen=True)
class Joined:
    """The last frame of a run after the joints have corrected its scale."""

    joints: int
    """Number of different joints that were seen."""
    error_percent: float
    """Error of the distance in percent of the path; so is sigma."""
    sigma_percent: float


@dataclass(frozen=True)
class WrongRig:
    """The last frame of a run whose rig is wrong or whose pipe is not clean."""

    error_over_sigma: float
    sigma_percent: float
    """Sigma in percent of the path."""
    registration_mm: float
    joined: Joined | None
    """None where the joints cannot be counted."""


@dataclass(frozen=True)
class BenchRow:
    """One method on one scenario."""

    scenario: str
    method: str
    evaluation: Evaluation
    time: StepTime
    wrong_rig: WrongRig | None = None
    """Only for Chainage, where the rig is wrong."""


@dataclass(frozen=True)
class TrackTime:
    """Wall time of the command `chainage track`, including the start of the process and writing."""

    frames: int
    track_s: float
    """Median time of the command."""
    decode_s: float
    """Median time of decoding the same file to grey, measured before each run of the command."""

    @property
    def ratio(self) -> float:
        """Ratio of the medians."""
        return self.track_s / self.decode_s


def bench(
    scenarios: Sequence[Scenario],
    *,
    methods: Mapping[str, Callable[[Rig], Method]] = METHODS,
    on_progress: Progress | None = None,
) -> list[BenchRow]:
    """Render each scenario, run every method on its video file and compare with the truth.

    A method without equations for the rig of a scenario has no row there.

    Args:
        scenarios: The scenarios to render.
        methods: Name and constructor of each method.
        on_progress: Called after every frame; a frame counts as one step for its rendering and one
            for each method.
    """
    rows: list[BenchRow] = []
    done = 0
    steps = sum(Trajectory(scenario).frames for scenario in scenarios) * (1 + len(methods))

    def count(what: str, frames: int = 1) -> None:
        nonlocal done
        done += frames
        if on_progress is not None:
            on_progress(what, done, steps)

    for scenario in scenarios:
        with TemporaryDirectory(prefix="chainage-bench-") as folder:
            rendering = f"rendering {scenario.name}"
            run = simulate(scenario, Path(folder), lambda *_, what=rendering: count(what))
            truth = Truth.from_csv(run.truth.read_text(encoding="utf-8"))
            for name, make in methods.items():
                try:
                    method = make(scenario.rig)
                except InvalidRig:
                    count(f"{name} cannot do {scenario.name}", len(truth))
                    continue
                timed = _counted(
                    _timed_steps(method, run.video), partial(count, f"{name} on {scenario.name}")
                )
                rows.append(_row(scenario, name, method, timed, truth))
    return rows


def _row(
    scenario: Scenario, name: str, method: Method, steps: Iterable[_Step], truth: Truth
) -> BenchRow:
    """Compare the steps of a method on a scenario with the truth."""
    finder = None
    if isinstance(method, Odometry) and scenario.is_stated_wrong:
        finder = JointFinder(scenario.rig)
    estimates: list[Estimate] = []
    times_ms: list[tuple[float, float]] = []
    for image, estimate, step_ms, unit_ms in steps:
        estimates.append(estimate)
        times_ms.append((step_ms, unit_ms))
        if isinstance(method, Odometry) and finder is not None:
            finder.add(image, estimate, initial_pose=method.initial_pose, smoothed=method.smoothed)
    if isinstance(method, Odometry):
        estimates = method.smoothed()
    track = Track.from_estimates(estimates)
    if isinstance(method, ForwardPeer):
        track = method.finish(track, truth)
    return BenchRow(
        scenario=scenario.name,
        method=name,
        evaluation=evaluate(track, truth),
        time=_step_time(times_ms[WARM_UP_FRAMES:]),
        wrong_rig=(
            None if finder is None else _wrong_rig(scenario.rig, track, truth, finder.finish())
        ),
    )


def _counted(steps: Iterable[_Step], count: Callable[[], None]) -> Iterator[_Step]:
    """Count each step once the caller is done with it."""
    for step in steps:
        yield step
        count()


def _wrong_rig(
    rig: Rig, track: Track, truth: Truth, sightings: Sequence[Sighting]
) -> WrongRig | None:
    path_mm = float(np.abs(np.diff(truth.distance_mm)).sum())
    if not path_mm:
        return None
    sigma_mm = float(track.sigma_distance_mm[-1])
    error_mm = float(track.distance_mm[-1] - truth.distance_mm[-1])
    return WrongRig(
        error_over_sigma=abs(error_mm) / sigma_mm,
        sigma_percent=100 * sigma_mm / path_mm,
        registration_mm=float(track.sigma_registration_mm[-1]),
        joined=_joined(rig, track, truth, sightings, path_mm),
    )


def _joined(
    rig: Rig, track: Track, truth: Truth, sightings: Sequence[Sighting], path_mm: float
) -> Joined | None:
    proposal = by_joints(rig, track, sightings)
    if proposal is None:
        return None
    joined = proposal.correction.track
    error_mm = float(joined.distance_mm[-1] - truth.distance_mm[-1])
    return Joined(
        joints=proposal.joints,
        error_percent=100 * error_mm / path_mm,
        sigma_percent=100 * float(joined.sigma_distance_mm[-1]) / path_mm,
    )


def by_joints(rig: Rig, track: Track, sightings: Sequence[Sighting]) -> ScaleProposal | None:
    """Propose the scale by the joints that were seen; None if they cannot be counted."""
    try:
        return propose(track, sightings, rig)
    except InvalidCorrection:
        return None


def _timed_steps(method: Method, video: Path) -> Iterator[_Step]:
    """Yield pictures and estimates of a video, with the ms of each step and of the unit."""
    with VideoFile(video) as frames, _one_opencv_thread():
        window = cv2.createHanningWindow((frames.info.width, frames.info.height), cv2.CV_32F)
        before = np.zeros(window.shape, np.float32)
        for frame in frames:
            start_s = thread_time()
            estimate = method.step(frame.image, frame.t_s)
            step_ms = (thread_time() - start_s) * 1000
            now = frame.image.astype(np.float32)
            # phaseCorrelate multiplies its inputs by the window in place.
            inputs = before, now.copy()
            start_s = thread_time()
            cv2.phaseCorrelate(*inputs, window)
            unit_ms = (thread_time() - start_s) * 1000
            before = now
            yield frame.image, estimate, step_ms, unit_ms


def _step_time(times_ms: Sequence[tuple[float, float]]) -> StepTime:
    steps_ms, units_ms = np.array(times_ms).T
    p10, median, p90 = np.percentile(steps_ms, (10, 50, 90)).tolist()
    return StepTime(ms=median, ms_p10=p10, ms_p90=p90, unit_ms=float(np.median(units_ms)))


@contextmanager
def _one_opencv_thread() -> Iterator[None]:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def time_track(
    scenario: Scenario, repeats: int = 3, on_progress: Progress | None = None
) -> TrackTime:
    """Time `chainage track` on the file of a scenario, alternating with decoding it to grey."""
    frames = Trajectory(scenario).frames
    steps = frames + 2 * repeats

    def count(what: str, done: int) -> None:
        if on_progress is not None:
            on_progress(what, done, steps)

    track_s, decode_s = [], []
    with TemporaryDirectory(prefix="chainage-bench-") as folder:
        run = simulate(scenario, Path(folder), lambda done, _: count("rendering", done))
        words = ["track", run.video, "--rig", run.rig, "--out", run.truth.with_name("track.csv")]
        for repeat in range(repeats):
            start_s = perf_counter()
            _decode_to_grey(run.video)
            decode_s.append(perf_counter() - start_s)
            count("decoding", frames + 2 * repeat + 1)
            start_s = perf_counter()
            subprocess.run(  # noqa: S603 - this very program on a file that it made
                [sys.executable, "-c", "from app.cli.main import main; main()", *map(str, words)],
                check=True,
                capture_output=True,
            )
            track_s.append(perf_counter() - start_s)
            count("chainage track", frames + 2 * repeat + 2)
    return TrackTime(frames, float(np.median(track_s)), float(np.median(decode_s)))


def _decode_to_grey(video: Path) -> None:
    """Decode all frames with a plain loop."""
    with av.open(str(video)) as container:
        for frame in container.decode(video=0):
            frame.to_ndarray(format="gray")
