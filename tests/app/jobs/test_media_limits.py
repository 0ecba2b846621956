"""What a child that decodes may use and reach; each bound is met here once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from builders import PATIENCE_S, children, clip_rig, make_clip, wait_until
from hostile import write_clip

from app.errors import MediaTimeout
from app.jobs.confinement import landlock_version
from app.jobs.messages import Limits, Problem
from app.jobs.process import Child, Died, Refused
from app.jobs.track.messages import TrackRequest
from app.tracking.pictures import media
from vo_core.errors import UnreadableVideo

MIB = 2**20
LIMITS = Limits(768 * MIB, 600)
TCP_SINCE = 4


def test_a_film_that_needs_more_memory_than_allowed_says_so(
    tmp_path: Path, *, is_long: bool
) -> None:
    size_wh = (7680, 4320)
    film = write_clip(tmp_path / "large.mp4", size_wh=size_wh, frames=6 if is_long else 2)
    rig = clip_rig(width=size_wh[0], height=size_wh[1], fx=7500.0, fy=7500.0, cx=3839.5, cy=2159.5)
    for mebibytes in (600, 768) if is_long else (768,):
        request = TrackRequest(str(film), rig, Limits(mebibytes * MIB))
        with Child("app.jobs.track.tracker") as child, pytest.raises(Refused) as refusal:
            child.ask(request, Problem, stall_s=PATIENCE_S, part=Any)
        assert refusal.value.code == "out_of_memory"


def test_a_film_that_takes_too_much_processor_time_ends_its_tracker(tmp_path: Path) -> None:
    film = make_clip(tmp_path / "film.mp4", 800)
    request = TrackRequest(str(film), clip_rig(), Limits(768 * MIB, cpu_s=1))
    with Child("app.jobs.track.tracker") as child, pytest.raises(Died, match="SIGXCPU"):
        child.ask(request, Problem, stall_s=PATIENCE_S, part=Any)


def test_a_media_process_that_is_killed_or_hangs_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = write_clip(tmp_path / "clip.mp4")
    service = media.Media(LIMITS)
    try:
        assert not service.is_alive()  # nobody has asked
        assert service.probe(clip, "clip.mp4").frames == 16
        (killed,) = children("app.jobs.requests.media")
        os.kill(killed, signal.SIGKILL)
        wait_until(lambda: not service.is_alive())
        assert service.probe(clip, "clip.mp4").frames == 16
        (hanging,) = children("app.jobs.requests.media")
        os.kill(hanging, signal.SIGSTOP)
        monkeypatch.setattr(media, "_ANSWER_TIMEOUT_S", 0.5)
        with pytest.raises(MediaTimeout):
            service.probe(clip, "clip.mp4")
        assert not Path(f"/proc/{hanging}").exists()
        monkeypatch.undo()
        assert service.probe(clip, "clip.mp4").frames == 16
        assert service.restarts == 2
    finally:
        service.close()


def test_a_probe_reads_nothing_but_where_videos_are(tmp_path: Path) -> None:
    (tmp_path / "uploads").mkdir()
    inside = write_clip(tmp_path / "uploads" / "a.mp4")
    outside = write_clip(tmp_path / "b.mp4")
    limits = Limits(768 * MIB, reads=(str(tmp_path / "uploads"),))
    service = media.Media(limits)
    try:
        assert service.probe(inside, "a.mp4").frames == 16
        if landlock_version():
            with pytest.raises(UnreadableVideo, match="Permission denied"):
                service.probe(outside, "b.mp4")
    finally:
        service.close()


_REACH = """
import os, signal, socket, sys
import app.jobs.live.camera, app.jobs.requests.media, app.jobs.track.tracker
from app.jobs.confinement import confine

assert not {"av", "cv2", "numpy"} & set(sys.modules), "they are to be loaded under the limits"
folder, port, other = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
confine(reads=[folder + "/film"], writes=[folder + "/inspection"], port=port)

import cv2, app.jobs.track.follow, vo_core.sources  # what is loaded afterwards

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
            env={"PYTHONPATH": str(Path(media.__file__).parents[3])},
        )
    printed = dict(line.split() for line in ran.stdout.splitlines())
    expected = dict.fromkeys(("film", "recording", "rewrite", "camera"), "allowed")
    if landlock_version():
        expected |= dict.fromkeys(("token", "change", "new", "list", "passwords"), "refused")
    if landlock_version() >= TCP_SINCE:
        expected["elsewhere"] = "refused"
    assert {name: printed[name] for name in expected} == expected
