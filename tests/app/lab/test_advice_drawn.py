"""The advice as words and pictures."""

import cv2
import pytest

from app.lab.advice import plot, rows
from app.lab.simulation import SCENARIOS
from vo_core import Pose
from vo_core.advice import advise, displacement_field

RIGS = {name: SCENARIOS[name].rig for name in ("nominal", "wide_lens", "tiled_floor")}


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())
def test_every_figure_is_reported_with_its_unit(rig):
    shown = dict(rows(advise(rig, Pose(15.0, 5.0), 25.0)))
    assert shown["motion between two frames"] == "15 mm forward, 5 mm to the right"
    assert " px, mean " in shown["displacement in the picture"]
    assert shown["- by the motion along the pipe"] == "15.0 to 15.0 mm, mean 15.0, spread 0.0%"
    assert shown["good speed, 25 frames/s"].endswith(" mm/s")
    assert shown["camera 1 mm higher than stated"].endswith(" % of distance")
    assert not any("nan" in value for value in shown.values())


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())
def test_displacement_field_is_drawn(rig, tmp_path):
    plot(displacement_field(rig, Pose(15.0, 5.0)), "15 mm", tmp_path / "field.png")
    assert cv2.imread(str(tmp_path / "field.png")).std() > 20
