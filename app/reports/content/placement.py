"""Places labels without overlap, as near as possible to what they name."""

from __future__ import annotations

from collections.abc import Sequence


def capacity(gap: float, low: float, high: float) -> int:
    """Return how many labels fit, at least one."""
    return max(1, int((high - low) / gap + 1e-9) + 1)


def spread(wanted: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Return places at least `gap` apart, within [low, high], in order and near the wanted ones.

    With z_i = y_i - i gap, the places y keep the gap exactly if z does not decrease, so the least
    squares solution is an isotonic regression (pool adjacent violators).

    Args:
        wanted: Wanted places of the labels, not decreasing.
        gap: Least distance of neighbours, in the unit of `wanted`, like low and high.
        low: Lower bound of the first label.
        high: Upper bound of the last label.

    Raises:
        ValueError: There are more labels than `capacity`.
    """
    if len(wanted) > capacity(gap, low, high):
        raise ValueError(f"{len(wanted)} labels {gap:g} apart do not fit from {low:g} to {high:g}.")
    pools: list[tuple[float, int]] = []
    """Mean and number of labels that touch each other."""
    for index, place in enumerate(wanted):
        mean, count = place - index * gap, 1
        while pools and pools[-1][0] > mean:
            before, others = pools.pop()
            mean = (before * others + mean * count) / (others + count)
            count += others
        pools.append((mean, count))
    top = max(low, high - (len(wanted) - 1) * gap)
    level = [min(max(mean, low), top) for mean, count in pools for _ in range(count)]
    return [place + index * gap for index, place in enumerate(level)]
