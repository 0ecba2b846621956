"""Time and memory of a piece of work, with those of the processes that it runs."""

from __future__ import annotations

import time
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage


class Used:
    """What is used from now on."""

    def __init__(self) -> None:
        self._before_mb = _peak_mb(RUSAGE_SELF)
        self._cpu_s = _cpu_s()
        self._began_s = time.perf_counter()

    def __str__(self) -> str:
        wall_s, cpu_s = time.perf_counter() - self._began_s, _cpu_s() - self._cpu_s
        return (
            f"{wall_s:.2f} s ({cpu_s:.2f} s of the processor), "
            f"peak {_peak_mb(RUSAGE_SELF):.0f} MiB (before {self._before_mb:.0f}), "
            f"of a child {_peak_mb(RUSAGE_CHILDREN):.0f} MiB"
        )


def _peak_mb(who: int) -> float:
    return getrusage(who).ru_maxrss / 1024


def _cpu_s() -> float:
    both = getrusage(RUSAGE_SELF), getrusage(RUSAGE_CHILDREN)
    return sum(one.ru_utime + one.ru_stime for one in both)
