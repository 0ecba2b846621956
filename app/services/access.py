"""Who may come in: tokens for programs, sessions for browsers; no passwords."""

from __future__ import annotations

import hashlib
import logging
import secrets
import threading
import time
from collections import OrderedDict, deque
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from app.errors import TooManyAttempts, Unauthenticated
from app.storage.access import AccessStore
from app.storage.tables import Token

logger = logging.getLogger(__name__)

SESSION_LIFETIME = timedelta(days=30)
"""After that the browser logs in again, used or not."""
SESSION_IDLE = timedelta(days=7)
_SEEN_STEP = timedelta(minutes=10)
"""How exactly the last use is known: a write for every request would be too many."""

_SERVER_TOKEN = "server"  # noqa: S105  (a name)
_WEAK_TOKEN_LENGTH = 16

_FAILURES = 10
_FAILURES_WITHIN_S = 60.0
_ADDRESSES = 1000


@dataclass(frozen=True)
class Principal:
    """Who makes a request."""

    name: str
    role: str


class Access:
    """Tokens, sessions, and a limit on guessing."""

    def __init__(self, store: AccessStore, server_token: str) -> None:
        """`server_token` is the one that always works; an earlier one of the server ends here."""
        self._store = store
        self.server_token = server_token
        self._attempts = _Attempts()
        if len(server_token) < _WEAK_TOKEN_LENGTH:
            logger.warning(
                "The access token has only %d characters; use %d or more.",
                len(server_token),
                _WEAK_TOKEN_LENGTH,
            )
        store.install_token(_digest(server_token), _SERVER_TOKEN, "admin")
        store.end_logins_unused_since(datetime.now(UTC) - SESSION_IDLE)

    def log_in(self, token: str, address: str) -> str:
        """Exchange a token for a new session's cookie value.

        Raises:
            TooManyAttempts: From this address came too many wrong tokens within a minute.
            Unauthenticated: The token is not known or was revoked.
        """
        self._attempts.check(address)
        digest = _digest(token)
        if _principal(self._store.token(digest)) is None:
            self._attempts.failed(address)
            raise Unauthenticated("This token is not known to the server.")
        cookie = secrets.token_urlsafe(32)
        self._store.add_login(_digest(cookie), digest)
        return cookie

    def log_out(self, cookie: str) -> None:
        """End a session."""
        self._store.end_login(_digest(cookie))

    def by_token(self, token: str) -> Principal | None:
        """Who holds this token."""
        return _principal(self._store.token(_digest(token)))

    def by_cookie(self, cookie: str) -> Principal | None:
        """Whose session this is; None if there is none or it has ended."""
        digest, now = _digest(cookie), datetime.now(UTC)
        login = self._store.login(digest)
        if login is None or now > login.created_at + SESSION_LIFETIME:
            return None
        if now > login.seen_at + SESSION_IDLE:
            return None
        principal = _principal(self._store.token(login.token_digest))
        if principal is not None and now > login.seen_at + _SEEN_STEP:
            self._store.touch_login(digest)
        return principal


class _Attempts:
    """Failed log-ins by address, in a bounded memory."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._failures: OrderedDict[str, deque[float]] = OrderedDict()

    def check(self, address: str) -> None:
        with self._lock:
            times = self._failures.get(address, deque())
            while times and times[0] < time.monotonic() - _FAILURES_WITHIN_S:
                times.popleft()
            if len(times) >= _FAILURES:
                raise TooManyAttempts("Too many wrong tokens; wait a minute, then try again.")

    def failed(self, address: str) -> None:
        with self._lock:
            self._failures.setdefault(address, deque(maxlen=_FAILURES)).append(time.monotonic())
            self._failures.move_to_end(address)
            while len(self._failures) > _ADDRESSES:
                self._failures.popitem(last=False)


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()


def _principal(token: Token | None) -> Principal | None:
    if token is None or token.revoked_at is not None:
        return None
    return Principal(token.name, token.role)
