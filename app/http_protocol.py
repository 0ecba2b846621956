"""HTTP/1.1 as uvicorn speaks it, with an end to the wait for a request that never gets whole."""

from __future__ import annotations

import asyncio

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_S = 20.0
"""Seconds that a client has for the head of a request, from its connection or its first byte on."""


class PromptProtocol(H11Protocol):
    """Closes a connection whose request has no end of its head in time.

    uvicorn waits for ever, so that some hundred such connections would keep everybody out.
    """

    _overdue: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """The first head is awaited from here on."""
        super().connection_made(transport)
        self._await_head()

    def data_received(self, data: bytes) -> None:
        """A head may begin, grow or end with this."""
        super().data_received(data)
        if self.conn.their_state is h11.IDLE and data:
            self._await_head()
        else:
            self._stop_waiting()

    def connection_lost(self, exc: Exception | None) -> None:
        """Nothing more is awaited."""
        self._stop_waiting()
        super().connection_lost(exc)

    def _await_head(self) -> None:
        if self._overdue is None:
            self._overdue = self.loop.call_later(HEAD_S, self.transport.close)

    def _stop_waiting(self) -> None:
        if self._overdue is not None:
            self._overdue.cancel()
            self._overdue = None
