"""Opens video files so that a hostile file does no harm, and reads what they state.

All media are untrusted: containers and codecs come from fixed lists, only the `file` protocol is
allowed, file-like objects are not (they have no protocol list), and the bound on the picture size
also holds when the size changes in mid-stream. Decode in a child process all the same.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import Self

import av
import numpy as np
from av.codec.context import CodecContext
from av.container import InputContainer
from av.error import FFmpegError
from av.packet import Packet
from av.sidedata.sidedata import SideData
from av.stream import Disposition
from av.video.codeccontext import VideoCodecContext
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from vo_core.errors import UnreadableVideo
from vo_core.types import ByteImage
from vo_core.video_info import VideoInfo

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
_STILLS = Disposition.attached_pic | Disposition.timed_thumbnails | Disposition.still_image
_PACKETS_COMPARED = 400
"""Number of packets in which a track of moving pictures shows its second one."""
_PACKETS_OF_FILM = 30
"""What holds as many is a film, and not the rest of a second track that ends somewhat later."""
_PACKETS_TURNED = 60
"""Number of packets that are decoded to find a first picture."""
_CLOCK = re.compile(r"(\d+):(\d\d):(\d\d(?:\.\d+)?)")
_NARROWEST = Fraction(1, 4)
"""Width by height of the narrowest pixel of any format; others are damage."""


@dataclass(frozen=True)
class Turn:
    """How a player turns and mirrors the coded pictures, by the container's display matrix."""

    is_transposed: bool = False
    """Rows become columns; before the mirroring."""
    is_mirrored: bool = False
    """Left and right are exchanged."""
    is_flipped: bool = False
    """Top and bottom are exchanged."""

    @classmethod
    def of(cls, picture: VideoFrame) -> Self:
        """Return the turn that a decoded picture states, to the next quarter, as browsers do."""
        stated = picture.side_data.get("DISPLAYMATRIX")
        if not isinstance(stated, SideData):
            return cls()
        a, b, _, c, d = (int(number) for number in np.frombuffer(memoryview(stated), np.int32)[:5])
        is_transposed = abs(b) > abs(a)
        x, y = (c, b) if is_transposed else (a, d)
        return cls(is_transposed, x < 0, y < 0)

    def __call__(self, image: ByteImage) -> ByteImage:
        """Return the picture as it is shown, a view of (H, W) or (H, W, 3)."""
        if self.is_transposed:
            image = image.swapaxes(0, 1)
        return image[:: -1 if self.is_flipped else 1, :: -1 if self.is_mirrored else 1]


AS_CODED = Turn()


@dataclass(frozen=True)
class Film:
    """A container that was opened, with the track to read and how its pictures are shown."""

    path: Path
    container: InputContainer
    stream: VideoStream
    turn: Turn
    info: VideoInfo
    """Read at once: PyAV crashes the interpreter when it is read after closing."""
    end_s: float | None
    """Stated end of the track itself; None if only that of the file is known, as its sound may be
    longer."""

    @classmethod
    def open(cls, path: Path) -> Self:
        """Open a file.

        Raises:
            UnreadableVideo: The file is missing, container or codec are not accepted, there is no
                video track, or a picture exceeds `MAX_PIXELS`.
        """
        with _opened(path) as probed:  # what was read may be missing after seeking back
            stream = _moving(probed, path.name)
            index, turn = stream.index, _turn(probed, stream)
        return cls._at_start(path, index, turn)

    def again(self) -> Self:
        """Open the same track once more, at its beginning; this one stays open."""
        return self._at_start(self.path, self.stream.index, self.turn)

    @classmethod
    def _at_start(cls, path: Path, index: int, turn: Turn) -> Self:
        container = _opened(path)
        try:
            stream = next(each for each in container.streams.video if each.index == index)
            _bounded(stream, path.name)
            end_s = _end_s(container, stream)
            return cls(
                path, container, stream, turn, _describe(container, stream, turn, end_s), end_s
            )
        except BaseException:
            container.close()
            raise


def holds_film(path: Path, byte: int) -> bool:
    """Return whether a file without an index holds a film from a place on."""
    with suppress(UnreadableVideo), _opened(path, byte) as rest:
        packets = islice(packets_of(rest, *_candidates(rest, path.name)), _PACKETS_OF_FILM)
        return len(list(packets)) == _PACKETS_OF_FILM
    return False


def _opened(path: Path, skipped: int = 0) -> InputContainer:
    if not path.is_file():
        raise UnreadableVideo(f"{path.name} is not there or is not a file.")
    if path.stat().st_size == 0:
        raise UnreadableVideo(f"{path.name} is empty (0 bytes).")
    try:
        return av.open(
            f"file:{path.resolve()}",
            timeout=_OPEN_AND_READ_TIMEOUT_S,
            container_options={
                "protocol_whitelist": "file",
                "format_whitelist": CONTAINERS,
                "codec_whitelist": ",".join(sorted(CODECS)),
                "skip_initial_bytes": str(skipped),
            },
        )
    except MemoryError:  # also raised by FFmpeg; it does not mean that the file is damaged
        raise
    except (FFmpegError, ValueError) as error:
        raise UnreadableVideo(
            f"{path.name} is not a video that can be opened ({reason(error)}). "
            "Accepted are MP4, MOV, MKV, WebM, AVI, MPEG-TS and MPEG files."
        ) from error


def checked_stream(container: InputContainer, name: str) -> VideoStream:
    """Select the video track that a player shows, and bound what its decoder accepts.

    Raises:
        UnreadableVideo: There is none, or its codec or size is not accepted.
    """
    return _bounded(_candidates(container, name)[0], name)


