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
THUMBNAIL_THREADS = 2

_limiter: RunVar[CapacityLimiter] = RunVar("slow work")
_thumbnail_limiter: RunVar[CapacityLimiter] = RunVar("thumbnails")

Endpoint = Callable[..., Any]
Waiting = Callable[..., Coroutine[Any, Any, Any]]


def slow(endpoint: Endpoint) -> Waiting:
    """Run a blocking endpoint in the separate threads."""
    return _run_in(_limiter, THREADS, endpoint)


def for_lists(endpoint: Endpoint) -> Waiting:
    """Run a blocking endpoint in threads of its own.

    A list wants dozens of thumbnails at once, and no other slow request may wait for all of them.
    """
    return _run_in(_thumbnail_limiter, THUMBNAIL_THREADS, endpoint)


def _run_in(limiter: RunVar[CapacityLimiter], threads: int, endpoint: Endpoint) -> Waiting:
    async def run(*positional: Any, **named: Any) -> Any:
        work = partial(endpoint, *positional, **named)
        return await run_sync(work, limiter=_of_this_loop(limiter, threads))

    run.__name__, run.__doc__ = endpoint.__name__, endpoint.__doc__
    run.__module__, run.__qualname__ = endpoint.__module__, endpoint.__qualname__
    # FastAPI reads the parameters from it; the names in it are those of the endpoint's module.
    run.__signature__ = inspect.signature(endpoint, eval_str=True)  # type: ignore[attr-defined]
    return run


def _of_this_loop(limiter: RunVar[CapacityLimiter], threads: int) -> CapacityLimiter:
    try:
        return limiter.get()
    except LookupError:
        made = CapacityLimiter(threads)
        limiter.set(made)
        return made
