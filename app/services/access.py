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

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from app.errors import TooManyAttempts, Unauthenticated
from app.storage.database import Database
from app.storage.tables import LoginSession, Token

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

    def __init__(self, database: Database, server_token: str) -> None:
        """`server_token` is the one that always works; an earlier one of the server ends here."""
        self._database = database
        self.server_token = server_token
        self._attempts = _Attempts()
        if len(server_token) < _WEAK_TOKEN_LENGTH:
            logger.warning(
                "The access token has only %d characters; use %d or more.",
                len(server_token),
                _WEAK_TOKEN_LENGTH,
            )
        database.write(self._install_server_token)

    def _install_server_token(self, session: Session) -> None:
        digest, now = _digest(self.server_token), datetime.now(UTC)
        for token in session.scalars(select(Token).where(Token.name == _SERVER_TOKEN)):
            if token.digest != digest and token.revoked_at is None:
                token.revoked_at = now
        known = session.get(Token, digest)
        if known is None:
            session.add(Token(digest=digest, name=_SERVER_TOKEN, role="admin", created_at=now))
        else:
            known.revoked_at = None
        session.execute(delete(LoginSession).where(LoginSession.seen_at < now - SESSION_IDLE))

    def log_in(self, token: str, address: str) -> str:
        """Exchange a token for a new session's cookie value.

        Raises:
            TooManyAttempts: From this address came too many wrong tokens within a minute.
            Unauthenticated: The token is not known or was revoked.
        """
        self._attempts.check(address)
        digest = _digest(token)
        with self._database.read() as session:
            known = session.get(Token, digest)
        if known is None or known.revoked_at is not None:
            self._attempts.failed(address)
            raise Unauthenticated("This token is not known to the server.")
        cookie, now = secrets.token_urlsafe(32), datetime.now(UTC)
        row = LoginSession(digest=_digest(cookie), token_digest=digest, created_at=now, seen_at=now)
        self._database.write(lambda session: session.add(row))
        return cookie

    def log_out(self, cookie: str) -> None:
        """End a session."""
        digest = _digest(cookie)
        self._database.write(
            lambda session: session.execute(
                delete(LoginSession).where(LoginSession.digest == digest)
            )
        )

    def by_token(self, token: str) -> Principal | None:
        """Who holds this token."""
        with self._database.read() as session:
            return _principal(session.get(Token, _digest(token)))

    def by_cookie(self, cookie: str) -> Principal | None:
        """Whose session this is; None if there is none or it has ended."""
        digest, now = _digest(cookie), datetime.now(UTC)
        with self._database.read() as session:
            row = session.get(LoginSession, digest)
            if row is None or now > row.created_at + SESSION_LIFETIME:
                return None
            if now > row.seen_at + SESSION_IDLE:
                return None
            principal = _principal(session.get(Token, row.token_digest))
        if principal is not None and now > row.seen_at + _SEEN_STEP:
            self._database.write(lambda session: _touch(session, digest, now))
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


def _touch(session: Session, digest: str, now: datetime) -> None:
    row = session.get(LoginSession, digest)
    if row is not None:
        row.seen_at = now
