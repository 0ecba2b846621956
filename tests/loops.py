"""Coroutines in a test."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

T = TypeVar("T")


def run(coroutine: Callable[[], Coroutine[Any, Any, T]]) -> T:
    """Run a coroutine in a thread of its own.

    In this one Playwright's loop runs once a test of a browser was here.
    """
    with ThreadPoolExecutor(1) as other:
        return other.submit(lambda: asyncio.run(coroutine())).result()
