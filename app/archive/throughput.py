"""How fast the archive is processed, from the times at which films ended."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from app.storage.archive.films import Ended

LOOKED_AT = 100
"""Films that ended last, of which the rate is taken."""
_STOOD_STILL = 10
"""A gap of more than this many median gaps is one in which the archive stood still."""


@dataclass(frozen=True)
class Throughput:
    """Rates of an archive."""

    fps: float
    """Frames per second."""
    films_per_h: float
    bytes_per_s: float

    def eta_s(self, bytes_left: int) -> float | None:
        """Return the time for the rest; the length of a film is as its size."""
        return bytes_left / self.bytes_per_s if self.bytes_per_s > 0 else None


def throughput(ended: Sequence[Ended]) -> Throughput | None:
    """Return the rates of the films that ended last; None if they are too few.

    A film counts for the gap between the end of the one before it and its own. So pauses and
    restarts of the server, which show as long gaps, do not slow the rate down.

    Args:
        ended: The newest first.
    """
    gaps = [
        ((newer.finished_at - older.finished_at).total_seconds(), newer)
        for newer, older in pairwise(ended)
    ]
    if not gaps:
        return None
    longest_s = _STOOD_STILL * statistics.median(gap_s for gap_s, _ in gaps)
    counted = [(gap_s, film) for gap_s, film in gaps if gap_s <= longest_s] or gaps
    whole_s = sum(gap_s for gap_s, _ in counted)
    if whole_s <= 0:
        return None
    return Throughput(
        fps=sum(film.frames for _, film in counted) / whole_s,
        films_per_h=3600 * len(counted) / whole_s,
        bytes_per_s=sum(film.size for _, film in counted) / whole_s,
    )
