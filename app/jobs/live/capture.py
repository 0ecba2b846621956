"""Captures a camera: every packet is recorded unchanged and decoded for the tracker.

One thread reads the camera into one film until it is stopped, through all drop-outs. The tracker
learns which frames it missed, so that every frame of the recording gets a row in the track.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from itertools import chain, islice

from av.bitstream import BitStreamFilterContext
from av.codec.context import CodecContext
from av.error import FFmpegError
from av.packet import Packet
from av.video.codeccontext import VideoCodecContext
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from app.back_off import BackOff
from app.jobs.live import nal
from app.jobs.live.cameras import (
    CameraFault,
    NoPictures,
    Opened,
    WrongPictures,
    opened,
    plain_errors,
)
from app.jobs.live.clocks import PAUSE_MS, FileClock, StreamClock
from app.jobs.live.film import NO_ROOM, Film
from app.jobs.live.messages import CameraInput
from app.jobs.live.recording import Coding
from app.jobs.live.waiting import Captured, Waiting
from vo_core.containers import MAX_FRAMES, MAX_PIXELS
from vo_core.sources import frame_of

UNREACHABLE_AFTER_S = 15.0
"""A camera without a picture for this long at the beginning is unreachable."""
_BACK_OFF = BackOff(first_s=0.2, longest_s=2.0)
_SYNC_S = 1.0
_MILLISECOND = Fraction(1, 1000)
_MOST_DAMAGED = 100
"""Most damaged packets in a row."""
_AT_ONCE_S = 0.004
"""Packets that arrive at shorter intervals than this had been waiting."""
_MOST_WAITED = 200
"""Most packets that may have been waiting."""
_TOO_LONG = f"The recording ended after {MAX_FRAMES} pictures, the most that one may have."


Arrival = tuple["Packet[VideoStream]", float]
"""A packet and its arrival time, by `time.monotonic`."""


class Capture:
    """Reads a camera in its own thread until `stop`, or until its file or pipe has ended."""

    def __init__(
        self,
        camera: CameraInput,
        size_wh: tuple[int, int],
        film: Film,
        *,
        first_index: int,
        zero_s: float | None,
    ) -> None:
        """Set what to capture, and where to.

        Args:
            camera: The source to open.
            size_wh: Picture size stated by the rig.
            film: The film to record into.
            first_index: Number of the next frame.
            zero_s: Time 0 of a recording that is continued, by `time.monotonic`.
        """
        self.waiting = Waiting(is_patient=camera.kind == "file")
        self.is_connected = False
        self.reconnects = 0
        self.detail: str | None = None
        self.zero_s = zero_s
        self.problem: str | None = None
        """Why the capture ended by itself, if that was too early."""
        self.failure: NoPictures | None = None
        """Code and sentence, if the capture never began."""
        self._camera = camera
        self._size_wh = size_wh
        self.film = film
        self._first_index = self._next_index = first_index
        self._last_t_s = float("-inf")
        self._damaged = 0
        self._decoder = _decoder(film.recording.coding) if film.recording else None
        self._ending, self._ended = threading.Event(), threading.Event()
        self._fault: Exception | None = None
        self._reader = threading.Thread(target=self._run, name="capture", daemon=True)
        self._disk = threading.Thread(target=self._look_after_disk, name="disk", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._disk.start()
        self._reader.start()

    def stop(self) -> None:
        """Ask the thread to end, which takes at most the time limit of one read."""
        self._ending.set()

    def join(self) -> None:
        """Wait until the recording is closed; raise any unexpected exception."""
        self._reader.join()
        if self._fault is not None:
            raise self._fault

    @property
    def captured(self) -> int:
        """Number of frames so far, tracked or not."""
        return self._next_index - self._first_index

    @property
    def recorded_s(self) -> float:
        """Length of the recording."""
        last_ms = self.film.recording.last_ms if self.film.recording else None
        return (last_ms or 0) / 1000

    def _run(self) -> None:
        try:
            self._keep_reading()
            self._close()
        except Exception as error:  # raised again by `join` in the caller's thread
            self._fault = error
        finally:
            self._ended.set()
            self.waiting.close()

    def _close(self) -> None:
        if self._decoder is not None:
            with suppress(FFmpegError):  # pictures that waited for later ones, unless damaged
                self._hand_on(self._decoder.decode(None), time.monotonic())
        self.is_connected = False
        self._ended.set()
        self._disk.join()
        self.film.close()

    def _look_after_disk(self) -> None:
        try:
            while not self._ended.wait(_SYNC_S):
                self.film.look_after_disk()
        except Exception as error:  # such as a broken disk; raised again by `join`
            self._fault = error
            self._ending.set()

    def _keep_reading(self) -> None:
        began_s, failures = time.monotonic(), 0
        ends_once = self._camera.kind in ("file", "pipe")  # input from an odd recorder
        while not self._ending.is_set():
            try:
                self._read_one_connection()
                self.detail = None if self._ending.is_set() else "It ended the connection."
            except CameraFault as fault:
                self.detail = str(fault)
                if self.film.recording is None and self._is_hopeless(fault, began_s):
                    return
                if ends_once and isinstance(fault, WrongPictures):  # others are its usual end
                    self.problem = f"The recording ended early. {fault}"
            if ends_once and self.film.recording is not None:
                return
            if self.is_connected:
                self.is_connected = False
                failures = 0
            self._ending.wait(_BACK_OFF.pause_s(failures))
            failures += 1

    def _is_hopeless(self, fault: CameraFault, began_s: float) -> bool:
        if isinstance(fault, WrongPictures):
            self.failure = fault
        elif time.monotonic() - began_s > UNREACHABLE_AFTER_S:
            self.failure = NoPictures("camera_unreachable", f"The camera gives no picture. {fault}")
        return self.failure is not None

    def _read_one_connection(self) -> None:
        with opened(self._camera) as source:
            arrivals = _from_key_frame(source.packets)
            is_file = self._camera.kind == "file"
            waited = [] if is_file else _waited(arrivals)
            if not waited and not is_file:
                return
            self._require_same(source.codec)
            form = _Form(source)
            clock = FileClock() if is_file else self._clock(waited)
            for packet, arrived_s in chain(waited, arrivals):
                if self._ending.is_set():
                    return
                time_ms = clock.time_ms(
                    arrived_s, self._stated_s(packet), is_reordered=self._is_reordered(source)
                )
                is_key = packet.is_keyframe  # a filter empties the packet that it receives
                with plain_errors():
                    contents = form.applied(packet)
                if not self.is_connected:
                    self.is_connected, self.detail = True, None
                for content in contents:
                    self._take(content, time_ms, is_key, arrived_s)

    def _require_same(self, codec: VideoCodecContext) -> None:
        """Raise WrongPictures unless the pictures fit the rig and the recording; begin the
        recording.
        """
        self._require_size(codec)
        recording = self.film.recording
        if recording is None:
            coding = Coding(codec.name, codec.width, codec.height, _extradata(codec))
            try:
                self.film.begin(coding)
            except OSError as error:
                if error.errno not in NO_ROOM:
                    raise
                raise CameraFault("The server's disk has no room for a recording.") from error
            self._decoder = _decoder(coding)
        elif codec.name != recording.coding.codec:
            raise WrongPictures(
                "unreadable_video",
                f"The camera now sends {codec.name} where it sent {recording.coding.codec}.",
            )
        else:
            self.reconnects += 1

    def _clock(self, waited: list[Arrival]) -> StreamClock:
        """Make the clock of a connection that begins with these packets."""
        last_ms = self.film.last_ms
        first_ms = 0 if last_ms is None else last_ms + PAUSE_MS
        last_ms = -1 if last_ms is None else last_ms
        first, first_s = waited[0]
        delay_s = min(
            (
                at_s - pts_s
                for packet, at_s in waited
                if (pts_s := self._stated_s(packet)) is not None
            ),
            default=None,
        )
        stated_s = self._stated_s(first)
        if self.zero_s is None:
            shown_s = first_s if stated_s is None or delay_s is None else stated_s + delay_s
            self.zero_s = shown_s - first_ms / 1000
        return StreamClock(self.zero_s, last_ms, delay_s)

    def _is_reordered(self, source: Opened) -> bool:
        """Return whether pictures may be sent after ones that are shown later."""
        assert self._decoder is not None  # noqa: S101  (begun by _require_same)
        return source.codec.has_b_frames or self._decoder.has_b_frames

    @staticmethod
    def _stated_s(packet: Packet[VideoStream]) -> float | None:
        """Return the presentation time of a packet, which MJPEG over HTTP does not have."""
        if packet.pts is None or packet.time_base is None:
            return None
        return float(packet.pts * packet.time_base)

    def _take(self, content: bytes, time_ms: int, is_key: bool, arrived_s: float) -> None:
        """Record a packet that can be decoded, and pass its pictures on."""
        pictures = self._decoded(content, time_ms)
        if pictures is None:
            return
        self.film.append(time_ms, is_key, content)
        self._hand_on(pictures, arrived_s)

    def _hand_on(self, pictures: list[VideoFrame], arrived_s: float) -> None:
        for picture in pictures:
            t_s = (picture.pts or 0) / 1000
            # A packet that `VideoFile` skips when reading the recording gets no number here.
            if picture.pts is None or t_s <= self._last_t_s:
                continue
            self._last_t_s = t_s
            self.film.note(self._next_index, picture.pts)
            self.waiting.add(Captured(frame_of(picture, self._next_index, t_s), arrived_s))
            self._next_index += 1
        if self._next_index >= MAX_FRAMES:
            self.problem = _TOO_LONG
            self._ending.set()

    def _decoded(self, content: bytes, time_ms: int) -> list[VideoFrame] | None:
        """Return the pictures that are ready; None if the packet is damaged."""
        assert self._decoder is not None  # noqa: S101  (begun by _require_same)
        packet = Packet(content)
        packet.pts = time_ms
        packet.time_base = _MILLISECOND
        try:
            pictures = self._decoder.decode(packet)
        except FFmpegError:
            self._damaged += 1
            if self._damaged > _MOST_DAMAGED:
                self._damaged = 0
                raise WrongPictures("unreadable_video", "What it sends is damaged.") from None
            return None
        self._damaged = 0
        self._require_size(self._decoder)
        return pictures

    def _require_size(self, codec: VideoCodecContext) -> None:
        if (codec.width, codec.height) != self._size_wh:
            raise WrongPictures(
                "rig_video_mismatch",
                f"The camera's pictures have {codec.width}x{codec.height} px, the rig is made for "
                f"{self._size_wh[0]}x{self._size_wh[1]}. Set the camera to that size, or begin an "
                "inspection with a rig for these pictures.",
            )


def _decoder(coding: Coding) -> VideoCodecContext:
    """Decode like `VideoFile` will decode the recording: packet by packet, through all
    connections.
    """
    decoder = CodecContext.create(coding.codec, "r")
    assert isinstance(decoder, VideoCodecContext)  # noqa: S101  (all codecs of a Coding are)
    decoder.extradata = coding.extradata or None
    decoder.width, decoder.height = coding.width, coding.height
    decoder.options = {"max_pixels": str(MAX_PIXELS)}
    decoder.thread_count = 1
    return decoder


def _from_key_frame(packets: Iterator[Packet[VideoStream]]) -> Iterator[Arrival]:
    """Yield packets as they arrive, starting where decoding may begin."""
    has_begun = False
    while True:
        with plain_errors():
            packet = next(packets, None)
        if packet is None:
            return
        has_begun = has_begun or packet.is_keyframe
        if has_begun and packet.size:
            yield packet, time.monotonic()


def _waited(arrivals: Iterator[Arrival]) -> list[Arrival]:
    """Return the packets that piled up during connecting, and the first that did not.

    Only packets that did not wait show the delay from the camera.
    """
    waited: list[Arrival] = []
    for packet, arrived_s in islice(arrivals, _MOST_WAITED):
        waited.append((packet, arrived_s))
        if len(waited) > 1 and arrived_s - waited[-2][1] > _AT_ONCE_S:
            break
    return waited


class _Form:
    """Converts packets to the form used in files.

    Parameters that a camera may send only once, at the start of a connection, are put before each
    key frame: they may differ after a drop-out, and the recording starts only once.
    """

    def __init__(self, source: Opened) -> None:
        codec = source.codec
        is_stream_form = nal.is_stream_form(codec.extradata or b"")
        self._to_lengths = codec.name == "h264" and is_stream_form
        self._parameters: BitStreamFilterContext | None = None
        if codec.name in ("h264", "hevc") and is_stream_form:
            self._parameters = BitStreamFilterContext("dump_extra=freq=keyframe", source.stream)

    def applied(self, packet: Packet[VideoStream]) -> list[bytes]:
        """Convert a packet, which is used up."""
        whole = self._parameters.filter(packet) if self._parameters else [packet]
        contents = [bytes(each) for each in whole]
        return [nal.file_form(each) for each in contents] if self._to_lengths else contents


def _extradata(codec: VideoCodecContext) -> bytes:
    """Return the initial data for a decoder of the recording, or raise WrongPictures.

    H.265 stays in the form of the camera, which FFmpeg and programs based on it read.
    """
    extradata = bytes(codec.extradata or b"")
    if codec.name != "h264":
        return extradata
    if nal.is_stream_form(extradata):
        extradata = nal.configuration(extradata) or b""
    if not extradata:
        raise CameraFault("It does not say how its video is coded.")
    return extradata
