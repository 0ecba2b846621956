"""Separate threads for slow requests, so that a tag never waits for one of them."""

from __future__ import annotations

import inspect
from collections.abc import AsyncGenerator, Callable, Coroutine, Iterator
from functools import partial
from typing import Annotated, Any

from anyio import CapacityLimiter
from anyio.to_thread import run_sync
from fastapi import Depends
from fastapi.concurrency import iterate_in_threadpool

from app.web.middleware import person_of
from app.web.turns import Turns

PersonDep = Annotated[str, Depends(person_of)]

Endpoint = Callable[..., Any]
Waiting = Callable[..., Coroutine[Any, Any, Any]]


_SLOW = Turns("slow work", most=8, each=4)
"""What waits for the disk, a child process or many rows."""
_HEAVY = Turns("heavy work", most=3, each=2)
"""What keeps a processor busy or takes much memory: reports, tables, maps."""
_THUMBNAILS = Turns("thumbnails", most=2, each=1)
"""A list wants dozens of them at once."""

_STREAMS = Turns("streams", most=4, each=1)
"""What is made while it is sent, at the speed of its reader."""


def slow(endpoint: Endpoint) -> Waiting:
    """Run a blocking endpoint in threads apart from those of quick ones."""
    return _in_turns(_SLOW, endpoint)


def heavy(endpoint: Endpoint) -> Waiting:
    """Run an endpoint that takes much of the machine, a few of them at a time."""
    return _in_turns(_HEAVY, endpoint)


def for_lists(endpoint: Endpoint) -> Waiting:
    """Run a blocking endpoint in threads that no other slow request waits for."""
    return _in_turns(_THUMBNAILS, endpoint)


async def streamed(blocks: Iterator[bytes], person: str) -> AsyncGenerator[bytes]:
    """Yield the blocks of what is made while it is sent, once its turn has come."""
    async with _STREAMS.turn(person):
        async for block in iterate_in_threadpool(blocks):
            yield block


def _in_turns(turns: Turns, endpoint: Endpoint) -> Waiting:
    async def run(*positional: Any, whose_turn: str, **named: Any) -> Any:
        async with turns.turn(whose_turn):
            # The turn is the limit; the default one is that of quick requests.
            return await run_sync(
                partial(endpoint, *positional, **named), limiter=CapacityLimiter(1)
            )

    run.__name__, run.__doc__ = endpoint.__name__, endpoint.__doc__
    run.__module__, run.__qualname__ = endpoint.__module__, endpoint.__qualname__
    # FastAPI reads the parameters from it; the names in it are those of the endpoint's module.
    signature = inspect.signature(endpoint, eval_str=True)
    person = inspect.Parameter(
        "whose_turn",
        inspect.Parameter.KEYWORD_ONLY,
        annotation=PersonDep,
    )
    run.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[*signature.parameters.values(), person]
    )
    return run
