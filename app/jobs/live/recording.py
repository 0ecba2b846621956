"""The recording of a camera: a Matroska file that can be read at any time, also after a crash.

Every packet is one cluster, appended by one write on arrival. So at most the last cluster of a
killed process is incomplete, and another process can continue after it. The index for seeking (the
cues) is kept in reserved space at the front, so that the file never has to be read from its
beginning, neither while it grows nor afterwards. FFmpeg's own Matroska writer delays each cluster
until the next one begins and writes its cues at the very end.

Element names and ids: RFC 9559 (Matroska), RFC 8794 (EBML).
"""

from __future__ import annotations

import fcntl
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from vo_core.errors import UnreadableVideo

_EBML, _SEGMENT, _SEEK_HEAD, _INFO, _TRACKS, _CUES, _CLUSTER = (
    "1A45DFA3", "18538067", "114D9B74", "1549A966", "1654AE6B", "1C53BB6B", "1F43B675",
)  # fmt: skip
_UNKNOWN_SIZE = b"\x01" + 7 * b"\xff"
_TICKS_A_SECOND = 1000
_CUE_ROOM = 128 * 1024
"""Bytes reserved for cues: some 1900, half an hour at one a second."""
_CODEC_IDS = {
    "h264": "V_MPEG4/ISO/AVC",
    "hevc": "V_MPEGH/ISO/HEVC",
    "mjpeg": "V_MJPEG",
    "mpeg4": "V_MPEG4/ISO/ASP",
    "mpeg1video": "V_MPEG1",
    "mpeg2video": "V_MPEG2",
    "vp8": "V_VP8",
    "vp9": "V_VP9",
}
CODECS = frozenset(_CODEC_IDS)
"""FFmpeg's names of the codecs that can be recorded unchanged."""


@dataclass(frozen=True)
class Coding:
    """The information that a decoder needs before the first packet."""

    codec: str
    width: int
    height: int
    extradata: bytes


class Recording:
    """One growing video stream, with packets in the order of arrival.

    Raises:
        OSError: The disk is full; everything written before stays readable.
    """

    def __init__(self, path: Path, coding: Coding) -> None:
        """Create a new file."""
        self.coding = coding
        self._cues = _Cues()
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX)
            self._write(_head(coding), 0)
        except BaseException:
            os.close(self._file)
            path.unlink()  # without its head, the file could not be continued
            raise
        self._end = len(_head(coding))

    @classmethod
    def reopen(cls, path: Path) -> Self:
        """Continue after the last complete packet of an existing file.

        It waits until nobody else writes: the camera process of a server that was killed records
        until it notices that.

        Raises:
            UnreadableVideo: The file is not our recording, or its head is incomplete.
        """
        self = cls.__new__(cls)
        self._file = os.open(path, os.O_RDWR)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX)
            self._read_back(path.name)
        except BaseException:
            os.close(self._file)
            raise
        return self

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        os.close(self._file)

    @property
    def size(self) -> int:
        """Number of bytes so far."""
        return self._end

    @property
    def packets(self) -> int:
        """Number of packets."""
        return self._cues.packets

    @property
    def last_ms(self) -> int | None:
        """Latest time of a packet; None before the first."""
        return self._cues.last_ms

    def append(self, time_ms: int, is_key: bool, packet: bytes) -> None:
        """Write a packet; readers see it when this returns.

        Args:
            time_ms: Presentation time since the beginning of the recording.
            is_key: Whether decoding may begin here.
            packet: The packet from the camera, unchanged.
        """
        cluster = _cluster(time_ms, is_key, packet)
        try:
            self._write(cluster, self._end)
        except OSError:
            os.ftruncate(self._file, self._end)  # an incomplete packet is useless
            raise
        if self._cues.note(time_ms, is_key, self._end - _segment_start()):
            self._write(self._cues.element(), _cues_at(self.coding))
        self._end += len(cluster)

    def finish(self) -> None:
        """Write the duration; nothing is appended after that."""
        self._write(struct.pack(">d", float(self.last_ms or 0)), _duration_at())
        os.fsync(self._file)

    def sync(self) -> None:
        """Sync the file from the page cache to the disk."""
        os.fdatasync(self._file)

    def _write(self, content: bytes, at: int) -> None:
        view = memoryview(content)
        while view:
            written = os.pwrite(self._file, view, at)
            view, at = view[written:], at + written

    def _read_back(self, name: str) -> None:
        size = os.fstat(self._file).st_size
        self.coding = _coding_of(os.pread(self._file, _LONGEST_HEAD, 0), name)
        self._cues = _Cues()
        self._end = len(_head(self.coding))
        while (found := _cluster_at(self._file, self._end)) is not None:
            length, time_ms, is_key = found
            if self._end + length > size:
                break
            self._cues.note(time_ms, is_key, self._end - _segment_start())
            self._end += length
        os.ftruncate(self._file, self._end)
        self._write(self._cues.element(), _cues_at(self.coding))


