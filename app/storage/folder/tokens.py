"""Named access tokens, by the SHA-256 of their secrets, in a file of the data folder.

They are in a file because `chainage token` changes them while a server runs, and the only writer of
the database is in the server. A change holds a lock; a reader gets the whole old or the whole new
file.
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
from app.storage.folder.files import write_durably


class Role(StrEnum):
    """Roles of tokens; each includes the rights of those before it."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ADMIN = "admin"

    def may(self, needed: Role) -> bool:
        """Return whether this role includes the rights of `needed`."""
        roles = list(Role)
        return roles.index(self) >= roles.index(needed)


class NamedToken(msgspec.Struct, frozen=True):
    """A named token without its secret, which is stored nowhere."""

    name: str
    role: Role
    digest: str
    """SHA-256 of the secret, hexadecimal."""
    created_at: datetime
    revoked_at: datetime | None = None
    projects: frozenset[str] | None = None
    """The only projects that it sees and changes; None: all of them."""


class _Content(msgspec.Struct, frozen=True):
    tokens: tuple[NamedToken, ...] = ()


_Stamp = tuple[int, int, int]


class TokenFile:
    """The tokens of a data folder; the next call sees the changes of other processes."""

    def __init__(self, folder: Path) -> None:
        """Remember the folder; nothing is read or made yet."""
        self.folder = folder
        self._path = folder / "tokens.json"
        self._lock = threading.Lock()
        self._read: tuple[_Stamp | None, tuple[NamedToken, ...]] = (None, ())

    def all(self) -> tuple[NamedToken, ...]:
        """Return all tokens in the order of creation, including revoked ones.

        Raises:
            UnreadableTokens: The file is damaged.
        """
        with self._lock:
            stamp = self._stamp()
            if stamp != self._read[0]:
                self._read = (stamp, self._load() if stamp else ())
            return self._read[1]

    def valid(self, digest: str) -> NamedToken | None:
        """Return the token with this digest, or None if unknown or revoked."""
        found = (token for token in self.all() if token.digest == digest)
        return next((token for token in found if token.revoked_at is None), None)

    def add(
        self, name: str, role: Role, digest: str, projects: frozenset[str] | None = None
    ) -> None:
        """Add a token, for some projects or for all of them, and sync the file.

        Raises:
            TokenNameTaken: Another valid token has this name.
        """

        def added(tokens: tuple[NamedToken, ...]) -> tuple[NamedToken, ...]:
            if any(token.name == name and token.revoked_at is None for token in tokens):
                raise TokenNameTaken(
                    f"There is a token {name!r} already; revoke it first, or take another name."
                )
            made = NamedToken(name, role, digest, datetime.now(UTC), projects=projects)
            return (*tokens, made)

        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._change(added)

    def revoke(self, name: str) -> None:
        """Revoke the valid token of this name and sync the file.

        Raises:
            TokenNotFound: No valid token has this name.
        """
        self._replace(name, revoked_at=datetime.now(UTC))

    def change_role(self, name: str, role: Role) -> None:
        """Give the valid token of this name another role and sync the file.

        Raises:
            TokenNotFound: No valid token has this name.
        """
        self._replace(name, role=role)

    def _replace(self, name: str, **changes: object) -> None:
        def replaced(tokens: tuple[NamedToken, ...]) -> tuple[NamedToken, ...]:
            for i, token in enumerate(tokens):
                if token.name == name and token.revoked_at is None:
                    changed = msgspec.structs.replace(token, **changes)
                    return (*tokens[:i], changed, *tokens[i + 1 :])
            raise _not_found(name)

        if not self._path.exists():
            raise _not_found(name)
        self._change(replaced)

    def _change(self, changed: Callable[[tuple[NamedToken, ...]], tuple[NamedToken, ...]]) -> None:
        with self._locked():
            tokens = self._load() if self._path.exists() else ()
            content = msgspec.json.format(msgspec.json.encode(_Content(changed(tokens))))
            write_durably(self._path, content, mode=0o600)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Lock the file against other processes; a change takes milliseconds."""
        with (self.folder / "tokens.lock").open("wb") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def _stamp(self) -> _Stamp | None:
        """Return a stamp that differs after every replacement of the file; None without a file."""
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
