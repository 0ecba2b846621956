"""Cameras on loopback that are recorded and tracked, in this process or by the camera process."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from builders import HEIGHT, STEP_MM, WIDTH, make_clip
from camera_sessions import LIMITS, Session, session
from cameras import Camera, MjpegCamera, RtspCamera, floor
from hostile import write_clip

from app.jobs.confinement import landlock_version
from app.jobs.messages import Failed, Limits, Problem
from app.jobs.process import Child
from app.jobs.track import parts
from app.tracking.cameras import Sources
from vo_core import Estimate
from vo_core.sources import VideoFile

TCP_SINCE = 4
"""Version of Landlock that restricts ports."""


def by_itself() -> Child:
    return Child("app.jobs.live.camera")


def assert_rows_are_frames(rows: Sequence[Estimate], recording: Path) -> list[float]:
    """Row i is frame i of the recording; the times."""
    with VideoFile(recording) as video:
        times = [frame.t_s for frame in video]
        assert video.problem is None
    assert [row.frame for row in rows] == list(range(len(rows)))
    assert np.allclose([row.time_s for row in rows], times, atol=1e-6), (len(rows), len(times))
    return times


@pytest.mark.parametrize("kind", [MjpegCamera, RtspCamera])
def test_a_drop_out_and_a_silence_are_gaps_in_one_recording_and_leave_no_file_open(
    kind: type[Camera], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    timeouts = dict.fromkeys(("rtsp", "mjpeg"), (0.5, 0.5))
    monkeypatch.setattr("app.jobs.live.cameras._TIMEOUTS_S", timeouts)
    with kind() as camera:
        live = session(camera.url, tmp_path).frames(15)
        opened = len(list(Path("/proc/self/fd").iterdir()))
        camera.drop_out()
        live.until(lambda: not live.states[-1].status.connected)
        gone_s = time.monotonic()
        live.until_said("refuses the connection")
        gap_s = time.monotonic() - gone_s
        camera.come_back()
        live.frames(len(live.rows) + 15)
        whole_s, reconnects = time.monotonic() - gone_s, live.states[-1].status.reconnects
        dropped_out = len(live.rows)
        camera.fall_silent()
        live.until_said("in time").until(lambda: camera.connections > 3)
        camera.speak()
        live.frames(len(live.rows) + 5)
        assert len(list(Path("/proc/self/fd").iterdir())) <= opened + 2
        live.stop()
    times = assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")
    assert live.end == Problem(None)
    assert reconnects >= 1
    # Pictures that come late are recorded a little later than they came.
    steps_s = np.diff(times)
    assert gap_s / 2 < max(steps_s[: dropped_out - 1]) < whole_s + 1
    assert max(steps_s[dropped_out - 1 :]) > 0.5
    if kind is RtspCamera:  # it states when it took them
        periods = 30 * steps_s
        assert np.median(np.abs(periods - np.rint(periods))) < 0.1


def test_what_comes_too_fast_is_recorded_and_gets_rows_in_between(tmp_path: Path) -> None:
    with MjpegCamera(rate_hz=400, picture=lambda number: floor(number // 13)) as camera:
        live = session(camera.url, tmp_path)
        live.until(lambda: live.states and live.states[-1].status.dropped > 20).stop()
    assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")
    dropped = live.states[-1].status.dropped
    assert 20 < dropped < len(live.rows)
    assert sum(row.status != "ok" for row in live.rows) >= dropped
    assert live.rows[0].distance_mm == 0


def test_a_full_disk_ends_the_recording_and_not_the_tracking(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHAINAGE_TOKEN", "secret-of-the-server")
    limits = Limits(LIMITS.memory_bytes, file_bytes=400_000)
    with MjpegCamera() as camera:
        child = by_itself()
        live = session(camera.url, tmp_path, child=child, limits=limits)
        live.until(lambda: live.states and not live.states[-1].status.is_recording)
        assert "Max file size             400000" in Path(f"/proc/{child.pid}/limits").read_text()
        assert b"secret" not in Path(f"/proc/{child.pid}/environ").read_bytes()
        live.frames(len(live.rows) + 30).stop()
    assert live.end == Problem(None)
    left_out = [mark for state in live.states for mark in state.left_out]
    marks = parts.read(tmp_path / "parts.csv")
    assert marks == left_out
    # Pictures that a busy machine reads late are weak: the camera has no clock of its own.
    assert "lost" not in {row.status for row in live.rows[-20:]}
    assert live.rows[-1].distance_mm - live.rows[-20].distance_mm > 10 * STEP_MM
    recorded = live.rows[: left_out[0].frame]
    assert [row.frame for row in live.rows] == list(range(len(live.rows)))
    assert [mark.frame for mark in marks] == [row.frame for row in live.rows[len(recorded) :]]
    assert len(assert_rows_are_frames(recorded, tmp_path / "recording.mkv")) > 10


def test_a_recording_stops_before_the_disk_is_full(tmp_path: Path) -> None:
    with MjpegCamera() as camera:
        live = session(camera.url, tmp_path, reserve_bytes=2**60)
        live.until(lambda: any(state.left_out for state in live.states)).stop()
    assert live.end == Problem(None)
    assert parts.read(tmp_path / "parts.csv")


def test_a_camera_that_changes_to_another_size_is_waited_for(tmp_path: Path) -> None:
    def change(size_wh: tuple[int, int]) -> None:
        camera.drop_out()
        camera.size_wh = size_wh
        camera.come_back()

    with MjpegCamera() as camera:
        live = session(camera.url, tmp_path).frames(10)
        camera.size_wh = (320, 240)  # in mid-stream
        live.until_said("320x240")
        assert "Set the camera to that size" in str(live.states[-1].status.detail)
        change((WIDTH, HEIGHT))
        live.frames(len(live.rows) + 5)
        change((384, 288))
        live.until_said("384x288")
        change((WIDTH, HEIGHT))
        live.frames(len(live.rows) + 5).stop()
    assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")


def test_a_camera_is_opened_by_its_password_and_a_wrong_one_is_given_up_and_not_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.jobs.live.capture.UNREACHABLE_AFTER_S", 0.5)
    with MjpegCamera(login="operator:right") as camera:
        wrong = session(camera.url.replace("right", "wr0ng"), tmp_path).until_end()
        assert not (tmp_path / "recording.mkv").exists()
        right = session(camera.url, tmp_path).frames(5).stop()
    assert right.end == Problem(None)
    assert isinstance(wrong.end, Failed)
    assert wrong.end.code == "camera_unreachable"
    assert "user name or the password" in wrong.end.detail
    assert "wr0ng" not in repr((wrong.states, wrong.end))


def test_a_camera_that_sends_one_on_is_not_recorded_from_elsewhere(tmp_path: Path) -> None:
    with (
        RtspCamera(host="127.0.0.2") as far,
        RtspCamera(port=far.port, location=far.url) as sends_on,
        MjpegCamera() as other,
        MjpegCamera(location=other.url) as redirects,
    ):
        live = session(sends_on.url, tmp_path).until_said("another address").stop()
        session(redirects.url, tmp_path).until_said().stop()
        assert redirects.connections > 0
        assert other.connections == 0
    assert live.rows == []
    assert not (tmp_path / "recording.mkv").exists()


def test_where_ports_are_restricted_a_camera_that_sends_one_on_to_another_is_not_followed(
    tmp_path: Path,
) -> None:
    with RtspCamera() as other, RtspCamera(location=other.url) as camera:
        live = session(camera.url, tmp_path, child=by_itself())
        if landlock_version() >= TCP_SINCE:
            live.until_said("redirects to a")
            assert other.connections == 0
        else:
            live.frames(1)
        assert camera.connections > 0
        live.stop()


def watched(folder: Path, name: str) -> Session:
    """A session about a file or pipe of the watched folder."""
    found = Sources([], folder / "watch").resolve(name, (WIDTH, HEIGHT)).camera
    return Session(found, folder / "recording.mkv")


@pytest.fixture
def watch(tmp_path: Path) -> Path:
    (tmp_path / "watch").mkdir()
    return tmp_path / "watch"


def test_a_growing_file_is_read_on_to_its_end_and_nothing_is_left_out(
    tmp_path: Path, watch: Path
) -> None:
    whole = 2 * make_clip(tmp_path / "whole.ts", 60).read_bytes()  # its times begin anew
    growing = watch / "run.ts"
    growing.write_bytes(whole[: len(whole) // 3])
    live = watched(tmp_path, "file:run.ts").frames(20)
    with growing.open("ab") as file:
        file.write(whole[len(whole) // 3 :])
    live.until_end()
    assert live.end == Problem(None)
    times = assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")
    assert len(times) == 120
    steps = np.diff(times)
    assert steps[59] == pytest.approx(10, abs=0.0011)
    assert np.delete(steps, 59) == pytest.approx(1 / 25, abs=0.0011)


def test_a_growing_file_whose_pictures_change_their_size_ends_with_the_reason(
    tmp_path: Path, watch: Path
) -> None:
    small = write_clip(tmp_path / "small.ts", frames=10)
    whole = make_clip(tmp_path / "whole.ts", 30).read_bytes() + small.read_bytes()
    (watch / "run.ts").write_bytes(whole)
    live = watched(tmp_path, "file:run.ts").until_end()
    assert isinstance(live.end, Problem)
    assert "96x64" in str(live.end.sentence)
    assert len(assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")) == 30


def test_a_pipe_is_read_until_it_is_silent(tmp_path: Path, watch: Path) -> None:
    os.mkfifo(watch / "recorder")
    live = watched(tmp_path, "pipe:recorder")
    (watch / "recorder").write_bytes(make_clip(tmp_path / "whole.ts", 60).read_bytes())
    live.until_end()
    assert live.end == Problem(None)
    assert len(assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")) == 60
