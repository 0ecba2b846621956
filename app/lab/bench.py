"""The accuracy and speed tables: every method on every rendered scenario, in one run.

Where the rig that is stated is wrong, or silt lies in the pipe, Chainage's run is also brought to
scale by the joints that it saw, as `chainage correct --joints` does.

Times are given as a multiple of one windowed `cv2.phaseCorrelate` of the same frames, measured
between the steps of the method: a busy or slow machine slows both.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Protocol

import av
import cv2
import numpy as np

from app.lab.evaluation import Evaluation, Truth, evaluate, or_dash
from app.lab.peers import PEERS
from app.lab.simulation import SCENARIOS, Scenario, simulate
from app.lab.simulation.motion import Trajectory
from vo_core.errors import InvalidCorrection, InvalidRig
from vo_core.joints.finder import JointFinder, Sighting
from vo_core.odometry import Odometry
from vo_core.paper import PaperOdometry
from vo_core.rig import Rig
from vo_core.scale.proposal import ScaleProposal, propose
from vo_core.sources import VideoFile
from vo_core.track import Estimate, Track
from vo_core.types import Image

LENGTH_MM = 2000.0
"""Path of each scenario: the paper's method takes a tenth of a second for every frame."""

QUICK_LENGTH_MM = 250.0
QUICK_NAMES = ("nominal", "dirty_lens", "drop_outs", "large_sway", "wide_lens")

FIELD_LENGTH_MM = 6000.0
"""What the targets are for."""
FIELD_NAMES = (
    "nominal", "low_texture", "dirty_lens", "drop_outs", "network_jitter", "stop_dead", "bounce",
    "climb", "rolling_shutter", "low_bit_rate",
)  # fmt: skip
"""What the field does to a film, one scenario of each kind."""

WARM_UP_FRAMES = 10
"""Left out of the times: caches fill, and the robot does not move yet."""


@dataclass(frozen=True)
class Target:
    """What Chainage must reach on a scenario, over 6 m; None where nothing is asked for."""

    end_percent: float | None = None
    """Largest size of the end error in percent of the path."""
    ate_mm: float | None = None
    yaw_rms_deg: float | None = None
    max_error_mm: float | None = None
    """Of the distance, in any frame."""
    lost_frames: int | None = None


_STEADY = Target(end_percent=0.05, ate_mm=4, yaw_rms_deg=0.15)
_HINDERED = Target(end_percent=0.1, ate_mm=4, yaw_rms_deg=0.2)
_INTERRUPTED = Target(end_percent=0.3, ate_mm=12, yaw_rms_deg=0.4)
_LATE = Target(end_percent=0.1, yaw_rms_deg=0.3)
_SCALE_ASIDE = Target()
TARGETS: Mapping[str, Target] = {
    **dict.fromkeys(("nominal", "photo_wall", "brick_wall", "dim"), _STEADY),
    **dict.fromkeys(("reverse", "flicker", "turned_camera"), _STEADY),
    "blur": Target(end_percent=0.05, ate_mm=8, yaw_rms_deg=0.15),
    "low_texture": Target(end_percent=0.05, ate_mm=6, yaw_rms_deg=0.2),
    **dict.fromkeys(("spot_light", "burnt_in_text", "dirty_lens"), _HINDERED),
    **dict.fromkeys(("large_sway", "tiled_floor"), _HINDERED),
    "fast": Target(end_percent=0.1, ate_mm=20, yaw_rms_deg=0.2),
    "wide_lens": Target(end_percent=0.1, ate_mm=6, yaw_rms_deg=0.2),
    **dict.fromkeys(("drop_outs", "running_water"), _INTERRUPTED),
    "there_and_back": Target(end_percent=0.02, ate_mm=4, yaw_rms_deg=0.15),
    **dict.fromkeys(("network_burst", "network_jitter"), Target(0.05, yaw_rms_deg=0.15)),
    **dict.fromkeys(("late_start", "late_return"), _LATE),
    "stop_dead": Target(end_percent=0.05, yaw_rms_deg=0.15, max_error_mm=15, lost_frames=15),
    "bounce": Target(end_percent=0.1, ate_mm=2, yaw_rms_deg=0.15),
    **dict.fromkeys(("climb", "pitched_mount"), Target(end_percent=0.1)),
    "rolling_shutter": Target(end_percent=0.1),
    "interlaced": Target(end_percent=0.05),
    "low_bit_rate": Target(end_percent=0.05, yaw_rms_deg=0.5),
    "weak_spot_light": Target(end_percent=0.1, yaw_rms_deg=0.3),
    **dict.fromkeys(("tape_height", "tape_height_wide_lens", "data_sheet_lens"), _SCALE_ASIDE),
    **dict.fromkeys(("silt", "silt_rising", "silt_wide_lens"), _SCALE_ASIDE),
}
"""By scenario; where a range is allowed, its strict end.  Those left out have no target."""

