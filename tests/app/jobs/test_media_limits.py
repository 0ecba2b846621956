"""What a child that decodes may use and reach; each bound is met here once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import msgspec
import pytest
from builders import children, clip_rig, wait_until
from cameras import MjpegCamera
from hostile import write_clip

from app.errors import MediaTimeout
from app.jobs.confinement import landlock_version
from app.jobs.messages import (
    Batch,
    CameraState,
    Checkpoint,
    Done,
    Failed,
    FromCamera,
    FromMedia,
    FromTracker,
    Limits,
    LiveRequest,
    Probed,
    ProbeRequest,
    StopCapture,
    TrackRequest,
)
from app.jobs.parts import read
from app.jobs.process import Child, describe_exit
from app.settings import Settings
from app.tracking import media
from app.tracking.cameras import Sources

MIB = 2**20
LIMITS = Limits(768 * MIB, 600)
TCP_SINCE = 4
needs_landlock = pytest.mark.skipif(not landlock_version(), reason="the kernel has no Landlock")


def ended(module: str, request: msgspec.Struct, *first: msgspec.Struct) -> object:
    """The last message of a child."""
    decoder = msgspec.msgpack.Decoder(FromMedia if module == "app.jobs.media" else FromTracker)
    child = Child(module)
    try:
        for message in (*first, request):
            child.send(message)
        while isinstance(answer := decoder.decode(child.receive(60)), Batch | Checkpoint):
            pass
        return answer
    finally:
        child.end()


@pytest.mark.parametrize("mebibytes", [600, 768])
def test_a_film_that_needs_more_memory_than_allowed_says_so(mebibytes: int, tmp_path: Path) -> None:
    size_wh = (7680, 4320)
    film = write_clip(tmp_path / "large.mp4", size_wh=size_wh, frames=6)
    rig = clip_rig(width=size_wh[0], height=size_wh[1], fx=7500.0, fy=7500.0, cx=3839.5, cy=2159.5)
    answer = ended("app.jobs.tracker", TrackRequest(str(film), rig, Limits(mebibytes * MIB)))
    assert isinstance(answer, Failed), answer
    assert (answer.code, answer.trace) == ("out_of_memory", "")


def test_a_film_that_takes_too_much_processor_time_ends_its_tracker(long_clip: Path) -> None:
    child = Child("app.jobs.tracker")
    child.send(TrackRequest(str(long_clip), clip_rig(), Limits(768 * MIB, cpu_s=2)))
    with suppress(EOFError):
        while True:
            child.receive(60)
    assert "SIGXCPU" in describe_exit(child.end())


def test_a_probe_that_hangs_is_ended_and_the_next_one_is_answered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = write_clip(tmp_path / "clip.mp4")
    service = media.Media(LIMITS)
    try:
        assert service.probe(clip, "clip.mp4").frames == 16
        (pid,) = children("app.jobs.media")
        os.kill(pid, signal.SIGSTOP)
        monkeypatch.setattr(media, "_ANSWER_TIMEOUT_S", 0.5)
        with pytest.raises(MediaTimeout):
            service.probe(clip, "clip.mp4")
        assert not Path(f"/proc/{pid}").exists()
        monkeypatch.undo()
        assert service.probe(clip, "clip.mp4").frames == 16
    finally:
        service.close()


def test_a_recording_stops_before_the_disk_is_full(tmp_path: Path) -> None:
    networks = Settings(camera_networks="127.0.0.0/8").camera_networks
    with MjpegCamera() as camera:
        found = Sources(networks, None).resolve(camera.url, (256, 160)).camera
        recording, marks = str(tmp_path / "recording.mkv"), str(tmp_path / "parts.csv")
        limits = Limits(LIMITS.memory_bytes, file_bytes=MIB)
        request = LiveRequest(found, clip_rig(), recording, marks, limits, 2**60)
        end = ended_camera(request)
    assert isinstance(end, Done)
    assert read(tmp_path / "parts.csv")


def ended_camera(request: LiveRequest) -> Done | Failed:
    """Ask it to end as soon as it does not record."""
    decoder = msgspec.msgpack.Decoder(FromCamera)
    child = Child("app.jobs.camera")
    try:
        child.send(request)
        while not isinstance(message := decoder.decode(child.receive(60)), Done | Failed):
            if isinstance(message, CameraState) and message.left_out:
                child.send(StopCapture())
        return message
    finally:
        child.end()


@needs_landlock
def test_a_probe_reads_nothing_but_where_videos_are(tmp_path: Path) -> None:
    (tmp_path / "uploads").mkdir()
    inside = write_clip(tmp_path / "uploads" / "a.mp4")
    outside = write_clip(tmp_path / "b.mp4")
    limits = Limits(768 * MIB, reads=(str(tmp_path / "uploads"),))
    assert isinstance(ended("app.jobs.media", ProbeRequest(str(inside)), limits), Probed)
    refused = ended("app.jobs.media", ProbeRequest(str(outside)), limits)
    assert isinstance(refused, Failed)
    assert "Permission denied" in refused.detail


_REACH = """
import os, signal, socket, sys
from app.jobs.confinement import confine

