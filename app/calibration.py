"""Camera intrinsics from pictures of a checkerboard or a ChArUco board.

`find_boards` looks for the board in each picture, `calibrate` fits the camera to what was found and
leaves out pictures that do not fit, `plot` shows which part of the picture the boards covered.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from vo_core.errors import ChainageError
from vo_core.rig import Camera
from vo_core.types import ByteImage, Matrix
from vo_core.wall import Points

LEAST_IMAGES = 5
"""Fewer boards leave the lens undetermined: each has a pose of its own to be found as well."""

GOOD_IMAGES = 10

LEAST_CORNERS = 8
"""Of a partly seen ChArUco board; fewer say nothing about the lens beyond the board's own pose."""

SHARP_PX = 3.0
"""Width of an edge, 10 to 90 %, up to which a picture is sharp (OpenCV's advice)."""

BLUR_RATIO = 2.0
"""A picture with edges this many times wider than those of the middle one of the set is blurred."""

OUTLIER_RATIO, OUTLIER_PX = 3.0, 0.5
"""A picture whose middle residual is so many times that of the middle picture, and at least so many
px, does not show the same flat board through the same lens."""

STRAY_RATIO, STRAY_PX = 4.0, 0.3
"""A corner whose residual is so many times the middle one, and at least so many px, was not found
but guessed: finders do so where squares are small."""

GOOD_RMS_PX = 0.5
WORST_FX_SIGMA = 0.05
"""Share of fx above which there is no result."""
GOOD_FX_PERCENT = 0.2
"""Two standard deviations of fx; each percent of fx is a percent of every distance."""

MOST_REFINED_PX = 9
"""Half a side of the window for a corner: beyond it the lens bends the edges."""

COVERAGE_CELLS = (6, 8)
"""Rows and columns of the grid on which the coverage of the picture is counted."""
GOOD_COVERAGE = 0.6

_ARUCO_FAMILIES = ("4X4", "5X5", "6X6", "7X7")
_ARUCO_SIZES = (50, 100, 250, 1000)


class UnusableBoards(ChainageError):
    """The pictures do not determine a camera; the text says why and what to do."""


@dataclass(frozen=True)
class Board:
    """A flat calibration pattern: a ChArUco board if it has markers, else a checkerboard."""

    columns: int
    """Squares along a row of a ChArUco board; inner corners, or squares, of a checkerboard."""
    rows: int
    square_mm: float
    marker_mm: float | None = None
    """Side of a ChArUco board's markers."""

    def __post_init__(self) -> None:
        if self.marker_mm is not None and not 0 < self.marker_mm < self.square_mm:
            raise UnusableBoards(
                f"The markers of a ChArUco board are smaller than its squares of "
                f"{self.square_mm:g} mm; found {self.marker_mm:g} mm."
            )

    @property
    def margin(self) -> float:
        """How far on both sides of a square's edge the print is of one colour, in squares.

        Half a square, or the white around a marker, less a tenth for safety.
        """
        return 0.4 if self.marker_mm is None else 0.45 * (1 - self.marker_mm / self.square_mm)


@dataclass(frozen=True, eq=False)
class View:
    """A board as one picture shows it."""

    name: str
    corners_px: Points
    """(N, 2), pixel centres at integers."""
    corners_mm: Points
    """(N, 3) on the board, z = 0."""
    edge_px: float
    """Width of the edges between squares: height of the step over its steepest slope."""

    def only(self, good: NDArray[np.bool_]) -> View:
        """The same with some of its corners, `good` (N,)."""
        return replace(self, corners_px=self.corners_px[good], corners_mm=self.corners_mm[good])


@dataclass(frozen=True)
class Dropped:
    """A picture that is not used."""

    name: str
    reason: str


@dataclass(frozen=True)
class Boards:
    """What was found in a set of pictures."""

    size_wh: tuple[int, int]
    views: tuple[View, ...]
    dropped: tuple[Dropped, ...]


