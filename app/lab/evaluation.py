"""Compares a track with the truth: errors without any alignment, and the coverage of its sigma.

Track and truth both start at (0, 0, 0).  Nothing is shifted, rotated or scaled to fit, because that
would hide the most important error, the scale.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from vo_core.csv_rows import number_columns
from vo_core.errors import InvalidTrack
from vo_core.track import Track

if TYPE_CHECKING:  # matplotlib is imported only for plots
    from matplotlib.axes import Axes

RPE_STEP_MM = 500.0
"""Length of path over which the relative error is taken."""

_ROUNDING_MM = 1e-3
"""Rounding of the files; smaller errors count as 0."""

_Column = NDArray[np.float64]
_Parsed = TypeVar("_Parsed")


@dataclass(frozen=True)
class Truth:
    """True poses as columns, each (N,), in the order of the frames."""

    frame: NDArray[np.int64]
    time_s: _Column
    x_mm: _Column
    y_mm: _Column
    yaw_deg: _Column
    distance_mm: _Column
    z_mm: _Column | None = None
    """None in older files, whose camera keeps its height and is not tilted; so are the next two."""
    pitch_deg: _Column | None = None
    roll_deg: _Column | None = None

    def __len__(self) -> int:
        return len(self.frame)

    @classmethod
    def from_csv(cls, text: str) -> Truth:
        """Read truth.csv as `simulate` writes it; lines that start with # are skipped.

        Raises:
            InvalidTrack: A column is missing, a value is not a finite number, or there are no rows.
        """
        needed = [one.name for one in fields(cls) if one.default is MISSING]
        further = [one.name for one in fields(cls) if one.default is not MISSING]
        columns = number_columns(text, needed, "truth", further=further)
        frame = columns.pop("frame").astype(np.int64)
        if not len(frame):
            raise InvalidTrack("The truth holds no rows.")
        return cls(frame=frame, **columns)


@dataclass(frozen=True)
class Run:
    """A named track with its truth."""

    name: str
    track: Track
    truth: Truth


@dataclass(frozen=True)
class Errors:
    """Track minus truth in the common frames, as columns, each (N,)."""

    time_s: _Column
    distance_mm: _Column
    position_mm: _Column
    """Distance of (x, y) from the truth."""
    yaw_deg: _Column
    sigma_mm: _Column
    """Sigma of the distance, as the track states it."""
    sigma_registration_mm: _Column
    """The part of sigma without the rig's tolerances."""


