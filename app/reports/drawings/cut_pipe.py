"""Where clock positions and water lie on a pipe that is cut open along its crown."""

from __future__ import annotations

import math

from app.reports.report import Report


def clock_spans(first: int | None, last: int | None) -> list[tuple[float, float]]:
    """Return the parts of the strip, from 0 (left) to 1, that a clock position or sector covers.

    The strip is the wall cut along its crown: 12 at both edges, 9 at a quarter, 3 at three.
    A single position has no width; a sector runs clockwise, 12 to 12 all round.
    """
    if first is None:
        return []
    if last is None or (first == last and first % 12):
        at = 1 - (first % 12) / 12
        return [(at, at)]
    if first % 12 == last % 12 == 0:
        return [(0.0, 1.0)]
    start, end = first % 12, last % 12 or 12
    if start < end:
        return [(1 - end / 12, 1 - start / 12)]
    spans = [(0.0, 1 - start / 12), (1 - end / 12, 1.0)]
    return [(low, high) for low, high in spans if high > low]


def water_share(report: Report) -> float:
    """Return the share of a circular pipe's wall below the header's water level."""
    level = report.header.get("water_level_pct")
    if not isinstance(level, int | float) or isinstance(level, bool) or not 0 < level <= 100:
        return 0.0
    return math.acos(1 - 2 * level / 100) / math.pi
