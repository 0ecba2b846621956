"""Places labels without overlap, as near as possible to what they name."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate


def capacity(gap: float, low: float, high: float) -> int:
    """Return how many labels fit, at least one."""
    return max(1, int((high - low) / gap + 1e-9) + 1)


def spread(
    wanted: Sequence[float], gaps: float | Sequence[float], low: float, high: float
) -> list[float]:
    """Return places at least `gaps` apart, within [low, high], in order and near the wanted ones.

    With z_i = y_i minus the gaps before it, the places y keep the gaps exactly if z does not
    decrease, so the least squares solution is an isotonic regression (pool adjacent violators).

    Args:
        wanted: Wanted places of the labels, not decreasing.
        gaps: Least distance of all neighbours, or of each label from the next, in the unit of
            `wanted`, like low and high.
        low: Lower bound of the first label.
        high: Upper bound of the last label.

    Raises:
        ValueError: The labels do not fit.
    """
    each = [gaps] * (len(wanted) - 1) if isinstance(gaps, int | float) else gaps
    before = list(accumulate(each, initial=0.0))
    if before[-1] > high - low + 1e-6:
        raise ValueError(f"{len(wanted)} labels do not fit from {low:g} to {high:g}.")
    pools: list[tuple[float, int]] = []
    """Mean and number of labels that touch each other."""
    for place, offset in zip(wanted, before, strict=False):
        mean, count = place - offset, 1
        while pools and pools[-1][0] > mean:
            earlier, others = pools.pop()
            mean = (earlier * others + mean * count) / (others + count)
            count += others
        pools.append((mean, count))
    top = max(low, high - before[-1])
    level = [min(max(mean, low), top) for mean, count in pools for _ in range(count)]
    return [place + offset for place, offset in zip(level, before, strict=False)]
