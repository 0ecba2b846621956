"""Splits a long film into chunks that are tracked at the same time, and joins their results.

Each chunk is tracked by a tracker of its own (`TrackRequest.frames`). It begins some time before
the frames that it contributes, because a track learns during its first metres, and consecutive
chunks share these frames. `join` gives what one run over the whole film would give. If the shared
frames do not tie two chunks, the earlier one goes on from its last checkpoint as far as `extended`
says: a robot may have stood still there, or the lens was under water.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple
from functools import partial

import msgspec
import numpy as np

from app.jobs.follow import wall_tile
from app.jobs.messages import (
    Batch,
    FrameRange,
    Gauged,
    Placed,
    Row,
    Seen,
    Standing,
    Tie,
    Tilted,
    WallTile,
)
from vo_core import Estimate, Rig, Track
from vo_core.geometry.stance import Stance
from vo_core.geometry.tilt import MountTilt
from vo_core.joints.finder import SAME_JOINT_MM
from vo_core.mosaic.layers import Shift, joined_tile, shift_of, touched
from vo_core.mosaic.mosaic import Layout
from vo_core.track import COLUMNS
from vo_core.track_join import Part, join_tilts, join_tracks

SHARED_FRAMES = 1500
"""Number of frames that two chunks share: a minute at 25 frames a second.

