"""Tracking that was broken off goes on from its last checkpoint, and comes out the same."""

from __future__ import annotations

import json
import logging
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from builders import (
    PATIENCE_S,
    Client,
    assert_error,
    children,
    clip_rig,
    make_clip,
    send_signal,
    serving,
    wait_until,
)

from app.tracking.films.offline import Method, track_video
from vo_core import Rig, Track

TRACKER = "app.jobs.track.tracker"
GOES_ON = "app.tracking.films.film_run"
FRAMES, PACE = 120, 3.0
STALL_S = 15.0
"""A child on a busy machine starts in less."""


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some five seconds, of which `PACE` makes one and a half: there is time for checkpoints."""
    return make_clip(tmp_path_factory.mktemp("film") / "film.mp4", FRAMES)


@pytest.fixture(scope="module")
def paced(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with serving(tmp_path_factory.mktemp("paced"), pace=PACE, stall_s=STALL_S) as client:
        yield client


@pytest.fixture(scope="module")
def whole(paced: Client, film: Path) -> dict[str, bytes]:
    """What an uninterrupted run leaves."""
    return paced.results(paced.tracked(film))


def test_the_stored_track_is_that_of_the_command(whole: dict[str, bytes], film: Path) -> None:
    track = track_video(film, Rig.parse(clip_rig()), Method.CHAINAGE).track
    stored = Track.from_csv(whole["track.csv"].decode())
    for name in ("distance_mm", "sigma_distance_mm", "y_mm", "yaw_deg"):
        # The file has four decimals; numpy counts with another number of threads in a child.
        np.testing.assert_allclose(getattr(stored, name), getattr(track, name), atol=2e-4)


def checkpoint_of(client: Client, inspection_id: str) -> Path:
    """The file of a checkpoint, once there is one."""
    path = client.data / "inspections" / inspection_id / "checkpoint"
    wait_until(path.exists)
    return path


def resumed_at(caplog: pytest.LogCaptureFixture) -> list[int]:
    """Frames from which tracking has gone on."""
    return [
        int(record.args[1])
        for record in caplog.records
        if record.name == GOES_ON and "on." in record.msg and len(record.args or ()) == 2
    ]


def test_a_process_that_dies_and_one_that_hangs_are_followed_by_one_that_goes_on(
    paced: Client,
    film: Path,
    whole: dict[str, bytes],
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO, GOES_ON)
    inspection_id = paced.inspect(film)
    with paced.socket(f"/api/inspections/{inspection_id}/live") as socket:
        checkpoint_of(paced, inspection_id)
        send_signal(TRACKER, signal.SIGKILL)
        wait_until(lambda: resumed_at(caplog))
        (pid,) = wait_until(lambda: children(TRACKER))
        os.kill(pid, signal.SIGSTOP)
        assert paced.get("/healthz").status_code == 200
        assert paced.inspection(inspection_id)["status"] == "running"
        states, frames = [], []
        while not states or states[-1] in ("queued", "running"):
            message = socket.recv(PATIENCE_S)
            if isinstance(message, bytes):
                header = json.loads(message[4 : 4 + int.from_bytes(message[:4], "big")])
                socket.send(json.dumps({"type": "ack", "seq": header["seq"]}))
                states.append(header["state"])
                frames.append(header["progress"]["frames_done"])
    assert paced.wait(inspection_id)["status"] == states[-1] == "done"
    assert frames[-1] == FRAMES
    at, again = resumed_at(caplog)
    assert again >= at > 0
    assert not Path(f"/proc/{pid}").exists()
    assert paced.results(inspection_id) == whole
    names = {path.name for path in (paced.data / "inspections" / inspection_id).iterdir()}
    assert not names & {"checkpoint", "journal"}


def test_one_video_that_ends_every_process_fails_clearly(paced: Client, film: Path) -> None:
    inspection_id = paced.inspect(film)
    killed = set[int]()

    def has_failed() -> bool:
        for pid in set(children(TRACKER)) - killed:
            os.kill(pid, signal.SIGKILL)
            killed.add(pid)
        return bool(paced.inspection(inspection_id)["status"] == "failed")

    wait_until(has_failed)
    failed = paced.inspection(inspection_id)
    assert failed["error"]["code"] == "tracking_process_died"
    assert "SIGKILL" in failed["error"]["detail"]
    assert "3 times" in failed["error"]["detail"]
    assert len(killed) in (3, 4)  # and one that gives the rest of the film rows without poses
    other = paced.inspect(film)
    paced.wait(other, "running")  # the server goes on
    paced.post(f"/api/inspections/{other}/cancel")


def test_retry_of_a_cancelled_one_continues_at_its_checkpoint(
    paced: Client, film: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, GOES_ON)
    inspection_id = paced.inspect(film)
    checkpoint = checkpoint_of(paced, inspection_id)
    assert_error(paced.post(f"/api/inspections/{inspection_id}/retry"), 409, "still_running")
    assert checkpoint.exists()
    paced.post(f"/api/inspections/{inspection_id}/cancel")
    assert not resumed_at(caplog)
    paced.post(f"/api/inspections/{inspection_id}/retry")
    wait_until(lambda: resumed_at(caplog))
    paced.post(f"/api/inspections/{inspection_id}/cancel")
    assert checkpoint.exists()