@dataclass(frozen=True)
class Fit:
    """A picture that is used, and how well it agrees with the camera."""

    view: View
    residual_px: Points
    """(N, 2) corner found minus corner projected."""

    @property
    def length_px(self) -> NDArray[np.float64]:
        """(N,) lengths of the residuals."""
        return np.asarray(np.linalg.norm(self.residual_px, axis=1))

    @property
    def median_px(self) -> float:
        """Median length, which a few corners that were not found cannot spoil."""
        return float(np.median(self.length_px))

    @property
    def rms_px(self) -> float:
        """Root mean square length."""
        return float(np.sqrt((self.length_px**2).mean()))


@dataclass(frozen=True)
class Calibration:
    """A camera and what it rests on."""

    camera: Camera
    fits: tuple[Fit, ...]
    dropped: tuple[Dropped, ...]
    fx_sigma_px: float
    """Standard deviation of fx."""
    covered: NDArray[np.bool_]
    """(rows, columns) cells of the picture in which a corner was seen."""

    @property
    def rms_px(self) -> float:
        """Root mean square residual of all corners."""
        return float(np.sqrt(np.concatenate([fit.length_px**2 for fit in self.fits]).mean()))

    @property
    def fx_percent(self) -> float:
        """95 % uncertainty of fx in percent of it, which is also that of every distance."""
        return 200 * self.fx_sigma_px / self.camera.fx

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
        """What keeps this from being a good calibration, with what to do; empty if it is one."""
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


Model = Literal["pinhole", "fisheye"]

Finder = Callable[[ByteImage], tuple[Points, Points]]
"""Corners (N, 2) px and (N, 3) mm of the board in a picture; N = 0 if it shows none."""

_NOTHING: tuple[Points, Points] = (np.empty((0, 2)), np.empty((0, 3)))


def read_grey(path: Path) -> ByteImage | None:
    """A grey picture as the sensor has it, or None for a file that is no picture.

    EXIF does not turn it: it does not turn a video of the same camera either.
    """
    data = np.frombuffer(path.read_bytes(), np.uint8)
    if len(data) == 0:
        return None
    image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    return None if image is None else np.asarray(image, np.uint8)


def find_boards(pictures: Iterable[tuple[str, ByteImage | None]], board: Board) -> Boards:
    """The boards in named grey pictures, and the pictures that show none or a blurred one.

    Args:
        pictures: Name and picture, None for what is no picture; taken one after the other.
    Raises:
        UnusableBoards: The pictures differ in size, or there is none.
    """
    views: list[View] = []
    dropped: list[Dropped] = []
    shape: tuple[int, ...] | None = None
    candidates, find = _finders(board), None
    for name, image in pictures:
        if image is None:
            dropped.append(Dropped(name, "not a picture that can be read"))
            continue
        shape = shape or image.shape
        if image.shape != shape:
            raise UnusableBoards(
                f"All pictures must have one size: {name} has {image.shape[1]}x{image.shape[0]} "
                f"px, those before it {shape[1]}x{shape[0]} px."
            )
        # The first picture with a board shows which form of it was meant.
        find = find or _best_finder(candidates, image)
        corners_px, corners_mm = find(image) if find is not None else _NOTHING
        if len(corners_px) == 0:
            dropped.append(Dropped(name, "no board found"))
        else:
            corners_px = _refined(image, corners_px, board)
            edge_px = _edge_width_px(image, corners_px, corners_mm, board)
            views.append(View(name, corners_px, corners_mm, edge_px))
    if shape is None:
        raise UnusableBoards("None of the files is a picture that can be read.")
    usual_px = float(np.median([view.edge_px for view in views])) if views else 0.0
    limit_px = max(SHARP_PX, BLUR_RATIO * usual_px)
    dropped += [
        Dropped(view.name, f"too blurred: edges {view.edge_px:.1f} px wide, usual {usual_px:.1f}")
        for view in views
        if view.edge_px > limit_px
    ]
    sharp = tuple(view for view in views if view.edge_px <= limit_px)
    return Boards((shape[1], shape[0]), sharp, tuple(dropped))


