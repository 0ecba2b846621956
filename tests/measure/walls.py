"""Measures how well the walls of two surveys of one rendered culvert are aligned.

    python tests/measure walls [--culverts 20] [--tracked 2] [--length-mm 6000]
                               [--write docs/changes.md]

The later survey has another lens, height, resolution and light, a fifth of the wall is under new
dirt, and every second one comes from the other end. Most walls are unrolled along true poses with
an error of the scale and one that comes and goes; some films are tracked.
"""

# ruff: noqa: T201
from __future__ import annotations

import argparse
import pickle
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from wall_pairs import RIGS, Survey, culvert, dirtied, scenario, survey, turned, wall_of

from app.lab.markdown_figures import write_figures
from vo_core.alignment.align import align
from vo_core.alignment.wall_map import WallMap

MARK = "walls"
COMMAND = "python tests/measure walls --write docs/changes.md"
DIRT = 0.2
_FRAMES_PER_S = 25
_PROCESSES = 2


@dataclass(frozen=True)
class Row:
    """One pair of surveys of the same culvert."""

    is_found: bool
    """Whether it was recognised, and the direction is right."""
    end_mm: float
    """Error of the last frame's place on the earlier wall, by the map or, where that ends before,
    by the camera from the last place of the map."""
    worst_mm: float
    """Largest error of a node."""
    ratios: Sequence[float]
    """Errors of the nodes over their sigmas."""
    holds: float
    """Share of the frames at which the map holds."""
    align_s: float
    """Processor time."""


def pair(seed: int, length_mm: float, *, is_tracked: bool) -> tuple[Survey, Survey, bool]:
    """Render both surveys of a culvert; the last value is whether the later one comes back."""
    rng = np.random.default_rng([seed, 35])
    is_ahead, is_opposite = seed % 4 == 3, seed % 2 == 0
    surface = culvert(seed, length_mm, arc_mm=500.0 if is_ahead else 130.0)
    first, second = (
        ("narrow", "wider, lower") if not is_ahead else ("wider, lower", "fisheye ahead")
    )
    drive = {"frames_per_s": 30 if is_tracked else _FRAMES_PER_S}
    earlier = survey(
        scenario(RIGS[first], length_mm, seed=seed, **drive), surface, is_tracked=is_tracked
    )
    later_surface = dirtied(surface, seed, DIRT)
    if is_opposite:
        later_surface = turned(later_surface, length_mm)
    film = scenario(
        RIGS[second], length_mm - 400, seed=seed + 1000, lamp_width=0.8, brightness=0.6,
        yaw_deg=2.0, sway_mm=6.0, **drive,
    )  # fmt: skip
    later = survey(
        film, later_surface, start_mm=float(rng.uniform(0, 400)), is_tracked=is_tracked,
        drift=float(rng.uniform(-0.008, 0.008)), wave_mm=2.0,
    )  # fmt: skip
    return earlier, later, is_opposite


def judged(earlier: Survey, later: Survey, *, is_opposite: bool, length_mm: float) -> Row:
    """Align a pair and compare the map with the truth."""
    started_s = time.process_time()
    found = align(earlier.wall, later.wall)
    took_s = time.process_time() - started_s
    true_mm = length_mm - later.true_mm if is_opposite else later.true_mm
    wanted_mm = np.interp(true_mm, earlier.true_mm, earlier.raw_mm)
    order = np.argsort(later.raw_mm)
    errors, ratios = [0.0], []
    for node in found.nodes:
        if later.raw_mm.min() <= node.axial_mm <= later.raw_mm.max():
            true = np.interp(node.axial_mm, later.raw_mm[order], wanted_mm[order])
            errors.append(float(node.earlier_mm - true))
            ratios.append(errors[-1] / node.sigma_mm)
    holds = [found.earlier(float(each)) is not None for each in later.raw_mm]
    return Row(
        is_found=any(holds) and (found.direction == "opposite") == is_opposite,
        end_mm=_end_mm(found, later, float(wanted_mm[-1])),
        worst_mm=float(np.abs(errors).max()),
        ratios=ratios,
        holds=float(np.mean(holds)),
        align_s=took_s,
    )


