"""What the children do, as their parent sees it: most of it here, each as a process once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from builders import PATIENCE_S, RATE, clip_rig, frame_number, make_clip
from in_process import track

from app.jobs.messages import Limits, Problem
from app.jobs.process import Child, Refused, Stalled, describe_exit
from app.jobs.requests.media import PictureRequest, ProbeRequest
from app.jobs.track.batches import Batch
from app.jobs.track.messages import Checkpoint, TrackRequest
from app.jobs.track.tracker import Pace
from vo_core.errors import UnreadableVideo
from vo_core.video_info import VideoInfo

MOMENT_S = 0.3
LIMITS = Limits(768 * 2**20, 600)
"""The least that an operator may set."""


def request(video: Path, limits: Limits = LIMITS, pace: float | None = None) -> TrackRequest:
    return TrackRequest(str(video), clip_rig(), limits, pace)


def tracked(wanted: TrackRequest) -> tuple[list[Batch], Problem]:
    """The batches of a tracking process, and its answer."""
    found: list[Batch | Checkpoint] = []
    with Child("app.jobs.track.tracker") as child:
        problem = child.ask(
            wanted, Problem, stall_s=PATIENCE_S, part=Batch | Checkpoint, on_part=found.append
        )
        assert child.end() == 0
    return [each for each in found if isinstance(each, Batch)], problem


def test_every_frame_comes_once_and_each_picture_is_of_the_last_of_its_batch(clip: Path) -> None:
    batches, problem = tracked(request(clip))
    assert problem.sentence is None
    estimates = [each for batch in batches for each in batch.estimates]
    assert [each.frame for each in estimates] == list(range(40))
    assert estimates[0].time_s == 0
    assert [each.frame for each in batches.pop().smoothed] == list(range(40)), "all of them anew"
    for batch in batches:
        assert frame_number(batch.jpeg) == batch.estimates[-1].frame


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
    with pytest.raises(Refused) as refusal:
        tracked(request(path))
    assert refusal.value.code == "unreadable_video"


def test_a_child_short_of_memory_ends_without_a_hang(clip: Path) -> None:
    with pytest.raises(Refused) as refusal:
        tracked(request(clip, Limits(300 * 2**20)))
    assert refusal.value.code in ("out_of_memory", "tracking_failed")


def test_a_child_ends_when_its_parent_does(clip: Path) -> None:
    child = Child("app.jobs.track.tracker")
    child.send(request(clip, pace=0.5))
    child.receive(PATIENCE_S)
    assert child.end() == 0


def test_a_media_process_answers_until_it_hangs_and_waits_for_a_busy_processor(
    clip: Path, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.mp4"
    bad.write_bytes(b"no video")
    shown = PictureRequest(str(clip), 0.6, 92)
    with Child("app.jobs.requests.media") as child:
        child.send(Limits(768 * 2**20))
        info = child.ask(ProbeRequest(str(clip)), VideoInfo, stall_s=PATIENCE_S)
        assert info.frames == 40
        for wrong in (ProbeRequest(str(bad)), PictureRequest(str(clip), 60.0, 92)):
            with pytest.raises(Refused) as refusal:
                child.ask(wrong, bytes, stall_s=PATIENCE_S)
            assert refusal.value.code == "unreadable_video"
        assert frame_number(child.ask(shown, bytes, stall_s=PATIENCE_S)) == 15
        with a_busy_machine_for(child):
            assert child.ask(shown, bytes, stall_s=MOMENT_S)  # of seconds it gets a hundredth
        os.kill(child.pid, signal.SIGSTOP)
        with pytest.raises(Stalled):
            child.ask(shown, bytes, stall_s=MOMENT_S)
        assert not child.is_alive()


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


def test_a_video_of_one_frame_is_a_track_of_one_frame(tmp_path: Path) -> None:
    (batch, smoothed, answer), _ = track(request(make_clip(tmp_path / "one.mp4", 1)))
    assert isinstance(batch, Batch)
    assert isinstance(smoothed, Batch)
    assert isinstance(answer, Problem)
    assert [each.distance_mm for each in batch.estimates] == [0.0]
    assert [each.distance_mm for each in smoothed.smoothed] == [0.0]
