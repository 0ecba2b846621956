"""How well a track fits the truth: errors without any alignment, and whether its sigma is honest.

Track and truth both start at (0, 0, 0).  Nothing is shifted, turned or scaled to fit, because that
would hide the error that matters most, the scale.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vo_core.errors import InvalidTrack
from vo_core.track import Track

RPE_STEP_MM = 500.0
"""Length of path over which the relative error is taken."""

_ROUNDING_MM = 1e-3
"""Files round their numbers; an error below this is none."""

_Column = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """True poses as columns, each (N,), in the order of the frames."""

    frame: NDArray[np.int64]
    time_s: _Column
    x_mm: _Column
    y_mm: _Column
    yaw_deg: _Column
    distance_mm: _Column

    def __len__(self) -> int:
        return len(self.frame)

    @classmethod
    def from_csv(cls, text: str) -> Truth:
        """Read truth.csv as `simulate` writes it; lines that start with # are skipped.

        Raises:
            InvalidTrack: A column is missing, a value is no number, or there is no row.
        """
        reader = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
        names = [field.name for field in fields(cls)]
        missing = set(names) - set(reader.fieldnames or ())
        if missing:
            raise InvalidTrack(f"The truth has no column {', '.join(sorted(missing))}.")
        try:
            rows = [[float(record[name]) for name in names] for record in reader]
        except (TypeError, ValueError) as error:
            raise InvalidTrack(f"The truth holds a row that is not numbers: {error}.") from error
        if not rows:
            raise InvalidTrack("The truth holds no rows.")
        frame, *columns = np.array(rows).T
        return cls(frame.astype(np.int64), *columns)


@dataclass(frozen=True)
class Evaluation:
    """Figures of one track against its truth; errors are track minus truth."""

    frames: int
    """Of the truth."""
    missing_frames: int
    """Of the truth that the track does not have."""
    lost_share: float
    """Share of the track's frames with status `lost`."""
    weak_share: float
    path_mm: float
    """Length of the true way along the axis, there and back added up."""
    end_error_mm: float
    """Of the distance, in the last frame that both have."""
    end_error_percent: float
    """The same in percent of `path_mm`."""
    max_error_mm: float
    """Largest size of the distance error on the way."""
    mean_error_mm: float
    sd_error_mm: float
    variance_error_mm2: float
    """Of the distance error over all frames, as the paper states them in its figure 9."""
    ate_mm: float
    """Absolute trajectory error: root mean square distance of (x, y) from the truth."""
    rpe_mm: float | None
    """Relative pose error over `RPE_STEP_MM` of path, root mean square; None on a shorter way."""
    rpe_deg: float | None
    yaw_rms_deg: float
    coverage: float
    """Share of frames whose distance error is within three sigma."""
    error_over_sigma: float | None
    """Median of |distance error| / sigma; None if no frame states a sigma."""
    nees: float | None
    """Mean of (distance error / sigma)^2: 1 for honest independent errors."""

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of every figure, for a table."""
        return [
            ("frames", f"{self.frames}, of which {self.missing_frames} missing"),
            ("lost / weak", f"{self.lost_share:.1%} / {self.weak_share:.1%}"),
            ("path along the axis", f"{self.path_mm / 1000:.3f} m"),
            ("end error", f"{self.end_error_mm:+.2f} mm ({self.end_error_percent:+.3f} %)"),
            ("largest distance error", f"{self.max_error_mm:.2f} mm"),
            (
                "distance error, mean / sd / variance",
                f"{self.mean_error_mm:+.2f} mm / {self.sd_error_mm:.2f} mm / "
                f"{self.variance_error_mm2:.2f} mm²",
            ),
            ("ATE (no alignment)", f"{self.ate_mm:.2f} mm"),
            (
                f"RPE over {RPE_STEP_MM / 1000:g} m",
                "path too short"
                if self.rpe_mm is None
                else f"{self.rpe_mm:.2f} mm, {self.rpe_deg:.3f}°",
            ),
            ("yaw rms", f"{self.yaw_rms_deg:.3f}°"),
            ("within 3 sigma", f"{self.coverage:.1%}"),
            ("median |error| / sigma", _or_dash(self.error_over_sigma)),
            ("NEES of the distance", _or_dash(self.nees)),
        ]


def _or_dash(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def evaluate(track: Track, truth: Truth) -> Evaluation:
    """Compare a track with the truth, frame number by frame number.

    Raises:
        InvalidTrack: The two have no frame in common.
    """
    ours, theirs = _common_frames(track, truth)
    error_mm = track.distance_mm[ours] - truth.distance_mm[theirs]
    off_mm = np.hypot(track.x_mm[ours] - truth.x_mm[theirs], track.y_mm[ours] - truth.y_mm[theirs])
    yaw_error_deg = _wrapped_deg(track.yaw_deg[ours] - truth.yaw_deg[theirs])
    path_mm = float(np.abs(np.diff(truth.distance_mm)).sum())
    sigma_mm = track.sigma_distance_mm[ours]
    stated = sigma_mm > 0
    ratio = np.abs(error_mm[stated]) / sigma_mm[stated]
    rpe_mm, rpe_deg = _relative_errors(track, truth, ours, theirs)
    return Evaluation(
        frames=len(truth),
        missing_frames=len(truth) - len(theirs),
        lost_share=float(np.mean(track.status == "lost")),
        weak_share=float(np.mean(track.status == "weak")),
        path_mm=path_mm,
        end_error_mm=float(error_mm[-1]),
        end_error_percent=float(100 * error_mm[-1] / path_mm) if path_mm else 0.0,
        max_error_mm=float(np.abs(error_mm).max()),
        mean_error_mm=float(error_mm.mean()),
        sd_error_mm=float(error_mm.std()),
        variance_error_mm2=float(error_mm.var()),
        ate_mm=_rms(off_mm),
        rpe_mm=rpe_mm,
        rpe_deg=rpe_deg,
        yaw_rms_deg=_rms(yaw_error_deg),
        coverage=float(np.mean(np.abs(error_mm) <= 3 * sigma_mm + _ROUNDING_MM)),
        error_over_sigma=float(np.median(ratio)) if ratio.size else None,
        nees=float(np.mean(ratio**2)) if ratio.size else None,
    )


def _common_frames(track: Track, truth: Truth) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices into both of the frames that both have, in the order of the frames."""
    common, ours, theirs = np.intersect1d(track.frame, truth.frame, return_indices=True)
    if not common.size:
        raise InvalidTrack("Track and truth have no frame in common.")
    return ours, theirs


