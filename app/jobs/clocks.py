"""When a packet is to be shown, in ms since the beginning of the recording."""

from __future__ import annotations

_LONGEST_STEP_S = 0.2
_SHARE_OF_NEWEST = 0.05


class StreamClock:
    """Times on our own clock, as evenly as the camera states them.

    No packet comes before it was captured, so of all delays the least is taken for the one that
    the camera's clock means; the hurry and the hesitation of the network then do not show.  A
    camera's clock that runs slower or faster is followed, one that jumps is begun with anew.
    """

    _DRIFT = 5e-4
    """Seconds a second by which two clocks may part; quartz does a tenth of that."""
    _JUMP_S = 2.0

    def __init__(self, zero_s: float, last_ms: int, delay_s: float | None = None) -> None:
        """A clock for one connection.

        Args:
            zero_s: Time 0 of the recording on the clock of `arrived_s`.
            last_ms: Latest time in the recording; all that follows is later.
            delay_s: From a stated time to its arrival, at least, if some have come already.
        """
        self._zero_s = zero_s
        self._last_ms = last_ms
        self._delay_s = delay_s
        self._arrived_s = zero_s
        self._latest_pts_s = float("-inf")
        self._usual_s: float | None = None
        """Between two packets without a stated time."""

    def time_ms(self, arrived_s: float, pts_s: float | None) -> int:
        """Of the next packet; it rises but for pictures that are shown before earlier ones.

        Args:
            arrived_s: When it came.
            pts_s: What the camera states, if it does.
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
        """Half of the usual interval.

        What a network has held up comes all at once; a millisecond from picture to picture would
        be read as a robot that shoots through the pipe.
        """
        step_s = arrived_s - self._arrived_s
        if self._usual_s is None:
            self._usual_s = min(step_s, _LONGEST_STEP_S)
        else:  # one long pause does not make pauses usual
            self._usual_s += _SHARE_OF_NEWEST * (min(step_s, 3 * self._usual_s) - self._usual_s)
        self._usual_s = max(self._usual_s, 0.001)
        return round(500 * self._usual_s)

    def _later(self, shown_s: float, least_ms: int = 1) -> int:
        shown_ms = round(1000 * (shown_s - self._zero_s))
        self._last_ms = max(shown_ms, self._last_ms + max(least_ms, 1))
        return self._last_ms


class FileClock:
    """The own times of a file that is read while it grows, from its first packet on."""

    def __init__(self) -> None:
        self._first_s: float | None = None

    def time_ms(self, _arrived_s: float, pts_s: float | None) -> int:
        """Of the next packet."""
        if self._first_s is None:
            self._first_s = pts_s or 0.0
        return max(round(1000 * ((pts_s or 0.0) - self._first_s)), 0)
