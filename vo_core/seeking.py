"""Where a film can be entered: its key frames, and the numbers of the frames after them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from av.error import FFmpegError
from av.video.frame import VideoFrame

from vo_core.containers import MAX_FRAMES, Film, packets_of
from vo_core.decoding import Decoder, Entry, Key
from vo_core.timeline import Timeline

CHECKED_FRAMES = 60
"""Number of frames decoded to check that decoding from a key frame gives what it should."""
_LONGEST_PACK = 256 * 1024
"""A packet may begin so many bytes before the place that is told: packs hold parts of packets."""


@dataclass(frozen=True)
class Announced:
    """What the packets of a file say of its frames."""

    numbers: dict[int, int]
    """Number of the frame with a presentation time on the time axis; empty if unknown."""
    keys: list[Key]
    """In the order of the file."""
    is_whole: bool
    """Whether the time stamps never begin anew."""

    @classmethod
    def of(cls, film: Film, until_s: float = math.inf) -> Announced:
        """Pass over the packets of a film at its beginning, up to a time, and close it."""
        times: list[int] = []
        keys: list[Key] = []
        latest = -math.inf
        is_numbered = True
        timeline = Timeline(film.stream)
        entries = deque([Entry(shift=timeline.shift)])
        last = until_s / film.stream.time_base if film.stream.time_base else math.inf
        with film.container:
            packets = packets_of(film.container, film.stream)
            for count, packet in enumerate(timeline.placed(packets)):
                if latest > last:
                    break
                if packet.pts is None or packet.is_corrupt or count > MAX_FRAMES:
                    is_numbered = False
                    continue
                if packet.is_discard:
                    continue
                if packet.is_keyframe and packet.pts > latest:
                    dts = packet.pts if packet.dts is None else packet.dts
                    if packet.pos is not None:
                        entries.append(Entry(packet.pos, timeline.shift))
                        while len(entries) > 1 and entries[1].byte <= packet.pos - _LONGEST_PACK:
                            entries.popleft()
                    keys.append(Key(packet.pts, dts - timeline.shift, count, entries[0]))
                times.append(packet.pts)
                latest = max(latest, packet.pts)
        numbers = {pts: number for number, pts in enumerate(sorted(times))}
        is_numbered = is_numbered and len(numbers) == len(times)
        return cls(numbers if is_numbered else {}, keys, not timeline.seams_s)

    def keys_until(self, index: int) -> list[Key]:
        """Key frames at or before frame `index`, the nearest first; none if it is unknown."""
        return [key for key in reversed(self.keys) if self.numbers.get(key.pts, math.inf) <= index]


@lru_cache(maxsize=8)
def keys_of(path: Path, size: int, mtime_ns: int, until_s: float) -> list[Key]:
    """Return the key frames up to a time; it is another file once size or time has changed."""
    return Announced.of(Film.open(path), until_s).keys


@dataclass(frozen=True)
class Entered:
    """A file that is being decoded, not always from its beginning."""

    decoder: Decoder
    pictures: Iterator[tuple[VideoFrame, float]]
    """The pictures that follow."""
    index: int
    """Number of the first of them."""
    last_s: float | None
    """Time of the frame before it; None if there was none."""

    @classmethod
    def at_start(cls, decoder: Decoder) -> Entered:
        """The file as the decoder finds it, with the first frame as number 0."""
        return cls(decoder, decoder.pictures(), 0, None)


def enter(film: Film, announced: Announced, key: Key) -> Entered | None:
    """Decode from a key frame on; None unless the frames come as announced."""
    decoder = Decoder(film)
    if not announced.is_whole:
        decoder.skip_to(key)
    else:
        try:
            film.container.seek(key.seek_to, stream=film.stream, backward=True)
        except FFmpegError:
            return None
    pictures = decoder.pictures()
    # Frames before the key frame may lack what they refer to, and so may pictures that are shown
    # before it and come after it.
    number, last_s = announced.numbers[key.pts], None
    for picture, t_s in pictures:
        if picture.pts is not None and picture.pts < key.pts:
            continue
        if picture.pts is None or announced.numbers.get(picture.pts) != number:
            return None
        number, last_s = number + 1, t_s
        if number == announced.numbers[key.pts] + CHECKED_FRAMES:
            decoder.faults.clear()
            decoder.damaged_packets = 0
            return Entered(decoder, pictures, number, last_s)
    return None