def _wrapped_deg(angle_deg: _Column) -> _Column:
    return (angle_deg + 180) % 360 - 180


def _rms(values: _Column) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _relative_errors(
    track: Track, truth: Truth, ours: NDArray[np.intp], theirs: NDArray[np.intp]
) -> tuple[float | None, float | None]:
    """RMS of (T_true_i^-1 T_true_j)^-1 (T_i^-1 T_j) over all i, j one step of path later."""
    steps_mm = np.hypot(np.diff(truth.x_mm), np.diff(truth.y_mm))
    path_mm = np.concatenate([[0.0], np.cumsum(steps_mm)])[theirs]
    later = np.searchsorted(path_mm, path_mm + RPE_STEP_MM)
    start = np.flatnonzero(later < len(path_mm))
    if not start.size:
        return None, None
    end = later[start]

    def motion(run: Track | Truth, index: NDArray[np.intp]) -> tuple[NDArray[Any], _Column]:
        """Motion in the axes of the start, as x + iy, and the turn."""
        position = run.x_mm[index] + 1j * run.y_mm[index]
        yaw_deg = run.yaw_deg[index]
        moved = (position[end] - position[start]) * np.exp(-1j * np.radians(yaw_deg[start]))
        return moved, yaw_deg[end] - yaw_deg[start]

    moved, turned_deg = motion(track, ours)
    true_moved, true_turned_deg = motion(truth, theirs)
    return (
        _rms(np.abs(moved - true_moved)),
        _rms(_wrapped_deg(turned_deg - true_turned_deg)),
    )


def plot(runs: Sequence[tuple[str, Track, Truth]], file: Path) -> None:
    """Draw named runs in the manner of the paper's figures 8 and 9.

    A row a run: on the left the path that was driven and the path that was measured, on the right
    the error of the displacement with its mean, standard deviation and variance, and +-3 sigma as
    the track states it.

    Args:
        runs: Name, track and truth of each run, at least one.
        file: Where the picture goes; its suffix decides the format (.png, .pdf, .svg).
    """
    # Only this function draws; whoever does not plot does not wait for matplotlib.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.4 * len(runs)), layout="constrained")
    grid = figure.subplots(len(runs), 2, squeeze=False)
    for (path_axes, error_axes), (name, track, truth) in zip(grid, runs, strict=True):
        ours, theirs = _common_frames(track, truth)
        path_axes.plot(truth.x_mm / 1000, truth.y_mm, color="0.6", lw=3, label="true")
        path_axes.plot(track.x_mm / 1000, track.y_mm, color="tab:red", lw=1, label="measured")
        path_axes.set(title=f"{name}: path", xlabel="x (m)", ylabel="y (mm)")
        path_axes.legend()

        result = evaluate(track, truth)
        error_mm = track.distance_mm[ours] - truth.distance_mm[theirs]
        time_s, sigma_mm = truth.time_s[theirs], track.sigma_distance_mm[ours]
        error_axes.fill_between(
            time_s, -3 * sigma_mm, 3 * sigma_mm, color="0.88", label="±3 sigma as stated"
        )
        error_axes.plot(time_s, error_mm, color="tab:red", lw=1, label="error")
        error_axes.axhline(result.mean_error_mm, color="tab:blue", ls="--", lw=1, label="mean")
        error_axes.set(
            title=(
                f"{name}: error of displacement\nmean {result.mean_error_mm:+.2f} mm, "
                f"sd {result.sd_error_mm:.2f} mm, variance {result.variance_error_mm2:.2f} mm²"
            ),
            xlabel="time (s)",
            ylabel="error (mm)",
        )
        error_axes.legend()
    figure.savefig(file, dpi=110)
