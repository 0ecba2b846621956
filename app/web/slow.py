"""Threads of their own for what takes long, so that a tag never waits for one of them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from anyio import CapacityLimiter
from anyio.lowlevel import RunVar
from anyio.to_thread import run_sync

THREADS = 8
"""Reports, pictures and imports at a time; others wait, which occupies no thread."""

_limiter: RunVar[CapacityLimiter] = RunVar("slow work")


def slow(endpoint: Callable[..., Any]) -> Callable[..., Coroutine[Any, Any, Any]]:
    """Let a blocking endpoint run beside those that answer at once, not among them."""

    async def run(*positional: Any, **named: Any) -> Any:
        return await run_sync(partial(endpoint, *positional, **named), limiter=_of_this_loop())

    run.__name__, run.__doc__ = endpoint.__name__, endpoint.__doc__
    run.__module__, run.__qualname__ = endpoint.__module__, endpoint.__qualname__
    # FastAPI reads from it what to hand over; the names in it are those of the endpoint's module.
    run.__signature__ = inspect.signature(endpoint, eval_str=True)  # type: ignore[attr-defined]
    return run


def _of_this_loop() -> CapacityLimiter:
    try:
        return _limiter.get()
    except LookupError:
        limiter = CapacityLimiter(THREADS)
        _limiter.set(limiter)
        return limiter
