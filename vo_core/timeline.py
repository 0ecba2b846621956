"""One time axis for all packets of a film, also where its time stamps begin anew.

Recorders write chunks and DVDs are cut into parts, and joined files keep the time stamps of each
part. A film across the roll-over of the 33 bits of MPEG's clock begins before zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from av.packet import Packet
from av.video.stream import VideoStream

SEAM_S = 10.0
"""Time between the parts of a film whose time stamps begin anew.

Nobody knows how long the film shows nothing there.  In this time a robot may cross the length of a
culvert, so that the odometry ties the parts together only if they show the same wall."""

_JITTER_S = 0.2
"""Time stamps of one part may fall by as much: some muxers write them with jitter."""


class Timeline:
    """Moves the time stamps of packets, in the order of the file, so that they go on at seams."""

    def __init__(self, stream: VideoStream) -> None:
        self._base_s = stream.time_base
        self.shift = max(-(stream.start_time or 0), 0)
        """Ticks added to the time stamps of the current part."""
        self._newest: int | None = None
        """Decoding time of the packet before."""
        self._end = 0
        """Latest time of the packets so far."""
        self.seams_s: list[float] = []
        """Ends of the parts that others follow."""

    def placed(self, packets: Iterable[Packet[VideoStream]]) -> Iterator[Packet[VideoStream]]:
        """Yield each packet with its time stamps moved to this axis."""
        for packet in packets:
            self._place(packet)
            yield packet

    def _place(self, packet: Packet[VideoStream]) -> None:
        time = packet.pts if packet.dts is None else packet.dts
        if time is None or self._base_s is None:
            return
        jitter = _JITTER_S / self._base_s
        if self._newest is not None and time + self.shift < self._newest - jitter:
            self.seams_s.append(float(self._end * self._base_s))
            self.shift = self._end + round(SEAM_S / self._base_s) - time
        if packet.dts is not None:
            packet.dts += self.shift
        if packet.pts is not None:
            packet.pts += self.shift
        self._newest = time + self.shift
        self._end = max(self._end, self._newest, self._newest if packet.pts is None else packet.pts)
