"""Access: tokens for programs, sessions for browsers, and the role of each; no passwords."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import logging
import secrets
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

from app.errors import Busy, DiskFull, Forbidden, TooManyAttempts, Unauthenticated
from app.storage.database.limits import Limit
from app.storage.folder.tokens import Role, TokenFile
from app.storage.records.access import AccessStore

logger = logging.getLogger(__name__)

SESSION_LIFETIME = timedelta(days=30)
"""Lifetime of a session, used or not; then the browser logs in again."""
SESSION_IDLE = timedelta(days=7)
_CLOCK_SLACK = timedelta(days=1)
"""How far in the future a session may seem to begin after the server's clock was corrected."""
_SEEN_STEP = timedelta(minutes=10)
"""Precision of the stored last use: writing at every request would be too much."""

SERVER = "server"
"""Name of the server's own token; no other token may have it."""
_WEAK_TOKEN_LENGTH = 16
_NAME_LENGTH = 100

_FAILURES = 10
_FAILURES_WITHIN_S = 60.0
_ADDRESSES = 1000


@dataclass(frozen=True)
class Principal:
    """The identity behind a request."""

    name: str
    role: Role
    credential: str
    """Digest of the session or token; it distinguishes one browser from another."""
    projects: frozenset[str] | None = None
    """The only projects that it sees and changes; None: all of them."""

    @property
    def limit(self) -> Limit | None:
        """What it is limited to."""
        return None if self.projects is None else Limit(self.name, self.projects)

    def require(self, needed: Role) -> None:
        """Raise Forbidden unless the role is sufficient."""
        if not self.role.may(needed):
            raise Forbidden(
                f"The token {self.name!r} has the role {self.role}; this needs the role {needed}."
            )


class Access:
    """Checks tokens and sessions, and limits guessing."""

    def __init__(self, store: AccessStore, tokens: TokenFile, server_token: str) -> None:
        """Accept `server_token` always; it replaces that of an earlier start."""
        self._store = store
        self._tokens = tokens
        self.server_token = server_token
        self._ticket_key = hashlib.sha256(f"3D view {server_token}".encode()).digest()
        self._server_digest = digest_of(server_token)
        self._log_ins = Attempts(counts_repeats=True)
        # A program that keeps using a revoked token is not guessing.
        self._guesses = Attempts(counts_repeats=False)
        self._guests = _Recent(_ADDRESSES)
        self._used_at: dict[str, datetime] = {}
        """By the digest of each valid token, when its use was last noted."""
        if len(server_token) < _WEAK_TOKEN_LENGTH:
            logger.warning(
                "The access token has only %d characters; use %d or more.",
                len(server_token),
                _WEAK_TOKEN_LENGTH,
            )

    def log_in(self, token: str, address: str) -> str:
        """Exchange a token for a new session's cookie value.

        Raises:
            TooManyAttempts: This address sent too many wrong tokens within a minute.
            Unauthenticated: The token is unknown or was revoked.
        """
        if self._presented_by(token, address, self._log_ins) is None:
            raise Unauthenticated("This token is not known to the server.")
        digest = digest_of(token)
        cookie = secrets.token_urlsafe(32)
        now = datetime.now(UTC)
        self._store.add_login(
            digest_of(cookie),
            digest,
            unused_since=now - SESSION_IDLE,
            begun_before=now - SESSION_LIFETIME,
        )
        return cookie

    def log_out(self, cookie: str) -> None:
        """End a session."""
        self._store.end_login(digest_of(cookie))

    def by_token(self, token: str, address: str) -> Principal | None:
        """Return the holder of a token, or None.

        Raises:
            TooManyAttempts: This address sent too many wrong tokens within a minute.
        """
        principal = self._presented_by(token, address, self._guesses)
        if principal is not None:
            self._note_token(principal.credential)
        return principal

    def _presented_by(self, token: str, address: str, attempts: Attempts) -> Principal | None:
        """Return the holder of a token, or None for a wrong one, which is counted.

        Others at the same address, such as an office or a proxy, may guess meanwhile. That shuts
        out neither a token that is too long to be guessed nor a holder who was admitted before.

        Raises:
            TooManyAttempts: This address sent too many wrong tokens within a minute.
        """
        digest = digest_of(token)
        if len(token) < _WEAK_TOKEN_LENGTH and not self._guests.has((address, digest)):
            attempts.check(address)
        principal = self._holder(digest)
        if principal is None:
            attempts.check(address)
            attempts.failed(address, digest)
        else:
            self._guests.add((address, digest))
        return principal

    def by_cookie(self, cookie: str) -> Principal | None:
        """Return the holder of a session; None if it does not exist or has ended."""
        return self._in_session(digest_of(cookie))

    def ticket(self, principal: Principal, inspection_id: str) -> str:
        """Make a ticket that admits the client of one 3D view to that view only.

        It ends with the session or token of `principal`.  It consists of hex digits and a dot. A
        ticket is no cookie, so no other page can make a browser send it.
        """
        return f"{principal.credential}.{self._signature(principal.credential, inspection_id)}"

    def by_ticket(self, ticket: str, inspection_id: str) -> Principal | None:
        """Return the holder of a ticket to the 3D view of this inspection.

        Return None for a false ticket, and once the session or token of the holder has ended.
        """
        credential, _, signature = ticket.partition(".")
        if not hmac.compare_digest(
            signature.encode(), self._signature(credential, inspection_id).encode()
        ):
            return None
        return self._in_session(credential) or self._holder(credential)

    def _signature(self, credential: str, inspection_id: str) -> str:
        message = f"{credential} {inspection_id}".encode()
        return hmac.new(self._ticket_key, message, hashlib.sha256).hexdigest()

    def _in_session(self, digest: str) -> Principal | None:
        now = datetime.now(UTC)
        login = self._store.login(digest)
        if login is None or not _is_within(now - login.created_at, SESSION_LIFETIME):
            return None
        if not _is_within(now - login.seen_at, SESSION_IDLE):
            return None
        principal = self._holder(login.token_digest)
        if principal is None:
            return None
        if abs(now - login.seen_at) > _SEEN_STEP:
            self._noted(lambda: self._store.touch_login(digest))
        self._note_token(login.token_digest)
        return replace(principal, credential=digest)

    def _note_token(self, digest: str) -> None:
        now = datetime.now(UTC)
        last = self._used_at.get(digest)
        if last is None or abs(now - last) > _SEEN_STEP:
            self._used_at[digest] = now
            self._noted(lambda: self._store.note_use(digest))

    def _noted(self, note: Callable[[], None]) -> None:
        try:
            note()
        except (Busy, DiskFull) as failure:  # a reader needs neither disk space nor a free writer
            logger.warning("The use of a token could not be noted: %s", failure)

    def _holder(self, digest: str) -> Principal | None:
        if hmac.compare_digest(digest, self._server_digest):
            return Principal(SERVER, Role.ADMIN, digest)
        token = self._tokens.valid(digest)
        if token is None:
            return None
        return Principal(token.name, token.role, digest, token.projects)


