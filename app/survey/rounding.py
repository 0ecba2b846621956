"""The one way to round a figure, so that a distance reads the same wherever it is shown.

A value is rounded half away from zero, as people do, on its decimal form: 3.815 becomes 3.82
although its binary form is slightly smaller. An interval is rounded up.
static/core/wall/rounding.js has the same rules.
"""

from __future__ import annotations

import math
from decimal import ROUND_HALF_UP, Context, Decimal

_WHOLE = 1e-9
"""Tolerance within which a number counts as whole despite its binary form."""
_EXACT = Context(prec=400, rounding=ROUND_HALF_UP)
"""Enough digits for any float: an imported header may hold 1e300."""


def decimals(value: float, digits: int, *, unit: float = 1.0) -> str:
    """Format a value with so many decimals, halves away from zero; never -0.

    Args:
        value: Finite.
        digits: Number of decimals.
        unit: Divisor; the value that is shown as 1.
    """
    exact = Decimal(repr(float(value))) / Decimal(repr(float(unit)))
    shown = exact.quantize(Decimal(1).scaleb(-digits), context=_EXACT)
    return f"{abs(shown) if shown == 0 else shown:f}"


def signed(value: float, digits: int) -> str:
    """Format like `decimals`, with a plus sign for values above zero."""
    text = decimals(value, digits)
    return f"+{text}" if float(text) > 0 else text


def rounded(value: float, digits: int) -> float:
    """Round like `decimals` and return a number."""
    return float(decimals(value, digits))


def rounded_up(value: float, digits: int) -> float:
    """Round up to the next step."""
    steps = 10.0**digits
    return math.ceil(value * steps - _WHOLE) / steps


def metres(mm: float) -> float:
    """Convert a distance for publication: metres to the millimetre.

    It is rounded to tenths of a millimetre first, as tracks are sent, so that the page, which
    rounds those, agrees with reports.
    """
    return rounded(rounded(mm / 1000, 4), 3)


def with_interval(value: float, u95: float) -> str:
    """Format a measured size `23 ± 2`, with a decimal where the interval is below 1."""
    digits = 1 if u95 < 1 else 0
    return f"{decimals(value, digits)} ± {decimals(rounded_up(u95, digits), digits)}"
