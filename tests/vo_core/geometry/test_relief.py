"""The relief of a corrugated wall in the displacements of its picture."""

import numpy as np
import pytest
from textures import make_rig

from vo_core import Pose
from vo_core.geometry.motion import relief_modes
from vo_core.geometry.rectify import Rectifier, developed
from vo_core.geometry.wall import robot_pixels, sight

PITCH_MM, DEPTH_MM, CRESTS_MM = 67.7, 13.0, 150.0
WAVES = {"corrugation": {"pitch_mm": PITCH_MM, "depth_mm": DEPTH_MM}}
DOWN = make_rig(pipe=WAVES)
FORWARD = make_rig(
    camera={"fx": 400.0, "fy": 400.0}, mount={"view": "forward", "height_mm": 150.0}, pipe=WAVES
)


def seen_moving(rig, way_mm, crest_mm):
    """Where a patch of corrugated wall is seen, (axial, arc), and how far it seems to move."""
    patch = Rectifier(rig).grid
    columns, rows = np.meshgrid(np.arange(0, patch.shape[1], 4), np.arange(0, patch.shape[0], 8))
    axial, arc = patch.to_mm(np.stack([columns.ravel(), rows.ravel()], 1).astype(float)).T
    beyond = DEPTH_MM / 2 * (1 - np.cos(2 * np.pi * (axial - crest_mm) / PITCH_MM))
    phi, out = arc / rig.pipe.radius_mm, CRESTS_MM + beyond
    wall = np.stack([axial, out * np.sin(phi), out * np.cos(phi)], 1)
    before, now = (
        developed(rig, robot_pixels(rig, sight(rig, at, wall))) for at in (Pose(), Pose(way_mm))
    )
    return before, (before - now)[:, 0]


@pytest.mark.parametrize(("rig", "left"), [(DOWN, 0.05), (FORWARD, 0.45)], ids=["down", "forward"])
@pytest.mark.parametrize("crest_mm", [0.0, 20.0, 50.0])
def test_the_relief_explains_how_unevenly_a_corrugated_wall_moves(rig, left, crest_mm):
    """Along the pipe waves are seen so obliquely that they are more than bent."""
    way_mm = 20.0
    before, moved = seen_moving(rig, way_mm, crest_mm)
    design = np.column_stack([np.ones(len(before)), way_mm * relief_modes(rig, before)[:, 0].T])
    (shift_mm, *waves), *_ = np.linalg.lstsq(design, moved, rcond=None)
    assert np.std(moved - design @ [shift_mm, *waves]) < left * np.std(moved)
    # The relief has its stated depth, and what is left is the way.
    assert np.hypot(*waves[:2]) == pytest.approx(1.0, abs=0.2)
    assert shift_mm == pytest.approx(way_mm, rel=1e-3)