def calibrate(boards: Boards, model: Model) -> Calibration:
    """The camera that shows all the boards where they were found, by least squares.

    Pictures and corners that do not agree with the others are left out and the fit repeated.

    Raises:
        UnusableBoards: Too few pictures are left, or they determine no camera.
    """
    views, dropped = list(boards.views), list(boards.dropped)
    while True:
        _require_enough(views, dropped)
        solution = _solve(views, model, boards.size_wh)
        fits = [
            Fit(view, view.corners_px - _project(solution, n)[0])
            for n, view in enumerate(solution.views)
        ]
        usual_px = float(np.median([fit.median_px for fit in fits]))
        worst = max(fits, key=lambda fit: fit.median_px)
        if worst.median_px > max(OUTLIER_PX, OUTLIER_RATIO * usual_px):
            views.remove(worst.view)
            reason = f"residual {worst.median_px:.2f} px, usual {usual_px:.2f} px"
            dropped.append(Dropped(worst.view.name, reason))
            continue
        limit_px = max(STRAY_PX, STRAY_RATIO * usual_px)
        if all((fit.length_px <= limit_px).all() for fit in fits):
            break
        for fit in fits:
            views.remove(fit.view)
            good = fit.view.only(fit.length_px <= limit_px)
            if len(good.corners_px) >= LEAST_CORNERS:
                views.append(good)
            else:
                dropped.append(Dropped(fit.view.name, f"fewer than {LEAST_CORNERS} good corners"))
    dropped += [
        Dropped(view.name, "no pose of the board fits: too far aside or too flat an angle")
        for view in views
        if view not in solution.views
    ]
    _require_enough(solution.views, dropped)
    camera = _camera(solution, boards.size_wh)
    fx_sigma_px = _fx_sigma_px(solution, fits)
    if fx_sigma_px > WORST_FX_SIGMA * camera.fx:
        raise UnusableBoards(
            f"The pictures do not determine the focal length: {camera.fx:.0f} px, give or take "
            f"{fx_sigma_px:.0f}; tilt the board by 20 to 45 degrees to all sides."
        )
    return Calibration(
        camera=camera,
        fits=tuple(fits),
        dropped=tuple(dropped),
        fx_sigma_px=fx_sigma_px,
        covered=_covered(solution.views, boards.size_wh),
    )


