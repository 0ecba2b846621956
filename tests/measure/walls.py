"""Measures how well the walls of two surveys of one rendered culvert are aligned.

    python tests/measure walls [--culverts 20] [--tracked 3] [--length-mm 6000]
                               [--write docs/changes.md]

The later survey has another lens, height, resolution and light, a fifth of the wall is under new
dirt, and every second one comes from the other end. Most walls are unrolled along true poses with
an error of the scale and one that comes and goes; some films are tracked.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from wall_pairs import RIGS, Survey, culvert, dirtied, scenario, survey, turned

from vo_core.alignment.align import align

MARK = "walls"
COMMAND = "python tests/measure walls --write docs/changes.md"
DIRT = 0.2
_FRAMES_PER_S = 25


@dataclass(frozen=True)
class Row:
    """One pair of surveys of the same culvert."""

    rigs: str
    is_tracked: bool
    is_opposite: bool
    is_found: bool
    end_mm: float | None
    """Error of the last frame's place on the earlier wall; None where the map does not hold."""
    worst_mm: float
    within: float
    """Share of the nodes within their 95 % interval."""
    holds: float
    """Share of the frames at which the map holds."""
    align_s: float


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
    errors, within, nodes = [], 0, 0
    order = np.argsort(later.raw_mm)
    for node in found.nodes:
        if not later.raw_mm.min() <= node.axial_mm <= later.raw_mm.max():
            continue
        error_mm = node.earlier_mm - float(
            np.interp(node.axial_mm, later.raw_mm[order], wanted_mm[order])
        )
        errors.append(abs(error_mm))
        within += abs(error_mm) <= 1.96 * node.sigma_mm
        nodes += 1
    end = found.earlier(float(later.raw_mm[-1]))
    held = np.mean([found.earlier(float(each)) is not None for each in later.raw_mm])
    return Row(
        rigs="",
        is_tracked=False,
        is_opposite=is_opposite,
        is_found=bool(found.nodes) and (found.direction == "opposite") == is_opposite,
        end_mm=None if end is None else end.axial_mm - float(wanted_mm[-1]),
        worst_mm=max(errors, default=0.0),
        within=within / max(nodes, 1),
        holds=float(held),
        align_s=took_s,
    )
