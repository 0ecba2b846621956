"""Memory that is free goes back to the system."""

import os
from pathlib import Path

from app.ops.memory import give_back

BLOCK_BYTES, BLOCKS = 60_000, 1500


def resident_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def test_memory_between_blocks_that_stay_goes_back() -> None:
    blocks = [b"x" * BLOCK_BYTES for _ in range(BLOCKS)]
    before = resident_bytes()
    del blocks[:-1]  # the allocator cannot shorten its heap below the last one
    give_back()
    assert before - resident_bytes() > BLOCK_BYTES * BLOCKS // 2
