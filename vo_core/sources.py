"""Reads video files, and opens them so that a hostile file does no harm.

All media are untrusted: containers and codecs come from fixed lists, only the `file` protocol is
allowed, file-like objects are not (they have no protocol list), and the bound on the picture size
also holds when the size changes in mid-stream. Decode in a child process all the same.
"""

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

import av
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.packet import Packet
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from vo_core.errors import UnreadableVideo
from vo_core.types import ByteImage

CONTAINERS = "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg"
CODECS = frozenset(
    ("h264", "hevc", "mpeg4", "mpeg2video", "mpeg1video", "mjpeg", "msmpeg4")
    + ("vp8", "vp9", "av1", "libdav1d")
)
MAX_PIXELS = 4096 * 2304
"""Largest picture that is decoded, 4K; decoders reject larger ones, even in mid-stream."""
MAX_FRAMES = 1_000_000
"""Most frames of one video, nine hours at 30 per second; a hostile file makes one of four bytes."""

_OPEN_AND_READ_TIMEOUT_S = (10, 10)
_FRAMES_AHEAD = 4
_CHECKED_FRAMES = 60
"""Number of frames decoded to check that decoding from a key frame gives what it should."""
_ENTRIES_TRIED = (0, 1, 4, 16)
"""Which of the key frames before the wanted frame are tried: a seek in a file without an index may
end after the place that was asked for."""
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
    """(H, W) grey."""
    _picture: VideoFrame = field(repr=False, compare=False)

    def to_bgr(self) -> ByteImage:
        """The picture in colour, (H, W, 3), blue first."""
        return np.asarray(self._picture.to_ndarray(format="bgr24"), np.uint8)


def frame_of(picture: VideoFrame, index: int, t_s: float) -> Frame:
    """Wrap a decoded picture as a frame."""
    return Frame(index, t_s, _grey(picture), picture)


@dataclass(frozen=True)
class VideoInfo:
    """What the container states about its video; none of it is trusted for timing."""

    width: int
    height: int
    codec: str
    container: str
    pixel_format: str | None
    frames: int | None
    """Estimated number of frames, for progress bars only; None if nothing is stated."""
    duration_s: float | None
    rate_hz: float | None


