"""Ports for servers that are started later, or again."""

from __future__ import annotations

import secrets
import socket
from contextlib import suppress

_FIRST, _LAST = 10_000, 32_000
"""Below the ports that a system gives to connections and to servers that state none: one of those
would be taken while a killed server is away."""


def free_port() -> int:
    """Return a port of this machine that is free now; another process chooses another one."""
    while True:
        port = _FIRST + secrets.randbelow(_LAST - _FIRST)
        with suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return port
