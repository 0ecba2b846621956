"""Frames of video files with their exact times, from the beginning or from somewhere within."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np
from av.error import FFmpegError
from av.video.frame import VideoFrame

from vo_core.containers import (
    AS_CODED,
    MAX_FRAMES,
    Film,
    Turn,
    demuxed,
    holds_film,
    packets_of,
    reason,
)
from vo_core.errors import UnreadableVideo
from vo_core.timeline import SEAM_S, Timeline
from vo_core.types import ByteImage

_FRAMES_AHEAD = 4
_CHECKED_FRAMES = 60
"""Number of frames decoded to check that decoding from a key frame gives what it should."""
_ENTRIES_TRIED = (0, 1, 4, 16)
"""Which of the key frames before the wanted frame are tried: a seek in a file without an index may
end after the place that was asked for."""
_SOUGHT_BY_BYTES = ("mpegts", "mpeg")
"""Containers without an index, which are read on from any place."""
_LONGEST_PACK = 256 * 1024
"""A packet may begin so many bytes before the place that is told: packs hold parts of packets."""
_MOST_BLANK = 40
"""Packets without a picture that a decoder may want before it gives the first, with a margin."""
_PAUSE_S = SEAM_S + 1.0
"""So long shows a film nothing where it pauses or its clock was set forward; longer than a seam."""
_LEAST_READ_S = 64.0
"""So much of a film is read at least to find its key frames, then twice as much, and so on."""
_MOMENT_S = 1e-3
"""After this time comes a picture whose own time is missing or does not rise."""
_LUMA_FIRST = ("yuv4", "yuvj4", "nv12", "nv21", "gray")
"""Eight-bit planar formats whose first plane is the grey picture; others are converted."""


@dataclass(frozen=True)
class Frame:
    """One picture of a source, in presentation order."""

    index: int
    """Counted from 0."""
    t_s: float
    """Presentation time, exact: pts times the stream's time base."""
    image: ByteImage
    """(H, W) grey, turned as a player shows it; its pixels may be wider than high."""
    _picture: VideoFrame = field(repr=False, compare=False)
    _turn: Turn = field(default=AS_CODED, repr=False, compare=False)
    _pixel_aspect: float = field(default=1.0, repr=False, compare=False)

    def to_bgr(self) -> ByteImage:
        """The picture in colour, (H, W, 3), blue first."""
        coded = np.asarray(self._picture.to_ndarray(format="bgr24"), np.uint8)
        return np.ascontiguousarray(self._turn(coded))

    def to_square_bgr(self) -> ByteImage:
        """The picture in colour with square pixels, for people: larger than (H, W, 3) if its own
        are not square.
        """
        return squared(self.to_bgr(), self._pixel_aspect)


def frame_of(
    picture: VideoFrame,
    index: int,
    t_s: float,
    turn: Turn = AS_CODED,
    pixel_aspect: float = 1.0,
) -> Frame:
    """Wrap a decoded picture as a frame."""
    return Frame(index, t_s, turn(_grey(picture)).copy(), picture, turn, pixel_aspect)


def squared(picture: ByteImage, pixel_aspect: float) -> ByteImage:
    """Return a picture, (H, W) or (H, W, 3), with square pixels."""
    height, width = picture.shape[:2]
    size_wh = square_size((width, height), pixel_aspect)
    if size_wh == (width, height):
        return picture
    return np.asarray(cv2.resize(picture, size_wh, interpolation=cv2.INTER_CUBIC), np.uint8)


def square_size(size_wh: tuple[int, int], pixel_aspect: float) -> tuple[int, int]:
    """Return the size of a picture with square pixels, width and height; no side gets smaller."""
    width, height = size_wh
    return round(width * max(pixel_aspect, 1.0)), round(height * max(1 / pixel_aspect, 1.0))


