"""The tracking process: runs one video through the odometry and returns poses and small pictures.

It writes no file and opens only the video and its checkpoint; its parent stores the results.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from itertools import dropwhile, islice, takewhile
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import MAX_MESSAGE_BYTES, Problem
from app.jobs.track import parts
from app.jobs.track.messages import (
    Checkpoint,
    KeptCheckpoint,
    Passing,
    TrackRequest,
    Untracked,
)
from app.jobs.track.parts import Numbered

if TYPE_CHECKING:
    from app.jobs.track.follow import Follower
    from vo_core.sources import VideoFile

BATCH_S = 1 / 15
"""Shortest time between batches with a picture."""
_LONGEST_PAUSE_S = 1.0
"""Longest pause between frames: longer silence is taken for a hang."""
_PASSING_S = 1.0
_CHECKPOINT_S = (0.5, 30.0)
"""Shortest and longest time between two checkpoints; their cost may make it longer."""
_REDONE = 1 / 20
"""Share of the work that a crash may lose."""
_CHECKPOINT_COST = 1 / 100
"""Largest share of time spent on checkpoints."""
_UNTRACKED_AT_ONCE = 500
"""Rows of a batch without poses."""
_MOST_STATE_BYTES = MAX_MESSAGE_BYTES - 1024


def track(request: TrackRequest, parent: Parent) -> Problem:
    """Track a film."""
    # Imported here so that the decoders are loaded under the limits.
    from app.jobs.track.follow import Follower
    from vo_core import Rig, VideoFile

    if request.untracked is not None:
        with VideoFile(request.video) as video:
            return _untracked(video, request.untracked, parent)
    if request.checkpoint is None:
        begun = Checkpoint(request.frames.first if request.frames else 0, 0.0, b"")
        follower = Follower(Rig.parse(request.rig), frames=request.frames)
    else:
        begun, evidence = _read(Path(request.checkpoint), Path(request.journal or ""))
        follower = Follower.from_state(begun.state, evidence)
        if request.frames is not None:
            follower.reach(request.frames)
    with follower, VideoFile(request.video) as video:
        return _followed(video, follower, begun, request, parent)


def _untracked(video: VideoFile, rest: Untracked, parent: Parent) -> Problem:
    """Send a lost row for each frame of the rest of a film."""
    from app.jobs.track.batches import Batch
    from app.jobs.track.rows import Rows, at_rest
    from vo_core.track import Estimate

    frames = dropwhile(lambda frame: frame.index < rest.first, video.read_ahead())
    times = ((frame.index, frame.t_s) for frame in frames)
    last = None if rest.last is None else Estimate(**rest.last)
    while some := list(islice(times, _UNTRACKED_AT_ONCE)):
        last = last or at_rest(*some[0])
        parent.send(Batch(Rows(last, None).leave_out(some)))
    return Problem(video.problem)


def _followed(
    video: VideoFile, follower: Follower, begun: Checkpoint, request: TrackRequest, parent: Parent
) -> Problem:
    """Track the frames of a film from a checkpoint on."""
    chunk, end = request.frames, begun.frames
    checkpoints = _Checkpoints(parent, begun.cpu_s)
    pace = None if request.pace is None else Pace(request.pace)
    sent_at = 0.0
    for found in _from(end, _numbered(video, request, parent), parent):
        frame = found.frame
        # Sent before the frame is added, so that the last batch contains a frame.
        if time.monotonic() - sent_at >= BATCH_S:
            _send(follower, parent)
            checkpoints.make_if_due(follower, end)
            sent_at = time.monotonic()
        if found.between or found.left_out:
            follower.begin_part(found.between)
        follower.add(frame, found.left_out)
        if pace is not None:
            time.sleep(pace.pause_s(frame.t_s, time.monotonic()))
        end = frame.index + 1
    follower.leave_out(parts.left_out_after(request.marks, end))
    if chunk is not None and end == chunk.end:
        # From here the chunk goes on if its frames do not tie it to the next one.
        _send(follower, parent)
        checkpoints.make(follower, end)
    follower.finish()
    _send(follower, parent)
    for batch in parent.wait_for(follower.smoothed, Passing(end)):
        parent.send(batch)
    return Problem(video.problem)


def _read(checkpoint: Path, journal: Path) -> tuple[Checkpoint, bytearray]:
    """Return a checkpoint, and the evidence of the frames before it."""
    from app.jobs.track.batches import evidence_of

    kept = msgspec.msgpack.decode(checkpoint.read_bytes(), type=KeptCheckpoint)
    with journal.open("rb") as content:
        return kept.checkpoint, evidence_of(content, kept.journal_bytes)


def _numbered(video: VideoFile, request: TrackRequest, parent: Parent) -> Iterator[Numbered]:
    """Yield the frames to track, and possibly some before them."""
    chunk = request.frames
    if chunk is None:
        return parts.numbered(video.read_ahead(), request.marks)
    # A checkpoint, too, is reached from here: frames that cannot be decoded have no number,
    # although the packets announce them.
    parent.wait_for(partial(video.seek_frame, chunk.first), Passing(0))
    return (Numbered(frame) for frame in takewhile(chunk.holds, video.read_ahead()))


def _from(first: int, frames: Iterator[Numbered], parent: Parent) -> Iterator[Numbered]:
    """Yield the frames from this number on; earlier ones are decoded too, as later ones refer to
    them.
    """
    reported_s = time.monotonic()
    for found in frames:
        if found.frame.index >= first:
            yield found
        elif time.monotonic() - reported_s >= _PASSING_S:
            parent.send(Passing(found.frame.index))
            reported_s = time.monotonic()


def _send(follower: Follower, parent: Parent) -> None:
    evidence = follower.evidence()
    follower.hand_on(lambda batch: parent.send(msgspec.structs.replace(batch, evidence=evidence)))


class _Checkpoints:
    """Sends a checkpoint when it is worth its cost."""

    def __init__(self, parent: Parent, spent_cpu_s: float) -> None:
        """Start with `spent_cpu_s`, the processor time of the processes before this one."""
        self._parent = parent
        self._spent_cpu_s = spent_cpu_s
        self._begun_s: float | None = None
        self._due_s = 0.0

    def make_if_due(self, follower: Follower, frames: int) -> None:
        """Send a checkpoint if it is due, right after a batch, when `frames` are tracked."""
        least_s, most_s = _CHECKPOINT_S
        started_s = time.monotonic()
        if self._begun_s is None:
            self._begun_s, self._due_s = started_s, started_s + least_s
        if started_s < self._due_s:
            return
        self.make(follower, frames)
        now = time.monotonic()
        pause_s = min(max(_REDONE * (now - self._begun_s), least_s), most_s)
        self._due_s = now + max(pause_s, (now - started_s) / _CHECKPOINT_COST)

    def make(self, follower: Follower, frames: int) -> None:
        """Send a checkpoint right after a batch, when `frames` are tracked."""
        state = follower.state()
        # A state too long for a message is not sent; an earlier checkpoint is good enough.
        if len(state) <= _MOST_STATE_BYTES:
            cpu_s = self._spent_cpu_s + time.process_time()
            self._parent.send(Checkpoint(frames, cpu_s, state))


class Pace:
    """Limits tracking to so many seconds of video per second."""

    def __init__(self, pace: float) -> None:
        self._pace = pace
        self._first: tuple[float, float] | None = None
        """Clock and time of the first frame."""

    def pause_s(self, t_s: float, now_s: float) -> float:
        """Return how long to wait after the frame of this time, when the clock shows `now_s`."""
        begun_s, first_s = self._first = self._first or (now_s, t_s)
        ahead_s = (t_s - first_s) / self._pace - (now_s - begun_s)
        return min(max(ahead_s, 0.0), _LONGEST_PAUSE_S)


def main() -> None:
    """Answer the one request."""
    serve(
        TrackRequest,
        track,
        named="Tracking",
        reads=lambda request: [request.video, *filter(None, [request.checkpoint, request.journal])],
    )


if __name__ == "__main__":
    main()
