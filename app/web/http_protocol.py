"""HTTP/1.1 as uvicorn speaks it, with an end to the wait for a request that never gets whole.

uvicorn waits for ever and takes any number of connections, so that some hundred that send nothing
would keep everybody out.  How long a body may take while it is read, `middleware.Envelope` says.
"""

from __future__ import annotations

import asyncio

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_S = 20.0
"""Seconds that a client has for the head of a request, from its connection or its first byte on."""
CONNECTIONS = 512
"""At once; a page has seven or eight."""


class PromptProtocol(H11Protocol):
    """Closes a connection that owes its request for too long, or that has owed it the longest.

    One owes a request while its head has begun to be awaited and is not whole, and after an answer
    that came before the end of the request.
    """

    head_s = HEAD_S
    most = CONNECTIONS

    _overdue: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """The first head is awaited from here on."""
        super().connection_made(transport)
        self._await_request()
        if len(self.connections) > self.most:
            self._make_room()

    def data_received(self, data: bytes) -> None:
        """A request may begin, grow or end with this."""
        super().data_received(data)
        state = self.conn.their_state
        is_answered = self.cycle is not None and self.cycle.response_complete
        if state is h11.IDLE or (state is h11.SEND_BODY and is_answered):
            self._await_request()
        else:
            self._stop_waiting()

    def connection_lost(self, exc: Exception | None) -> None:
        """Nothing more is awaited."""
        self._stop_waiting()
        super().connection_lost(exc)

    def _await_request(self) -> None:
        if self._overdue is None and not self.transport.is_closing():
            self._overdue = self.loop.call_later(self.head_s, self.transport.abort)

    def _stop_waiting(self) -> None:
        if self._overdue is not None:
            self._overdue.cancel()
            self._overdue = None

    def _make_room(self) -> None:
        """Who sends a request at once is served, however many connections send nothing."""
        owing = {
            other._overdue.when(): other
            for other in self.connections
            if isinstance(other, PromptProtocol) and other._overdue is not None
        }
        oldest = owing[min(owing)]
        oldest._stop_waiting()  # it is not chosen again before it is gone
        oldest.transport.abort()
