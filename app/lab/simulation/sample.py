"""The sample inspection: a culvert with defects to see, three of them tagged already."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from app.lab.simulation.defects import Defect
from app.lab.simulation.motion import Trajectory
from app.lab.simulation.scenario import Scenario
from app.lab.simulation.scenarios import SCENARIOS
from app.survey.observations.tag import Tag
from vo_core.geometry.wall import enclose, robot_pixels, sight

_CRACK = Defect("crack", x_mm=750, arc_mm=70, length_mm=420, width_mm=60)
_ROOTS = Defect("roots", x_mm=1500, arc_mm=-85, length_mm=180, width_mm=110)
_SILT = Defect("silt", x_mm=2250, arc_mm=0, length_mm=650, width_mm=80)
_LEAK = Defect("leak", x_mm=3000, arc_mm=100, length_mm=70, width_mm=170)
_SECOND_CRACK = Defect("crack", x_mm=3750, arc_mm=-40, length_mm=260, width_mm=50)

SAMPLE = replace(
    SCENARIOS["wide_lens"],
    name="sample",
    description="A 300 mm culvert with cracks, roots, silt and a leak, seen by a fisheye lens.",
    length_mm=4500.0,
    speed_mm_s=140.0,  # 8.4 m/min; crews are asked to stay below 9
    acceleration_mm_s2=280.0,
    frames_per_s=15,  # 9 mm a frame, as in the other scenarios
    first_joint_mm=0.0,  # the zero is where the first pipe begins, so joints can be counted
    brightness=1.5,
    lamp_width=2.5,
    defects=(_CRACK, _ROOTS, _SILT, _LEAK, _SECOND_CRACK),
)
"""The sample: long enough for three joints, and rendered while a person waits."""

_TAGGED: tuple[tuple[Defect, Mapping[str, Any]], ...] = (
    (_CRACK, {"code": "BAB", "char1": "C", "char2": "A", "quant1": 2.0, "severity": 3}),
    (_ROOTS, {"code": "BBA", "char1": "C", "quant1": 10.0, "severity": 4}),
    (_LEAK, {"code": "BBF", "char1": "B", "severity": 2}),
)


def tags(scenario: Scenario) -> list[Tag]:
    """Return tags of the defects that the camera reaches in a sample, which may be shortened."""
    return [
        _tag(scenario, defect, fields)
        for defect, fields in _TAGGED
        if defect.x_mm <= scenario.length_mm
    ]


def _tag(scenario: Scenario, defect: Defect, fields: Mapping[str, Any]) -> Tag:
    """Tag a defect in the frame whose camera is nearest."""
    trajectory = Trajectory(scenario)
    poses = [trajectory.pose(n / scenario.frames_per_s) for n in range(trajectory.frames)]
    frame = min(range(len(poses)), key=lambda n: abs(poses[n].x_mm - defect.x_mm))
    point = enclose(scenario.rig, np.array([[defect.x_mm, defect.arc_mm]]))
    ((u, v),) = robot_pixels(scenario.rig, sight(scenario.rig, poses[frame], point))
    return Tag(frame=frame, pixel=[round(float(u), 1), round(float(v), 1)], **fields)
