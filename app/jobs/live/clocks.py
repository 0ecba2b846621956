"""Presentation times of packets, in ms since the beginning of the recording."""

from __future__ import annotations

from vo_core.timeline import SEAM_S

PAUSE_MS = 1000
"""Pause between the last picture of one part of the recording and the first of the next."""
_LONGEST_STEP_S = 0.2
_SHARE_OF_NEWEST = 0.05


class _Order:
    """Tells a clock that was set back from pictures that are sent after ones shown later."""

    _MOST_SENT_LATER = 16
    """Most pictures that a decoder of H.264 or H.265 holds back."""
    _JUMP_S = 2.0

    def __init__(self) -> None:
        self._latest_s = float("-inf")
        self._behind = 0
        """Number of packets since the latest."""

    def is_latest(self, pts_s: float) -> bool:
        """Return whether no packet before this one is shown later."""
        return pts_s >= self._latest_s

    def is_set_back(self, pts_s: float, *, is_reordered: bool) -> bool:
        """Note the time of the next packet, and return whether times begin anew with it."""
        self._behind = 0 if self.is_latest(pts_s) else self._behind + 1
        most = self._MOST_SENT_LATER if is_reordered else 0
        is_set_back = self._behind > most or self._latest_s - pts_s > self._JUMP_S
        if is_set_back or not self._behind:
            self.begin(pts_s)
        return is_set_back

    def begin(self, pts_s: float) -> None:
        """Forget the packets before this one."""
        self._latest_s, self._behind = pts_s, 0


class StreamClock:
    """Times on the server's clock, with the even spacing stated by the camera.

    No packet arrives before it was captured, so the smallest delay links the camera's clock to
    ours; jitter of the network is then invisible. A camera's clock that runs slow or fast is
    followed; after a jump the clock starts anew.
    """

    _DRIFT = 5e-4
    """Largest drift between two clocks, seconds per second; that of quartz is a tenth of it."""
    _JUMP_S = 2.0

    def __init__(self, zero_s: float, last_ms: int, delay_s: float | None = None) -> None:
        """Start a clock for one connection.

        Args:
            zero_s: Time 0 of the recording on the clock of `arrived_s`.
            last_ms: Latest time in the recording; all later packets get later times.
            delay_s: Smallest delay from stated time to arrival, if packets have come already.
        """
        self._zero_s = zero_s
        self._last_ms = last_ms
        self._delay_s = delay_s
        self._arrived_s = zero_s
        self._order = _Order()
        self._usual_s: float | None = None
        """Usual interval between two packets without a stated time."""

    def time_ms(self, arrived_s: float, pts_s: float | None, *, is_reordered: bool) -> int:
        """Return the time of the next packet; it rises, except for pictures shown before earlier
        ones.

        Args:
            arrived_s: Arrival time.
            pts_s: Time stated by the camera, if any.
            is_reordered: Whether pictures may be sent after ones that are shown later.
        """
        if pts_s is None:
            least_ms = self._least_step_ms(arrived_s)
            self._arrived_s = arrived_s
            return self._later(arrived_s, least_ms)
        delay_s = arrived_s - pts_s
        is_set_back = self._order.is_set_back(pts_s, is_reordered=is_reordered)
        if is_set_back or self._delay_s is None or abs(delay_s - self._delay_s) > self._JUMP_S:
            self._delay_s = delay_s
            self._order.begin(pts_s)
        else:
            drift_s = self._DRIFT * (arrived_s - self._arrived_s)
            self._delay_s = min(delay_s, self._delay_s + drift_s)
        self._arrived_s = arrived_s
        shown_s = pts_s + self._delay_s
        if not self._order.is_latest(pts_s):
            return max(round(1000 * (shown_s - self._zero_s)), 0)
        return self._later(shown_s)

    def _least_step_ms(self, arrived_s: float) -> int:
        """Return half of the usual interval.

        Packets delayed by the network arrive all at once; intervals of a millisecond would look
        like a robot that shoots through the pipe.
        """
        step_s = arrived_s - self._arrived_s
        if self._usual_s is None:
            self._usual_s = min(step_s, _LONGEST_STEP_S)
        else:  # one long pause does not change the usual interval
            self._usual_s += _SHARE_OF_NEWEST * (min(step_s, 3 * self._usual_s) - self._usual_s)
        self._usual_s = max(self._usual_s, 0.001)
        return round(500 * self._usual_s)

    def _later(self, shown_s: float, least_ms: int = 1) -> int:
        shown_ms = round(1000 * (shown_s - self._zero_s))
        self._last_ms = max(shown_ms, self._last_ms + max(least_ms, 1))
        return self._last_ms


class FileClock:
    """The file's own times, from its first packet on, while the file is read and grows.

    Where they begin anew, because a recorder went on with a new clock, they go on as those of a
    finished film do (`vo_core.timeline`).
    """

    def __init__(self) -> None:
        self._zero_s: float | None = None
        self._last_ms = 0
        self._order = _Order()

    def time_ms(self, _arrived_s: float, pts_s: float | None, *, is_reordered: bool) -> int:
        """Return the time of the next packet."""
        if pts_s is None:
            return self._last_ms
        if self._zero_s is None:
            self._zero_s = pts_s
        if self._order.is_set_back(pts_s, is_reordered=is_reordered):
            self._zero_s = pts_s - self._last_ms / 1000 - SEAM_S
        time_ms = max(round(1000 * (pts_s - self._zero_s)), 0)
        self._last_ms = max(self._last_ms, time_ms)
        return time_ms
