"""What `chainage bench --findings` measures, and the tables that it writes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from pathlib import Path
from time import process_time

import cv2
import numpy as np

from app.lab.bench.tables import environment, table
from app.lab.findings import photographs
from app.lab.findings.painting import PaintedWall, painted_wall
from app.lab.findings.scoring import NOTHING, Case, Score, score
from app.lab.findings.tracked import NAMES, tracked_wall
from vo_core.findings.classical import Classical
from vo_core.findings.finding import Size
from vo_core.findings.search import propose
from vo_core.findings.surface import Surface

WALLS = 10
"""Painted walls, of four metres each."""

TARGET_RECALL, TARGET_FALSE = 0.95, 3.0
"""Recall of cracks of at least 1 mm and 100 mm, and false findings in 10 m, of any kind."""

REVIEW_M, REVIEW_DEFECTS = 200.0, 30
DRIVE_M_MIN, FRAMES_PER_S = 8.4, 25
"""A crew drives below 9 m/min; a film has 25 frames a second."""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Speed:
    """Processor time of the search on one core."""

    ms_per_m: float
    ratio: float
    """Over that of `skimage.filters.sato` with three sigmas on the same pixels; nan without it."""


def measure(pictures: Path | None, seed: int, on_progress: Progress) -> str:
    """Measure everything, and return the tables.

    Raises:
        NoPictures: The folder of pictures holds none with a mask.
    """
    photographed = [] if pictures is None else list(photographs.rows(pictures))
    steps = WALLS + len(NAMES)
    painted = tracked = NOTHING
    speeds: list[Speed] = []
    for k in range(WALLS):
        on_progress("painted walls", k, steps)
        wall = painted_wall(seed * 1000 + k)
        found, speed = _searched(wall)
        painted, speeds = painted + found, [*speeds, speed]
    for k, name in enumerate(NAMES):
        on_progress(f"film {name}", WALLS + k, steps)
        found, speed = _searched(tracked_wall(name, seed))
        tracked, speeds = tracked + found, [*speeds, speed]
    parts = [
        _by_kind({"painted": painted, "tracked films": tracked}),
        _sizes(painted),
        _reviewer(reduce(add, (painted, tracked))),
        _speed(speeds),
        _photographs(photographed),
        environment(),
    ]
    return "\n\n".join(part for part in parts if part)


def _searched(wall: PaintedWall) -> tuple[Score, Speed]:
    patches = list(wall.patches())
    start_s = process_time()
    found = propose(Classical(), patches)
    ours_s = process_time() - start_s
    sato = photographs.skimage_filters().get("sato")
    sato_s = float("nan")
    if sato is not None:
        greys = [cv2.cvtColor(Surface.of(patch).image, cv2.COLOR_BGR2GRAY) for patch in patches]
        start_s = process_time()
        for grey in greys:
            sato(grey, sigmas=(1, 1.6, 2.5))
        sato_s = process_time() - start_s
    return score(wall.metres, wall.truth, found), Speed(
        1000 * ours_s / wall.metres, ours_s / sato_s
    )


def _by_kind(scores: dict[str, Score]) -> str:
    """Recall by kind, and false findings by kind."""
    lines = []
    for name, result in scores.items():
        for kind in sorted({case.truth.kind for case in result.cases}):
            cases = [case for case in result.cases if case.truth.kind == kind]
            hits = sum(case.finding is not None for case in cases)
            recall = f"{hits} of {len(cases)} ({hits / len(cases):.2f})"
            if kind == "crack" and hits / len(cases) < TARGET_RECALL:
                recall += f", target {TARGET_RECALL}"
            lines.append([name, kind, recall, _called(cases)])
        false = len(result.false) / result.metres * 10
        kinds = sorted({finding.kind for finding in result.false})
        counts = [f"{k} {sum(f.kind == k for f in result.false)}" for k in kinds]
        state = "" if false <= TARGET_FALSE else f", target {TARGET_FALSE:g}"
        text = f"{false:.1f} in 10 m{state}"
        lines.append([name, f"false, on {result.metres:.0f} m", text, ", ".join(counts)])
    return table(["walls", "defect", "found", "called"], lines)


def _called(cases: Sequence[Case]) -> str:
    kinds = [case.finding.kind for case in cases if case.finding is not None]
    return ", ".join(f"{kind} {kinds.count(kind)}" for kind in sorted(set(kinds)))


def _sizes(result: Score) -> str:
    """Errors of length and width of the cracks that were found, and coverage of their intervals."""
    lengths, widths = [], []
    for case in result.cases:
        if case.truth.kind == "crack" and case.finding is not None:
            lengths.append((case.finding.length, case.truth.length_mm))
            widths.append((case.finding.width, case.truth.width_mm))
    lines = [_errors("length", lengths), _errors("width", widths)]
    heading = ["crack's", "median error", "half are within", "95 % interval holds", "median sigma"]
    return table(heading, lines)


def _errors(name: str, sizes: Sequence[tuple[Size | None, float]]) -> list[str]:
    known = [(size.mm - true, size.sigma_mm) for size, true in sizes if size is not None]
    if not known:
        return [name, "", "", "", ""]
    error, sigma = np.array(known).T
    holds = float(np.mean(np.abs(error) < 1.96 * sigma))
    return [
        name,
        f"{np.median(error):+.2f} mm",
        f"{np.median(np.abs(error)):.2f} mm",
        f"{holds:.2f} of {len(known)}",
        f"{np.median(sigma):.2f} mm",
    ]


def _reviewer(result: Score) -> str:
    """What a reviewer looks at over `REVIEW_M` with `REVIEW_DEFECTS`."""
    share = sum(case.finding is not None for case in result.cases) / len(result.cases)
    false = len(result.false) / result.metres * REVIEW_M
    frames = REVIEW_M / DRIVE_M_MIN * 60 * FRAMES_PER_S
    lines = [
        ["every frame", f"{frames:,.0f}", "0"],
        ["every tile of the unrolled wall", f"{REVIEW_M / 0.5:.0f}", "0"],
        [
            "the queue",
            f"{share * REVIEW_DEFECTS + false:.0f}",
            f"{(1 - share) * REVIEW_DEFECTS:.1f}",
        ],
    ]
    return table([f"{REVIEW_M:.0f} m with {REVIEW_DEFECTS} defects", "pictures", "missed"], lines)


def _speed(speeds: Sequence[Speed]) -> str:
    ms = float(np.median([speed.ms_per_m for speed in speeds]))
    ratio = float(np.median([speed.ratio for speed in speeds]))
    beside = "" if np.isnan(ratio) else f", {ratio:.1f} times `skimage.filters.sato`"
    return f"The search takes {ms:.0f} ms of processor time for a metre of wall (median){beside}."


def _photographs(rows: Sequence[tuple[str, list[float]]]) -> str:
    """F1 on photographs; empty without."""
    if not rows:
        return ""
    heading = ["on photographs", *(f"F1 at {px} px" for px in photographs.TOLERANCES_PX)]
    text = table(heading, [[name, *(f"{value:.3f}" for value in values)] for name, values in rows])
    if len(rows) == 1:
        text += "\n\nscikit-image, beside which this is measured, is not installed."
    return text