class VideoFile:
    """A video file as an iterable context manager of `Frame`s, each with its exact time.

    Pictures are turned as the container states, and are numbered and timed on one axis, also where
    the time stamps of the file begin anew (see `Timeline`). After the loop `problem` is a sentence
    about what was damaged or missing, or None.

    Raises:
        UnreadableVideo: The file is missing, container or codec are not accepted, there is no video
            stream, or a picture exceeds `MAX_PIXELS`.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.problem: str | None = None
        self._film = Film.open(self.path)
        self.info = self._film.info
        self._entered: _Entered | None = None
        self._thread = ThreadPoolExecutor(1, "decode")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._thread.shutdown(cancel_futures=True)  # closing under a decoder crashes it
        self._film.container.close()

    def __iter__(self) -> Iterator[Frame]:
        """Yield every decodable frame once, in presentation order."""
        entered = self._entered or _Entered.at_start(_Decoder(self._film))
        decoder, self._entered = entered.decoder, None
        codec, turn = self._film.stream.codec_context, self._film.turn
        size_wh = (codec.width, codec.height)
        index, last_s = entered.index, entered.last_s
        for picture, t_s in entered.pictures:
            if (picture.width, picture.height) != size_wh:
                decoder.faults.append(
                    f"the picture changes to {picture.width}x{picture.height} at {t_s:.2f} s"
                )
                break
            if index == MAX_FRAMES:
                decoder.faults.append(f"only the first {MAX_FRAMES} frames are taken")
                break
            yield frame_of(picture, index, t_s, turn, self.info.pixel_aspect)
            index, last_s = index + 1, t_s
        if last_s is None:
            found = "; ".join(decoder.faults) or "it holds no decodable picture"
            raise UnreadableVideo(f"No frame of this video can be decoded: {found}.")
        self.problem = _summary(decoder, index, last_s, self._film)

    def read_ahead(self) -> Iterator[Frame]:
        """Yield the same frames, decoded by a second thread while the caller uses those before."""
        source = iter(self)
        ahead = deque(self._thread.submit(next, source, None) for _ in range(_FRAMES_AHEAD))
        while (frame := ahead.popleft().result()) is not None:
            ahead.append(self._thread.submit(next, source, None))
            yield frame

    def seek_frame(self, index: int) -> None:
        """Let the next loop start at frame `index` or somewhat before it.

        Its frames have the same numbers and the same pictures as in a loop over the whole file. The
        packets show the numbers without decoding, and decoding starts at a key frame; the frames
        after it must be the ones that the packets announce. Where they are not, or where packets
        have no times, the next loop starts with frame 0.
        """
        announced = _Announced.of(self._film.again())
        keys = announced.keys_until(index - _CHECKED_FRAMES)
        for key in (keys[n] for n in _ENTRIES_TRIED if n < len(keys)):
            self._reopen()
            self._entered = _enter(self._film, announced, key)
            if self._entered is not None:
                return
        self._reopen()

    def seek(self, t_s: float) -> None:
        """Seek to about the key frame at or before `t_s`; the next loop starts there.

        A file too damaged for seeking is read on from its current position. Where the time stamps
        begin anew, `seek_part` finds the place.
        """
        stream = self._film.stream
        if t_s <= 0.0:
            self._reopen()
        elif stream.time_base is not None:
            ticks = int(t_s / stream.time_base) - Timeline(stream).shift
            with suppress(FFmpegError, OverflowError):
                self._film.container.seek(ticks, stream=stream, backward=True)

    def seek_part(self, t_s: float) -> None:
        """Seek like `seek` where time stamps may begin anew; a file's packets are read once."""
        stream = self._film.stream
        if stream.frames or stream.time_base is None:  # an index of all frames has one time axis
            self.seek(t_s)
            return
        base_s = stream.time_base
        self._reopen()
        state = self.path.stat()
        until_s = 2.0 ** math.ceil(math.log2(max(t_s, _LEAST_READ_S)))
        keys = _keys_of(self.path, state.st_size, state.st_mtime_ns, until_s)
        before = [key for key in keys if key.pts * base_s <= t_s]
        if before:
            decoder = _Decoder(self._film)
            decoder.skip_to(before[-1])
            self._entered = _Entered.at_start(decoder)

    def _reopen(self) -> None:
        film = self._film.again()
        self._film.container.close()
        self._film = film


@dataclass(frozen=True)
class _Entry:
    """A place of a file without an index."""

    byte: int = 0
    shift: int = 0
    """Of the part there, see `Timeline`."""