def _candidates(container: InputContainer, name: str) -> list[VideoStream]:
    """Return the tracks that may be a film, the one that players take first.

    Covers and thumbnails are tracks of their own.
    """
    films = [each for each in container.streams.video if not each.disposition & _STILLS]
    # PyAV gives a stream without a decoder for codecs that FFmpeg does not know.
    known = [each for each in films if each.codec_context is not None]
    if not known:
        raise UnreadableVideo(f"{name} holds no video stream that can be decoded.")
    # PyAV's decoder ignores codec_whitelist.
    accepted = [each for each in known if each.codec_context.name in CODECS]
    if not accepted:
        raise UnreadableVideo(
            f"{name} is coded as {known[0].codec_context.name}; "
            f"accepted are {', '.join(sorted(CODECS))}."
        )
    return sorted(accepted, key=lambda each: not each.disposition & Disposition.default)


def _moving(container: InputContainer, name: str) -> VideoStream:
    """Return the first candidate with more than one picture: not every file marks its cover."""
    candidates = _candidates(container, name)
    if len(candidates) == 1:
        return _bounded(candidates[0], name)
    counts = dict.fromkeys((each.index for each in candidates), 0)
    for packet in islice(packets_of(container, *candidates), _PACKETS_COMPARED):
        counts[packet.stream_index] += 1
    moving = (each for each in candidates if counts[each.index] > 1)
    return _bounded(next(moving, candidates[0]), name)


def packets_of(container: InputContainer, *streams: VideoStream) -> Iterator[Packet[VideoStream]]:
    """Yield the packets up to the end or to the first that cannot be read."""
    with suppress(FFmpegError):
        yield from (packet for packet in demuxed(container, *streams) if packet.size)


def demuxed(container: InputContainer, *streams: VideoStream) -> Iterator[Packet[VideoStream]]:
    """Yield the packets and what makes each decoder give what it holds back."""
    # Where a track, such as sound, appears within the file, PyAV may fail to flush it at the end.
    with suppress(IndexError):
        yield from container.demux(streams)


def _bounded(stream: VideoStream, name: str) -> VideoStream:
    codec = stream.codec_context
    if min(codec.width, codec.height) < 32 or codec.width * codec.height > MAX_PIXELS:
        raise UnreadableVideo(
            f"{name} has pictures of {codec.width}x{codec.height} px; "
            f"accepted are 32x32 to {MAX_PIXELS} px in all."
        )
    codec.options = {"max_pixels": str(MAX_PIXELS)}  # holds when the size changes in mid-stream
    codec.thread_count = 1
    return stream


def _turn(container: InputContainer, stream: VideoStream) -> Turn:
    """Return the turn that the container states, as its decoder reports with the first picture."""
    packets = list(islice(packets_of(container, stream), _PACKETS_TURNED))
    turn = _first_turn(stream.codec_context, packets)
    if turn == AS_CODED:
        return turn
    # A turn that is stated within the coded pictures does not count: browsers ignore it, and a
    # decoder that does not know the container reports that one only.
    bare = CodecContext.create(stream.codec_context.name, "r")
    if not isinstance(bare, VideoCodecContext):
        return turn
    bare.extradata = stream.codec_context.extradata
    bare.options = stream.codec_context.options
    return turn if _first_turn(bare, packets) == AS_CODED else AS_CODED


def _first_turn(codec: VideoCodecContext, packets: list[Packet[VideoStream]]) -> Turn:
    for packet in (*packets, None):  # None makes the decoder give what it holds back
        with suppress(FFmpegError):
            for picture in codec.decode(packet):
                return Turn.of(picture)
    return AS_CODED


def _describe(
    container: InputContainer, stream: VideoStream, turn: Turn, end_s: float | None
) -> VideoInfo:
    codec = stream.codec_context
    size = (codec.height, codec.width) if turn.is_transposed else (codec.width, codec.height)
    aspect = stream.sample_aspect_ratio or Fraction(1)
    if not _NARROWEST <= aspect <= 1 / _NARROWEST:
        aspect = Fraction(1)
    duration_s = (
        _seconds(stream.duration, stream.time_base)
        or end_s
        or _seconds(container.duration, 1 / av.time_base)
    )
    rate_hz = max(float(stream.average_rate or 0), 0.0)
    frames = stream.frames or round((duration_s or 0.0) * rate_hz)
    return VideoInfo(
        width=size[0],
        height=size[1],
        codec=codec.name,
        container=container.format.name,
        pixel_format=codec.pix_fmt,
        frames=frames if 0 < frames <= MAX_FRAMES else None,
        duration_s=duration_s,
        rate_hz=rate_hz or None,
        pixel_aspect=float(1 / aspect if turn.is_transposed else aspect),
    )


def _end_s(container: InputContainer, stream: VideoStream) -> float | None:
    """Return the stated end of a track: a container without lengths of its tracks states ends."""
    if stream.duration is not None:
        return _seconds(max(stream.start_time or 0, 0) + stream.duration, stream.time_base)
    if (clock := _CLOCK.fullmatch(stream.metadata.get("DURATION", ""))) is not None:
        hours, minutes, seconds = (float(part) for part in clock.groups())
        return 3600 * hours + 60 * minutes + seconds or None
    return _seconds(container.duration, 1 / av.time_base) if len(container.streams) == 1 else None


def _seconds(ticks: int | None, tick_s: Fraction | float | None) -> float | None:
    return max(float(ticks * tick_s), 0.0) or None if ticks and tick_s else None


def reason(error: Exception) -> str:
    """Return the text of an error of FFmpeg."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
