"""Presentation times of packets, in ms since the beginning of the recording."""

from __future__ import annotations

_LONGEST_STEP_S = 0.2
_SHARE_OF_NEWEST = 0.05


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
        self._latest_pts_s = float("-inf")
        self._usual_s: float | None = None
        """Usual interval between two packets without a stated time."""

    def time_ms(self, arrived_s: float, pts_s: float | None) -> int:
        """Return the time of the next packet; it rises, except for pictures shown before earlier
        ones.

        Args:
            arrived_s: Arrival time.
            pts_s: Time stated by the camera, if any.
        """
        if pts_s is None:
            least_ms = self._least_step_ms(arrived_s)
            self._arrived_s = arrived_s
            return self._later(arrived_s, least_ms)
        delay_s = arrived_s - pts_s
        if self._delay_s is None or abs(delay_s - self._delay_s) > self._JUMP_S:
            self._delay_s, self._latest_pts_s = delay_s, float("-inf")
        else:
            drift_s = self._DRIFT * (arrived_s - self._arrived_s)
            self._delay_s = min(delay_s, self._delay_s + drift_s)
        self._arrived_s = arrived_s
        shown_s = pts_s + self._delay_s
        if pts_s < self._latest_pts_s:  # a picture that refers to one shown after it
            return max(round(1000 * (shown_s - self._zero_s)), 0)
        self._latest_pts_s = pts_s
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
    """The file's own times, from its first packet on, while the file is read and grows."""

    def __init__(self) -> None:
        self._first_s: float | None = None

    def time_ms(self, _arrived_s: float, pts_s: float | None) -> int:
        """Return the time of the next packet."""
        if self._first_s is None:
            self._first_s = pts_s or 0.0
        return max(round(1000 * ((pts_s or 0.0) - self._first_s)), 0)
