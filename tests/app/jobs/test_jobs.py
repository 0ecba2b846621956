"""What the children do, as their parent sees it: most of it here, each as a process once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest
from builders import HEIGHT, PATIENCE_S, RATE, WIDTH, clip_rig, frame_number, make_clip
from in_process import track

from app.jobs.messages import (
    Batch,
    Checkpoint,
    Done,
    Failed,
    FromMedia,
    FromTracker,
    Limits,
    Picture,
    PictureRequest,
    Probed,
    ProbeRequest,
    TrackRequest,
)
from app.jobs.process import Child, describe_exit
from app.jobs.track.tracker import Pace
from vo_core.errors import UnreadableVideo

MOMENT_S = 0.3
LIMITS = Limits(768 * 2**20, 600)
"""The least that an operator may set."""


def request(video: Path, limits: Limits = LIMITS, pace: float | None = None) -> TrackRequest:
    return TrackRequest(str(video), clip_rig(), limits, pace)


def from_child(wanted: TrackRequest) -> list[FromTracker]:
    """All messages of a tracking process, except checkpoints."""
    decoder = msgspec.msgpack.Decoder(FromTracker)
    child = Child("app.jobs.track.tracker")
    child.send(wanted)
    messages: list[FromTracker] = []
    while not messages or isinstance(messages[-1], Batch):
        message = decoder.decode(child.receive(PATIENCE_S))
        if not isinstance(message, Checkpoint):
            messages.append(message)
    assert child.end() == 0
    return messages


def test_every_frame_comes_once_and_each_picture_is_of_the_last_of_its_batch(clip: Path) -> None:
    *batches, end = from_child(request(clip))
    assert end == Done(None)
    rows = [row for batch in batches for row in batch.rows]
    assert [row.frame for row in rows] == list(range(40))
    assert rows[0].time_s == 0
    for batch in batches:
        assert frame_number(batch.jpeg) == batch.rows[-1].frame


def test_a_pace_keeps_tracking_at_the_speed_of_the_video_with_few_pictures(clip: Path) -> None:
    soon, at_end = (track(request(clip, pace=pace)) for pace in (1000.0, 1.0))
    last_s = 39 / RATE
    assert at_end[1].now_s - soon[1].now_s == pytest.approx(last_s * (1 - 1 / 1000))
    batches = [message for message in at_end[0] if isinstance(message, Batch)]
    assert len(batches) <= 15 * last_s + 2


def test_a_long_silence_of_a_film_is_not_waited_for() -> None:
    pace = Pace(2.0)
    assert pace.pause_s(10.0, 500.0) == 0
    assert pace.pause_s(11.0, 500.2) == pytest.approx(0.3)
    assert pace.pause_s(11.0, 501.0) == 0
    assert pace.pause_s(3600.0, 501.0) == 1.0


def test_what_is_no_video_is_a_plain_failure(tmp_path: Path) -> None:
    path = tmp_path / "x.mp4"
    for content in (b"", b"\0" * 5000, b"ffconcat version 1.0\nfile a.mp4\n"):
        path.write_bytes(content)
        with pytest.raises(UnreadableVideo):
            track(request(path))
    path.write_bytes(b"#EXTM3U\nfile:///etc/passwd\n")
    (failure,) = from_child(request(path))
    assert isinstance(failure, Failed)
    assert (failure.code, failure.trace) == ("unreadable_video", "")


def test_a_child_short_of_memory_ends_without_a_hang(clip: Path) -> None:
    (failure,) = from_child(request(clip, Limits(300 * 2**20)))
    assert isinstance(failure, Failed)
    assert failure.code in ("out_of_memory", "tracking_failed")


def test_a_child_ends_when_its_parent_does(clip: Path) -> None:
    child = Child("app.jobs.track.tracker")
    child.send(request(clip, pace=0.5))
    child.receive(PATIENCE_S)
    assert child.end() == 0


def test_the_media_process_answers_one_request_after_the_other_until_its_parent_ends(
    clip: Path, tmp_path: Path
) -> None:
    decoder = msgspec.msgpack.Decoder(FromMedia)
    bad = tmp_path / "bad.mp4"
    bad.write_bytes(b"no video")
    child = Child("app.jobs.requests.media")
    child.send(Limits(768 * 2**20))

    def answer(asked: msgspec.Struct) -> object:
        child.send(asked)
        return decoder.decode(child.receive(PATIENCE_S))

    probed = answer(ProbeRequest(str(clip)))
    assert isinstance(probed, Probed)
    assert (probed.width, probed.height, probed.frames) == (WIDTH, HEIGHT, 40)
    refused = answer(ProbeRequest(str(bad)))
    assert isinstance(refused, Failed)
    assert refused.code == "unreadable_video"
    picture = answer(PictureRequest(str(clip), 0.6, 92))
    assert isinstance(picture, Picture)
    assert frame_number(picture.jpeg) == 15
    assert isinstance(answer(PictureRequest(str(clip), 60.0, 92)), Failed)
    assert child.end() == 0


def test_a_child_that_waits_for_a_processor_is_waited_for_and_one_that_hangs_is_not(
    clip: Path,
) -> None:
    child = Child("app.jobs.requests.media")
    child.send(Limits(768 * 2**20))
    child.send(ProbeRequest(str(clip)))
    child.receive(PATIENCE_S)
    with a_busy_machine_for(child):
        child.send(PictureRequest(str(clip), 0.6, 92))
        assert child.receive(MOMENT_S)  # of some seconds it gets a hundredth
    os.kill(child.pid, signal.SIGSTOP)
    child.send(PictureRequest(str(clip), 0.6, 92))
    with pytest.raises(TimeoutError):
        child.receive(MOMENT_S)
    child.kill()


@contextmanager
def a_busy_machine_for(child: Child) -> Iterator[None]:
    """Let another process have nearly all of the one processor that the child may use."""
    processor = {min(os.sched_getaffinity(0))}
    burn = f"import os; os.sched_setaffinity(0, {processor})\nprint(flush=True)\nwhile True: pass"
    for thread in Path(f"/proc/{child.pid}/task").iterdir():
        os.sched_setaffinity(int(thread.name), processor)
        os.setpriority(os.PRIO_PROCESS, int(thread.name), 19)
    with subprocess.Popen([sys.executable, "-c", burn], stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        try:
            yield
        finally:
            other.kill()


def test_exit_codes_are_described_in_words() -> None:
    assert "exit code 3" in describe_exit(3)
    assert "SIGSEGV" in describe_exit(-11)
    assert "memory" in describe_exit(-9)
    assert "signal 64" in describe_exit(-64)


def test_a_video_of_one_frame_is_a_track_of_one_row(tmp_path: Path) -> None:
    (batch, end), _ = track(request(make_clip(tmp_path / "one.mp4", 1)))
    assert isinstance(batch, Batch)
    assert isinstance(end, Done)
    assert [row.distance_mm for row in batch.rows] == [0.0]