@dataclass(frozen=True)
class DisplacementError:
    """Statistics of the distance error over all frames of one or several runs."""

    mean_error_mm: float
    sd_error_mm: float
    variance_error_mm2: float
    """Variance, as in the paper's figure 9."""
    max_error_mm: float
    """Largest error in any frame, either sign."""
    coverage: float
    """Share of frames whose error is within three sigma."""
    error_over_sigma: float | None
    """Median of |error| / sigma; None if no frame states a sigma."""
    nees: float | None
    """Mean of (error / sigma)^2, which is 1 for correctly stated independent errors."""
    registration_coverage: float
    """Like `coverage`, by the registration's sigma, which a wrong rig does not widen; so is the
    next."""
    error_over_registration: float | None

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of every figure, for a table."""
        return [
            (
                "distance error, mean / sd / variance",
                f"{self.mean_error_mm:+.2f} mm / {self.sd_error_mm:.2f} mm / "
                f"{self.variance_error_mm2:.3g} mm²",
            ),
            ("largest distance error", f"{self.max_error_mm:.2f} mm"),
            ("within 3 sigma", f"{self.coverage:.1%}"),
            ("median |error| / sigma", or_dash(self.error_over_sigma)),
            ("NEES of the distance", or_dash(self.nees)),
            (
                "within 3 sigma of the registration",
                f"{self.registration_coverage:.1%}, median |error| / sigma "
                f"{or_dash(self.error_over_registration)}",
            ),
        ]


@dataclass(frozen=True)
class Evaluation(DisplacementError):
    """Comparison of one track with its truth; errors are track minus truth."""

    frames: int
    """Number of frames of the truth."""
    missing_frames: int
    """Frames of the truth that the track does not have."""
    surplus_frames: int
    """Frames of the track that the truth does not have; they are not evaluated."""
    lost_frames: int
    """Frames of the track with status `lost`."""
    weak_frames: int
    path_mm: float
    """Length of the true path along the axis, there and back added up."""
    end_error_mm: float
    """Error of the distance in the last common frame."""
    end_error_percent: float
    """The same in percent of `path_mm`."""
    quarter_errors_mm: tuple[float, float, float]
    """Errors of the distance after a quarter, a half and three quarters of the path."""
    ate_mm: float
    """Absolute trajectory error: root mean square distance of (x, y) from the truth."""
    y_rms_mm: float
    end_registration_mm: float
    """Sigma of the registration in the last common frame."""
    rpe_mm: float | None
    """Relative pose error over `RPE_STEP_MM` of path, root mean square; None on a shorter path."""
    rpe_deg: float | None
    yaw_rms_deg: float
    z_rms_mm: float | None
    """None where the truth does not have it; so are the next two."""
    pitch_rms_deg: float | None
    roll_rms_deg: float | None

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of every figure, for a table."""
        quarters = " / ".join(f"{error_mm:+.2f}" for error_mm in self.quarter_errors_mm)
        return [
            (
                "frames",
                f"{self.frames}, of which {self.missing_frames} missing; "
                f"{self.surplus_frames} beyond it",
            ),
            ("lost / weak", f"{self.lost_frames} / {self.weak_frames} frames"),
            ("path along the axis", f"{self.path_mm / 1000:.3f} m"),
            ("distance error at 1/4, 1/2, 3/4", f"{quarters} mm"),
            ("end error", f"{self.end_error_mm:+.2f} mm ({self.end_error_percent:+.3f} %)"),
            *super().rows(),
            ("ATE (no alignment)", f"{self.ate_mm:.2f} mm, y rms {self.y_rms_mm:.2f} mm"),
            (
                f"RPE over {RPE_STEP_MM / 1000:g} m",
                "path too short"
                if self.rpe_mm is None
                else f"{self.rpe_mm:.2f} mm, {self.rpe_deg:.3f}°",
            ),
            ("yaw rms", f"{self.yaw_rms_deg:.3f}°"),
            (
                "z, pitch, roll rms",
                f"{or_dash(self.z_rms_mm)} mm, {or_dash(self.pitch_rms_deg)}°, "
                f"{or_dash(self.roll_rms_deg)}°",
            ),
        ]


SUMMARY: Mapping[str, Callable[[Evaluation], str]] = {
    "missing": lambda run: str(run.missing_frames),
    "lost": lambda run: str(run.lost_frames),
    "end %": lambda run: f"{run.end_error_percent:+.3f}",
    "max mm": lambda run: f"{run.max_error_mm:.2f}",
    "ATE mm": lambda run: f"{run.ate_mm:.2f}",
    "RPE mm": lambda run: or_dash(run.rpe_mm),
    "yaw °": lambda run: f"{run.yaw_rms_deg:.3f}",
    "in 3σ": lambda run: f"{run.coverage:.1%}",
    "|e|/σ": lambda run: or_dash(run.error_over_sigma),
    "NEES": lambda run: or_dash(run.nees),
}
"""Figures of a table of several runs by their headings; |e|/σ is the median."""


def or_dash(value: float | None) -> str:
    """Format a figure; - if there is none."""
    return "-" if value is None else f"{value:.2f}"


def evaluate(track: Track, truth: Truth) -> Evaluation:
    """Compare a track with the truth by frame numbers.

    Raises:
        InvalidTrack: There is no common frame, or a value is not finite.
    """
    ours, theirs = _common_frames(track, truth)
    errors = errors_of(track, truth)
    steps_mm = np.abs(np.diff(truth.distance_mm))
    driven_mm = np.concatenate([[0.0], np.cumsum(steps_mm)])
    path_mm = float(driven_mm[-1])
    quarters = np.interp(
        path_mm * np.array([0.25, 0.5, 0.75]), driven_mm[theirs], errors.distance_mm
    )
    rpe_mm, rpe_deg = _relative_errors(track, truth, ours, theirs)
    return Evaluation(
        **vars(displacement_error([errors])),
        frames=len(truth),
        missing_frames=len(truth) - len(theirs),
        surplus_frames=len(track) - len(ours),
        lost_frames=int(np.sum(track.status == "lost")),
        weak_frames=int(np.sum(track.status == "weak")),
        path_mm=path_mm,
        end_error_mm=float(errors.distance_mm[-1]),
        end_error_percent=float(100 * errors.distance_mm[-1] / path_mm) if path_mm else 0.0,
        quarter_errors_mm=tuple(quarters.tolist()),
        ate_mm=_rms(errors.position_mm),
        y_rms_mm=_rms(track.y_mm[ours] - truth.y_mm[theirs]),
        end_registration_mm=float(errors.sigma_registration_mm[-1]),
        rpe_mm=rpe_mm,
        rpe_deg=rpe_deg,
        yaw_rms_deg=_rms(errors.yaw_deg),
        z_rms_mm=_rms_of(track.z_mm[ours], truth.z_mm, theirs),
        pitch_rms_deg=_rms_of(track.pitch_deg[ours], truth.pitch_deg, theirs),
        roll_rms_deg=_rms_of(track.roll_deg[ours], truth.roll_deg, theirs),
    )


