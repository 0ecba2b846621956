"""Frames of video files with their exact times, from the beginning or from somewhere within."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
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
)
from vo_core.decoding import Decoder, summary
from vo_core.errors import UnreadableVideo
from vo_core.seeking import CHECKED_FRAMES, Announced, Entered, enter, keys_of
from vo_core.timeline import Timeline
from vo_core.types import ByteImage

_FRAMES_AHEAD = 4
_ENTRIES_TRIED = (0, 1, 4, 16)
"""Which of the key frames before the wanted frame are tried: a seek in a file without an index may
end after the place that was asked for."""
_LEAST_READ_S = 64.0
"""So much of a film is read at least to find its key frames, then twice as much, and so on."""
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
        self._entered: Entered | None = None
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
        entered = self._entered or Entered.at_start(Decoder(self._film))
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
        self.problem = summary(decoder, index, last_s, self._film)

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
        announced = Announced.of(self._film.again())
        keys = announced.keys_until(index - CHECKED_FRAMES)
        for key in (keys[n] for n in _ENTRIES_TRIED if n < len(keys)):
            self._reopen()
            self._entered = enter(self._film, announced, key)
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
        keys = keys_of(self.path, state.st_size, state.st_mtime_ns, until_s)
        before = [key for key in keys if key.pts * base_s <= t_s]
        if before:
            decoder = Decoder(self._film)
            decoder.skip_to(before[-1])
            self._entered = Entered.at_start(decoder)

    def _reopen(self) -> None:
        film = self._film.again()
        self._film.container.close()
        self._film = film


def _grey(picture: VideoFrame) -> ByteImage:
    """Return the luma in the decoder's first plane, which is faster than converting."""
    name = picture.format.name
    if name.startswith(_LUMA_FIRST) and not name.endswith(("le", "be")):
        plane = picture.planes[0]
        rows: ByteImage = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)
        return rows[: picture.height, : picture.width]
    return np.asarray(picture.to_ndarray(format="gray"), np.uint8)