folder, port, other = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
confine(reads=[folder + "/film"], writes=[folder + "/inspection"], port=port)

import cv2, app.jobs.follow, vo_core.sources  # what is loaded afterwards

def attempt(name, action):
    try:
        action()
    except PermissionError:
        print(name, "refused")
    else:
        print(name, "allowed")

attempt("film", lambda: open(folder + "/film").close())
attempt("recording", lambda: open(folder + "/inspection/recording", "w").write("x"))
attempt("rewrite", lambda: os.truncate(folder + "/inspection/recording", 0))
attempt("camera", lambda: socket.create_connection(("127.0.0.1", port)).close())
attempt("token", lambda: open(folder + "/token"))
attempt("change", lambda: open(folder + "/film", "a"))
attempt("new", lambda: open(folder + "/new", "w"))
attempt("list", lambda: os.listdir(folder))
attempt("passwords", lambda: open("/etc/passwd"))
attempt("elsewhere", lambda: socket.create_connection(("127.0.0.1", other)))
attempt("kill", lambda: os.kill(os.getppid(), 0))
"""


@needs_landlock
def test_a_confined_process_reaches_what_it_was_given_and_nothing_else(tmp_path: Path) -> None:
    import socket

    (tmp_path / "inspection").mkdir()
    (tmp_path / "film").touch()
    (tmp_path / "token").touch()
    with (
        socket.create_server(("127.0.0.1", 0)) as camera,
        socket.create_server(("127.0.0.1", 0)) as other,
    ):
        ports = [str(each.getsockname()[1]) for each in (camera, other)]
        ran = subprocess.run(
            [sys.executable, "-P", "-c", _REACH, str(tmp_path), *ports],
            capture_output=True,
            text=True,
            check=True,
            env={"PYTHONPATH": str(Path(media.__file__).parents[2])},
        )
    printed = dict(line.split() for line in ran.stdout.splitlines())
    expected = dict.fromkeys(("film", "recording", "rewrite", "camera"), "allowed")
    expected |= dict.fromkeys(("token", "change", "new", "list", "passwords"), "refused")
    if landlock_version() >= TCP_SINCE:
        expected["elsewhere"] = "refused"
    assert {name: printed[name] for name in expected} == expected


def test_a_child_is_there_at_once_again(tmp_path: Path) -> None:
    """The media process dies with its limits; the next request meets another."""
    clip = write_clip(tmp_path / "clip.mp4")
    service = media.Media(LIMITS)
    try:
        assert not service.is_alive()  # nobody has asked
        service.probe(clip, "clip.mp4")
        for pid in children("app.jobs.media"):
            os.kill(pid, signal.SIGKILL)
        wait_until(lambda: not service.is_alive())
        begun_s = time.monotonic()
        assert service.probe(clip, "clip.mp4").frames == 16
        assert time.monotonic() - begun_s < 30
    finally:
        service.close()
