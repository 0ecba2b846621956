"""The bench on a few centimetres of rendered wall."""

import json

import numpy as np
import pytest

from app.bench import bench, quick_scenarios, to_json, to_markdown
from app.peers import PEERS, PhaseCorrelate
from app.simulation import SCENARIOS, render

ONLY_PEER = {"phaseCorrelate": PhaseCorrelate}


@pytest.fixture(scope="module")
def run():
    calls = []
    scenarios = [SCENARIOS[name].shortened(120) for name in ("nominal", "turned_camera")]
    rows = bench(scenarios, methods=ONLY_PEER, on_progress=lambda *call: calls.append(call))
    return rows, calls


def test_there_is_a_row_for_every_scenario_and_method(run):
    rows, _ = run
    assert [(row.scenario, row.method) for row in rows] == [
        ("nominal", "phaseCorrelate"),
        ("turned_camera", "phaseCorrelate"),
    ]
    for row in rows:
        assert row.evaluation.missing_frames == 0
        assert 0 < row.ms_per_frame <= row.ms_per_frame_p95


def test_peer_measures_in_the_right_direction_with_a_turned_camera_too(run):
    rows, _ = run
    for row in rows:
        assert abs(row.evaluation.end_error_percent) < 10
        assert row.evaluation.ate_mm < 10


def test_progress_rises_to_its_end_and_says_what_is_done(run):
    rows, calls = run
    assert [done for _, done, _ in calls] == list(range(1, len(calls) + 1))
    assert {total for *_, total in calls} == {len(calls)}
    assert len(calls) == 2 * sum(row.evaluation.frames for row in rows)
    sentences = list(dict.fromkeys(what for what, *_ in calls))
    assert sentences[:2] == ["rendering nominal", "phaseCorrelate on nominal"]


def test_tables_are_markdown_and_json(run):
    rows, _ = run
    text = to_markdown(rows)
    assert "| scenario | path (m) | phaseCorrelate |" in text
    assert "| nominal | 0.1 |" in text
    stored = json.loads(to_json(rows))
    assert stored["rows"][0]["evaluation"]["frames"] == rows[0].evaluation.frames
    assert stored["environment"]


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_follows_an_easy_wall_and_leaves_its_input_alone(name):
    scenario = SCENARIOS["nominal"].shortened(150)
    peer = PEERS[name](scenario.rig)
    for frame in render(scenario):
        before = frame.image.copy()
        estimate = peer.step(frame.image, frame.t_s)
        assert np.array_equal(frame.image, before)
    assert estimate.distance_mm == pytest.approx(frame.x_mm, rel=0.05)


@pytest.mark.parametrize("name", ["KLT", "ORB"])
def test_a_feature_peer_without_features_is_lost(name):
    peer = PEERS[name](SCENARIOS["nominal"].rig)
    blank = np.full((480, 640), 90, np.uint8)
    assert [peer.step(blank, t).status for t in (0.0, 0.1)] == ["ok", "lost"]


def test_quick_bench_is_short():
    scenarios = quick_scenarios()
    assert len(scenarios) == 6
    assert max(scenario.length_mm for scenario in scenarios) <= 600
