"""Memory that is free again goes back to the system, so that one busy hour does not stay for good.

GNU's allocator keeps it: in an arena for each of some dozens of threads, and between small blocks
that are still in use. Other systems' allocators lack these two functions, and need nothing.
"""

from __future__ import annotations

import ctypes

_ARENA_MAX, _MMAP_THRESHOLD = -8, -3
"""Numbers of parameters in malloc.h."""
_ARENAS = 2
"""More of them serve threads that allocate at once; Python's threads take turns."""
_MAPPED_BYTES = 128 * 2**10
"""Larger blocks are mapped one by one and go back when they are freed. The allocator would raise
this to the largest block so far, 32 MiB at most."""

_libc = ctypes.CDLL(None)


def keep_little() -> None:
    """Let the allocator keep little; called before there are many threads."""
    if hasattr(_libc, "mallopt"):
        _libc.mallopt(_ARENA_MAX, _ARENAS)
        _libc.mallopt(_MMAP_THRESHOLD, _MAPPED_BYTES)


def give_back() -> None:
    """Give the pages of the allocator that hold nothing back to the system."""
    if hasattr(_libc, "malloc_trim"):
        _libc.malloc_trim(0)
