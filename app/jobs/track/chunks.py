"""Splits a long film into chunks that are tracked at the same time, and joins their results.

Each chunk is tracked by a tracker of its own (`TrackRequest.frames`). It begins some time before
the frames that it contributes, because a track learns during its first metres, and consecutive
chunks share these frames. `join` gives what one run over the whole film would give. If it cannot,
because a robot stood still there or the lens was under water, `mended` says what to track further.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from app.jobs.track.batches import Batch, Tie, WallPicture
from app.jobs.track.messages import FrameRange, Placed
from vo_core import Estimate, Rig, Track
from vo_core.geometry.initial_pose import InitialPose
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.sightings import SAME_JOINT_MM, Sighting
from vo_core.mosaic.layout import Layout
from vo_core.track import COLUMNS

if TYPE_CHECKING:
    from vo_core.track_join import Part

SHARED_FRAMES = 1500
"""Number of frames that two chunks share: a minute at 25 frames a second.

A crawler at 100 mm/s then drives 6 m, in which the later chunk learns (`track_join.WARM_UP`) and is
tied to the earlier one."""

LEAST_FRAMES = 6 * SHARED_FRAMES
"""Least number of frames of a chunk, so that less than a sixth of the work is done twice."""


class Chunk(msgspec.Struct, frozen=True):
    """Everything that a tracker found in a chunk, except for its wall."""

    frames: FrameRange
    estimates: list[Estimate]
    ties: list[Tie]
    health: list[tuple[int, Health]]
    sightings: list[Sighting]
    tilt: MountTilt
    initial_pose: InitialPose
    start: InitialPose


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


def mended(ranges: Sequence[FrameRange], part: int, lacks: Sequence[str] = ()) -> list[FrameRange]:
    """Return other ranges for a film whose chunks could not be joined.

    Either chunk `part` reaches further, and goes on from its last checkpoint: it shares twice as
    many frames, or replaces the next chunk.  Or all later chunks are told what it has seen of the
    film, and are tracked again.  A chunk whose range is the same stays as it is. At the worst a
    single chunk is left.

    Args:
        ranges: The ranges that were tracked.
        part, lacks: Those of the `UndeterminedSeam`.
    """
    before, (one, other), after = ranges[:part], ranges[part : part + 2], ranges[part + 2 :]
    if lacks:
        told = dict.fromkeys(lacks, True)
        return [*before, one, *(msgspec.structs.replace(each, **told) for each in (other, *after))]
    assert one.end is not None  # noqa: S101  (only the last chunk has no end)
    end = 2 * one.end - other.first
    if other.end is not None and end >= other.end:
        return [*before, msgspec.structs.replace(one, end=other.end), *after]
    return [*before, msgspec.structs.replace(one, end=end), other, *after]


def gather(frames: FrameRange, batches: Iterable[Batch]) -> Chunk:
    """Collect all results of a tracker of these frames; unless it was stopped, smoothed ones."""
    found = list(batches)
    last = next(batch for batch in reversed(found) if not batch.smoothed)
    assert last.tilt is not None  # noqa: S101  (a chunk states it, and the next two)
    assert last.initial_pose is not None  # noqa: S101
    assert last.start is not None  # noqa: S101
    rows = [each for batch in found for each in batch.estimates]
    smoothed = [each for batch in found for each in batch.smoothed]
    return Chunk(
        frames,
        smoothed if len(smoothed) == len(rows) else rows,
        [tie for batch in found for tie in batch.ties],
        [each for batch in found for each in batch.health],
        [seen for batch in found for seen in batch.sightings],
        last.tilt,
        last.initial_pose,
        last.start,
    )


def join(chunks: Sequence[Chunk], rig: Rig) -> Joined:
    """Join the results of the chunks of a film, in the order of its frames.

    Raises:
        UndeterminedSeam: Two chunks cannot be joined as they are; see `mended`.
    """
    from vo_core.mosaic.layers import shift_of  # they load the odometry, as the next ones do
    from vo_core.track_join import join_tracks

    chunks = _numbered_alike(_up_to_the_end(chunks))
    parts = [_part(chunk) for chunk in chunks]
    joined = join_tracks(parts, rig)
    firsts = [0, *(seam.frame for seam in joined.seams)]
    health = [
        (frame, health)
        for chunk, first, end in zip(chunks, firsts, [*firsts[1:], None], strict=True)
        for frame, health in chunk.health
        if first <= frame and (end is None or frame < end)
    ]
    sightings = chunks[0].sightings
    for chunk, first in zip(chunks[1:], firsts[1:], strict=True):
        sightings = _merged(sightings, chunk.sightings, first, joined.track)
    batch = Batch(
        _estimates_of(joined.track),
        health=health,
        sightings=sightings,
        tilt=_tilt(chunks, firsts, rig),
        initial_pose=chunks[0].initial_pose,
    )
    origin, layout = chunks[0].initial_pose, Layout.of(rig)
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
) -> Iterator[WallPicture]:
    """Yield the tiles of the joined wall, one after the other; only a few are in memory.

    It decodes pictures, so it belongs into a child process.

    Args:
        placed: Of the chunks that contribute, see `join`.
        rig: Camera, mount and pipe.
        indices: Of each chunk, the indices of its layers.
        read: Returns the layer of a chunk with an index; None if there is none.
    """
    from app.jobs.track.onlooker import wall_tile
    from vo_core.mosaic.layers import Shift, joined_tile, touched

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
        if not chunk.estimates:
            return chunks[:number]
        if chunk.frames.end is None or chunk.estimates[-1].frame + 1 < chunk.frames.end:
            return chunks[: number + 1]
    return chunks


def _numbered_alike(chunks: Sequence[Chunk]) -> list[Chunk]:
    """Number the frames of each chunk as the chunk before it does, which has the same times.

    Frames that cannot be decoded have no number in a track. A tracker that begins behind them does
    not know of them.
    """
    found = list(chunks[:1])
    for chunk in chunks[1:]:
        before, begin = found[-1].estimates, chunk.estimates[0]
        row = bisect_left(before, begin.time_s, key=attrgetter("time_s"))
        is_shared = row < len(before) and before[row].time_s == begin.time_s
        found.append(_renumbered(chunk, before[row].frame - begin.frame if is_shared else 0))
    return found


def _renumbered(chunk: Chunk, by: int) -> Chunk:
    """Add a number to the numbers of all frames of a chunk."""
    if by == 0:
        return chunk

    return msgspec.structs.replace(
        chunk,
        estimates=[replace(each, frame=each.frame + by) for each in chunk.estimates],
        ties=[msgspec.structs.replace(each, frame=each.frame + by) for each in chunk.ties],
        health=[(frame + by, health) for frame, health in chunk.health],
        sightings=[replace(each, frame=each.frame + by) for each in chunk.sightings],
    )


def _part(chunk: Chunk) -> Part:
    from vo_core.track_join import Part

    return Part(
        Track.from_estimates(chunk.estimates),
        np.array([tie.systematic_mm for tie in chunk.ties]),
        np.array([tie.bed_mm for tie in chunk.ties]),
        np.array([tie.picture for tie in chunk.ties]),
        np.array([(tie.is_coarse, tie.is_noiseless) for tie in chunk.ties]),
        chunk.start,
    )


def _tilt(chunks: Sequence[Chunk], firsts: Sequence[int], rig: Rig) -> MountTilt:
    """Combine the tilts of chunks whose own frames begin at `firsts`."""
    from vo_core.track_join import join_tilts

    ends = [*firsts[1:], chunks[-1].estimates[-1].frame + 1]
    own = [end - first for first, end in zip(firsts, ends, strict=True)]
    shares = [number / len(chunk.estimates) for number, chunk in zip(own, chunks, strict=True)]
    return join_tilts([chunk.tilt for chunk in chunks], shares, rig)


def _estimates_of(track: Track) -> list[Estimate]:
    columns = (getattr(track, name).tolist() for name in COLUMNS)
    return [Estimate(*values) for values in zip(*columns, strict=True)]


def _merged(
    before: list[Sighting], after: list[Sighting], first: int, track: Track
) -> list[Sighting]:
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


def _is_same(one: Sighting, other: Sighting, track: Track) -> bool:
    """Whether two sightings are of one joint, in one passing of it; a crest is none."""
    if one.wave_mm > 0 or other.wave_mm > 0:
        return False
    first, last = sorted((one.frame, other.frame))
    if last >= len(track):
        return False
    way_mm = track.distance_mm[first : last + 1]
    apart_mm = way_mm[0 if one.frame == first else -1] + one.ahead_mm
    apart_mm -= way_mm[-1 if one.frame == first else 0] + other.ahead_mm
    return bool(np.ptp(way_mm) < SAME_JOINT_MM and abs(apart_mm) < SAME_JOINT_MM)