LEAST_COVERAGE = 0.97
"""Share of frames whose true distance lies within three sigma, everything included."""
LEAST_REGISTRATION_COVERAGE = 0.99
"""The same by the registration's sigma, where the rig is right."""
ERROR_OVER_SIGMA = (0.1, 1.5)
"""Range of the median |error| / sigma of the registration, where the rig is right: below it sigma
is padded, above it too small."""


@dataclass(frozen=True)
class ScaleTarget:
    """What Chainage must reach with a rig that is wrong by its tolerance."""

    error_over_sigma: float = 2.6
    """Of the distance in the last frame, before the run is brought to scale."""
    sigma_percent: float = 2.5
    """Sigma there in percent of the path."""
    registration_mm: float = 2.0
    joined_error_percent: float = 0.2
    """The error when the joints have brought the run to scale."""
    joined_sigma_percent: float = 0.5


SCALE_TARGET = ScaleTarget()
STEP_TARGET = 2.0
"""Largest time of a step over that of one windowed `cv2.phaseCorrelate`."""
TRACK_TARGET = 3.0
"""Largest wall time of `chainage track` over that of decoding the same file to grey."""


class Method(Protocol):
    """What is compared: one estimate a frame."""

    def step(self, image: Image, t_s: float) -> Estimate:
        """Take the next frame."""


OURS = "chainage"
METHODS: Mapping[str, Callable[[Rig], Method]] = {
    OURS: Odometry,
    "paper": PaperOdometry,
    **PEERS,
}
OURS_ALONE: Mapping[str, Callable[[Rig], Method]] = {OURS: Odometry}

Progress = Callable[[str, int, int], None]
"""Takes what is done now in words, steps done and steps in all."""


@dataclass(frozen=True)
class StepTime:
    """What one step costs on one OpenCV thread, without decoding and after the warm-up."""

    ms: float
    """Median."""
    ms_p10: float
    ms_p90: float
    unit_ms: float
    """Median of one windowed `cv2.phaseCorrelate` of the same frames."""

    @property
    def ratio(self) -> float:
        """Of the medians."""
        return self.ms / self.unit_ms


@dataclass(frozen=True)
class Joined:
    """The last frame of a run that the joints have brought to scale."""

    joints: int
    """Different ones that were seen."""
    error_percent: float
    """Of the path."""
    sigma_percent: float


@dataclass(frozen=True)
class WrongRig:
    """The last frame of a run whose rig is wrong, or whose pipe is not clean."""

    error_over_sigma: float
    sigma_percent: float
    """Of the path."""
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
    """Chainage only, where the rig is wrong."""


@dataclass(frozen=True)
class TrackTime:
    """Wall time of the command `chainage track`, start of the process and writing included."""

    frames: int
    track_s: float
    """Median."""
    decode_s: float
    """Of decoding the same file to grey, before each run of the command; median."""

    @property
    def ratio(self) -> float:
        """Of the medians."""
        return self.track_s / self.decode_s


def all_scenarios(length_mm: float = LENGTH_MM) -> list[Scenario]:
    """Every scenario that can be rendered here, over at most this path."""
    return [one.shortened(length_mm) for one in SCENARIOS.values() if one.is_available]


def quick_scenarios(length_mm: float = QUICK_LENGTH_MM) -> list[Scenario]:
    """A few significant scenarios over a short path: less than two minutes of work."""
    return [SCENARIOS[name].shortened(length_mm) for name in QUICK_NAMES]


def field_scenarios(length_mm: float = FIELD_LENGTH_MM) -> list[Scenario]:
    """Ten scenarios of the field over the path that the targets are for."""
    return [SCENARIOS[name].shortened(length_mm) for name in FIELD_NAMES]