def calibrate_files(
    files: Sequence[Path],
    board: Board,
    model: Model,
    on_progress: Callable[[int, int], None] | None = None,
) -> Calibration:
    """The camera that took these pictures of a board.

    Args:
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


def plot(calibration: Calibration, file: Path) -> None:
    """Draw where in the picture the boards were, and the residual of each picture.

    Args:
        file: Where the picture goes; its suffix decides the format (.png, .pdf, .svg).
    """
    # Only this function draws; whoever does not plot does not wait for matplotlib.
    from matplotlib.figure import Figure

    camera, fits = calibration.camera, calibration.fits
    figure = Figure(figsize=(13, max(5.5, 0.2 * len(fits))), layout="constrained")
    picture, bars = figure.subplots(1, 2, width_ratios=[1.4, 1])
    extent = (-0.5, camera.width - 0.5, camera.height - 0.5, -0.5)
    picture.imshow(calibration.covered, cmap="Greens", vmin=0, vmax=2, extent=extent)
    for fit in fits:
        picture.plot(*fit.view.corners_px.T, ".", ms=3)
    picture.plot(camera.cx, camera.cy, "k+", ms=12)
    picture.set(
        title=f"Corners seen: {calibration.covered.mean():.0%} of the picture covered (green)",
        xlabel="u (px)",
        ylabel="v (px)",
    )
    bars.barh([fit.view.name for fit in fits], [fit.rms_px for fit in fits], color="tab:blue")
    bars.axvline(calibration.rms_px, color="k", ls="--", lw=1)
    bars.invert_yaxis()
    bars.set(title=f"Residual, {calibration.rms_px:.3f} px over all", xlabel="rms (px)")
    figure.savefig(file, dpi=110)


def _finders(board: Board) -> list[Finder]:
    """Ways to read the board: what its maker left unsaid is seen from the pictures."""
    if board.marker_mm is None:
        # Counted are the inner corners, in OpenCV, or the squares, by whoever holds the board.
        sizes = [(board.columns - less, board.rows - less) for less in (0, 1)]
        return [partial(_checkerboard, size=size, square_mm=board.square_mm) for size in sizes]
    size = (board.columns, board.rows)
    markers = board.columns * board.rows // 2
    detectors = []
    for family in _ARUCO_FAMILIES:
        # A smaller dictionary is the beginning of a larger one, and mistakes fewer markers.
        count = min(n for n in _ARUCO_SIZES if n >= markers)
        words = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{family}_{count}"))
        for before_opencv_4_6 in (False, True):
            pattern = cv2.aruco.CharucoBoard(size, board.square_mm, board.marker_mm, words)
            pattern.setLegacyPattern(before_opencv_4_6)
            detectors.append(cv2.aruco.CharucoDetector(pattern))
    return [partial(_charuco, detector=detector) for detector in detectors]


def _best_finder(candidates: Sequence[Finder], image: ByteImage) -> Finder | None:
    counts = [len(find(image)[0]) for find in candidates]
    return candidates[int(np.argmax(counts))] if max(counts) > 0 else None


def _checkerboard(
    image: ByteImage, *, size: tuple[int, int], square_mm: float
) -> tuple[Points, Points]:
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
    if not found:
        return _NOTHING
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    corners = np.asarray(corners, np.float64).reshape(-1, 2)
    corners_mm = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1) * square_mm
    return corners, np.asarray(corners_mm, np.float64)


def _charuco(image: ByteImage, *, detector: cv2.aruco.CharucoDetector) -> tuple[Points, Points]:
    corners, ids, _, _ = detector.detectBoard(image)
    if ids is None or len(ids) < LEAST_CORNERS:
        return _NOTHING
    corners_mm = np.asarray(detector.getBoard().getChessboardCorners(), np.float64)[ids.ravel()]
    return np.asarray(corners, np.float64).reshape(-1, 2), corners_mm


def _refined(image: ByteImage, corners_px: Points, board: Board) -> Points:
    """The corners again, each from as much of the picture as shows only its own four squares.

    On rendered boards through a fisheye this took the errors of the finders from 0.17 px to 0.04
    and that of fx from 0.23 % to 0.02; unsmoothed, the pixels of sharp edges leave 0.07 px.
    """
    smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 1.0)
    apart = np.linalg.norm(corners_px[:, None] - corners_px[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    reach = np.minimum(board.margin * apart.min(axis=1), MOST_REFINED_PX).astype(int)
    refined = corners_px.astype(np.float32)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-4)
    for half in range(2, MOST_REFINED_PX + 1):  # nothing smaller holds an edge
        same = reach == half
        if same.any():
            refined[same] = cv2.cornerSubPix(
                smooth, refined[same], (half, half), (-1, -1), criteria
            )
    return refined.astype(np.float64)


def _edge_width_px(image: ByteImage, corners_px: Points, corners_mm: Points, board: Board) -> float:
    """Width of the step from black to white across the sides of the squares: height over slope.

    Measured for the sides along the rows and along the columns, as a motion blurs one of them
    only; the wider counts.
    """
    index = np.rint(corners_mm[:, :2] / board.square_mm).astype(int)
    index -= index.min(axis=0)
    grid = np.full((*(index.max(axis=0) + 1), 2), np.nan)
    grid[index[:, 0], index[:, 1]] = corners_px
    widths = []
    for start, end in ((grid[:-1], grid[1:]), (grid[:, :-1], grid[:, 1:])):
        side = (end - start).reshape(-1, 2)
        middle = ((start + end) / 2).reshape(-1, 2)
        seen = np.isfinite(side).all(axis=1)
        side, middle = side[seen], middle[seen]
        across = side[:, ::-1] * (-1, 1)  # as long as the side
        reach = np.minimum(board.margin, 12 / np.linalg.norm(side, axis=1))
        steps = np.linspace(-1, 1, 49) * reach[:, None]
        places = (middle[:, None] + steps[..., None] * across[:, None]).astype(np.float32)
        profile = cv2.remap(image, places[..., 0], places[..., 1], cv2.INTER_LINEAR).astype(float)
        step_px = (steps[:, 1] - steps[:, 0]) * np.linalg.norm(side, axis=1)
        slope = np.abs(np.diff(profile, axis=1)).max(axis=1) / step_px
        widths.append(np.median(np.ptp(profile, axis=1) / np.maximum(slope, 1e-3)))
    return float(max(widths))


_Arrays = list[NDArray[np.float32]]
"""calibrateCamera takes no other type."""


@dataclass(frozen=True)
class _Solution:
    """A fitted camera and the poses of the boards before it, in OpenCV's terms."""

    model: Model
    views: Sequence[View]
    matrix: Matrix
    distortion: Matrix
    turns: Sequence[Matrix]
    """Rotation vectors, board to camera."""
    places_mm: Sequence[Matrix]


