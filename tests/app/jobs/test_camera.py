"""The camera process by itself, as its parent sees it, with cameras on loopback."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from ipaddress import ip_network
from pathlib import Path

import msgspec
import numpy as np
import pytest
from builders import HEIGHT, PATIENCE_S, STEP_MM, WIDTH, clip_rig, make_clip
from cameras import Camera, MjpegCamera, RtspCamera, floor

from app.jobs import parts
from app.jobs.confinement import landlock_version
from app.jobs.messages import (
    Batch,
    CameraInput,
    CameraState,
    Done,
    Failed,
    FromCamera,
    Limits,
    LiveRequest,
    Row,
    StopCapture,
)
from app.jobs.process import Child
from app.tracking.cameras import Sources
from vo_core.sources import VideoFile

LOOPBACK = Sources([ip_network("127.0.0.0/8")], None)
LIMITS = Limits(1536 * 2**20, file_bytes=2**30)


@dataclass
class Session:
    """One camera process and its messages."""

    camera: CameraInput
    recording: Path
    limits: Limits = LIMITS
    last: Row | None = None
    zero_s: float | None = None
    rows: list[Row] = field(default_factory=list)
    states: list[CameraState] = field(default_factory=list)
    end: Done | Failed | None = None

    def __post_init__(self) -> None:
        self.child = Child("app.jobs.camera")
        self.child.send(
            LiveRequest(
                self.camera,
                clip_rig(),
                str(self.recording),
                str(self.recording.with_name("parts.csv")),
                self.limits,
                0,
                self.last,
                self.zero_s,
            )
        )
        self._decoder = msgspec.msgpack.Decoder(FromCamera)

    def until(self, condition: Callable[[], object]) -> Session:
        """Listen until it is so or the end."""
        deadline = time.monotonic() + PATIENCE_S
        while self.end is None and not condition():
            assert time.monotonic() < deadline, self.states
            match self._decoder.decode(self.child.receive(PATIENCE_S)):
                case Batch() as batch:
                    self.rows += batch.rows
                case CameraState() as state:
                    self.states.append(state)
                case Done() | Failed() as end:
                    self.end = end
        return self

    def stop(self) -> Session:
        self.child.send(StopCapture())
        self.until(lambda: False)
        self.child.end()
        return self

    def frames(self, count: int) -> Session:
        return self.until(lambda: len(self.rows) >= count)


def session(camera: Camera, folder: Path, **more: object) -> Session:
    found = LOOPBACK.resolve(camera.url, (WIDTH, HEIGHT)).camera
    return Session(found, folder / "recording.mkv", **more)  # type: ignore[arg-type]


def assert_rows_are_frames(rows: Sequence[Row], recording: Path) -> list[float]:
    """Row i is frame i of the recording; the times."""
    with VideoFile(recording) as video:
        times = [frame.t_s for frame in video]
        assert video.problem is None
    assert [row.frame for row in rows] == list(range(len(rows)))
    assert np.allclose([row.time_s for row in rows], times, atol=1e-6), (len(rows), len(times))
    return times


@pytest.mark.parametrize("kind", [MjpegCamera, RtspCamera])
def test_a_drop_out_is_a_gap_in_one_recording(kind: type[Camera], tmp_path: Path) -> None:
    with kind() as camera:
        live = session(camera, tmp_path).frames(20)
        camera.drop_out()
        live.until(lambda: not live.states[-1].connected)
        gone_s = time.monotonic()
        seen = len(live.rows)
        time.sleep(1.0)
        camera.come_back()
        live.frames(seen + 20).stop()
        gap_s = time.monotonic() - gone_s
    times = assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")
    assert live.end == Done(None)
    assert live.states[-1].reconnects == 1
    assert any("refuses the connection" in (state.detail or "") for state in live.states)
    assert 1.0 < max(np.diff(times)) < gap_s
    # A busy machine's camera leaves frames out, but none come closer than they were taken.
    assert 0.029 < np.median(np.diff(times)) < 0.1


def test_what_comes_too_fast_is_recorded_and_gets_rows_in_between(tmp_path: Path) -> None:
    with MjpegCamera(rate_hz=400, picture=lambda number: floor(number // 13)) as camera:
        live = session(camera, tmp_path)
        live.until(lambda: live.states and live.states[-1].dropped > 20).stop()
    assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")
    dropped = live.states[-1].dropped
    assert 20 < dropped < len(live.rows)
    assert sum(row.status != "ok" for row in live.rows) >= dropped
    assert live.rows[0].distance_mm == 0


def test_drop_outs_leave_no_file_open(tmp_path: Path) -> None:
    with MjpegCamera() as camera:
        live = session(camera, tmp_path).frames(3)
        opened = len(list(Path(f"/proc/{live.child.pid}/fd").iterdir()))
        for count in range(1, 4):
            camera.drop_out()
            camera.come_back()
            live.until(lambda: live.states[-1].reconnects == count)  # noqa: B023
            live.frames(len(live.rows) + 3)
        assert len(list(Path(f"/proc/{live.child.pid}/fd").iterdir())) <= opened
        live.stop()


def test_another_process_goes_on_where_one_was_killed(tmp_path: Path) -> None:
    with RtspCamera() as camera:
        first = session(camera, tmp_path).frames(30)
        zero_s = first.states[-1].zero_s
        os.kill(first.child.pid, signal.SIGKILL)
        first.child.end()
        second = session(camera, tmp_path, last=first.rows[-1], zero_s=zero_s)
        second.frames(30).stop()
    rows = first.rows + second.rows
    times = assert_rows_are_frames(rows, tmp_path / "recording.mkv")
    assert max(np.diff(times)) > 0.3, "the time that nobody recorded is a gap"
    # The longer the gap the less is known of it, and the track says so.
    error_mm = rows[-1].distance_mm - STEP_MM * 30 * times[-1]
    assert abs(error_mm) < 15 + 3 * rows[-1].sigma_distance_mm


def test_a_full_disk_ends_the_recording_and_not_the_tracking(tmp_path: Path) -> None:
    with MjpegCamera() as camera:
        live = session(camera, tmp_path, limits=Limits(LIMITS.memory_bytes, file_bytes=400_000))
        live.until(lambda: live.states and not live.states[-1].is_recording)
        live.frames(len(live.rows) + 30).stop()
    assert live.end == Done(None)
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


def test_pictures_of_another_size_are_refused_at_the_start(tmp_path: Path) -> None:
    with MjpegCamera(size_wh=(320, 240)) as camera:
        live = session(camera, tmp_path).until(lambda: False)
    assert isinstance(live.end, Failed)
    assert live.end.code == "rig_video_mismatch"
    assert "320x240" in live.end.detail
    assert "256x160" in live.end.detail


def test_a_camera_that_comes_back_with_another_size_is_waited_for(tmp_path: Path) -> None:
    with MjpegCamera() as camera:
        live = session(camera, tmp_path).frames(10)
        camera.drop_out()
        camera.size_wh = (320, 240)
        camera.come_back()
        live.until(lambda: "320x240" in (live.states[-1].detail or ""))
        camera.drop_out()
        camera.size_wh = (WIDTH, HEIGHT)
        camera.come_back()
        live.frames(len(live.rows) + 10).stop()
    assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")


def test_a_camera_with_a_password_is_opened_by_it(tmp_path: Path) -> None:
    with MjpegCamera(login="operator:right") as camera:
        assert session(camera, tmp_path).frames(5).stop().end == Done(None)


def test_a_wrong_password_is_given_up_and_not_shown(tmp_path: Path) -> None:
    with MjpegCamera(login="operator:right") as camera:
        wrong = camera.url.replace("right", "wr0ng")
        found = LOOPBACK.resolve(wrong, (WIDTH, HEIGHT)).camera
        live = Session(found, tmp_path / "recording.mkv").until(lambda: False)
    assert isinstance(live.end, Failed)
    assert live.end.code == "camera_unreachable"
    assert "user name or the password" in live.end.detail
    assert "wr0ng" not in repr((live.states, live.end))
    assert not (tmp_path / "recording.mkv").exists()


def test_a_redirect_is_not_followed(tmp_path: Path) -> None:
    with MjpegCamera() as other, MjpegCamera(location=other.url) as camera:
        live = session(camera, tmp_path)
        live.until(lambda: any(state.detail for state in live.states)).stop()
        assert camera.connections > 0
        assert other.connections == 0


def test_a_camera_that_sends_one_on_is_not_recorded_from_elsewhere(tmp_path: Path) -> None:
    with (
        RtspCamera(host="127.0.0.2") as other,
        RtspCamera(port=other.port, location=other.url) as camera,
    ):
        live = session(camera, tmp_path)
        live.until(lambda: any(state.detail for state in live.states)).stop()
    assert live.rows == []
    assert not (tmp_path / "recording.mkv").exists()
    assert "another address" in str([state.detail for state in live.states])


@pytest.mark.skipif(landlock_version() < 4, reason="the kernel cannot restrict TCP")
def test_a_camera_that_sends_one_on_to_another_port_is_not_followed(tmp_path: Path) -> None:
    with RtspCamera() as other, RtspCamera(location=other.url) as camera:
        live = session(camera, tmp_path)
        live.until(lambda: any(state.detail for state in live.states)).stop()
        assert camera.connections > 0
        assert other.connections == 0
    assert "redirects to a" in str([state.detail for state in live.states])


def test_a_growing_file_is_read_on_to_its_end_and_nothing_is_left_out(tmp_path: Path) -> None:
    whole = make_clip(tmp_path / "whole.ts", 120).read_bytes()
    watch = tmp_path / "watch"
    watch.mkdir()
    growing = watch / "run.ts"
    growing.write_bytes(whole[: len(whole) // 3])
    found = Sources([], watch).resolve("file:run.ts", (WIDTH, HEIGHT)).camera
    live = Session(found, tmp_path / "recording.mkv").frames(20)
    with growing.open("ab") as file:
        file.write(whole[len(whole) // 3 :])
    live.until(lambda: False)
    assert live.end == Done(None)
    times = assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")
    assert len(times) == 120
    assert np.diff(times) == pytest.approx(1 / 25, abs=0.0011)


def test_a_pipe_is_read_until_it_is_silent(tmp_path: Path) -> None:
    whole = make_clip(tmp_path / "whole.ts", 60).read_bytes()
    watch = tmp_path / "watch"
    watch.mkdir()
    os.mkfifo(watch / "recorder")
    found = Sources([], watch).resolve("pipe:recorder", (WIDTH, HEIGHT)).camera
    live = Session(found, tmp_path / "recording.mkv")
    with (watch / "recorder").open("wb") as pipe:
        for at in range(0, len(whole), 4096):
            pipe.write(whole[at : at + 4096])
            time.sleep(0.01)
    live.until(lambda: False)
    assert live.end == Done(None)
    assert len(assert_rows_are_frames(live.rows, tmp_path / "recording.mkv")) == 60


def test_the_process_can_write_nothing_but_a_recording_of_its_size(tmp_path: Path) -> None:
    with MjpegCamera() as camera:
        live = session(camera, tmp_path).frames(3)
        limits = Path(f"/proc/{live.child.pid}/limits").read_text()
        assert f"Max file size             {2**30}" in limits
        environment = Path(f"/proc/{live.child.pid}/environ").read_bytes()
        assert b"CHAINAGE" not in environment
        live.stop()
