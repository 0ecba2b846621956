"""The three files of a rendered inspection."""

from dataclasses import replace
from fractions import Fraction

import av
import numpy as np
import pytest
from films import half_sized

from app.lab.simulation import SCENARIOS, render, simulate
from app.lab.simulation.time_stamps import time_stamps
from vo_core.rig import Rig

SHORT = half_sized(SCENARIOS["there_and_back"].shortened(60))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return simulate(SHORT, tmp_path_factory.mktemp("run") / "new folder")


@pytest.fixture(scope="module")
def rendered():
    return list(render(SHORT))


def test_video_is_playable_h264_with_exact_times(run, rendered):
    with av.open(str(run.video)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        times = [frame.pts * frame.time_base for frame in container.decode(video=0)]
    assert times == [Fraction(n, 30) for n in range(len(rendered))]


def test_index_stands_before_the_pictures_for_playing_while_loading(run):
    data = run.video.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")


def test_decoded_pictures_are_the_rendered_ones(run, rendered):
    with av.open(str(run.video)) as container:
        for frame, expected in zip(container.decode(video=0), rendered, strict=True):
            grey = frame.to_ndarray(format="gray").astype(float)
            assert abs((grey - expected.image).mean()) < 1.0
            assert np.abs(grey - expected.image).mean() < 4.0


def test_truth_has_a_row_for_every_frame(run, rendered):
    header, *lines = run.truth.read_text(encoding="utf-8").splitlines()
    assert header == ("frame,time_s,x_mm,y_mm,yaw_deg,distance_mm,z_mm,pitch_deg,roll_deg")
    assert lines[0] == "0" + 8 * ",0.000000"
    rows = np.array([[float(value) for value in line.split(",")] for line in lines])
    expected = [
        (f.index, f.t_s, f.x_mm, f.y_mm, f.yaw_deg, f.x_mm, f.z_mm, f.pitch_deg, f.roll_deg)
        for f in rendered
    ]
    np.testing.assert_allclose(rows, expected, atol=1e-6)


def test_rig_file_is_the_rig_of_the_scenario(run):
    assert Rig.load(run.rig) == SHORT.rig


def test_wrong_rig_is_stated_and_the_true_one_rendered(tmp_path):
    wrong = SCENARIOS["tape_height"].shortened(10)
    assert Rig.load(simulate(wrong, tmp_path).rig).mount.height_mm == 232
    right = replace(wrong, rig=SCENARIOS["nominal"].rig, true_rig=None)
    for ours, theirs in zip(render(wrong), render(right), strict=True):
        assert np.array_equal(ours.image, theirs.image)


def test_late_frames_have_their_time_stamps_in_the_file_and_the_pictures_of_the_nominal_run(
    tmp_path,
):
    nominal = half_sized(SCENARIOS["nominal"].shortened(60))
    plain = list(render(nominal))
    for changes in ({"late_s": 0.04}, {"burst_frame": 8}):
        scenario = replace(nominal, **changes)
        run = simulate(scenario, tmp_path / str(len(changes)))
        with av.open(str(run.video)) as container:
            times = [frame.pts * frame.time_base for frame in container.decode(video=0)]
        rendered = list(render(scenario))
        assert [float(t) for t in times] == pytest.approx([f.t_s for f in rendered], abs=1e-9)
        truth = np.loadtxt(run.truth, delimiter=",", skiprows=1)
        np.testing.assert_allclose(truth[:, 1], [float(t) for t in times], atol=1e-6)
        for ours, theirs in zip(rendered, plain, strict=True):
            assert np.array_equal(ours.image, theirs.image)
            assert ours.x_mm == theirs.x_mm


def test_burst_is_one_frame_late_and_three_milliseconds_before_the_next():
    stamps = time_stamps(SCENARIOS["network_burst"], 100)
    late = SCENARIOS["network_burst"].burst_frame
    np.testing.assert_allclose(np.delete(stamps, late), np.delete(np.arange(100) / 30, late))
    assert stamps[late + 1] - stamps[late] == pytest.approx(0.003)


def test_jitter_rises_and_is_never_later_than_stated():
    scenario = SCENARIOS["network_jitter"]
    stamps = np.array(time_stamps(scenario, 1000))
    assert (np.diff(stamps) > 0.0009).all()
    lateness = stamps - np.arange(1000) / 30
    assert lateness.max() - lateness.min() <= scenario.late_s + 0.002
    assert lateness.std() == pytest.approx(0.04 / np.sqrt(12), rel=0.2)
    assert np.diff(stamps).min() < 0.01


def test_low_bit_rate_makes_a_small_file(tmp_path):
    sizes = {}
    for name in ("nominal", "low_bit_rate"):
        run = simulate(SCENARIOS[name].shortened(60), tmp_path / name)
        sizes[name] = run.video.stat().st_size
    assert sizes["low_bit_rate"] < 0.2 * sizes["nominal"]


def test_progress_counts_every_frame(tmp_path):
    calls = []
    simulate(SHORT.shortened(10), tmp_path, lambda done, total: calls.append((done, total)))
    total = calls[-1][1]
    assert calls == [(n + 1, total) for n in range(total)]
