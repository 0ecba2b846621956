"""What of many cases is in the default run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest


def first_of(count: int, values: Sequence[Any]) -> list[Any]:
    """Return the values of a parameter, of which only the first `count` are in the default run."""
    rest = [pytest.param(each, marks=pytest.mark.long) for each in values[count:]]
    return [*values[:count], *rest]
