"""The child processes by themselves, as their parent sees them."""

from __future__ import annotations

import time
from pathlib import Path

import msgspec
import pytest
from builders import HEIGHT, PATIENCE_S, WIDTH, clip_rig, frame_number, make_clip

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

LIMITS = Limits(768 * 2**20, 600)
"""The least that an operator may set."""


def track(video: Path, limits: Limits = LIMITS) -> list[FromTracker]:
    """All messages of a tracker about a video, except checkpoints."""
    decoder = msgspec.msgpack.Decoder(FromTracker)
    child = Child("app.jobs.tracker")
    try:
        child.send(TrackRequest(str(video), clip_rig(), limits))
        messages: list[FromTracker] = []
        while not messages or isinstance(messages[-1], Batch):
            message = decoder.decode(child.receive(PATIENCE_S))
            if not isinstance(message, Checkpoint):
                messages.append(message)
        return messages
    finally:
        child.end()


def test_every_frame_comes_once_and_each_picture_is_of_the_last_of_its_batch(clip: Path) -> None:
    *batches, end = track(clip)
    assert end == Done(None)
    rows = [row for batch in batches for row in batch.rows]
    assert [row.frame for row in rows] == list(range(40))
    assert rows[0].time_s == 0
    for batch in batches:
        assert frame_number(batch.jpeg) == batch.rows[-1].frame


def test_a_pace_keeps_tracking_at_the_speed_of_the_video(clip: Path) -> None:
    child = Child("app.jobs.tracker")
    child.send(TrackRequest(str(clip), clip_rig(), LIMITS, pace=1.0))
    child.receive(PATIENCE_S)
    begun = time.monotonic()
    decoder = msgspec.msgpack.Decoder(FromTracker)
    while not isinstance(decoder.decode(child.receive(PATIENCE_S)), Done):
        pass
    assert time.monotonic() - begun > 1.4  # 39 frames at 25 Hz, but for the first batch
    child.end()


def test_previews_are_few(long_clip: Path) -> None:
    decoder = msgspec.msgpack.Decoder(FromTracker)
    child = Child("app.jobs.tracker")
    child.send(TrackRequest(str(long_clip), clip_rig(), LIMITS))
    times: list[float] = []
    while len(times) < 10:
        message = decoder.decode(child.receive(PATIENCE_S))
        if isinstance(message, Batch):
            times.append(message.rows[-1].time_s)
    child.kill()
    assert (times[-1] - times[0]) * 25 > 18, "several frames a batch"


@pytest.mark.parametrize(
    "content",
    [b"", b"\0" * 5000, b"#EXTM3U\nfile:///etc/passwd\n", b"ffconcat version 1.0\nfile a.mp4\n"],
)
def test_what_is_no_video_is_a_plain_failure(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.mp4"
    path.write_bytes(content)
    (failure,) = track(path)
    assert isinstance(failure, Failed)
    assert failure.code == "unreadable_video"
    assert not failure.trace


def test_a_child_short_of_memory_ends_without_a_hang(clip: Path) -> None:
    (failure,) = track(clip, Limits(300 * 2**20))
    assert isinstance(failure, Failed)
    assert failure.code in ("out_of_memory", "tracking_failed")


def test_a_child_ends_when_its_parent_does(long_clip: Path) -> None:
    child = Child("app.jobs.tracker")
    child.send(TrackRequest(str(long_clip), clip_rig(), LIMITS))
    child.receive(PATIENCE_S)
    assert child.end() == 0
    idle = Child("app.jobs.media")
    idle.send(Limits(768 * 2**20))
    idle.send(ProbeRequest(str(long_clip)))
    idle.receive(PATIENCE_S)
    assert idle.end() == 0


def test_the_media_process_answers_one_request_after_the_other(clip: Path, tmp_path: Path) -> None:
    decoder = msgspec.msgpack.Decoder(FromMedia)
    bad = tmp_path / "bad.mp4"
    bad.write_bytes(b"no video")
    child = Child("app.jobs.media")
    try:
        child.send(Limits(768 * 2**20))
        child.send(ProbeRequest(str(clip)))
        probed = decoder.decode(child.receive(PATIENCE_S))
        assert isinstance(probed, Probed)
        assert (probed.width, probed.height, probed.frames) == (WIDTH, HEIGHT, 40)
        child.send(ProbeRequest(str(bad)))
        refused = decoder.decode(child.receive(PATIENCE_S))
        assert isinstance(refused, Failed)
        assert refused.code == "unreadable_video"
        child.send(PictureRequest(str(clip), 0.6, 92))
        picture = decoder.decode(child.receive(PATIENCE_S))
        assert isinstance(picture, Picture)
        assert frame_number(picture.jpeg) == 15
        child.send(PictureRequest(str(clip), 60.0, 92))
        assert isinstance(decoder.decode(child.receive(PATIENCE_S)), Failed)
    finally:
        child.end()


def test_exit_codes_are_described_in_words() -> None:
    assert "exit code 3" in describe_exit(3)
    assert "SIGSEGV" in describe_exit(-11)
    assert "memory" in describe_exit(-9)
    assert "signal 64" in describe_exit(-64)


def test_a_video_of_one_frame_is_a_track_of_one_row(tmp_path: Path) -> None:
    batch, end = track(make_clip(tmp_path / "one.mp4", 1))
    assert isinstance(batch, Batch)
    assert isinstance(end, Done)
    assert [row.distance_mm for row in batch.rows] == [0.0]
