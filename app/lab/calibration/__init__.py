"""Camera intrinsics from pictures of a checkerboard or a ChArUco board.

- `boards`: what was printed, and what a picture shows of it.
- `finding`: looks for the board in each picture, and how sharp it is.
- `lens`: one least-squares fit of a camera to the boards found.
- `fitting`: fits, leaves out what does not agree, fits again; the result and its verdict.
- `report`: draws which part of the picture the boards covered, and the residuals.
"""

from app.lab.calibration.boards import Board, Boards, UnusableBoards, View
from app.lab.calibration.finding import find_boards
from app.lab.calibration.fitting import calibrate, calibrate_files
from app.lab.calibration.report import plot

__all__ = [
    "Board",
    "Boards",
    "UnusableBoards",
    "View",
    "calibrate",
    "calibrate_files",
    "find_boards",
    "plot",
]
