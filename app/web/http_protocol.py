"""HTTP/1.1 of uvicorn, with a time limit for incomplete requests.

uvicorn waits forever and accepts any number of connections, so that some hundred silent ones would
block everybody. `middleware.Envelope` limits the time for reading a body.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from ipaddress import ip_address, ip_network

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from app.access.access import network_of

HEAD_S = 20.0
"""Seconds for the head of a request, from the connection or the first byte on."""
CONNECTIONS = 512
"""Most connections at once; a page has seven or eight."""
CONNECTIONS_OF_ADDRESS = 256
"""Most connections from one address, unless it is that of a trusted proxy."""


class PromptProtocol(H11Protocol):
    """Closes a connection whose request is overdue, or the longest overdue one to make room.

    A request is pending while its head is incomplete, and after an answer that came before the end
    of the request.
    """

    head_s = HEAD_S
    most = CONNECTIONS
    most_of_address = CONNECTIONS_OF_ADDRESS

    _overdue: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start waiting for the first head."""
        super().connection_made(transport)
        self._await_request()
        neighbours = self._neighbours()
        if len(neighbours) > self.most_of_address:
            self._make_room(neighbours)
        elif len(self.connections) > self.most:
            self._make_room(self.connections)

    def data_received(self, data: bytes) -> None:
        """Restart or stop waiting: the bytes may begin, continue or complete a request."""
        super().data_received(data)
        state = self.conn.their_state
        is_answered = self.cycle is not None and self.cycle.response_complete
        if state is h11.IDLE or (state is h11.SEND_BODY and is_answered):
            self._await_request()
        else:
            self._stop_waiting()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._stop_waiting()
        super().connection_lost(exc)

    def _await_request(self) -> None:
        if self._overdue is None and not self.transport.is_closing():
            self._overdue = self.loop.call_later(self.head_s, self.transport.abort)

    def _stop_waiting(self) -> None:
        if self._overdue is not None:
            self._overdue.cancel()
            self._overdue = None

    def _neighbours(self) -> list[asyncio.Protocol]:
        """Return the connections from the same address; none if it is that of a trusted proxy."""
        address = _address_of(self)
        if address is None or (self.config.proxy_headers and self._is_of_proxy(address)):
            return []
        return [
            other
            for other in self.connections
            if (theirs := _address_of(other)) and network_of(theirs) == network_of(address)
        ]

    def _is_of_proxy(self, address: str) -> bool:
        return any(
            ip_address(address) in ip_network(proxy) for proxy in self.config.forwarded_allow_ips
        )

    def _make_room(self, among: Iterable[asyncio.Protocol]) -> None:
        """Close the longest pending connection, so that prompt requests are served."""
        owing = {
            other._overdue.when(): other
            for other in among
            if isinstance(other, PromptProtocol) and other._overdue is not None
        }
        oldest = owing[min(owing)]
        oldest._stop_waiting()  # not chosen again before it is closed
        oldest.transport.abort()


def _address_of(connection: object) -> str | None:
    """Return the address from which a connection comes, as protocols of uvicorn note it."""
    client: tuple[str, int] | None = getattr(connection, "client", None)
    return None if client is None else client[0]
