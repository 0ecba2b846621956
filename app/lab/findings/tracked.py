"""Walls of rendered films, as a run paints them, with the defects of their scenarios."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from app.lab.findings.painting import PaintedWall, Truth
from app.lab.simulation import SCENARIOS, Scenario, render
from app.lab.simulation.defects import Defect
from vo_core import Odometry
from vo_core.findings.patches import girth_of
from vo_core.mosaic.mosaic import LEAST_WEIGHT, Mosaic, Tile

NAMES = ("nominal", "wide_lens", "forward")
"""Scenarios: a view down, a fisheye, a view along the pipe."""

LENGTH_MM = 3000.0
VISIBLE = 0.8
"""Share of a defect that must be in view."""


def tracked_wall(name: str, seed: int) -> PaintedWall:
    """Render a film of a wall with defects, track it, and paint its wall."""
    scenario = _with_defects(SCENARIOS[name], seed)
    odometry, mosaic = Odometry(scenario.rig), Mosaic(scenario.rig)
    tiles: dict[int, Tile] = {}
    for frame in render(scenario):
        estimate = odometry.step(frame.image, frame.t_s)
        mosaic.add(
            np.asarray(cv2.cvtColor(frame.image, cv2.COLOR_GRAY2BGR), np.uint8),
            odometry.initial_pose.added_to(estimate),
        )
        tiles |= {tile.index: tile for tile in mosaic.changed()}
    tiles |= {tile.index: tile for tile in mosaic.finish()}
    wall = PaintedWall(tiles, mosaic.layout, girth_of(scenario.rig, mosaic.layout), ())
    truth = [_truth(defect) for defect in scenario.defects]
    seen = (replace(each, is_visible=_is_visible(wall, each)) for each in truth)
    return replace(wall, truth=tuple(seen))


def _with_defects(scenario: Scenario, seed: int) -> Scenario:
    """Put a defect into every 0.6 m, off the joints, on the wall that is in view."""
    rng = np.random.default_rng([seed, 36])
    reach_mm = {"wide_lens": 130.0, "forward": 350.0}.get(scenario.name, 35.0)
    defects = []
    for x_mm in np.arange(750.0, LENGTH_MM - 200, 600.0).tolist():
        kind = rng.choice(["crack", "crack", "leak", "roots", "silt"])
        along = rng.uniform(110, 260) if kind == "crack" else rng.uniform(60, 160)
        around = rng.uniform(20, 40) if kind == "crack" else rng.uniform(50, 90)
        arc_mm = rng.uniform(-1, 1) * reach_mm
        defects.append(Defect(kind, x_mm, float(arc_mm), float(along), float(around)))
    return replace(
        scenario,
        seed=int(rng.integers(1, 2**31)),
        length_mm=LENGTH_MM,
        frames_per_s=20,
        defects=tuple(defects),
    )


def _truth(defect: Defect) -> Truth:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    outline = [defect.x_mm, defect.arc_mm] + corners * [defect.length_mm, defect.width_mm]
    return Truth(defect.kind, outline, defect.length_mm, defect.width_mm, is_line=False)


def _is_visible(wall: PaintedWall, truth: Truth) -> bool:
    """Whether a run has seen most of a defect."""
    layout = wall.layout
    low, high = truth.outline_mm.min(axis=0).tolist(), truth.outline_mm.max(axis=0).tolist()
    axial = np.linspace(low[0], high[0], 20)
    row_mm = (layout.arc_to_mm - layout.arc_from_mm) / layout.height_px
    rows = (np.linspace(low[1], high[1], 20) - layout.arc_from_mm) / row_mm
    inside = rows[(rows >= 0) & (rows < layout.height_px)].astype(int)
    seen = 0.0
    for x_mm in axial.tolist():
        index, rest_mm = divmod(x_mm, layout.tile_mm)
        if (tile := wall.tiles.get(int(index))) is not None:
            column = min(int(rest_mm / layout.mm_per_px), layout.width_px - 1)
            seen += float((tile.weight[inside, column] > LEAST_WEIGHT).sum())
    return seen / 400 >= VISIBLE