@dataclass(frozen=True)
class _Key:
    """A key frame after which all later frames come in the file."""

    pts: int
    """Presentation time on the time axis of the film."""
    seek_to: int
    """The time stamp of its packet for seeking."""
    packets_before: int
    entry: _Entry
    """Where reading may begin to come to it."""


@dataclass(frozen=True)
class _Announced:
    """What the packets of a file say of its frames."""

    numbers: dict[int, int]
    """Number of the frame with a presentation time on the time axis; empty if unknown."""
    keys: list[_Key]
    """In the order of the file."""
    is_whole: bool
    """Whether the time stamps never begin anew."""

    @classmethod
    def of(cls, film: Film, until_s: float = math.inf) -> _Announced:
        """Pass over the packets of a film at its beginning, up to a time, and close it."""
        times: list[int] = []
        keys: list[_Key] = []
        latest = -math.inf
        is_numbered = True
        timeline = Timeline(film.stream)
        entries = deque([_Entry(shift=timeline.shift)])
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
                        entries.append(_Entry(packet.pos, timeline.shift))
                        while len(entries) > 1 and entries[1].byte <= packet.pos - _LONGEST_PACK:
                            entries.popleft()
                    keys.append(_Key(packet.pts, dts - timeline.shift, count, entries[0]))
                times.append(packet.pts)
                latest = max(latest, packet.pts)
        numbers = {pts: number for number, pts in enumerate(sorted(times))}
        is_numbered = is_numbered and len(numbers) == len(times)
        return cls(numbers if is_numbered else {}, keys, not timeline.seams_s)

    def keys_until(self, index: int) -> list[_Key]:
        """Key frames at or before frame `index`, the nearest first; none if it is unknown."""
        return [key for key in reversed(self.keys) if self.numbers.get(key.pts, math.inf) <= index]


@lru_cache(maxsize=8)
def _keys_of(path: Path, size: int, mtime_ns: int, until_s: float) -> list[_Key]:
    """Return the key frames up to a time; it is another file once size or time has changed."""
    return _Announced.of(Film.open(path), until_s).keys


@dataclass(frozen=True)
class _Entered:
    """A file that is being decoded, not always from its beginning."""

    decoder: _Decoder
    pictures: Iterator[tuple[VideoFrame, float]]
    """The pictures that follow."""
    index: int
    """Number of the first of them."""
    last_s: float | None
    """Time of the frame before it; None if there was none."""

    @classmethod
    def at_start(cls, decoder: _Decoder) -> _Entered:
        return cls(decoder, decoder.pictures(), 0, None)


def _enter(film: Film, announced: _Announced, key: _Key) -> _Entered | None:
    """Decode from a key frame on; None unless the frames come as announced."""
    decoder = _Decoder(film)
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
        if number == announced.numbers[key.pts] + _CHECKED_FRAMES:
            decoder.faults.clear()
            decoder.damaged_packets = 0
            return _Entered(decoder, pictures, number, last_s)
    return None