def create_token(
    tokens: TokenFile, name: str, role: Role, projects: frozenset[str] | None = None
) -> str:
    """Make a named token, for some projects or for all of them, and return its secret, which is
    stored nowhere.

    Raises:
        TokenNameTaken: Another valid token has this name.
    """
    secret = secrets.token_urlsafe(32)
    tokens.add(name, role, digest_of(secret), projects)
    return secret


def fault_of_name(name: str) -> str | None:
    """Return why no token may have this name; None if one may."""
    if not (name == name.strip() and name.isprintable() and 0 < len(name) <= _NAME_LENGTH):
        return f"must have 1 to {_NAME_LENGTH} printable characters"
    return "is the name of the server's own token" if name == SERVER else None


def network_of(address: str) -> str:
    """Return the address, or for IPv6 its /64, which one person can use freely."""
    try:
        found = ipaddress.ip_address(address)
    except ValueError:
        return address
    if isinstance(found, ipaddress.IPv6Address) and found.ipv4_mapped is None:
        return str(ipaddress.ip_network((found, 64), strict=False))
    return address


class _Recent:
    """A bounded memory of the newest items."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._lock = threading.Lock()
        self._things: OrderedDict[Hashable, None] = OrderedDict()

    def has(self, thing: Hashable) -> bool:
        return thing in self._things

    def add(self, thing: Hashable) -> None:
        with self._lock:
            self._things[thing] = None
            self._things.move_to_end(thing)
            while len(self._things) > self._size:
                self._things.popitem(last=False)


class Attempts:
    """A bounded count of wrong tokens, or links, for each address."""

    def __init__(self, *, counts_repeats: bool) -> None:
        """Count a wrong token each time, or once."""
        self._counts_repeats = counts_repeats
        self._lock = threading.Lock()
        self._failures: OrderedDict[str, deque[tuple[float, str]]] = OrderedDict()

    def check(self, address: str) -> None:
        """Raise TooManyAttempts if this address has sent too many wrong ones within a minute."""
        with self._lock:
            failures = self._failures.get(network_of(address), deque())
            while failures and failures[0][0] < time.monotonic() - _FAILURES_WITHIN_S:
                failures.popleft()
            if len(failures) >= _FAILURES:
                raise TooManyAttempts(
                    "Too many wrong tokens or links; wait a minute, then try again."
                )

    def failed(self, address: str, digest: str) -> None:
        """Count a wrong token."""
        network = network_of(address)
        with self._lock:
            failures = self._failures.setdefault(network, deque(maxlen=_FAILURES))
            if self._counts_repeats or all(digest != earlier for _, earlier in failures):
                failures.append((time.monotonic(), digest))
            self._failures.move_to_end(network)
            while len(self._failures) > _ADDRESSES:
                self._failures.popitem(last=False)


def _is_within(age: timedelta, most: timedelta) -> bool:
    """Return whether an age is within the limit; a clock that was set back extends nothing."""
    return -_CLOCK_SLACK <= age <= most


def digest_of(secret: str) -> str:
    """Return the SHA-256 of a secret, which is all that is stored of it."""
    return hashlib.sha256(secret.encode()).hexdigest()