def _require_enough(views: Sequence[View], dropped: Sequence[Dropped]) -> None:
    if len(views) < LEAST_IMAGES:
        reasons = "".join(f"\n  {drop.name}: {drop.reason}" for drop in dropped)
        raise UnusableBoards(
            f"The board is usable in {len(views)} pictures; at least {LEAST_IMAGES} are needed, "
            f"{GOOD_IMAGES} or more are good.{reasons}"
        )


def _solve(views: Sequence[View], model: Model, size_wh: tuple[int, int]) -> _Solution:
    if model == "pinhole":
        solids, seen = _as_opencv(views)
        found: Sequence[Any]  # float64 all of them, which the stubs do not say
        try:
            _, *found = cv2.calibrateCamera(solids, seen, size_wh, np.eye(3), np.zeros(4))
        except cv2.error as error:
            raise UnusableBoards("No pinhole lens fits these pictures.") from error
        matrix, distortion, turns, places_mm = found
        return _Solution(model, views, matrix, distortion.ravel(), turns, places_mm)
    # Started from nothing, OpenCV fails on boards far aside, which say most about the lens.
    # Started from the lens that the others gave, it takes nearly all of them.
    first = _solve_fisheye(views, size_wh, None)
    try:
        again = _solve_fisheye(views, size_wh, first)
    except UnusableBoards:
        return first
    return again if len(again.views) >= len(first.views) else first


def _solve_fisheye(
    views: Sequence[View], size_wh: tuple[int, int], start: _Solution | None
) -> _Solution:
    """The fisheye lens of those views that OpenCV can place, which may not be all."""
    flags = cv2.CALIB_RECOMPUTE_EXTRINSIC | cv2.CALIB_FIX_SKEW | cv2.CALIB_CHECK_COND
    matrix, distortion = np.eye(3), np.zeros(4)
    if start is not None:
        flags |= cv2.CALIB_USE_INTRINSIC_GUESS
        matrix, distortion = start.matrix, start.distortion
    kept = list(views)
    while True:
        solids, seen = _as_opencv(kept)
        try:
            found: Sequence[Any]
            _, *found = cv2.fisheye.calibrate(
                solids, seen, size_wh, matrix.copy(), distortion.copy(), flags=flags
            )  # copies, as both are changed in place
        except cv2.error as error:
            # One view fails the whole set (opencv/opencv#23962); only the message says which.
            culprit = re.search(r"input array (\d+)", str(error))
            if culprit is None or len(kept) <= LEAST_IMAGES:
                raise UnusableBoards(
                    "No fisheye lens fits these pictures; is it a pinhole?"
                ) from error
            del kept[int(culprit[1])]
        else:
            matrix, distortion, turns, places_mm = found
            return _Solution("fisheye", kept, matrix, distortion.ravel(), turns, places_mm)