class _Cues:
    """Positions of key frames, as many as the reserved space holds."""

    _BYTES_EACH = 69
    _MOST = (_CUE_ROOM - 32) // _BYTES_EACH

    def __init__(self) -> None:
        self._points: list[bytes] = []
        self._newest_ms = 0
        self._interval_ms = 1000
        self.packets = 0
        self.last_ms: int | None = None

    def note(self, time_ms: int, is_key: bool, position: int) -> bool:
        """Count a packet; return whether it became a cue."""
        self.packets += 1
        self.last_ms = time_ms if self.last_ms is None else max(self.last_ms, time_ms)
        if not is_key or (self._points and time_ms < self._newest_ms + self._interval_ms):
            return False
        if len(self._points) == self._MOST:  # a long drive: keep every second one from here on
            del self._points[1::2]
            self._interval_ms *= 2
        place = _element("B7", _number("F7", 1), _number("F1", position))
        self._points.append(_element("BB", _number("B3", time_ms), place))
        self._newest_ms = time_ms
        return True

    def element(self) -> bytes:
        """Return the cues, and a void that fills the rest of the space."""
        cues = _element(_CUES, *self._points)
        void = _CUE_ROOM - len(cues) - 9
        return cues + bytes.fromhex("EC01") + void.to_bytes(7, "big") + bytes(void)


def _head(coding: Coding) -> bytes:
    """Return everything before the first cluster; equal codings give equal bytes."""
    front = _ebml_header() + bytes.fromhex(_SEGMENT) + _UNKNOWN_SIZE + _front(coding)
    return front + _Cues().element()


def _cues_at(coding: Coding) -> int:
    return len(_head(coding)) - _CUE_ROOM


def _ebml_header() -> bytes:
    return _element(
        _EBML,
        _number("4286", 1),
        _number("42F7", 1),
        _number("42F2", 4),
        _number("42F3", 8),
        _element("4282", b"matroska"),
        _number("4287", 4),
        _number("4285", 2),
    )


def _front(coding: Coding) -> bytes:
    info = _element(
        _INFO,
        _element("4489", struct.pack(">d", 0.0)),  # the duration, stated at the end
        _number("2AD7B1", 10**9 // _TICKS_A_SECOND),
        _element("4D80", b"Chainage"),
        _element("5741", b"Chainage"),
    )
    track = _element(
        "AE",
        _number("D7", 1),
        _number("73C5", 1),
        _number("83", 1),
        _number("9C", 0),
        _element("86", _CODEC_IDS[coding.codec].encode()),
        _element("63A2", coding.extradata),
        _element("E0", _number("B0", coding.width), _number("BA", coding.height)),
    )
    body = info + _element(_TRACKS, track)
    return _seek_head(len(_seek_head(0)) + len(body)) + body


def _seek_head(cues_at: int) -> bytes:
    seek = _element("4DBB", _element("53AB", bytes.fromhex(_CUES)), _number("53AC", cues_at))
    return _element(_SEEK_HEAD, seek)


def _duration_at() -> int:
    """Return the position of the number in the first element of the info."""
    return _segment_start() + len(_seek_head(0)) + 12 + 2 + 8


def _segment_start() -> int:
    """Return the origin of the positions in the file."""
    return len(_ebml_header()) + 4 + len(_UNKNOWN_SIZE)


_LONGEST_HEAD = 2**20


def _coding_of(head: bytes, name: str) -> Coding:
    """Recover the coding that `_head` wrote, by writing it again."""
    for codec, codec_id in _CODEC_IDS.items():
        front = _element("86", codec_id.encode()) + bytes.fromhex("63A2")
        start = head.find(front)
        if start < 0:
            continue
        extradata_at = start + len(front) + 8
        end = extradata_at + int.from_bytes(head[extradata_at - 7 : extradata_at], "big")
        # The picture size follows: 9 bytes, a number of 8 bytes, 9 bytes, another number.
        width, height = (int.from_bytes(head[end + at : end + at + 8], "big") for at in (18, 35))
        coding = Coding(codec, width, height, head[extradata_at:end])
        track = slice(start, end + 43)
        if len(head) >= len(_head(coding)) and head[track] == _head(coding)[track]:
            return coding
    raise UnreadableVideo(f"{name} is not a recording that can be continued.")


def _cluster(time_ms: int, is_key: bool, packet: bytes) -> bytes:
    flags = 0x80 if is_key else 0
    # The block is of track 1 and has the time of its cluster.
    block = _element("A3", b"\x81\x00\x00", bytes((flags,)), packet)
    return _element(_CLUSTER, _number("E7", time_ms), block)


_CLUSTER_HEAD = 4 + 8 + (1 + 8 + 8) + (1 + 8) + 4
"""Bytes of a cluster before its packet."""


def _cluster_at(file: int, at: int) -> tuple[int, int, bool] | None:
    """Return length in bytes, time and kind of the cluster that begins there; None if none does."""
    head = os.pread(file, _CLUSTER_HEAD, at)
    if len(head) < _CLUSTER_HEAD or head[:4] != bytes.fromhex(_CLUSTER):
        return None
    length = 12 + int.from_bytes(head[5:12], "big")
    return length, int.from_bytes(head[21:29], "big"), bool(head[-1] & 0x80)


def _element(id_hex: str, *parts: bytes) -> bytes:
    """Build an EBML element; its size always takes eight bytes."""
    body = b"".join(parts)
    return bytes.fromhex(id_hex) + b"\x01" + len(body).to_bytes(7, "big") + body


def _number(id_hex: str, value: int) -> bytes:
    return _element(id_hex, value.to_bytes(8, "big"))