def bench(
    scenarios: Sequence[Scenario],
    *,
    methods: Mapping[str, Callable[[Rig], Method]] = METHODS,
    on_progress: Progress | None = None,
) -> list[BenchRow]:
    """Render each scenario, run every method on its video file and compare with the truth.

    A method that has no equations for the rig of a scenario has no row there.

    Args:
        scenarios: What to render.
        methods: Name and maker of what is compared.
        on_progress: Called after every frame; a frame counts one step for its rendering and one
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
                finder = None
                if name == OURS and scenario.is_stated_wrong:
                    finder = JointFinder(scenario.rig)
                estimates: list[Estimate] = []
                times_ms: list[tuple[float, float]] = []
                for image, estimate, step_ms, unit_ms in _timed_steps(method, run.video):
                    estimates.append(estimate)
                    times_ms.append((step_ms, unit_ms))
                    if finder is not None:
                        finder.add(image, estimate)
                    count(f"{name} on {scenario.name}")
                track = Track.from_estimates(estimates)
                rows.append(
                    BenchRow(
                        scenario=scenario.name,
                        method=name,
                        evaluation=evaluate(track, truth),
                        time=_step_time(times_ms[WARM_UP_FRAMES:]),
                        wrong_rig=(
                            None
                            if finder is None
                            else _wrong_rig(scenario.rig, track, truth, finder.finish())
                        ),
                    )
                )
    return rows


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
    """The scale by the joints that were seen; None where they cannot be counted."""
    try:
        return propose(track, sightings, rig)
    except InvalidCorrection:
        return None


def _timed_steps(method: Method, video: Path) -> Iterator[tuple[Image, Estimate, float, float]]:
    """Pictures and estimates of a video, the milliseconds of each step and those of the unit."""
    with VideoFile(video) as frames, _one_opencv_thread():
        window = cv2.createHanningWindow((frames.info.width, frames.info.height), cv2.CV_32F)
        before = np.zeros(window.shape, np.float32)
        for frame in frames:
            start_s = perf_counter()
            estimate = method.step(frame.image, frame.t_s)
            step_ms = (perf_counter() - start_s) * 1000
            now = frame.image.astype(np.float32)
            # phaseCorrelate multiplies its inputs by the window in place.
            inputs = before, now.copy()
            start_s = perf_counter()
            cv2.phaseCorrelate(*inputs, window)
            unit_ms = (perf_counter() - start_s) * 1000
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
    """Run `chainage track` on the file of a scenario, in turns with decoding it to grey."""
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
    """As anybody would write it."""
    with av.open(str(video)) as container:
        for frame in container.decode(video=0):
            frame.to_ndarray(format="gray")


_TARGET_HEADINGS = (
    "scenario", "path (m)", "end error (%)", "largest (mm)", "ATE (mm)", "yaw rms (°)",
    "within 3 sigma", "within 3 of the registration", "median error / sigma of it", "frames lost",
    "missing",
)  # fmt: skip
_SHORT_HEADINGS = (
    "scenario", "end error (%)", "largest (mm)", "ATE (mm)", "yaw rms (°)", "within 3 sigma",
    "frames lost",
)  # fmt: skip


def to_short_markdown(rows: Sequence[BenchRow]) -> str:
    """One table: the accuracy of each row beside its targets, and no times."""
    lines = [dict(zip(_TARGET_HEADINGS, _against_targets(row), strict=True)) for row in rows]
    cells = [[line[heading] for heading in _SHORT_HEADINGS] for line in lines]
    return _table(_SHORT_HEADINGS, cells) + "\n"


def to_markdown(rows: Sequence[BenchRow], track_time: TrackTime | None = None) -> str:
    """Tables: Chainage beside its targets, all methods side by side, and what they cost."""
    methods = list(dict.fromkeys(row.method for row in rows))
    scenarios = list(dict.fromkeys(row.scenario for row in rows))
    by_key = {(row.scenario, row.method): row for row in rows}
    ours = [row for row in rows if row.method == OURS]
    left_out = [name for name, one in SCENARIOS.items() if not one.is_available]
    parts: list[str] = []
    if ours:
        parts += [
            "Chainage and its targets, which are those for 6 m of path; **bold** falls short. No "
            "shift, turn or scale is fitted. The first interval holds the rig's tolerances, the "
            "second is that of the registration alone.",
            _table(_TARGET_HEADINGS, [_against_targets(row) for row in ours]),
        ]
    wrong = [(row.scenario, row.wrong_rig) for row in ours if row.wrong_rig is not None]
    if wrong:
        parts += [
            "Where the rig is wrong or the pipe not clean, in the last frame; then after the "
            "joints have brought the run to scale (- where they cannot be counted):",
            _table(
                [
                    "scenario", "error / sigma", "sigma (%)", "sigma of registration (mm)",
                    "joints", "error with joints (%)", "sigma with joints (%)",
                ],
                [_against_scale_target(name, result) for name, result in wrong],
            ),
        ]  # fmt: skip
    parts += [
        "End error in % of the path · ATE in mm; - where a method has no equations for the camera:",
        _table(
            ["scenario", *methods],
            [
                [scenario, *(_accuracy(by_key.get((scenario, method))) for method in methods)]
                for scenario in scenarios
            ],
        ),
        "Time of one step over that of one windowed `cv2.phaseCorrelate` of the same frames "
        f"({environment()}; one thread, medians after {WARM_UP_FRAMES} frames of warm-up; in "
        "brackets milliseconds, median and 10th to 90th percentile):",
        _table(
            ["scenario", *methods],
            [
                [scenario, *(_cost(by_key.get((scenario, method))) for method in methods)]
                for scenario in scenarios
            ],
        ),
    ]
    if track_time is not None:
        parts.append(
            f"`chainage track` of {track_time.frames} frames takes {track_time.track_s:.2f} s, "
            f"decoding the same file to grey {track_time.decode_s:.2f} s: "
            f"{_limited(track_time.ratio, TRACK_TARGET, '.1f')} times as long."
        )
    if left_out:
        parts.append(
            f"Left out: {', '.join(left_out)}, for which scikit-image must be installed "
            "(pip install scikit-image)."
        )
    return "\n\n".join(parts) + "\n"


def _table(heading: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rule = "|" + "---|" * len(heading)
    return "\n".join([_line(heading), rule, *map(_line, lines)])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _against_targets(row: BenchRow) -> list[str]:
    result, target = row.evaluation, TARGETS.get(row.scenario, Target())
    low, high = ERROR_OVER_SIGMA
    ratio, share = result.error_over_registration, result.registration_coverage
    is_right = row.wrong_rig is None
    return [
        row.scenario,
        f"{result.path_mm / 1000:.2f}",
        _limited(result.end_error_percent, target.end_percent, "+.3f"),
        _limited(result.max_error_mm, target.max_error_mm, ".2f"),
        _limited(result.ate_mm, target.ate_mm, ".2f"),
        _limited(result.yaw_rms_deg, target.yaw_rms_deg, ".3f"),
        _bold_if(result.coverage < LEAST_COVERAGE, f"{result.coverage:.1%}"),
        _bold_if(is_right and share < LEAST_REGISTRATION_COVERAGE, f"{share:.1%}"),
        _bold_if(is_right and (ratio is None or not low <= ratio <= high), or_dash(ratio)),
        f"{_limited(result.lost_frames, target.lost_frames, 'd')} of {result.frames}",
        _bold_if(result.missing_frames > 0, str(result.missing_frames)),
    ]


def _against_scale_target(scenario: str, result: WrongRig) -> list[str]:
    # How much silt lies in a pipe is in no tolerance.
    limit = None if SCENARIOS[scenario].silt.is_there else SCALE_TARGET.error_over_sigma
    cells = [
        scenario,
        _limited(result.error_over_sigma, limit, ".2f"),
        _limited(result.sigma_percent, SCALE_TARGET.sigma_percent, ".2f"),
        _limited(result.registration_mm, SCALE_TARGET.registration_mm, ".2f"),
    ]
    joined = result.joined
    if joined is None:
        return [*cells, "**-**", "**-**", "**-**"]
    return [
        *cells,
        str(joined.joints),
        _limited(joined.error_percent, SCALE_TARGET.joined_error_percent, "+.3f"),
        _limited(joined.sigma_percent, SCALE_TARGET.joined_sigma_percent, ".2f"),
    ]


def _limited(value: float, limit: float | None, form: str) -> str:
    """A figure beside the limit of its size, bold where it is beyond."""
    if limit is None:
        return format(value, form)
    beyond = abs(value) > limit
    return _bold_if(beyond, f"{value:{form}} {'>' if beyond else '≤'} {limit:g}")


def _bold_if(holds: bool, text: str) -> str:
    return f"**{text}**" if holds else text


def _accuracy(row: BenchRow | None) -> str:
    if row is None:
        return "-"
    return f"{row.evaluation.end_error_percent:+.3f} · {row.evaluation.ate_mm:.1f}"


def _cost(row: BenchRow | None) -> str:
    if row is None:
        return "-"
    time, limit = row.time, STEP_TARGET if row.method == OURS else None
    spread = f"({time.ms:.1f}; {time.ms_p10:.1f}-{time.ms_p90:.1f})"
    return f"{_limited(time.ratio, limit, '.2f')} {spread}"


def to_json(rows: Sequence[BenchRow], track_time: TrackTime | None = None) -> str:
    """All figures of all rows, their targets, and what they were measured on."""
    return json.dumps(
        {
            "environment": environment(),
            "targets": {
                "scenarios": {name: asdict(target) for name, target in TARGETS.items()},
                "wrong_rigs": asdict(SCALE_TARGET),
                "least_coverage": LEAST_COVERAGE,
                "least_registration_coverage": LEAST_REGISTRATION_COVERAGE,
                "error_over_sigma": ERROR_OVER_SIGMA,
                "step_ratio": STEP_TARGET,
                "track_ratio": TRACK_TARGET,
            },
            "rows": [asdict(row) for row in rows],
            "track": None if track_time is None else asdict(track_time),
        },
        indent=2,
        allow_nan=False,
    )


def environment() -> str:
    """What the times were measured on, in a phrase."""
    return (
        f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, "
        f"OpenCV {cv2.__version__}, numpy {np.__version__}"
    )