A crawler at 100 mm/s then drives 6 m, in which the later chunk learns (`track_join.WARM_UP`) and is
tied to the earlier one."""

LEAST_FRAMES = 6 * SHARED_FRAMES
"""Least number of frames of a chunk, so that less than a sixth of the work is done twice."""


class Chunk(msgspec.Struct, frozen=True):
    """Everything that a tracker found in a chunk, except for its wall."""

    frames: FrameRange
    rows: list[Row]
    ties: list[Tie]
    health: list[Gauged]
    sightings: list[Seen]
    tilt: Tilted
    stance: Standing
    start: Standing


class Joined(msgspec.Struct, frozen=True):
    """The results of a film that was tracked in chunks."""

    batch: Batch
    """As one run gives them; without pictures."""
    placed: list[Placed]
    """One for each chunk that contributes."""


def plan(frames: int | None, parts: int) -> list[FrameRange]:
    """Divide a film into at most `parts` chunks of about equal work.

    A film that is short, of an unknown length, or has marks (`parts.csv`) is tracked as a whole: a
    single range means that nothing is split.

    Args:
        frames: Number of frames, as the container states it; the last chunk has no end.
        parts: Number of trackers that are free.
    """
    most = max(((frames or 0) - SHARED_FRAMES) // (LEAST_FRAMES - SHARED_FRAMES), 1)
    count = max(min(parts, most), 1)
    if frames is None or count == 1:
        return [FrameRange(0, None, 0)]
    own = (frames - SHARED_FRAMES) / count
    # Even, because picture health is measured along and around the pipe by turns.
    firsts = [2 * round(number * own / 2) for number in range(count)]
    ends: list[int | None] = [first + SHARED_FRAMES for first in firsts[1:]]
    return [
        FrameRange(first, end, SHARED_FRAMES)
        for first, end in zip(firsts, [*ends, None], strict=True)
    ]


def extended(ranges: Sequence[FrameRange], part: int) -> list[FrameRange]:
    """Let chunk `part` reach further into the next one, or to its end instead of it.

    It shares twice as many frames each time. `part` is that of an `UndeterminedSeam`.
    """
    one, other = ranges[part : part + 2]
    assert one.end is not None  # noqa: S101  (only the last chunk has no end)
    end = 2 * one.end - other.first
    before, after = ranges[:part], ranges[part + 2 :]
    if other.end is not None and end >= other.end:
        return [*before, msgspec.structs.replace(one, end=other.end), *after]
    return [*before, msgspec.structs.replace(one, end=end), other, *after]


def gather(frames: FrameRange, batches: Iterable[Batch]) -> Chunk:
    """Collect all results of a tracker of these frames."""
    found = list(batches)
    last = found[-1]
    assert last.tilt is not None  # noqa: S101  (a chunk states it, and the next two)
    assert last.stance is not None  # noqa: S101
    assert last.start is not None  # noqa: S101
    return Chunk(
        frames,
        [row for batch in found for row in batch.rows],
        [tie for batch in found for tie in batch.ties],
        [each for batch in found for each in batch.health],
        [seen for batch in found for seen in batch.sightings],
        last.tilt,
        last.stance,
        last.start,
    )


def join(chunks: Sequence[Chunk], rig: Rig) -> Joined:
    """Join the results of the chunks of a film, in the order of its frames.

    Raises:
        UndeterminedSeam: The shared frames do not tie two chunks; see `extended`.
    """
    chunks = _up_to_the_end(chunks)
    parts = [_part(chunk) for chunk in chunks]
    joined = join_tracks(parts, rig)
    firsts = [0, *(seam.frame for seam in joined.seams)]
    health = [
        each
        for chunk, first, end in zip(chunks, firsts, [*firsts[1:], None], strict=True)
        for each in chunk.health
        if first <= each.frame and (end is None or each.frame < end)
    ]
    sightings = chunks[0].sightings
    for chunk, first in zip(chunks[1:], firsts[1:], strict=True):
        sightings = _merged(sightings, chunk.sightings, first, joined.track)
    batch = Batch(
        _rows(joined.track),
        b"",
        health=health,
        sightings=sightings,
        tilt=_tilt(chunks, firsts, rig),
        stance=chunks[0].stance,
    )
    origin, layout = _stance(chunks[0].stance), Layout.of(rig)
    placed = [Placed(0, 0.0, 0.0, 0, 0)]
    for part, seam in zip(parts[1:], joined.seams, strict=True):
        shift = shift_of(rig, layout, seam, start=part.start, origin=origin)
        placed.append(Placed(seam.frame, seam.x_mm, seam.sigma_mm, shift.columns, shift.rows))
    return Joined(batch, placed)


def join_walls(
    placed: Sequence[Placed],
    rig: Rig,
    indices: Sequence[Iterable[int]],
    read: Callable[[int, int], bytes | None],
) -> Iterator[WallTile]:
    """Yield the tiles of the joined wall, one after the other; only a few are in memory.

    It decodes pictures, so it belongs into a child process.

    Args:
        placed: Of the chunks that contribute, see `join`.
        rig: Camera, mount and pipe.
        indices: Of each chunk, the indices of its layers.
        read: Returns the layer of a chunk with an index; None if there is none.
    """
    layout = Layout.of(rig)
    shifts = [Shift(each.columns, each.rows) for each in placed]
    wanted = {
        index
        for shift, own in zip(shifts, indices, strict=False)
        for each in own
        for index in touched(layout, shift, each)
    }
    layers = [(shift, partial(read, number)) for number, shift in enumerate(shifts)]
    for index in sorted(wanted):
        picture = joined_tile(rig, layout, index, layers)
        if picture is not None:
            yield wall_tile(index, picture)


def _up_to_the_end(chunks: Sequence[Chunk]) -> Sequence[Chunk]:
    """Leave out the chunks after one in which the film has ended."""
    for number, chunk in enumerate(chunks):
        end = chunk.rows[-1].frame + 1 if chunk.rows else chunk.frames.first
        if chunk.frames.end is None or end < chunk.frames.end:
            return chunks[: number + 1]
    return chunks


def _part(chunk: Chunk) -> Part:
    track = Track.from_estimates(Estimate(*msgspec.structs.astuple(row)) for row in chunk.rows)
    ties = [msgspec.structs.astuple(tie) for tie in chunk.ties]
    _, systematic_mm, bed_mm, pictures = np.array(ties, np.float64).reshape(-1, 4).T
    return Part(track, systematic_mm, bed_mm, pictures.astype(np.int64), _stance(chunk.start))


def _stance(standing: Standing) -> Stance:
    return Stance(*msgspec.structs.astuple(standing))


def _tilt(chunks: Sequence[Chunk], firsts: Sequence[int], rig: Rig) -> Tilted:
    """Combine the tilts of chunks whose own frames begin at `firsts`."""
    ends = [*firsts[1:], chunks[-1].rows[-1].frame + 1]
    own = [end - first for first, end in zip(firsts, ends, strict=True)]
    shares = [number / len(chunk.rows) for number, chunk in zip(own, chunks, strict=True)]
    tilts = [MountTilt(*msgspec.structs.astuple(chunk.tilt)) for chunk in chunks]
    return Tilted(*astuple(join_tilts(tilts, shares, rig)))


def _rows(track: Track) -> list[Row]:
    columns = (getattr(track, name).tolist() for name in COLUMNS)
    return [Row(*values) for values in zip(*columns, strict=True)]


def _merged(before: list[Seen], after: list[Seen], first: int, track: Track) -> list[Seen]:
    """Take each joint once, from the chunk that contributes the frame in which it is nearest.

    Near the seam one chunk may see a joint best just before it, and the other one just after it.
    """
    kept, replaced = [], set()
    for seen in after:
        twin = next((each for each in before if _is_same(each, seen, track)), None)
        if twin is not None and twin.frame >= first:
            replaced.add(twin)
        if twin.frame >= first if twin is not None else seen.frame >= first:
            kept.append(seen)
    return [each for each in before if each.frame < first and each not in replaced] + kept


def _is_same(one: Seen, other: Seen, track: Track) -> bool:
    """Whether two sightings are of one joint, in one passing of it."""
    first, last = sorted((one.frame, other.frame))
    if last >= len(track):
        return False
    way_mm = track.distance_mm[first : last + 1]
    apart_mm = way_mm[0 if one.frame == first else -1] + one.ahead_mm
    apart_mm -= way_mm[-1 if one.frame == first else 0] + other.ahead_mm
    return bool(np.ptp(way_mm) < SAME_JOINT_MM and abs(apart_mm) < SAME_JOINT_MM)
