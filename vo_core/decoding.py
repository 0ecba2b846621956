"""Decodes the pictures of a film one after the other, and notes what is damaged or missing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from av.error import FFmpegError
from av.video.frame import VideoFrame

from vo_core.containers import Film, demuxed, holds_film, reason
from vo_core.timeline import SEAM_S, Timeline

_SOUGHT_BY_BYTES = ("mpegts", "mpeg")
"""Containers without an index, which are read on from any place."""
_MOST_BLANK = 40
"""Packets without a picture that a decoder may want before it gives the first, with a margin."""
_PAUSE_S = SEAM_S + 1.0
"""So long shows a film nothing where it pauses or its clock was set forward; longer than a seam."""
_MOMENT_S = 1e-3
"""After this time comes a picture whose own time is missing or does not rise."""


@dataclass(frozen=True)
class Entry:
    """A place of a file without an index."""

    byte: int = 0
    shift: int = 0
    """Of the part there, see `Timeline`."""


@dataclass(frozen=True)
class Key:
    """A key frame after which all later frames come in the file."""

    pts: int
    """Presentation time on the time axis of the film."""
    seek_to: int
    """The time stamp of its packet for seeking."""
    packets_before: int
    entry: Entry
    """Where reading may begin to come to it."""


class Decoder:
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

    def skip_to(self, key: Key) -> None:
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


def summary(decoder: Decoder, frames: int, last_s: float, film: Film) -> str | None:
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
