"""A film that is tracked in chunks has the results of one run over it, uncertainty included."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import av
import cv2
import msgspec
import numpy as np
import pytest
from films import film, half_sized
from in_process import batch_of

from app.jobs.messages import encode
from app.jobs.track import chunks
from app.jobs.track.batches import Batch
from app.jobs.track.chunks import Chunk, Joined, gather, join, join_walls, mended, plan
from app.jobs.track.follow import Follower
from app.jobs.track.messages import FrameRange
from app.lab.simulation import SCENARIOS, RenderedFrame
from vo_core import Estimate
from vo_core.errors import UndeterminedSeam
from vo_core.image.health import Health
from vo_core.sources import Frame, frame_of

SHARED = 140
CLOSE_MM = 0.25
"""Largest difference of the distances; tracks by other keyframes differ by half of it.

A seam that is wrong by one frame moves what follows by 25 mm."""

DRIVE = replace(
    SCENARIOS["nominal"],
    rig=half_sized(half_sized(SCENARIOS["nominal"])).rig,
    seed=3,
    length_mm=7600.0,
    speed_mm_s=750.0,
    acceleration_mm_s2=3000.0,
    legs=(0.52, 0.48),
    rest_s=0.8,
)
"""A drive with a stop in its middle, in pictures of a quarter of the size."""


def frames_of(frames: Sequence[RenderedFrame], black: Iterable[int] = ()) -> list[Frame]:
    """Return the film, with some frames in which nothing shows."""
    hidden = set(black)

    def frame(each: RenderedFrame) -> Frame:
        image = np.zeros_like(each.image) if each.index in hidden else each.image
        return frame_of(av.VideoFrame.from_ndarray(image, format="gray"), each.index, each.t_s)

    return [frame(each) for each in frames]


def followed(film: Sequence[Frame], frames: FrameRange | None = None) -> list[Batch]:
    """Return what a tracker of these frames sends."""
    follower = Follower(DRIVE.rig, frames=frames)
    batches: list[Batch] = []
    for frame in film[frames.first if frames else 0 : frames.end if frames else None]:
        follower.add(frame)
        if frame.index % 40 == 39:
            batches.append(batch_of(follower))
    follower.finish()
    batches.append(batch_of(follower))
    return batches


class Tracked:
    """A film, tracked as a whole and in chunks."""

    def __init__(self, film: Sequence[Frame], ranges: Sequence[FrameRange]) -> None:
        self.film = film
        whole = followed(film)
        self.rows = [each for batch in whole for each in batch.estimates]
        self.whole = whole[-1]
        self.health = [each for batch in whole for each in batch.health]
        self.sightings = [seen for batch in whole for seen in batch.sightings]
        self.tiles = {tile.index: tile.content for batch in whole for tile in batch.tiles}
        batches = [followed(film, frames) for frames in ranges]
        self.chunks = [
            sent(gather(frames, found)) for frames, found in zip(ranges, batches, strict=True)
        ]
        self.layers = [
            {layer.index: layer.content for batch in found for layer in batch.layers}
            for found in batches
        ]


def sent(chunk: Chunk) -> Chunk:
    return msgspec.msgpack.decode(encode(chunk), type=Chunk)


@pytest.fixture(scope="module")
def drive() -> list[RenderedFrame]:
    return film(DRIVE)


@pytest.fixture(scope="module")
def tracked(drive: list[RenderedFrame]) -> Tracked:
    """The robot stands still at the end of the first chunk; the second one ends in the dark."""
    x_mm = np.array([frame.x_mm for frame in drive])
    standing = int(np.flatnonzero(np.abs(x_mm - x_mm[len(drive) // 2]) < 1).mean())
    second = standing - SHARED // 2
    ranges = [
        FrameRange(0, standing, SHARED),
        FrameRange(standing - SHARED, second + 2 * SHARED, SHARED),
        FrameRange(second + SHARED, None, SHARED),
    ]
    dark = range(second + 2 * SHARED - 6, second + 2 * SHARED + 3)
    return Tracked(frames_of(drive, dark), ranges)


@pytest.fixture(scope="module")
def joined(tracked: Tracked) -> Joined:
    return join(tracked.chunks, DRIVE.rig)


def column(rows: Iterable[Estimate | Health], name: str) -> np.ndarray:
    return np.array([getattr(row, name) for row in rows], np.float64)


def test_joined_track_is_the_serial_one_within_its_sigma_interval_included(
    tracked: Tracked, joined: Joined
) -> None:
    rows = joined.batch.estimates
    assert [(row.frame, row.time_s) for row in rows] == [
        (row.frame, row.time_s) for row in tracked.rows
    ]
    first = joined.placed[1].first
    assert rows[:first] == tracked.rows[:first]
    off_mm = column(rows, "distance_mm") - column(tracked.rows, "distance_mm")
    sigma_mm = column(tracked.rows, "sigma_registration_mm")
    assert np.abs(off_mm).max() < CLOSE_MM
    assert np.all(np.abs(off_mm) <= sigma_mm)
    for name in ("sigma_registration_mm", "sigma_distance_mm"):
        ratio = column(rows, name)[first:] / column(tracked.rows, name)[first:]
        assert ratio.min() > 0.9, name
        assert ratio.max() < 1.1, name
    for name, close in {"y_mm": 1.0, "yaw_deg": 0.3, "z_mm": 0.1, "roll_deg": 0.8}.items():
        assert np.abs(column(rows, name) - column(tracked.rows, name)).max() < close, name
    assert [row.status for row in rows] == [row.status for row in tracked.rows]


def test_joints_health_tilt_and_stance_are_those_of_one_run(
    tracked: Tracked, joined: Joined
) -> None:
    batch = joined.batch

    def joints(rows: list[Estimate], batch: Batch | Tracked) -> list[float]:
        return sorted(rows[s.frame].distance_mm + s.ahead_mm for s in batch.sightings)

    assert joints(batch.estimates, batch) == pytest.approx(joints(tracked.rows, tracked), abs=0.5)
    health, other = (dict(each.health) for each in (batch, tracked))
    assert list(health) == list(other)
    for name in ("overlap", "brightness", "overexposed", "fixed_pattern"):
        off = column(health.values(), name) - column(other.values(), name)
        assert np.abs(off).max() < 0.02, name
    assert batch.initial_pose == tracked.whole.initial_pose
    assert batch.tilt is not None
    assert tracked.whole.tilt is not None
    assert batch.tilt.pitch_deg == pytest.approx(tracked.whole.tilt.pitch_deg, abs=0.02)
    assert batch.tilt.roll_sigma_deg == pytest.approx(tracked.whole.tilt.roll_sigma_deg, rel=0.1)


def test_the_joined_wall_shows_every_part_of_the_wall_where_one_run_shows_it(
    tracked: Tracked, joined: Joined
) -> None:
    tiles = list(
        join_walls(joined.placed, DRIVE.rig, tracked.layers, lambda c, k: tracked.layers[c].get(k))
    )
    assert {tile.index for tile in tiles} == set(tracked.tiles)
    for tile in tiles:
        one, other = (_fine(jpeg) for jpeg in (tile.content, tracked.tiles[tile.index]))
        (along_px, around_px), _ = cv2.phaseCorrelate(one, other)
        # Half a pixel by whole pixels, and what a pixel of sway makes.
        assert abs(along_px) < 0.75, tile.index
        assert abs(around_px) < 1.5, tile.index


def _fine(jpeg: bytes) -> np.ndarray:
    grey = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE).astype(np.float32)
    return grey - cv2.GaussianBlur(grey, (0, 0), 8)


def test_a_chunk_gets_its_numbers_by_the_times_of_its_frames(
    tracked: Tracked, joined: Joined
) -> None:
    one, other, last = tracked.chunks
    found = join([one, misnumbered(other, 1), last], DRIVE.rig)
    assert found == joined


def misnumbered(chunk: Chunk, by: int) -> Chunk:
    """Return a chunk that counts frames which cannot be decoded."""
    moved: dict[str, Any] = {
        name: [replace(each, frame=each.frame + by) for each in getattr(chunk, name)]
        for name in ("estimates", "sightings")
    }
    moved["ties"] = [msgspec.structs.replace(each, frame=each.frame + by) for each in chunk.ties]
    moved["health"] = [(frame + by, health) for frame, health in chunk.health]
    end = None if chunk.frames.end is None else chunk.frames.end + by
    frames = msgspec.structs.replace(chunk.frames, end=end)
    return msgspec.structs.replace(chunk, frames=frames, **moved)


def test_a_chunk_that_shows_other_pictures_is_not_joined(tracked: Tracked) -> None:
    one, other, _ = tracked.chunks
    late = [
        msgspec.structs.replace(tie, picture=before.picture) for before, tie in pairwise(other.ties)
    ]
    decoded_otherwise = list(other.ties)
    decoded_otherwise[3] = msgspec.structs.replace(other.ties[3], picture=1)
    for ties in ([other.ties[0], *late], decoded_otherwise):
        with pytest.raises(UndeterminedSeam, match="different pictures"):
            join([one, msgspec.structs.replace(other, ties=ties)], DRIVE.rig)


def test_chunks_that_share_too_little_say_which_one_must_go_on(tracked: Tracked) -> None:
    one, other, last = tracked.chunks
    short = msgspec.structs.replace(one, estimates=one.estimates[:-105], ties=one.ties[:-105])
    short = msgspec.structs.replace(
        short, frames=msgspec.structs.replace(one.frames, end=len(short.estimates))
    )
    with pytest.raises(UndeterminedSeam) as error:
        join([short, other, last], DRIVE.rig)
    assert error.value.part == 0


def test_a_chunk_in_which_the_camera_looks_around_gives_only_what_comes_after_it(
    tracked: Tracked,
) -> None:
    one, other, last = tracked.chunks
    rows = [
        replace(row, looking_around=float(n == len(other.estimates) - 30))
        for n, row in enumerate(other.estimates)
    ]
    with pytest.raises(UndeterminedSeam) as error:
        join([one, msgspec.structs.replace(other, estimates=rows), last], DRIVE.rig)
    assert error.value.part == 0


def test_chunks_after_the_end_of_a_film_count_for_nothing(tracked: Tracked) -> None:
    one, other, _ = tracked.chunks
    longer = FrameRange(other.frames.first, 10**6, SHARED)
    beyond = FrameRange(10**6 - SHARED, None, SHARED)
    found = join(
        [
            one,
            msgspec.structs.replace(other, frames=longer),
            msgspec.structs.replace(other, estimates=[], ties=[], frames=beyond),
        ],
        DRIVE.rig,
    )
    assert found.batch.estimates[-1].frame == other.estimates[-1].frame
    assert len(found.placed) == 2


def test_short_films_are_not_split_and_long_ones_into_equal_work() -> None:
    assert plan(None, 4) == plan(chunks.LEAST_FRAMES, 4) == [FrameRange(0, None, 0)]
    assert plan(10**6, 1) == [FrameRange(0, None, 0)]
    for frames in (2 * chunks.LEAST_FRAMES, 180_000):
        ranges = plan(frames, 5)
        ends = [frames if each.end is None else each.end for each in ranges]
        work = [end - each.first for each, end in zip(ranges, ends, strict=True)]
        assert max(work) - min(work) <= 4
        assert min(work) >= chunks.LEAST_FRAMES - 4
        for before, after in zip(ends, ranges[1:], strict=False):
            assert before - after.first == chunks.SHARED_FRAMES
    assert len(plan(180_000, 5)) == 5


def test_a_chunk_goes_on_into_the_next_one_and_at_last_replaces_it() -> None:
    ranges = [FrameRange(0, 50, 10), FrameRange(40, 90, 10), FrameRange(80, None, 10)]
    further = [FrameRange(0, 60, 10), *ranges[1:]]
    assert mended(ranges, 0) == further
    assert mended(further, 0) == [FrameRange(0, 80, 10), *ranges[1:]]
    covers = [FrameRange(0, 90, 10), ranges[2]]
    assert mended([FrameRange(0, 80, 10), *ranges[1:]], 0) == covers


def test_later_chunks_are_told_what_an_earlier_one_has_seen_of_the_film(tracked: Tracked) -> None:
    one, other, last = tracked.chunks
    coarse = [msgspec.structs.replace(tie, is_coarse=tie.frame > 5) for tie in one.ties]
    with pytest.raises(UndeterminedSeam) as error:
        join([msgspec.structs.replace(one, ties=coarse), other, last], DRIVE.rig)
    ranges = mended([chunk.frames for chunk in tracked.chunks], error.value.part, error.value.lacks)
    assert [each.is_coarse for each in ranges] == [False, True, True]
    assert {each.name for each in ranges}.isdisjoint({other.frames.name, last.frames.name})
    assert [each.end for each in ranges] == [chunk.frames.end for chunk in tracked.chunks]
    (batch,) = followed(tracked.film[:3], msgspec.structs.replace(ranges[1], first=0))
    assert all(tie.is_coarse for tie in batch.ties)
