"""Limits that a child puts on itself before it imports a decoder."""

import resource

from app.jobs.messages import Limits

_OPEN_FILES = 64


def apply(limits: Limits) -> None:
    """Address space, processor time, files; no file can be written and no core dumped."""
    _set(resource.RLIMIT_AS, limits.memory_bytes)
    _set(resource.RLIMIT_NOFILE, _OPEN_FILES)
    _set(resource.RLIMIT_FSIZE, 0)
    _set(resource.RLIMIT_CORE, 0)
    if limits.cpu_s is not None:
        _set(resource.RLIMIT_CPU, limits.cpu_s)


def _set(kind: int, value: int) -> None:
    _, hard = resource.getrlimit(kind)
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(kind, (value, value))
