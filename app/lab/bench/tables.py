"""Writes a bench run as Markdown tables and as JSON; figures that miss their target are bold."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Sequence

import cv2
import numpy as np

from app.lab.bench.run import OURS, WARM_UP_FRAMES, BenchRow, TrackTime, WrongRig
from app.lab.bench.targets import (
    ERROR_OVER_SIGMA,
    LEAST_COVERAGE,
    LEAST_REGISTRATION_COVERAGE,
    SCALE_TARGET,
    STEP_TARGET,
    TARGETS,
    TRACK_TARGET,
    Target,
)
from app.lab.evaluation import or_dash
from app.lab.simulation import SCENARIOS

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
    return table(_SHORT_HEADINGS, cells) + "\n"


def to_forward_markdown(rows: Sequence[BenchRow]) -> str:
    """One table of the forward view: every method, Chainage beside its targets, and no times."""
    return _forward_accuracy(rows) + "\n"


def to_markdown(rows: Sequence[BenchRow], track_time: TrackTime | None = None) -> str:
    """Write the tables: Chainage beside its targets, all methods side by side, and their times."""
    ours = [row for row in rows if row.method == OURS]
    left_out = [name for name, one in SCENARIOS.items() if not one.is_available]
    parts: list[str] = []
    if ours:
        parts += [
            "Chainage and its targets, which are those for 6 m of path; **bold** falls short. No "
            "shift, turn or scale is fitted. The first interval holds the rig's tolerances, the "
            "second is that of the registration alone.",
            table(_TARGET_HEADINGS, [_against_targets(row) for row in ours]),
        ]
    wrong = [(row.scenario, row.wrong_rig) for row in ours if row.wrong_rig is not None]
    if wrong:
        parts += [
            "Where the rig is wrong or the pipe not clean, in the last frame; then after the "
            "joints have brought the run to scale (- where they cannot be counted):",
            table(
                [
                    "scenario", "error / sigma", "sigma (%)", "sigma of registration (mm)",
                    "joints", "error with joints (%)", "sigma with joints (%)",
                ],
                [_against_scale_target(name, result) for name, result in wrong],
            ),
        ]  # fmt: skip
    forward = [row for row in rows if _looks_forward(row)]
    down = [row for row in rows if not _looks_forward(row)]
    if down:
        parts += [
            "A camera that looks down, end error in % of the path · ATE in mm; - where a method "
            "has no equations for the camera:",
            _by_method(down, _accuracy),
        ]
    if forward:
        parts.append(_forward_accuracy(forward))
    parts.append(
        "Time of one step over that of one windowed `cv2.phaseCorrelate` of the same frames "
        f"({environment()}; one thread, medians after {WARM_UP_FRAMES} frames of warm-up; in "
        "brackets milliseconds, median and 10th to 90th percentile):"
    )
    parts += [_by_method(some, _cost) for some in (down, forward) if some]
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


def _looks_forward(row: BenchRow) -> bool:
    return SCENARIOS[row.scenario].rig.mount.view == "forward"


def _forward_accuracy(rows: Sequence[BenchRow]) -> str:
    return (
        "A camera that looks along the pipe, end error in % of the path · largest error of the "
        "distance in mm · frames lost. **The essential matrices are given the true length of every "
        "step**, which they cannot measure: only their directions and rotations are their own. "
        "Counted joints are a known segment apart, the frames between them share the distance "
        "evenly.\n\n" + _by_method(rows, _forward_cell)
    )


def _by_method(rows: Sequence[BenchRow], cell: Callable[[BenchRow | None], str]) -> str:
    """A table with a line for each scenario and a column for each method of these rows."""
    methods = list(dict.fromkeys(row.method for row in rows))
    scenarios = list(dict.fromkeys(row.scenario for row in rows))
    by_key = {(row.scenario, row.method): row for row in rows}
    return table(
        ["scenario", *methods],
        [
            [scenario, *(cell(by_key.get((scenario, method))) for method in methods)]
            for scenario in scenarios
        ],
    )


def table(heading: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Write a table."""
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
    # No tolerance contains the depth of silt.
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
    """Format a figure with its limit, in bold if it exceeds the limit."""
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


def _forward_cell(row: BenchRow | None) -> str:
    if row is None:
        return "-"
    result, target = row.evaluation, Target()
    if row.method == OURS:
        target = TARGETS.get(row.scenario, target)
    return " · ".join(
        (
            _limited(result.end_error_percent, target.end_percent, "+.2f"),
            _limited(result.max_error_mm, target.max_error_mm, ".0f"),
            f"{_limited(result.lost_frames, target.lost_frames, 'd')} of {result.frames}",
        )
    )


def _cost(row: BenchRow | None) -> str:
    if row is None:
        return "-"
    time, limit = row.time, STEP_TARGET if row.method == OURS else None
    spread = f"({time.ms:.1f}; {time.ms_p10:.1f}-{time.ms_p90:.1f})"
    return f"{_limited(time.ratio, limit, '.2f')} {spread}"


def environment() -> str:
    """Describe the machine and the versions in a phrase."""
    return (
        f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, "
        f"OpenCV {cv2.__version__}, numpy {np.__version__}"
    )
