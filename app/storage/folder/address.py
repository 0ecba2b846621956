"""Where the server that uses a data folder is reached from its own machine.

The file lies beside the lock, which shows whether a server uses the folder.
"""

from __future__ import annotations

import fcntl
import json
from contextlib import suppress
from dataclasses import asdict, dataclass

from app.storage.folder.files import Places, replace_file


@dataclass(frozen=True)
class Address:
    """The address of a server."""

    url: str
    """Scheme, host and port."""
    certificate: str | None
    """File of its certificate, if it uses TLS."""


class AddressFile:
    """The address kept in a data folder."""

    def __init__(self, places: Places) -> None:
        self._lock = places.lock
        self._path = places.root / "address.json"
        self._kept = b""

    def keep(self, address: Address) -> None:
        """Write the address of the server that uses the folder."""
        self._kept = json.dumps(asdict(address)).encode()
        replace_file(self._path, self._kept)

    def forget(self) -> None:
        """Delete the address of a server that stops, unless another one has taken over."""
        with suppress(FileNotFoundError):
            if self._path.read_bytes() == self._kept:
                self._path.unlink()

    def clear(self) -> None:
        """Delete what a killed server left, so that commands wait for the address of this one."""
        self._path.unlink(missing_ok=True)

    def read(self) -> Address | None:
        """Return the address; None while a server starts or stops."""
        try:
            return Address(**json.loads(self._path.read_bytes()))
        except FileNotFoundError:
            return None

    def is_in_use(self) -> bool:
        """Return whether a server uses the folder."""
        try:
            with self._lock.open("rb") as lock:
                # Any server holds it, alone or shared; this lock is released at once.
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except FileNotFoundError:
            return False
        return False
