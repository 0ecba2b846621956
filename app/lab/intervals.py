"""Checks the stated interval by tracking films repeatedly with rigs that are wrong.

A film of a few metres is rendered once and tracked with many stated rigs, drawn from the tolerances
around the true one (`app.lab.simulation.drawn_rigs`).  If sigma is correct, the true distance lies
within one sigma in 68 % of these runs and within 1.96 sigma in 95 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from app.lab.bench.run import Progress, by_joints
from app.lab.simulation import SCENARIOS, RenderedFrame, Scenario, drawn_rigs, render
from vo_core.joints.finder import JointFinder
from vo_core.odometry import Odometry
from vo_core.rig import Rig
from vo_core.track import Track

if TYPE_CHECKING:  # matplotlib is imported only for plots
    from matplotlib.axes import Axes

NAMES = ("nominal", "turned_camera", "wide_lens", "forward_wide")
RIGS = 50
"""Number of stated rigs for each film."""

QUICK_RIGS = 5
"""The same for a quick run."""

SHARES = (0.68, 0.95)
"""Nominal coverage of the intervals, as shares of the runs."""


@dataclass(frozen=True)
class Stated:
    """Error and sigma of the distance in the last frame."""

    error_mm: float
    """Measured minus true."""
    sigma_mm: float


@dataclass(frozen=True)
class Trial:
    """One film tracked with one stated rig."""

    film: str
    path_mm: float
    raw: Stated
    joined: Stated | None
    """After the joints have corrected the scale; None if they cannot be counted."""


@dataclass(frozen=True)
class Calibration:
    """Coverage and width of the interval over many trials."""

    runs: int
    inside: tuple[float, ...]
    """Share of the runs with the truth inside, for each of `SHARES`."""
    sigma_percent: float
    """Median sigma in percent of the path."""
    error_percent: float
    """Median |error| in percent of the path."""


def films() -> list[Scenario]:
    """Films of a short path past two joints at twice the speed, for every kind of camera."""
    return [
        replace(
            SCENARIOS[name],
            length_mm=1800.0,
            first_joint_mm=150.0,
            speed_mm_s=600.0,
            acceleration_mm_s2=1200.0,
        )
        for name in NAMES
    ]


def run_trials(
    scenarios: Sequence[Scenario], rigs: int, on_progress: Progress | None = None
) -> list[Trial]:
    """Render each film once and track it with `rigs` stated rigs."""
    trials: list[Trial] = []
    for number, film in enumerate(scenarios):
        if on_progress is not None:
            on_progress(f"rendering {film.name}", len(trials), rigs * len(scenarios))
        frames = list(render(film))
        for rig in islice(drawn_rigs(film.rendered_rig, seed=number), rigs):
            trials.append(_trial(film.name, rig, frames))
            if on_progress is not None:
                on_progress(f"tracking {film.name}", len(trials), rigs * len(scenarios))
    return trials


def _trial(name: str, rig: Rig, frames: Sequence[RenderedFrame]) -> Trial:
    odometry, finder = Odometry(rig), JointFinder(rig)
    for frame in frames:
        estimate = odometry.step(frame.image, frame.t_s)
        finder.add(
            frame.image, estimate, initial_pose=odometry.initial_pose, smoothed=odometry.smoothed
        )
    track = Track.from_estimates(odometry.smoothed())
    proposal = by_joints(rig, track, finder.finish())
    true_mm = frames[-1].x_mm
    return Trial(
        film=name,
        path_mm=float(np.abs(np.diff([frame.x_mm for frame in frames])).sum()),
        raw=_stated(track, true_mm),
        joined=None if proposal is None else _stated(proposal.correction.track, true_mm),
    )


def _stated(track: Track, true_mm: float) -> Stated:
    return Stated(
        error_mm=float(track.distance_mm[-1] - true_mm),
        sigma_mm=float(track.sigma_distance_mm[-1]),
    )


def calibration(trials: Sequence[tuple[Stated, float]]) -> Calibration:
    """Compute the figures of distances with the lengths of their paths, at least one."""
    errors_mm, sigmas_mm, paths_mm = np.array(
        [(abs(stated.error_mm), stated.sigma_mm, path_mm) for stated, path_mm in trials]
    ).T
    return Calibration(
        runs=len(trials),
        inside=tuple(float(np.mean(errors_mm <= _sigmas(share) * sigmas_mm)) for share in SHARES),
        sigma_percent=float(100 * np.median(sigmas_mm / paths_mm)),
        error_percent=float(100 * np.median(errors_mm / paths_mm)),
    )


def _sigmas(share: float) -> float:
    """Half width, in sigmas, of the interval that holds a share of a normal distribution."""
    return NormalDist().inv_cdf((1 + share) / 2)


def _raw(trials: Sequence[Trial]) -> list[tuple[Stated, float]]:
    return [(trial.raw, trial.path_mm) for trial in trials]


def _joined(trials: Sequence[Trial]) -> list[tuple[Stated, float]]:
    return [(trial.joined, trial.path_mm) for trial in trials if trial.joined is not None]


def to_markdown(trials: Sequence[Trial]) -> str:
    """Write a row for each film and one for all, before and after the joints."""
    lines = [
        "| film | runs | inside 68 % | inside 95 % | median sigma (%) | median error (%) |",
        "|" + "---|" * 6,
    ]
    names = list(dict.fromkeys(trial.film for trial in trials))
    groups = [(name, [trial for trial in trials if trial.film == name]) for name in names]
    for name, group in [*groups, ("all", trials)]:
        for words, chosen in ((name, _raw(group)), (f"{name}, with joints", _joined(group))):
            if chosen:
                lines.append(_line(words, calibration(chosen)))
    uncounted = sum(trial.joined is None for trial in trials)
    lines += ["", f"In {uncounted} of {len(trials)} runs the joints cannot be counted."]
    return "\n".join(lines) + "\n"


def _line(name: str, result: Calibration) -> str:
    shares = " | ".join(f"{share:.0%}" for share in result.inside)
    return (
        f"| {name} | {result.runs} | {shares} | {result.sigma_percent:.2f} | "
        f"{result.error_percent:.2f} |"
    )


def plot(trials: Sequence[Trial], file: Path) -> None:
    """Draw the coverage of the stated interval, and the errors against their sigma.

    Args:
        trials: At least one.
        file: Where the picture goes; its suffix decides the format (.png, .pdf, .svg).
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5), layout="constrained")
    shares, errors = figure.subplots(1, 2)
    kinds = [("raw", "tab:red", _raw(trials)), ("with joints", "tab:blue", _joined(trials))]
    for name, colour, chosen in kinds:
        if chosen:
            _draw_shares(shares, name, colour, [stated for stated, _ in chosen])
            _draw_errors(errors, name, colour, chosen)
    shares.plot([0, 1], [0, 1], color="0.7", lw=1, label="as stated")
    shares.set(
        title="Truth inside the stated interval",
        xlabel="share that the interval is meant to hold",
        ylabel="share of the runs",
        aspect="equal",
    )
    widest = max(100 * stated.sigma_mm / path_mm for stated, path_mm in _raw(trials))
    for share in SHARES:
        edge = _sigmas(share) * widest
        errors.plot([0, widest], [0, edge], color="0.7", lw=1)
        errors.plot([0, widest], [0, -edge], color="0.7", lw=1)
        errors.annotate(f"{share:.0%}", (widest, edge), color="0.5")
    errors.set(
        title=f"{len(trials)} runs with rigs that are wrong by their tolerance",
        xlabel="stated sigma (% of the path)",
        ylabel="measured - true (% of the path)",
    )
    shares.legend(loc="upper left", frameon=False)
    errors.legend(loc="upper left", frameon=False)
    figure.savefig(file, dpi=110)


def _draw_shares(axes: Axes, name: str, colour: str, stated: Sequence[Stated]) -> None:
    meant = np.linspace(0.02, 0.98, 49)
    ratios = np.array([abs(one.error_mm) / one.sigma_mm for one in stated])
    inside = [float(np.mean(ratios <= _sigmas(float(share)))) for share in meant]
    axes.plot(meant, inside, color=colour, label=name)


def _draw_errors(
    axes: Axes, name: str, colour: str, chosen: Sequence[tuple[Stated, float]]
) -> None:
    sigma_percent, error_percent = np.array(
        [
            (100 * stated.sigma_mm / path_mm, 100 * stated.error_mm / path_mm)
            for stated, path_mm in chosen
        ]
    ).T
    axes.plot(sigma_percent, error_percent, ".", color=colour, label=name)
