"""Fits the camera of a set of pictures, rejects outliers, fits again, and gives a verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.lab.calibration.boards import Board, Boards, Dropped, UnusableBoards, View
from app.lab.calibration.finding import LEAST_CORNERS, find_boards, read_grey
from app.lab.calibration.lens import LEAST_VIEWS, Model, fit_lens
from vo_core.geometry.wall import Points
from vo_core.rig import Camera, Rig
from vo_core.types import ByteImage

GOOD_IMAGES = 10
"""Number of pictures for a good calibration."""

OUTLIER_RATIO = 3.0
"""A picture is rejected if its median residual exceeds this many times that of the median picture:
it does not show the same flat board through the same lens."""

OUTLIER_PX = 0.5
"""A picture is kept up to this median residual, whatever the others have."""

STRAY_RATIO = 4.0
"""A corner is rejected if its residual exceeds this many times the median: detectors guess corners
where squares are small."""

STRAY_PX = 0.3
"""A corner is kept up to this residual, whatever the others have."""

GOOD_RMS_PX = 0.5
"""Largest residual of a good calibration."""

WORST_FX_SIGMA = 0.05
"""Largest sigma of fx, relative to fx, for which there is a result."""

GOOD_FX_PERCENT = 0.2
"""Largest two standard deviations of fx in a good calibration; one percent of fx is one percent of
every distance."""

COVERAGE_CELLS = (6, 8)
"""Rows and columns of the grid on which the coverage of the picture is counted."""

GOOD_COVERAGE = 0.6
"""Least share of covered cells in a good calibration."""


@dataclass(frozen=True)
class Fit:
    """A picture that is used, with its residuals."""

    view: View
    residual_px: Points
    """(N, 2) detected corner minus projected corner."""

    @property
    def length_px(self) -> NDArray[np.float64]:
        """(N,) lengths of the residuals."""
        return np.asarray(np.linalg.norm(self.residual_px, axis=1))

    @property
    def median_px(self) -> float:
        """Median length, which a few wrong corners do not affect."""
        return float(np.median(self.length_px))

    @property
    def rms_px(self) -> float:
        """Root mean square length."""
        return float(np.sqrt((self.length_px**2).mean()))


@dataclass(frozen=True)
class Calibration:
    """A camera, and the pictures that determine it."""

    camera: Camera
    fits: tuple[Fit, ...]
    dropped: tuple[Dropped, ...]
    fx_sigma_px: float
    """Standard deviation of fx."""
    covered: NDArray[np.bool_]
    """(rows, columns) whether a corner was seen in each cell of the picture."""

    @property
    def rms_px(self) -> float:
        """Root mean square residual of all corners."""
        return float(np.sqrt(np.concatenate([fit.length_px**2 for fit in self.fits]).mean()))

    @property
    def fx_percent(self) -> float:
        """95 % uncertainty of fx in percent, which is also that of every distance."""
        return 200 * self.fx_sigma_px / self.camera.fx

    def into(self, rig: Rig) -> Rig:
        """Put this camera, and the tolerance of its focal length, into a rig."""
        known = rig.known_to(focal_percent=round(100 * self.fx_sigma_px / self.camera.fx, 4))
        return known.model_copy(update={"camera": self.camera})

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of every figure, for a table."""
        camera = self.camera
        return [
            ("residual", f"{self.rms_px:.3f} px over {len(self.fits)} pictures"),
            ("coverage", f"{self.covered.mean():.0%} of the picture"),
            ("fx", f"{camera.fx:.2f} px, 95 % within {self.fx_percent:.3f} %"),
            ("fy, cx, cy", f"{camera.fy:.2f}, {camera.cx:.2f}, {camera.cy:.2f} px"),
            ("verdict", "; ".join(self.weaknesses()) or "good"),
        ]

    def weaknesses(self) -> list[str]:
        """What makes this calibration weak, with what to do; empty for a good one."""
        found = [
            (
                len(self.fits) < GOOD_IMAGES,
                f"only {len(self.fits)} pictures were used: take {GOOD_IMAGES} or more",
            ),
            (
                self.covered.mean() < GOOD_COVERAGE,
                f"the boards covered {self.covered.mean():.0%} of the picture: bring the board "
                "into its corners and up to its edges too",
            ),
            (
                self.fx_percent > GOOD_FX_PERCENT,
                f"the focal length is known to {self.fx_percent:.2f} % only: tilt the board by 20 "
                "to 45 degrees to all sides and come close",
            ),
            (
                self.rms_px > GOOD_RMS_PX,
                f"the corners are {self.rms_px:.2f} px off: is the board flat, the camera's focus "
                "fixed, the model of the lens the right one?",
            ),
        ]
        return [sentence for holds, sentence in found if holds]


