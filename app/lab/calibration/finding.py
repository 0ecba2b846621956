"""Detects a calibration board in pictures: its corners, and whether it is sharp."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from app.lab.calibration.boards import Board, Boards, Dropped, UnusableBoards, View
from vo_core.geometry.wall import Points
from vo_core.types import ByteImage

LEAST_CORNERS = 8
"""Least corners of a partly visible ChArUco board; fewer determine hardly more than its pose."""

SHARP_PX = 3.0
"""Largest width of an edge, 10 to 90 %, in a sharp picture (advice of OpenCV)."""

BLUR_RATIO = 2.0
"""A picture is blurred if its edges are this many times wider than the median of the set."""

MOST_REFINED_PX = 9
"""Largest half side of the window for a corner; in a larger one the lens bends the edges."""

_ARUCO_FAMILIES = ("4X4", "5X5", "6X6", "7X7")
_ARUCO_SIZES = (50, 100, 250, 1000)

Finder = Callable[[ByteImage], tuple[Points, Points]]
"""Returns corners (N, 2) px and (N, 3) mm of the board in a picture; N = 0 if there is none."""

_NOTHING: tuple[Points, Points] = (np.empty((0, 2)), np.empty((0, 3)))


def read_grey(path: Path) -> ByteImage | None:
    """Read a grey picture as the sensor recorded it; None for a file that is not a picture. EXIF
    does not rotate it, as it does not rotate a video of the same camera either.
    """
    data = np.frombuffer(path.read_bytes(), np.uint8)
    if len(data) == 0:
        return None
    image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    return None if image is None else np.asarray(image, np.uint8)


def find_boards(pictures: Iterable[tuple[str, ByteImage | None]], board: Board) -> Boards:
    """Detect the boards in named grey pictures, and reject pictures with none or a blurred one.

    Args:
        pictures: Name and picture, None for a file that is not a picture; read one after the other.
        board: The printed board.
    Raises:
        UnusableBoards: The pictures differ in size, or there are none.
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
        # The first picture with a board determines its form.
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


def _finders(board: Board) -> list[Finder]:
    """Ways to read the board, for each detail that `Board` leaves open."""
    if board.marker_mm is None:
        # OpenCV counts inner corners; people often count squares.
        sizes = [(board.columns - less, board.rows - less) for less in (0, 1)]
        return [partial(_checkerboard, size=size, square_mm=board.square_mm) for size in sizes]
    size = (board.columns, board.rows)
    markers = board.columns * board.rows // 2
    detectors = []
    for family in _ARUCO_FAMILIES:
        # A smaller dictionary is the beginning of a larger one, and confuses fewer markers.
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
    """Refine each corner in the largest window that shows only its own four squares.

    On rendered boards through a fisheye this reduced the corner errors from 0.17 px to 0.04 and
    that of fx from 0.23 % to 0.02; without smoothing, the pixels of sharp edges leave 0.07 px.
    """
    smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 1.0)
    apart = np.linalg.norm(corners_px[:, None] - corners_px[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    reach = np.minimum(board.margin * apart.min(axis=1), MOST_REFINED_PX).astype(int)
    refined = corners_px.astype(np.float32)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-4)
    for half in range(2, MOST_REFINED_PX + 1):  # a smaller window holds no edge
        same = reach == half
        if same.any():
            refined[same] = cv2.cornerSubPix(
                smooth, refined[same], (half, half), (-1, -1), criteria
            )
    return refined.astype(np.float64)


def _edge_width_px(image: ByteImage, corners_px: Points, corners_mm: Points, board: Board) -> float:
    """Measure the width of the step from black to white across the squares: height over slope.

    The sides along the rows and along the columns are measured separately, as motion blurs only one
    of them; the larger width counts.
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
        across = side[:, ::-1] * (-1, 1)  # has the length of the side
        reach = np.minimum(board.margin, 12 / np.linalg.norm(side, axis=1))
        steps = np.linspace(-1, 1, 49) * reach[:, None]
        places = (middle[:, None] + steps[..., None] * across[:, None]).astype(np.float32)
        profile = cv2.remap(image, places[..., 0], places[..., 1], cv2.INTER_LINEAR).astype(float)
        step_px = (steps[:, 1] - steps[:, 0]) * np.linalg.norm(side, axis=1)
        slope = np.abs(np.diff(profile, axis=1)).max(axis=1) / step_px
        widths.append(np.median(np.ptp(profile, axis=1) / np.maximum(slope, 1e-3)))
    return float(max(widths))
