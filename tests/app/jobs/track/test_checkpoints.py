"""A tracker that goes on from a checkpoint of another one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import accumulate
from pathlib import Path

import av
import cv2
import msgspec
import numpy as np
from builders import HEIGHT, RATE, WIDTH, clip_rig, make_clip
from in_process import batch_of, track

from app.jobs.messages import Limits, Problem, encode
from app.jobs.track.batches import Batch, Tie, entry_of
from app.jobs.track.follow import Follower
from app.jobs.track.messages import Checkpoint, FrameRange, KeptCheckpoint, TrackRequest
from vo_core import Estimate, Rig
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting
from vo_core.sources import Frame, VideoFile, frame_of

LIMITS = Limits(1536 * 2**20, 600)
FRAMES = 80


class Found:
    """The messages of a tracker about a video, in order."""

    def __init__(self) -> None:
        self.rows: list[Estimate] = []
        self.smoothed: list[Estimate] = []
        self.health: list[tuple[int, Health]] = []
        self.sightings: list[Sighting] = []
        self.tiles: dict[int, bytes] = {}
        self.ties: list[Tie] = []
        self.layers: dict[int, bytes] = {}

    def take(self, batch: Batch) -> None:
        self.rows += batch.estimates
        self.smoothed += batch.smoothed
        self.health += batch.health
        self.sightings += batch.sightings
        self.tiles |= {tile.index: tile.content for tile in batch.tiles}
        self.ties += batch.ties
        self.layers |= {layer.index: layer.content for layer in batch.layers}


def follow(request: TrackRequest, found: Found, *, leave_at: int | None = None) -> KeptCheckpoint:
    """Collect all messages of a tracker; with `leave_at` only up to a checkpoint after it.

    Write the newest checkpoint and a journal beside the video.
    """
    journal, newest = bytearray(), KeptCheckpoint("", 0, Checkpoint(0, 0.0, b""))
    for message in track(request, leave_at=leave_at)[0]:
        match message:
            case Batch() as batch:
                found.take(batch)
                journal += entry_of(batch)
            case Checkpoint() as checkpoint:
                newest = KeptCheckpoint("", len(journal), checkpoint)
            case Problem() as end:
                assert end.sentence is None
    folder = Path(request.video).parent
    (folder / "journal").write_bytes(journal)
    (folder / "checkpoint").write_bytes(encode(newest))
    return newest


def going_on(request: TrackRequest) -> TrackRequest:
    """From what was written last beside the video."""
    folder = Path(request.video).parent
    return msgspec.structs.replace(
        request, checkpoint=str(folder / "checkpoint"), journal=str(folder / "journal")
    )


def uneven_clip(path: Path) -> Path:
    """With frames that are shown before others that come first in the file, at uneven times."""
    steps_s = (1.5 / RATE if n % 7 == 0 else 0.9 / RATE for n in range(FRAMES - 1))
    return make_clip(path, FRAMES, times_s=list(accumulate(steps_s, initial=0.0)), bf="3")


def test_what_goes_on_from_a_checkpoint_finds_the_same_to_the_bit(tmp_path: Path) -> None:
    request = TrackRequest(str(uneven_clip(tmp_path / "clip.ts")), clip_rig(), LIMITS)
    whole, parts = Found(), Found()
    follow(request, whole)
    at_pace = msgspec.structs.replace(request, pace=1.0)  # there is time for a checkpoint
    checkpoint = follow(at_pace, parts, leave_at=30).checkpoint
    assert [row.frame for row in parts.rows] == list(range(checkpoint.frames))
    later = follow(going_on(request), parts).checkpoint
    for rows in (whole.rows, whole.smoothed):
        assert [row.frame for row in rows] == list(range(FRAMES))
    assert vars(parts) == vars(whole)
    assert later.frames == 0 or later.cpu_s > checkpoint.cpu_s


def test_a_chunk_has_the_frames_of_the_film_and_goes_on_after_its_end(tmp_path: Path) -> None:
    video = str(uneven_clip(tmp_path / "clip.ts"))
    frames = FrameRange(30, 80, 15)
    request = TrackRequest(video, clip_rig(), LIMITS, frames=frames)
    found = Found()
    checkpoint = follow(request, found).checkpoint
    with VideoFile(video) as film:
        shown = list(film)
    follower = Follower(Rig.parse(clip_rig()), frames=frames)
    for frame in shown[30:80]:
        follower.add(frame)
    batch = batch_of(follower)
    assert found.rows == batch.estimates
    assert found.ties == batch.ties
    assert [tie.picture > 0 for tie in found.ties] == [True] * 15 + [False] * 20 + [True] * 15
    assert len(found.layers) > 0
    assert found.tiles == {}
    assert checkpoint.frames == 80

    longer = msgspec.structs.replace(request, frames=FrameRange(30, 95, 15))
    at_once = Found()
    found.smoothed.clear()  # as the journal ends at the checkpoint
    follow(going_on(longer), found)
    follow(longer, at_once)
    assert found.smoothed == at_once.smoothed
    assert found.rows == at_once.rows
    assert found.health == at_once.health
    assert found.layers == at_once.layers


def barred_frames(count: int) -> Iterator[Frame]:
    """A floor with a dark joint every 500 px that passes by, 16 px a frame."""
    rng = np.random.default_rng(3)
    noise = rng.integers(0, 256, (HEIGHT, WIDTH + 16 * count), np.uint8)
    floor = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 2), None, 60, 225, cv2.NORM_MINMAX)
    for left in range(300, floor.shape[1], 500):
        floor[:, left : left + 6] //= 4
    for n in range(count):
        grey = np.ascontiguousarray(floor[:, 16 * n : 16 * n + WIDTH], np.uint8)
        picture = av.VideoFrame.from_ndarray(grey, format="gray")
        yield frame_of(picture, n, n / RATE)


def test_a_follower_made_of_a_state_sees_joints_and_wall_as_the_one_before() -> None:
    before, after = (Follower(Rig.parse(clip_rig())) for _ in range(2))
    whole, parts, evidence = Found(), Found(), bytearray()
    # Each has its own frames, as a frame is used by one thread at a time.
    for frame, same in zip(barred_frames(110), barred_frames(110), strict=True):
        if frame.index % 9 == 0 and frame.index > 0:  # joints and tiles are under way each time
            whole.take(batch_of(before))
            parts.take(batch_of(after))
            evidence += after.evidence().content
            after = Follower.from_state(after.state(), evidence)
        before.add(frame)
        after.add(same)
    for follower, found in ((before, whole), (after, parts)):
        follower.finish()
        found.take(batch_of(follower))
    assert len(whole.sightings) >= 2
    assert len(whole.tiles) >= 2
    assert vars(parts) == vars(whole)
