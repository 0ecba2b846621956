"""Media files to break: small valid clips, and ways to damage their bytes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from builders import clip_rig
from cameras import floor

SIZE_WH = (96, 64)
FRAMES = 16
RIG = clip_rig(width=SIZE_WH[0], height=SIZE_WH[1], cx=47.5, cy=31.5)
CODINGS = {
    "h264.mp4": "libx264",
    "hevc.mp4": "libx265",
    "av1.mp4": "libsvtav1",
    "h264.mov": "libx264",
    "mjpeg.mov": "mjpeg",
    "h264.mkv": "libx264",
    "mpeg4.mkv": "mpeg4",
    "vp8.webm": "libvpx",
    "vp9.webm": "libvpx-vp9",
    "mpeg4.avi": "mpeg4",
    "mjpeg.avi": "mjpeg",
    "msmpeg4.avi": "msmpeg4",
    "h264.ts": "libx264",
    "mpeg2.ts": "mpeg2video",
    "mpeg1.mpg": "mpeg1video",
}
"""Every accepted container and codec: file name and encoder."""
_QUICK = {
    "libx264": {"preset": "ultrafast"},
    "libx265": {"preset": "ultrafast", "x265-params": "log-level=none"},
    "libsvtav1": {"preset": "12", "svtav1-params": "lp=1"},
    "libvpx": {"deadline": "realtime"},
    "libvpx-vp9": {"deadline": "realtime"},
}


def write_clip(
    path: Path,
    encoder: str = "libx264",
    *,
    frames: int = FRAMES,
    size_wh: tuple[int, int] = SIZE_WH,
    times: Callable[[int], int] | None = None,
    **options: str,
) -> Path:
    """Write a passing floor at 25 frames a second; `times` sets other time stamps, in 1/12800 s."""
    with _ordinary_priority(), av.open(str(path), "w") as container:
        stream = container.add_stream(encoder, rate=25)
        assert isinstance(stream, av.VideoStream)
        stream.width, stream.height = size_wh
        stream.pix_fmt = "yuvj420p" if encoder == "mjpeg" else "yuv420p"
        stream.gop_size = 6
        stream.options = _QUICK.get(encoder, {}) | options
        for n in range(frames):
            grey = np.ascontiguousarray(floor(n)[16:])
            frame = av.VideoFrame.from_ndarray(grey, format="gray")
            frame = frame.reformat(*size_wh, format=stream.pix_fmt)
            frame.pts, frame.time_base = n, Fraction(1, 25)
            for packet in stream.encode(frame):
                container.mux(_retimed(packet, times))
        for packet in stream.encode():
            container.mux(_retimed(packet, times))
    return path


@contextmanager
def _ordinary_priority() -> Iterator[None]:
    """Undo the priority of SVT-AV1, which gives a root process SCHED_FIFO 99 permanently.

    Browsers and servers started by such a test process would leave no time to others.
    """
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def _retimed(
    packet: av.Packet[av.VideoStream], times: Callable[[int], int] | None
) -> av.Packet[av.VideoStream]:
    if times is not None and packet.pts is not None and packet.time_base is not None:
        pts = times(round(packet.pts * packet.time_base * 25))
        packet.time_base = Fraction(1, 12800)
        packet.pts = packet.dts = pts
    return packet


def copy_packets(source: Path, target: Path, **options: str) -> None:
    """Copy packets unchanged into another container; `options` are those of its writer."""
    with av.open(str(source)) as whole, av.open(str(target), "w", options=options) as sink:
        stream = whole.streams.video[0]
        copy = sink.add_stream_from_template(stream)
        for packet in whole.demux(stream):
            if packet.size:
                packet.stream = copy
                sink.mux(packet)


def write_seeds(folder: Path) -> dict[str, bytes]:
    """Write one valid clip of each coding."""
    os.environ["SVT_LOG"] = "1"  # errors only
    return {name: write_clip(folder / name, coder).read_bytes() for name, coder in CODINGS.items()}


@dataclass(frozen=True)
class Edit:
    """One change to a file."""

    kind: str
    at: float
    """Place of the change, from 0 at the beginning to 1 at the end."""
    value: int
    """Value of the change; its meaning depends on the kind."""


EXTREMES = (
    0,
    1,
    0x7F,
    0xFF,
    0x7FFF,
    0xFFFF,
    0x10000,
    0x7FFFFFFF,
    0x80000000,
    0xFFFFFFFE,
    2**32 - 1,
)
MARKS = (
    (b"mvhd", b"tkhd", b"mdhd", b"elst", b"stts", b"ctts", b"stsz", b"stsc", b"stco", b"stss")
    + (b"avc1", b"avcC", b"hvcC", b"av1C", b"trun", b"moov", b"trak", b"ftyp", b"mdat")
    + (b"RIFF", b"avih", b"strh", b"strf", b"idx1", b"indx", b"movi", b"00dc")
    + (b"\x1a\x45\xdf\xa3", b"\x18\x53\x80\x67", b"\x16\x54\xae\x6b", b"\x1f\x43\xb6\x75")
    + (b"\x1c\x53\xbb\x6b", b"\xb0\x82", b"\xba\x82", b"\x2a\xd7\xb1", b"\xa3", b"\xe7")
    + (b"\x00\x00\x01\xba", b"\x00\x00\x01\xe0", b"\x00\x00\x01\xb3", b"\x00\x00\x01\xb5")
    + (b"\x00\x00\x01\x67", b"\x00\x00\x01\x65", b"\x47\x40", b"\x47\x01", b"\xff\xd8", b"\xff\xc0")
)
"""Bytes before the numbers in headers of containers and codecs."""


def edited(content: bytes, edits: Sequence[Edit], other: bytes) -> bytes:
    """Apply the edits to a file; pieces of `other` may be inserted."""
    data = bytearray(content)
    for edit in edits:
        if data:
            KINDS[edit.kind](data, min(int(edit.at * len(data)), len(data) - 1), edit.value, other)
    return bytes(data)


def _flip(data: bytearray, at: int, value: int, _other: bytes) -> None:
    data[at] ^= 1 << value % 8


def _noise(data: bytearray, at: int, value: int, _other: bytes) -> None:
    length = 1 + value % 64
    noise = np.random.default_rng(value).bytes(length)
    data[at : at + length] = noise[: len(data) - at]


def _number(data: bytearray, at: int, value: int, _other: bytes) -> None:
    number = EXTREMES[value % len(EXTREMES)]
    order = "big" if value // len(EXTREMES) % 2 else "little"
    data[at : at + 4] = number.to_bytes(4, order)  # type: ignore[arg-type]


def _header(data: bytearray, at: int, value: int, _other: bytes) -> None:
    """Write an extreme number into a header, at a place where its format may read it."""
    found = [place for mark in MARKS if (place := data.find(mark)) >= 0]
    if found:
        start = found[at % len(found)]
        _number(data, min(start + value // 64 % 96, len(data) - 1), value, b"")


def _truncate(data: bytearray, at: int, _value: int, _other: bytes) -> None:
    del data[at:]


def _delete(data: bytearray, at: int, value: int, _other: bytes) -> None:
    del data[at : at + 1 + value % 4096]


def _repeat(data: bytearray, at: int, value: int, _other: bytes) -> None:
    data[at:at] = data[at : at + 1 + value % 4096]


def _zero(data: bytearray, at: int, value: int, _other: bytes) -> None:
    data[at : at + 1 + value % 4096] = bytes(len(data[at : at + 1 + value % 4096]))


def _splice(data: bytearray, at: int, value: int, other: bytes) -> None:
    """Append the rest of another file."""
    data[at:] = other[value % max(len(other), 1) :]


KINDS = {
    "flip": _flip,
    "noise": _noise,
    "number": _number,
    "header": _header,
    "truncate": _truncate,
    "delete": _delete,
    "repeat": _repeat,
    "zero": _zero,
    "splice": _splice,
}
