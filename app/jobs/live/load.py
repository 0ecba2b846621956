"""What is left out on a machine that cannot follow its camera, in a stated order.

First the 3D view, which a browser on the same machine draws, then the unrolled wall, then pictures:
five a second are enough to drive by. Tags and the recording never wait for any of them.
"""

from __future__ import annotations

from typing import Literal, get_args

Shed = Literal["view", "wall", "pictures"]
ORDER: tuple[Shed, ...] = get_args(Shed)

_WINDOW_S = 4.0
"""Time over which skipped frames are counted: a short hitch is no lack of power."""
_SETTLES_S = 6.0
"""So long after a start frames are skipped on any machine: the first ones are tracked twice."""
_TOO_MANY, _FEW = 0.2, 0.05
"""Shares of skipped frames from which more is left out, and below which something comes back."""
_CALM_WINDOWS = 5
"""Windows in a row with few skipped frames until something comes back: it costs what it cost."""


class Load:
    """Watches the share of skipped frames, and decides what to leave out."""

    def __init__(self) -> None:
        self.skipped_share = 0.0
        """In the last window."""
        self._level = 0
        self._calm = 0
        self._begun_s: float | None = None
        self._window: tuple[float, int, int] | None = None
        """Its beginning, with the numbers of captured and skipped frames then."""

    @property
    def shed(self) -> tuple[Shed, ...]:
        """What is left out now."""
        return ORDER[: self._level]

    def note(self, captured: int, skipped: int, now_s: float) -> None:
        """Take the numbers of frames since the start, at a time by any clock."""
        self._begun_s = now_s if self._begun_s is None else self._begun_s
        if self._window is None:
            if now_s - self._begun_s >= _SETTLES_S:
                self._window = (now_s, captured, skipped)
            return
        since_s, captured_then, skipped_then = self._window
        if now_s - since_s < _WINDOW_S:
            return
        self._window = (now_s, captured, skipped)
        frames = captured - captured_then
        self.skipped_share = (skipped - skipped_then) / frames if frames else 0.0
        self._calm = self._calm + 1 if self.skipped_share < _FEW else 0
        if self.skipped_share > _TOO_MANY:
            self._level = min(self._level + 1, len(ORDER))
        elif self._calm >= _CALM_WINDOWS:
            self._level, self._calm = max(self._level - 1, 0), 0
