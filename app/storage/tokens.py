"""Named access tokens, by the SHA-256 of their secrets, in a file of the data folder.

A file, because `chainage token` changes it while a server runs, and the database has one writer,
which is in the server.  Whoever changes the file holds a lock; whoever reads it gets the old one or
the new one, whole.
"""

from __future__ import annotations

import fcntl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path

import msgspec

from app.errors import TokenNameTaken, TokenNotFound, UnreadableTokens
from app.storage.files import write_durably


class Role(StrEnum):
    """What a token may do; each may do what those before it may."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ADMIN = "admin"

    def may(self, needed: Role) -> bool:
        """Whether this role is enough where `needed` is asked for."""
        roles = list(Role)
        return roles.index(self) >= roles.index(needed)


class NamedToken(msgspec.Struct, frozen=True):
    """A token; the secret itself is kept nowhere."""

    name: str
    role: Role
    digest: str
    """SHA-256 of the secret, hexadecimal."""
    created_at: datetime
    revoked_at: datetime | None = None


class _Content(msgspec.Struct, frozen=True):
    tokens: tuple[NamedToken, ...] = ()


_Stamp = tuple[int, int, int]


class TokenFile:
    """The tokens of a data folder; a change by another process is seen by the next call."""

    def __init__(self, folder: Path) -> None:
        """Nothing is read or made yet."""
        self.folder = folder
        self._path = folder / "tokens.json"
        self._lock = threading.Lock()
        self._read: tuple[_Stamp | None, tuple[NamedToken, ...]] = (None, ())

    def all(self) -> tuple[NamedToken, ...]:
        """In the order in which they were made, the revoked ones too.

        Raises:
            UnreadableTokens: The file is damaged.
        """
        with self._lock:
            stamp = self._stamp()
            if stamp != self._read[0]:
                self._read = (stamp, self._load() if stamp else ())
            return self._read[1]

    def valid(self, digest: str) -> NamedToken | None:
        """The token with this digest, unless it is revoked."""
        found = (token for token in self.all() if token.digest == digest)
        return next((token for token in found if token.revoked_at is None), None)

    def add(self, name: str, role: Role, digest: str) -> None:
        """Keep a new one; when this returns, it is on the disk.

        Raises:
            TokenNameTaken: Another one of this name is valid.
        """

        def added(tokens: tuple[NamedToken, ...]) -> tuple[NamedToken, ...]:
            if any(token.name == name and token.revoked_at is None for token in tokens):
                raise TokenNameTaken(
                    f"There is a token {name!r} already; revoke it first, or take another name."
                )
            return (*tokens, NamedToken(name, role, digest, datetime.now(UTC)))

        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._change(added)

    def revoke(self, name: str) -> None:
        """End the valid token of this name; when this returns, that is on the disk.

        Raises:
            TokenNotFound: No valid token has this name.
        """

        def revoked(tokens: tuple[NamedToken, ...]) -> tuple[NamedToken, ...]:
            for i, token in enumerate(tokens):
                if token.name == name and token.revoked_at is None:
                    ended = msgspec.structs.replace(token, revoked_at=datetime.now(UTC))
                    return (*tokens[:i], ended, *tokens[i + 1 :])
            raise _not_found(name)

        if not self._path.exists():
            raise _not_found(name)
        self._change(revoked)

    def _change(self, changed: Callable[[tuple[NamedToken, ...]], tuple[NamedToken, ...]]) -> None:
        with self._locked():
            tokens = self._load() if self._path.exists() else ()
            content = msgspec.json.format(msgspec.json.encode(_Content(changed(tokens))))
            write_durably(self._path, content, mode=0o600)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Among processes; a change takes milliseconds, so nobody waits for long."""
        with (self.folder / "tokens.lock").open("wb") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def _stamp(self) -> _Stamp | None:
        """Differs whenever the file was replaced; None without a file."""
        try:
            stat = self._path.stat()
        except FileNotFoundError:
            return None
        return stat.st_ino, stat.st_mtime_ns, stat.st_size

    def _load(self) -> tuple[NamedToken, ...]:
        try:
            return msgspec.json.decode(self._path.read_bytes(), type=_Content).tokens
        except msgspec.MsgspecError as error:
            raise UnreadableTokens(
                f"The file {self._path.name} of the data folder is damaged ({error}); restore it, "
                "or remove it to end all named tokens."
            ) from error


def _not_found(name: str) -> TokenNotFound:
    return TokenNotFound(f"There is no valid token {name!r}.")
