"""A line to a server that breaks within answers, as a radio link does."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress
from typing import Self
from urllib.parse import urlsplit

from steps import Server

HEAD_END = b"\r\n\r\n"
MOST_BYTES = 65536


class Line:
    """Forwards TCP connections to a server; while it `breaks`, each ends within an answer."""

    def __init__(self, server: Server) -> None:
        """Prepare a line to a running server."""
        self._server = urlsplit(server.url)
        self._door = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._door.getsockname()[1]}"
        self.breaks = False

    def __enter__(self) -> Self:
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._door.close()

    def _accept(self) -> None:
        with suppress(OSError):  # the door is closed
            while True:
                browser, _ = self._door.accept()
                server = socket.create_connection((self._server.hostname, self._server.port))
                for way in ((browser, server), (server, browser)):
                    is_answer = way[0] is server
                    threading.Thread(
                        target=self._carry, args=(*way, is_answer), daemon=True
                    ).start()

    def _carry(self, source: socket.socket, target: socket.socket, is_answer: bool) -> None:
        with suppress(OSError):
            while piece := source.recv(MOST_BYTES):
                if is_answer and self.breaks:
                    end = piece.find(HEAD_END)
                    target.sendall(piece[: end + len(HEAD_END) + 1] if end >= 0 else b"")
                    break
                target.sendall(piece)
        for end_of_line in (source, target):
            with suppress(OSError):
                end_of_line.shutdown(socket.SHUT_RDWR)
            end_of_line.close()
