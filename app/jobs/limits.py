"""Limits that a child sets for itself before it imports a decoder."""

import resource

from app.jobs.messages import Limits

_OPEN_FILES = 64
_CPU_GRACE_S = 5


def apply(limits: Limits) -> None:
    """Limit address space, processor time and file size; disable core dumps."""
    _set(resource.RLIMIT_AS, limits.memory_bytes)
    _set(resource.RLIMIT_NOFILE, _OPEN_FILES)
    _set(resource.RLIMIT_FSIZE, limits.file_bytes)
    _set(resource.RLIMIT_CORE, 0)
    if limits.cpu_s is not None:
        # The soft limit sends SIGXCPU, which names the reason; SIGKILL at the hard limit does not.
        _set(resource.RLIMIT_CPU, limits.cpu_s, limits.cpu_s + _CPU_GRACE_S)


def _set(kind: int, soft: int, hard: int | None = None) -> None:
    _, most = resource.getrlimit(kind)
    hard = soft if hard is None else hard
    hard = hard if most == resource.RLIM_INFINITY else min(hard, most)
    resource.setrlimit(kind, (min(soft, hard), hard))
