"""The three files of a rendered inspection."""

from fractions import Fraction

import av
import numpy as np
import pytest

from app.simulation import SCENARIOS, render, simulate
from vo_core.rig import Rig

SHORT = SCENARIOS["there_and_back"].shortened(60)


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
    assert header == "frame,time_s,x_mm,y_mm,yaw_deg,distance_mm"
    assert lines[0] == "0,0.000000,0.000000,0.000000,0.000000,0.000000"
    rows = np.array([[float(value) for value in line.split(",")] for line in lines])
    expected = [(f.index, f.t_s, f.x_mm, f.y_mm, f.yaw_deg, f.x_mm) for f in rendered]
    np.testing.assert_allclose(rows, expected, atol=1e-6)


def test_rig_file_is_the_rig_of_the_scenario(run):
    assert Rig.load(run.rig) == SHORT.rig


def test_progress_counts_every_frame(tmp_path):
    calls = []
    simulate(SHORT.shortened(10), tmp_path, lambda done, total: calls.append((done, total)))
    total = calls[-1][1]
    assert calls == [(n + 1, total) for n in range(total)]