def _as_opencv(views: Sequence[View]) -> tuple[_Arrays, _Arrays]:
    """Corners in mm and in px, (1, N, k) each."""
    solids = [view.corners_mm[None].astype(np.float32) for view in views]
    return solids, [view.corners_px[None].astype(np.float32) for view in views]


def _project(solution: _Solution, n: int) -> tuple[Points, Matrix, Matrix]:
    """Pixels (N, 2) of the corners of view n; derivatives (2 N, k) by intrinsics and (2 N, 6)."""
    solid = solution.views[n].corners_mm[None]
    camera = solution.turns[n], solution.places_mm[n], solution.matrix, solution.distortion
    pixels: Any
    slopes: Any
    if solution.model == "fisheye":
        pixels, slopes = cv2.fisheye.projectPoints(solid, *camera)
        return pixels.reshape(-1, 2), slopes[:, :8], slopes[:, 8:14]
    pixels, slopes = cv2.projectPoints(solid, *camera)
    return pixels.reshape(-1, 2), slopes[:, 6:], slopes[:, :6]


def _fx_sigma_px(solution: _Solution, fits: Sequence[Fit]) -> float:
    """Standard deviation of fx: s^2 (J'J)^-1 of all corners, the boards' poses eliminated.

    OpenCV states it for the pinhole only.
    """
    information: Matrix = np.zeros((0, 0))
    for n in range(len(fits)):
        _, by_camera, by_pose = _project(solution, n)
        cross = by_pose.T @ by_camera
        own = by_camera.T @ by_camera - cross.T @ np.linalg.solve(by_pose.T @ by_pose, cross)
        information = own if n == 0 else information + own
    values = 2 * sum(len(fit.residual_px) for fit in fits)
    unknown = len(information) + 6 * len(fits)
    variance_px2 = sum(float((fit.residual_px**2).sum()) for fit in fits) / (values - unknown)
    scale = np.sqrt(np.diag(information))  # px and powers of an angle: of one size to invert
    cofactor = np.linalg.inv(information / np.outer(scale, scale))[0, 0] / scale[0] ** 2
    # Rounding makes it negative where the boards say nothing about fx.
    return float(np.sqrt(variance_px2 * cofactor)) if cofactor > 0 else float("inf")


def _camera(solution: _Solution, size_wh: tuple[int, int]) -> Camera:
    matrix = solution.matrix
    try:
        return Camera.model_validate(
            {
                "model": solution.model,
                "width": size_wh[0],
                "height": size_wh[1],
                "fx": round(float(matrix[0, 0]), 4),
                "fy": round(float(matrix[1, 1]), 4),
                "cx": round(float(matrix[0, 2]), 4),
                "cy": round(float(matrix[1, 2]), 4),
                "distortion": [round(float(k), 8) for k in solution.distortion],
            }
        )
    except ValidationError as error:
        fields = ", ".join(str(fault["loc"][0]) for fault in error.errors(include_url=False))
        raise UnusableBoards(
            f"The pictures give no possible camera ({fields}); tilt the board by 20 to 45 degrees "
            "to all sides."
        ) from error


def _covered(views: Sequence[View], size_wh: tuple[int, int]) -> NDArray[np.bool_]:
    uv = np.concatenate([view.corners_px for view in views])
    edges = [
        np.linspace(-0.5, size - 0.5, cells + 1)
        for size, cells in zip(size_wh[::-1], COVERAGE_CELLS, strict=True)
    ]
    counts, _, _ = np.histogram2d(uv[:, 1], uv[:, 0], edges)
    return np.asarray(counts > 0)