class _Decoder:
    """Decodes packets to pictures, and continues after a damaged packet, unlike a plain loop."""

    MAX_FAULTS = 1000

    def __init__(self, film: Film) -> None:
        self._film = film
        self.timeline = Timeline(film.stream)
        self.packets = self.timeline.placed(demuxed(film.container, film.stream))
        self.faults: list[str] = []
        self.damaged_packets = 0
        self.hidden = 0
        """Pictures that an edit list leaves out."""
        self.newest_byte = 0
        """Place of the newest packet in the file."""
        self._blank = 0
        """Packets since the newest picture."""
        self.longest_blank = 0
        self.untimed = 0
        self.pauses_s: list[tuple[float, float]] = []
        """Times of the pictures before and after each pause."""

    def skip_to(self, key: _Key) -> None:
        """Go to a key frame of any part; what cannot be read shows when decoding."""
        container = self._film.container
        with suppress(FFmpegError, StopIteration):
            if container.format.name in _SOUGHT_BY_BYTES:
                container.seek(key.entry.byte, unsupported_byte_offset=True)
                self.timeline.shift = key.entry.shift
                return
            for _ in range(key.packets_before):
                next(self.packets)

    def pictures(self) -> Iterator[tuple[VideoFrame, float]]:
        """Yield every picture with its time; one without a time of its own follows the last."""
        last_s = -math.inf
        for picture in self._decoded():
            t_s = math.nan
            if picture.pts is not None and picture.time_base is not None:
                t_s = float(picture.pts * picture.time_base)
            if not t_s > last_s:
                self.untimed += 1
                t_s = last_s + _MOMENT_S if last_s > -math.inf else 0.0
            if _PAUSE_S <= t_s - last_s < math.inf:
                self.pauses_s.append((last_s, t_s))
            last_s = t_s
            yield picture, t_s

    def _is_followed(self) -> bool:
        """Whether another film follows, on tracks of its own: FFmpeg gives the first only."""
        film = self._film
        is_joinable = film.container.format.name in _SOUGHT_BY_BYTES
        return is_joinable and holds_film(film.path, self.newest_byte + 1)

    def _decoded(self) -> Iterator[VideoFrame]:
        while self.damaged_packets < self.MAX_FAULTS:
            try:
                packet = next(self.packets)
            except StopIteration:
                if self._is_followed():
                    self.faults.append("another film follows in the file and is not read")
                return
            except MemoryError:
                raise
            except FFmpegError as error:
                self.faults.append(f"reading stopped: {reason(error)}")
                return
            self.hidden += packet.is_discard
            self.newest_byte = packet.pos or self.newest_byte
            self._blank += not packet.is_discard
            try:
                for picture in packet.decode():
                    self._blank = 0
                    yield picture
            except MemoryError:  # no damaged packet: a frame must not be left out silently
                raise
            except FFmpegError:
                self.damaged_packets += 1
            self.longest_blank = max(self.longest_blank, self._blank)
        self.faults.append(f"more than {self.MAX_FAULTS} damaged packets")


def _summary(decoder: _Decoder, frames: int, last_s: float, film: Film) -> str | None:
    """Describe in a sentence what was wrong with the file; None if nothing was.

    A demuxer may skip damage silently.  So the number of frames is compared with the count that the
    container states, without those that an edit list hides on purpose.
    """
    parts = list(decoder.faults)
    seams_s = decoder.timeline.seams_s
    if seams_s:
        ends = _listed([f"{end_s:.2f} s" for end_s in seams_s])
        parts.append(
            f"the time stamps of this film begin anew after {ends}; what follows is "
            f"placed {SEAM_S:g} s later, and what the robot did in between is not shown"
        )
    if decoder.pauses_s:
        named = _listed([f"{before:.2f} s to {after:.2f} s" for before, after in decoder.pauses_s])
        parts.append(f"nothing is shown from {named}, and what the robot did then is not known")
    stated = film.stream.frames - decoder.hidden
    if frames < stated - 1 - 0.005 * stated:
        parts.append(f"{frames} of {stated} frames could be decoded")
    if decoder.damaged_packets:
        parts.append(f"{decoder.damaged_packets} damaged packets were skipped")
    if decoder.longest_blank > _MOST_BLANK:
        parts.append(f"{decoder.longest_blank} packets in a row show no picture")
    if decoder.untimed:
        parts.append(f"{decoder.untimed} pictures without a usable time follow the one before")
    slack_s = 0.5 + 2 / (film.info.rate_hz or 10)
    if film.end_s is not None and not seams_s and last_s < film.end_s - slack_s:
        parts.append(f"the video ends at {last_s:.2f} s of {film.end_s:.2f} s")
    return ("; ".join(parts)).capitalize() + "." if parts else None


def _listed(places: list[str]) -> str:
    named = ", ".join(places[:3])
    return named if len(places) <= 3 else f"{named} and {len(places) - 3} times more"


def _grey(picture: VideoFrame) -> ByteImage:
    """Return the luma in the decoder's first plane, which is faster than converting."""
    name = picture.format.name
    if name.startswith(_LUMA_FIRST) and not name.endswith(("le", "be")):
        plane = picture.planes[0]
        rows: ByteImage = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)
        return rows[: picture.height, : picture.width]
    return np.asarray(picture.to_ndarray(format="gray"), np.uint8)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