def _end_mm(found: WallMap, later: Survey, wanted_mm: float) -> float:
    if not found.nodes:
        return float("nan")
    last_mm = float(later.raw_mm[-1])
    end = found.earlier(last_mm)
    if end is not None:
        return end.axial_mm - wanted_mm
    node = min(found.nodes, key=lambda each: abs(each.axial_mm - last_mm))
    sign = 1 if found.direction == "same" else -1
    return node.earlier_mm + sign * (last_mm - node.axial_mm) - wanted_mm


def kept(seed: int, length_mm: float, *, is_tracked: bool) -> tuple[Survey, Survey, bool]:
    """A pair as `pair` makes it, rendered once."""
    name = f"{seed}-{length_mm:g}{'-tracked' if is_tracked else ''}.pkl"
    file = Path(__file__).parents[2] / ".films" / "walls" / name
    if not file.exists():
        earlier, later, is_opposite = pair(seed, length_mm, is_tracked=is_tracked)
        file.parent.mkdir(parents=True, exist_ok=True)
        both = [(each.rig, each.tiles, each.true_mm, each.raw_mm) for each in (earlier, later)]
        file.write_bytes(pickle.dumps((*both, is_opposite)))
    *both, is_opposite = pickle.loads(file.read_bytes())  # noqa: S301 - our own file
    earlier, later = (
        Survey(rig, tiles, wall_of(rig, tiles), true_mm, raw_mm)
        for rig, tiles, true_mm, raw_mm in both
    )
    return earlier, later, is_opposite


def table(rows: Sequence[tuple[str, Sequence[Row]]], false: tuple[int, int]) -> str:
    """Write the figures as Markdown."""
    lines = [
        "| pairs of 6 m | recognised | end, mm: median, worst | worst node, mm | "
        "nodes within 95 % | error / sigma, rms | map holds | processor time, s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, some in rows:
        found = [row for row in some if row.is_found]
        ratios = np.array([each for row in found for each in row.ratios])
        ends = np.abs([row.end_mm for row in found])
        lines.append(
            f"| {name} | {len(found)} of {len(some)} | {np.median(ends):.2f}, {ends.max():.2f} | "
            f"{max(row.worst_mm for row in found):.2f} | {np.mean(np.abs(ratios) < 1.96):.3f} | "
            f"{np.sqrt(np.mean(ratios**2)):.2f} | {np.mean([row.holds for row in found]):.3f} | "
            f"{np.median([row.align_s for row in found]):.1f} |"
        )
    lines += ["", f"Walls of different culverts: {false[1]} pairs, {false[0]} false locks."]
    return "\n".join(lines) + "\n"


def _judged(task: tuple[int, float, bool]) -> Row:
    seed, length_mm, is_tracked = task
    earlier, later, is_opposite = kept(seed, length_mm, is_tracked=is_tracked)
    row = judged(earlier, later, is_opposite=is_opposite, length_mm=length_mm)
    print(f"culvert {seed}: end {row.end_mm:.2f} mm, holds {row.holds:.3f}", flush=True)
    return row


def _is_false(task: tuple[int, int, float]) -> bool:
    """Whether the wall of one culvert is recognised on that of another one."""
    one, other, length_mm = task
    earlier, *_ = kept(one, length_mm, is_tracked=False)
    _, later, _ = kept(other, length_mm, is_tracked=False)
    return bool(align(earlier.wall, later.wall).nodes)


def main() -> None:
    """Measure, print, and write the figures if a file is named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--culverts", type=int, default=20)
    parser.add_argument("--tracked", type=int, default=2)
    parser.add_argument("--length-mm", type=float, default=6000.0)
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    length_mm, seeds = options.length_mm, range(1, options.culverts + 1)
    with ProcessPoolExecutor(_PROCESSES, mp_context=get_context("spawn")) as workers:
        posed = workers.map(_judged, [(seed, length_mm, False) for seed in seeds])
        tracked = workers.map(
            _judged, [(seed, length_mm, True) for seed in range(1, options.tracked + 1)]
        )
        others = [(seed, seed % len(seeds) + 1, length_mm) for seed in seeds]
        false = workers.map(_is_false, others)
        rows = [("true poses, scale and wave added", list(posed)), ("tracked", list(tracked))]
        locks = sum(false)
    rows = [row for row in rows if row[1]]
    found = table(rows, (locks, len(others)))
    print(found)
    if options.write:
        write_figures(options.write, MARK, COMMAND, found)


if __name__ == "__main__":
    main()