def errors_of(track: Track, truth: Truth) -> Errors:
    """Compute the errors of each common frame.

    Raises:
        InvalidTrack: There is no common frame, or a value is not finite.
    """
    ours, theirs = _common_frames(track, truth)
    errors = Errors(
        time_s=truth.time_s[theirs],
        distance_mm=track.distance_mm[ours] - truth.distance_mm[theirs],
        position_mm=np.hypot(
            track.x_mm[ours] - truth.x_mm[theirs], track.y_mm[ours] - truth.y_mm[theirs]
        ),
        yaw_deg=_wrapped_deg(track.yaw_deg[ours] - truth.yaw_deg[theirs]),
        sigma_mm=track.sigma_distance_mm[ours],
        sigma_registration_mm=track.sigma_registration_mm[ours],
    )
    if not all(np.isfinite(column).all() for column in vars(errors).values()):
        raise InvalidTrack("Track or truth hold a value that is not a finite number.")
    return errors


def displacement_error(runs: Sequence[Errors]) -> DisplacementError:
    """Compute the statistics of the distance error over all frames of all runs."""
    error_mm = np.concatenate([run.distance_mm for run in runs])
    sigma_mm = np.concatenate([run.sigma_mm for run in runs])
    registration_mm = np.concatenate([run.sigma_registration_mm for run in runs])
    coverage, ratio, nees = _honesty(error_mm, sigma_mm)
    registration_coverage, registration_ratio, _ = _honesty(error_mm, registration_mm)
    return DisplacementError(
        mean_error_mm=float(error_mm.mean()),
        sd_error_mm=float(error_mm.std()),
        variance_error_mm2=float(error_mm.var()),
        max_error_mm=float(np.abs(error_mm).max()),
        coverage=coverage,
        error_over_sigma=ratio,
        nees=nees,
        registration_coverage=registration_coverage,
        error_over_registration=registration_ratio,
    )


def _honesty(error_mm: _Column, sigma_mm: _Column) -> tuple[float, float | None, float | None]:
    """Share of the frames within three sigma, median |error| / sigma, and NEES.

    The latter two are of the frames that state a sigma; None if none does.
    """
    coverage = float(np.mean(np.abs(error_mm) <= 3 * sigma_mm + _ROUNDING_MM))
    is_stated = sigma_mm > 0
    if not is_stated.any():
        return coverage, None, None
    ratio = np.abs(error_mm[is_stated]) / sigma_mm[is_stated]
    return coverage, float(np.median(ratio)), float(np.mean(ratio**2))


def load_runs(pairs: Sequence[tuple[Path, Path]]) -> list[Run]:
    """Load runs from pairs of files, track.csv and truth.csv.

    A run is named after its track file, including the folder if two files have the same name.

    Raises:
        InvalidTrack: A file is invalid, or two do not belong together; the message names them.
    """
    tracks = [track for track, _ in pairs]
    is_clear = len({track.stem for track in tracks}) == len(tracks)
    runs = []
    for track_file, truth_file in pairs:
        track = _parsed(track_file, Track.from_csv)
        truth = _parsed(truth_file, Truth.from_csv)
        try:
            errors_of(track, truth)
        except InvalidTrack as error:
            raise InvalidTrack(f"{track_file} and {truth_file}: {error}") from error
        name = track_file.stem if is_clear else str(track_file.with_suffix(""))
        runs.append(Run(name, track, truth))
    return runs


def _parsed(file: Path, parse: Callable[[str], _Parsed]) -> _Parsed:
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidTrack(f"{file} is not a text file.") from error
    if not text.strip():
        raise InvalidTrack(f"{file} is empty.")
    try:
        return parse(text)
    except InvalidTrack as error:
        raise InvalidTrack(f"{file}: {error}") from error


