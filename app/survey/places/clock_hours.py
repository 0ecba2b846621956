"""Clock positions as sets of whole hours, kept as bits so that a database compares them."""

from __future__ import annotations

ALL_ROUND = 0b1111_1111_1111


def hour_bits(first: int | None, last: int | None = None) -> int:
    """Return the hours of a sector as bits: 1 for 1 o'clock, 2048 for 12 o'clock.

    Args:
        first: The hour where the sector begins, 1 to 12; None for no clock position at all.
        last: Where it ends, clockwise seen in the direction of travel; None for one hour only.
            From 12 to 12 is all round.
    """
    if first is None:
        return 0
    if (first, last) == (12, 12):
        return ALL_ROUND
    count = 1 if last is None else (last - first) % 12 + 1
    return sum(1 << (first - 1 + step) % 12 for step in range(count))
