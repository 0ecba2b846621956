"""Parts of the pipe: whether a distance lies within one, and whether two overlap.

An adjusted or converted distance differs in its last bits from the one that it is compared with,
and differently on another processor: the joint at the end of 12 m may lie at 12.000000000000013 m.
So ends are compared up to `SAME_M`; static/core/wall/spans.js does so in the page, up to
the rounding of what it is sent.
"""

from __future__ import annotations

Span = tuple[float, float]
"""From the lower to the higher end."""

SAME_MM = 0.5
"""Distances less than this apart are the same: they are published to the millimetre."""
SAME_M = SAME_MM / 1000


def is_same(one_m: float, other_m: float) -> bool:
    """Return whether two distances are the same."""
    return abs(one_m - other_m) < SAME_M


def is_within(distance_m: float, span_m: Span) -> bool:
    """Return whether a distance lies in a part of the pipe, its ends included."""
    return span_m[0] - SAME_M <= distance_m <= span_m[1] + SAME_M


def begins_within(distance_m: float, span_m: Span) -> bool:
    """Return whether a distance lies in a part where another one follows, which has the end."""
    return span_m[0] - SAME_M <= distance_m < span_m[1] - SAME_M


def overlap(one_m: Span, other_m: Span) -> bool:
    """Return whether two parts have more than an end in common."""
    return one_m[0] < other_m[1] - SAME_M and one_m[1] > other_m[0] + SAME_M