def calibrate_files(
    files: Sequence[Path],
    board: Board,
    model: Model,
    on_progress: Callable[[int, int], None] | None = None,
) -> Calibration:
    """Calibrate the camera that took these pictures of a board.

    Args:
        files: The pictures.
        board: The printed board.
        model: Model of the lens.
        on_progress: Called after each picture with pictures done and in all.
    Raises:
        UnusableBoards: The pictures determine no camera.
        OSError: A file is missing.
    """

    def pictures() -> Iterator[tuple[str, ByteImage | None]]:
        for done, file in enumerate(files, 1):
            yield file.name, read_grey(file)
            if on_progress is not None:
                on_progress(done, len(files))

    return calibrate(find_boards(pictures(), board), model)


def calibrate(boards: Boards, model: Model) -> Calibration:
    """Fit the camera to all boards by least squares.

    Pictures and corners that do not agree with the others are rejected, and the fit is repeated.

    Raises:
        UnusableBoards: Too few pictures are left, or they determine no camera.
    """
    views, dropped = boards.views, list(boards.dropped)
    while True:
        _require_enough(views, dropped)
        lens = fit_lens(views, model, boards.size_wh)
        fits = [Fit(*pair) for pair in zip(lens.views, lens.residuals_px(), strict=True)]
        unplaced = [view for view in views if view not in lens.views]
        kept, lost = _agreeing(fits)
        if [fit.view for fit in fits] == kept:
            break
        views, dropped = (*unplaced, *kept), dropped + lost
    dropped += [
        Dropped(view.name, "no pose of the board fits: too far aside or too flat an angle")
        for view in unplaced
    ]
    _require_enough(lens.views, dropped)
    camera, fx_sigma_px = lens.camera(boards.size_wh), lens.fx_sigma_px()
    if fx_sigma_px > WORST_FX_SIGMA * camera.fx:
        raise UnusableBoards(
            f"The pictures do not determine the focal length: {camera.fx:.0f} ± "
            f"{fx_sigma_px:.0f} px; tilt the board by 20 to 45 degrees to all sides."
        )
    return Calibration(
        camera=camera,
        fits=tuple(fits),
        dropped=tuple(dropped),
        fx_sigma_px=fx_sigma_px,
        covered=_covered(lens.views, boards.size_wh),
    )


def _agreeing(fits: Sequence[Fit]) -> tuple[list[View], list[Dropped]]:
    """Reject the worst picture, or, if none is bad, stray corners."""
    usual_px = float(np.median([fit.median_px for fit in fits]))
    worst = max(fits, key=lambda fit: fit.median_px)
    if worst.median_px > max(OUTLIER_PX, OUTLIER_RATIO * usual_px):
        reason = f"residual {worst.median_px:.2f} px, usual {usual_px:.2f} px"
        return [f.view for f in fits if f is not worst], [Dropped(worst.view.name, reason)]
    limit_px = max(STRAY_PX, STRAY_RATIO * usual_px)
    kept, dropped = [], []
    for fit in fits:
        good = fit.length_px <= limit_px
        if good.all():
            kept.append(fit.view)
        elif np.count_nonzero(good) >= LEAST_CORNERS:
            kept.append(fit.view.only(good))
        else:
            dropped.append(Dropped(fit.view.name, f"fewer than {LEAST_CORNERS} good corners"))
    return kept, dropped


def _require_enough(views: Sequence[View], dropped: Sequence[Dropped]) -> None:
    if len(views) < LEAST_VIEWS:
        reasons = "".join(f"\n  {drop.name}: {drop.reason}" for drop in dropped)
        raise UnusableBoards(
            f"The board is usable in {len(views)} pictures; at least {LEAST_VIEWS} are needed, "
            f"{GOOD_IMAGES} or more are good.{reasons}"
        )


def _covered(views: Sequence[View], size_wh: tuple[int, int]) -> NDArray[np.bool_]:
    uv = np.concatenate([view.corners_px for view in views])
    edges = [
        np.linspace(-0.5, size - 0.5, cells + 1)
        for size, cells in zip(size_wh[::-1], COVERAGE_CELLS, strict=True)
    ]
    counts, _, _ = np.histogram2d(uv[:, 1], uv[:, 0], edges)
    return np.asarray(counts > 0)
