"""The ruler on the wall: each of its pixels shows the place that its line is named after."""

from __future__ import annotations

import numpy as np
import pytest

from app.lab.simulation import SCENARIOS
from vo_core import Rig
from vo_core.errors import InvalidRig
from vo_core.geometry.ruling import Line, ruling
from vo_core.geometry.wall import NOMINAL, Points, cast, develop, robot_rays


def places(rig: Rig, line: Line) -> Points:
    """(N, 2) axial and arc mm of the pixels of a line that are in the picture."""
    size = (rig.camera.width, rig.camera.height)
    with np.errstate(invalid="ignore"):
        inside = ((line.uv >= 0) & (line.uv < size)).all(axis=1)
    return develop(rig, cast(rig, NOMINAL, robot_rays(rig, line.uv[inside])))


@pytest.mark.parametrize(
    "name", ["nominal", "turned_camera", "wide_lens", "forward", "tiled_floor"]
)
def test_every_line_lies_where_it_is_named_after(name: str) -> None:
    rig = SCENARIOS[name].rig
    found = ruling(rig)
    seen = [(line, places(rig, line)) for line in found.across]
    assert sum(len(wall) > 1 for _, wall in seen) >= 3
    assert set(np.diff([line.at for line in found.across])) == {found.step_mm}
    for line, wall in seen:
        assert wall[:, 0] == pytest.approx(line.at, abs=0.01)
    for line in found.along:
        arc_mm = line.at
        if rig.pipe.diameter_mm is not None:
            arc_mm = (6 - line.at) / 12 * np.pi * rig.pipe.diameter_mm
            assert line.at in range(1, 13)
        wall = places(rig, line)[:, 1]
        if line.at == 12:  # the crown is at either end of the arc
            wall = -np.abs(wall)
        assert wall == pytest.approx(arc_mm, abs=0.01)


def test_a_camera_that_sees_no_wall_has_no_ruler() -> None:
    floor = SCENARIOS["tiled_floor"].rig
    upward = floor.model_copy(
        update={"mount": floor.mount.model_copy(update={"view": "forward", "pitch_deg": 80.0})}
    )
    with pytest.raises(InvalidRig):
        ruling(upward)
