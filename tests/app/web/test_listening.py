"""The socket that the server answers on."""

import socket
from pathlib import Path

from app.main import listening
from app.settings import Settings


def test_the_body_of_an_answer_does_not_wait_until_its_head_is_acknowledged(tmp_path: Path) -> None:
    with listening(Settings(data=tmp_path), "127.0.0.1", 0) as listener:
        listener.listen()
        with socket.create_connection(listener.getsockname()), listener.accept()[0] as connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