class VideoFile:
    """A video file as an iterable context manager of `Frame`s, each with its exact time.

    After the loop `problem` is a sentence about what was damaged or missing, or None.

    Raises:
        UnreadableVideo: The file is missing, container or codec are not accepted, there is no video
            stream, or a picture exceeds `MAX_PIXELS`.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.problem: str | None = None
        self._container, self._stream = _open(self.path)
        self.info = _describe(self._container, self._stream)
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
        self._container.close()

    def __iter__(self) -> Iterator[Frame]:
        """Yield every decodable frame once, in presentation order."""
        entered = self._entered or _Entered.at_start(_Decoder(self._container, self._stream))
        decoder, self._entered = entered.decoder, None
        size_wh = (self.info.width, self.info.height)
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
            yield frame_of(picture, index, t_s)
            index, last_s = index + 1, t_s
        if last_s is None:
            reason = "; ".join(decoder.faults) or "it holds no decodable picture"
            raise UnreadableVideo(f"No frame of this video can be decoded: {reason}.")
        self.problem = _summary(decoder, index, last_s, self._stream.frames, self.info)

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
        announced = _Announced.of(self.path)
        entries = announced.entries(index - _CHECKED_FRAMES)
        for entry in (entries[n] for n in _ENTRIES_TRIED if n < len(entries)):
            self._entered = _enter(self._container, self._stream, announced, entry)
            if self._entered is not None:
                return
        self._container.close()
        self._container, self._stream = _open(self.path)

    def seek(self, t_s: float) -> None:
        """Seek to about the key frame at or before `t_s`; the next loop starts there.

        A file too damaged for seeking is read on from its current position.
        """
        base = self._stream.time_base
        if base is not None:
            with suppress(FFmpegError, OverflowError):
                self._container.seek(int(t_s / base), stream=self._stream, backward=True)


@dataclass(frozen=True)
class _Announced:
    """What the packets of a file say of its frames."""

    numbers: dict[int, int]
    """Number of the frame with a presentation time, in units of the stream; empty if unknown."""
    keys: list[tuple[int, int]]
    """Presentation time, and time for seeking, of the key frames after which all later frames come
    in the file, in order."""

    @classmethod
    def of(cls, path: Path) -> _Announced:
        """Pass over the packets of a file."""
        times: list[int] = []
        keys: list[tuple[int, int]] = []
        latest = -math.inf
        container, stream = _open(path)
        with container:
            for packet in _packets(container, stream):
                if packet.pts is None or packet.is_corrupt or len(times) > MAX_FRAMES:
                    return cls({}, [])
                if packet.is_discard:
                    continue
                if packet.is_keyframe and packet.pts > latest:
                    keys.append((packet.pts, packet.pts if packet.dts is None else packet.dts))
                times.append(packet.pts)
                latest = max(latest, packet.pts)
        numbers = {pts: number for number, pts in enumerate(sorted(times))}
        return cls(numbers, keys) if len(numbers) == len(times) else cls({}, [])

    def entries(self, index: int) -> list[tuple[int, int]]:
        """Key frames at or before frame `index`, the nearest first."""
        return [key for key in reversed(self.keys) if self.numbers[key[0]] <= index]


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


def _packets(container: InputContainer, stream: VideoStream) -> Iterator[Packet[VideoStream]]:
    """Yield the packets up to the end or to the first that cannot be read."""
    with suppress(FFmpegError):
        yield from (packet for packet in container.demux(stream) if packet.size)


def _enter(
    container: InputContainer, stream: VideoStream, announced: _Announced, key: tuple[int, int]
) -> _Entered | None:
    """Decode from a key frame on; None unless the frames come as announced."""
    pts, seek_to = key
    decoder = _Decoder(container, stream)
    try:
        container.seek(seek_to, stream=stream, backward=True)
    except FFmpegError:
        return None
    pictures = decoder.pictures()
    # Frames before the key frame may lack what they refer to, and so may pictures that are shown
    # before it and come after it.
    number, last_s = announced.numbers[pts], None
    for picture, t_s in pictures:
        if picture.pts is not None and picture.pts < pts:
            continue
        if picture.pts is None or announced.numbers.get(picture.pts) != number:
            return None
        number, last_s = number + 1, t_s
        if number == announced.numbers[pts] + _CHECKED_FRAMES:
            decoder.faults.clear()
            decoder.damaged_packets = 0
            return _Entered(decoder, pictures, number, last_s)
    return None


def _open(path: Path) -> tuple[InputContainer, VideoStream]:
    if not path.is_file():
        raise UnreadableVideo(f"{path.name} is not there or is not a file.")
    if path.stat().st_size == 0:
        raise UnreadableVideo(f"{path.name} is empty (0 bytes).")
    try:
        container = av.open(
            f"file:{path.resolve()}",
            timeout=_OPEN_AND_READ_TIMEOUT_S,
            container_options={
                "protocol_whitelist": "file",
                "format_whitelist": CONTAINERS,
                "codec_whitelist": ",".join(sorted(CODECS)),
            },
        )
    except MemoryError:  # also raised by FFmpeg; it does not mean that the file is damaged
        raise
    except (FFmpegError, ValueError) as error:
        raise UnreadableVideo(
            f"{path.name} is not a video that can be opened ({_reason(error)}). "
            "Accepted are MP4, MOV, MKV, WebM, AVI, MPEG-TS and MPEG files."
        ) from error
    try:
        return container, checked_stream(container, path.name)
    except BaseException:
        container.close()
        raise


def checked_stream(container: InputContainer, name: str) -> VideoStream:
    """Select the first video stream, and bound what its decoder accepts.

    Raises:
        UnreadableVideo: There is none, or its codec or size is not accepted.
    """
    stream = next(iter(container.streams.video), None)
    # PyAV gives a stream without a decoder for codecs that FFmpeg does not know.
    codec = stream.codec_context if stream is not None else None
    if stream is None or codec is None:
        raise UnreadableVideo(f"{name} holds no video stream that can be decoded.")
    if codec.name not in CODECS:  # PyAV's decoder ignores codec_whitelist
        raise UnreadableVideo(
            f"{name} is coded as {codec.name}; accepted are {', '.join(sorted(CODECS))}."
        )
    if min(codec.width, codec.height) < 32 or codec.width * codec.height > MAX_PIXELS:
        raise UnreadableVideo(
            f"{name} has pictures of {codec.width}x{codec.height} px; "
            f"accepted are 32x32 to {MAX_PIXELS} px in all."
        )
    codec.options = {"max_pixels": str(MAX_PIXELS)}  # holds when the size changes in mid-stream
    codec.thread_count = 1
    return stream


def _describe(container: InputContainer, stream: VideoStream) -> VideoInfo:
    """Read all metadata now: PyAV crashes the interpreter when it is read after closing."""
    duration_s = max((container.duration or 0) / av.time_base, 0.0)
    rate_hz = max(float(stream.average_rate or 0), 0.0)
    frames = stream.frames or round(duration_s * rate_hz)
    codec = stream.codec_context
    return VideoInfo(
        width=codec.width,
        height=codec.height,
        codec=codec.name,
        container=container.format.name,
        pixel_format=codec.pix_fmt,
        frames=frames if 0 < frames <= MAX_FRAMES else None,
        duration_s=duration_s or None,
        rate_hz=rate_hz or None,
    )


class _Decoder:
    """Decodes packets to pictures, and continues after a damaged packet, unlike a plain loop."""

    MAX_FAULTS = 1000

    def __init__(self, container: InputContainer, stream: VideoStream) -> None:
        self.container, self.stream = container, stream
        self.faults: list[str] = []
        self.damaged_packets = 0

    def pictures(self) -> Iterator[tuple[VideoFrame, float]]:
        last_s = -np.inf
        for picture in self._decoded():
            if picture.pts is None or picture.time_base is None:
                self.damaged_packets += 1
                continue
            t_s = float(picture.pts * picture.time_base)
            if t_s <= last_s:  # a damaged index: presentation times must rise
                self.damaged_packets += 1
                continue
            last_s = t_s
            yield picture, t_s

    def _decoded(self) -> Iterator[VideoFrame]:
        packets = self.container.demux(self.stream)
        while self.damaged_packets < self.MAX_FAULTS:
            try:
                packet = next(packets)
            except StopIteration:
                return
            except MemoryError:
                raise
            except FFmpegError as error:
                self.faults.append(f"reading stopped: {_reason(error)}")
                return
            try:
                yield from packet.decode()
            except MemoryError:  # no damaged packet: a frame must not be left out silently
                raise
            except FFmpegError:
                self.damaged_packets += 1
        self.faults.append(f"more than {self.MAX_FAULTS} damaged packets")


def _summary(
    decoder: _Decoder, frames: int, last_s: float, stated_frames: int, info: VideoInfo
) -> str | None:
    """Describe in a sentence what was wrong with the file; None if nothing was.

    A demuxer may skip damage silently.  So the number of frames is compared with the count that the
    container states, with a margin for frames that an edit list hides on purpose.
    """
    parts = list(decoder.faults)
    if frames < stated_frames - 1 - 0.005 * stated_frames:
        parts.append(f"{frames} of {stated_frames} frames could be decoded")
    if decoder.damaged_packets:
        parts.append(f"{decoder.damaged_packets} damaged packets were skipped")
    slack_s = 0.5 + 2 / (info.rate_hz or 10)
    if info.duration_s is not None and last_s < info.duration_s - slack_s:
        parts.append(f"the video ends at {last_s:.2f} s of {info.duration_s:.2f} s")
    return ("; ".join(parts)).capitalize() + "." if parts else None


def _grey(picture: VideoFrame) -> ByteImage:
    """Copy the luma from the decoder's first plane, which is faster than converting."""
    name = picture.format.name
    if name.startswith(_LUMA_FIRST) and not name.endswith(("le", "be")):
        plane = picture.planes[0]
        rows: ByteImage = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)
        return rows[: picture.height, : picture.width].copy()
    return np.asarray(picture.to_ndarray(format="gray"), np.uint8)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
