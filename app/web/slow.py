"""Separate threads for slow requests, so that a tag never waits for one of them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from anyio import CapacityLimiter
from anyio.lowlevel import RunVar
from anyio.to_thread import run_sync

THREADS = 8
"""Reports, pictures and imports at a time; further ones wait without occupying a thread."""

_limiter: RunVar[CapacityLimiter] = RunVar("slow work")


def slow(endpoint: Callable[..., Any]) -> Callable[..., Coroutine[Any, Any, Any]]:
    """Run a blocking endpoint in the separate threads."""

    async def run(*positional: Any, **named: Any) -> Any:
        return await run_sync(partial(endpoint, *positional, **named), limiter=_of_this_loop())

    run.__name__, run.__doc__ = endpoint.__name__, endpoint.__doc__
    run.__module__, run.__qualname__ = endpoint.__module__, endpoint.__qualname__
    # FastAPI reads the parameters from it; the names in it are those of the endpoint's module.
    run.__signature__ = inspect.signature(endpoint, eval_str=True)  # type: ignore[attr-defined]
    return run


def _of_this_loop() -> CapacityLimiter:
    try:
        return _limiter.get()
    except LookupError:
        limiter = CapacityLimiter(THREADS)
        _limiter.set(limiter)
        return limiter
