"""The one way in which a figure is rounded, so that a distance reads the same wherever it stands.

A value is rounded half away from zero, as people do it, and on its decimal form: 3.815 is 3.82
although its binary form lies a little below.  An interval is rounded up.  The page has the same
rules in static/core/rounding.js.
"""

from __future__ import annotations

import math
from decimal import ROUND_HALF_UP, Context, Decimal

_WHOLE = 1e-9
"""Of a number that is whole but for its binary form."""
_EXACT = Context(prec=400, rounding=ROUND_HALF_UP)
"""Digits for any float: an imported header may hold 1e300."""


def decimals(value: float, digits: int, *, unit: float = 1.0) -> str:
    """With so many decimals, halves away from zero; never -0.

    Args:
        value: Finite.
        digits: Behind the point.
        unit: What is shown as 1.
    """
    exact = Decimal(repr(float(value))) / Decimal(repr(float(unit)))
    shown = exact.quantize(Decimal(1).scaleb(-digits), context=_EXACT)
    return f"{abs(shown) if shown == 0 else shown:f}"


def signed(value: float, digits: int) -> str:
    """The same with a plus sign before what is above zero."""
    text = decimals(value, digits)
    return f"+{text}" if float(text) > 0 else text


def rounded(value: float, digits: int) -> float:
    """As `decimals`, as a number."""
    return float(decimals(value, digits))


def rounded_up(value: float, digits: int) -> float:
    """To the next step that is not below it."""
    steps = 10.0**digits
    return math.ceil(value * steps - _WHOLE) / steps


def metres(mm: float) -> float:
    """A distance as it is published: metres to the millimetre.

    By way of whole tenths of a millimetre, as tracks are sent, so that the page, which rounds
    those, shows what reports do.
    """
    return rounded(rounded(mm / 1000, 4), 3)
