"""The thread in which a tracker looks at the frames behind the odometry."""

from __future__ import annotations

import threading
from functools import partial
from pathlib import Path

import pytest
from builders import clip_rig, make_clip
from in_process import track

from app.jobs.messages import Limits
from app.jobs.track.in_order import InOrder
from app.jobs.track.messages import TrackRequest
from vo_core.errors import InvalidRig
from vo_core.mosaic.mosaic import Mosaic


def test_work_is_done_in_its_order() -> None:
    behind, done = InOrder(), list[int]()
    for number in range(50):
        behind.do(partial(done.append, number))
    behind.wait()
    assert done == list(range(50))


def test_nothing_is_done_after_what_failed_and_whoever_waits_learns_of_it() -> None:
    behind, may_go, done = InOrder(), threading.Event(), list[int]()

    def fail() -> None:
        may_go.wait()
        raise InvalidRig("as a test")

    behind.do(fail)
    behind.do(partial(done.append, 1))
    may_go.set()
    with pytest.raises(InvalidRig):
        behind.wait()
    with pytest.raises(InvalidRig):
        behind.wait()
    assert done == []


def test_a_wall_that_cannot_be_painted_ends_the_tracking_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise InvalidRig("as a test")

    monkeypatch.setattr(Mosaic, "add", fail)
    request = TrackRequest(str(make_clip(tmp_path / "clip.ts", 20)), clip_rig(), Limits(2**31))
    with pytest.raises(InvalidRig, match="as a test"):
        track(request)