def _common_frames(track: Track, truth: Truth) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of the common frames in track and truth, in the order of the frames."""
    if not len(track):
        raise InvalidTrack("The track holds no rows.")
    common, ours, theirs = np.intersect1d(track.frame, truth.frame, return_indices=True)
    if not common.size:
        raise InvalidTrack(
            "Track and truth have no frame in common: the track has frames "
            f"{track.frame.min()} to {track.frame.max()}, the truth {truth.frame.min()} to "
            f"{truth.frame.max()}."
        )
    return ours, theirs


def _wrapped_deg(angle_deg: _Column) -> _Column:
    return (angle_deg + 180) % 360 - 180


def _rms(values: _Column) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _rms_of(ours: _Column, truth: _Column | None, theirs: NDArray[np.intp]) -> float | None:
    return None if truth is None else _rms(ours - truth[theirs])


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
        """Motion in the axes of the start, as x + iy, and the rotation."""
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


def plot(runs: Sequence[Run], file: Path) -> None:
    """Draw runs in the manner of the paper's figures 8 and 9.

    Each run has a row: on the left the true and the measured path, on the right the error of the
    displacement with its mean, standard deviation and variance, and +-3 sigma as the track states
    it. Several runs get a last row with all their errors side by side and the same figures over
    all.

    Args:
        runs: At least one.
        file: Where the picture goes; its suffix decides the format (.png, .pdf, .svg).
    """
    from matplotlib.figure import Figure

    rows = len(runs) + (len(runs) > 1)
    figure = Figure(figsize=(11, 3.4 * rows), layout="constrained")
    grid = figure.add_gridspec(rows, 2)
    errors = [errors_of(run.track, run.truth) for run in runs]
    for row, run in enumerate(runs):
        _draw_path(figure.add_subplot(grid[row, 0]), run)
        _draw_error(figure.add_subplot(grid[row, 1]), run.name, errors[row])
    if len(runs) > 1:
        _draw_all_errors(figure.add_subplot(grid[-1, :]), [run.name for run in runs], errors)
    figure.savefig(file, dpi=110)


def _draw_path(axes: Axes, run: Run) -> None:
    axes.plot(run.truth.x_mm / 1000, run.truth.y_mm, color="0.6", lw=3, label="true")
    axes.plot(run.track.x_mm / 1000, run.track.y_mm, color="tab:red", lw=1, label="measured")
    axes.set(title=f"{run.name}: path", xlabel="x along the pipe (m)", ylabel="y to the right (mm)")
    _legend_below(axes)


def _draw_error(axes: Axes, name: str, errors: Errors) -> None:
    statistics = displacement_error([errors])
    sigma_mm = errors.sigma_mm
    axes.fill_between(
        errors.time_s, -3 * sigma_mm, 3 * sigma_mm, color="0.88", label="±3 sigma as stated"
    )
    axes.plot(errors.time_s, errors.distance_mm, color="tab:red", lw=1, label="error")
    axes.axhline(statistics.mean_error_mm, color="tab:blue", ls="--", lw=1, label="mean")
    axes.set(
        title=f"{name}: error of displacement\n{_in_words(statistics)}",
        xlabel="time (s)",
        ylabel="measured - true (mm)",
    )
    _legend_below(axes)


def _draw_all_errors(axes: Axes, names: Sequence[str], runs: Sequence[Errors]) -> None:
    each = [displacement_error([run]) for run in runs]
    places = np.arange(len(runs))
    axes.errorbar(
        places,
        [one.mean_error_mm for one in each],
        yerr=[one.sd_error_mm for one in each],
        fmt="o",
        capsize=6,
        label="mean ± sd",
    )
    axes.plot(
        places, [run.distance_mm[-1] for run in runs], "x", color="tab:red", label="at the end"
    )
    axes.axhline(0, color="0.7", lw=1)
    axes.set(
        title=f"Error of displacement of all runs\n{_in_words(displacement_error(runs))}",
        ylabel="measured - true (mm)",
        xlim=(-0.6, len(runs) - 0.4),
    )
    axes.set_xticks(places, names, rotation=0 if len(runs) < 9 else 60)
    _legend_below(axes)


def _legend_below(axes: Axes) -> None:
    """Place the legend below the curves."""
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3, frameon=False)


def _in_words(statistics: DisplacementError) -> str:
    return (
        f"mean {statistics.mean_error_mm:+.2f} mm, sd {statistics.sd_error_mm:.2f} mm, "
        f"variance {statistics.variance_error_mm2:.3g} mm²"
    )
