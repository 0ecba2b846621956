"""Tokens and sessions in the database, by the SHA-256 of their secrets."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from app.storage.database import Database
from app.storage.tables import LoginSession, Token


class AccessStore:
    """Rows come back detached: what is done to them stays without effect on the database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def token(self, digest: str) -> Token | None:
        """A token, revoked or not."""
        with self._database.read() as session:
            return session.get(Token, digest)

    def install_token(self, digest: str, name: str, role: str) -> None:
        """Make it the one valid token of this name; the others of the name are revoked."""

        def install(session: Session) -> None:
            now = datetime.now(UTC)
            for token in session.scalars(select(Token).where(Token.name == name)):
                if token.digest != digest and token.revoked_at is None:
                    token.revoked_at = now
            known = session.get(Token, digest)
            if known is None:
                session.add(Token(digest=digest, name=name, role=role, created_at=now))
            else:
                known.revoked_at = None

        self._database.write(install)

    def login(self, digest: str) -> LoginSession | None:
        """A session, by the digest of its cookie."""
        with self._database.read() as session:
            return session.get(LoginSession, digest)

    def add_login(self, digest: str, token_digest: str) -> None:
        """A session begins."""
        now = datetime.now(UTC)
        row = LoginSession(digest=digest, token_digest=token_digest, created_at=now, seen_at=now)
        self._database.write(lambda session: session.add(row))

    def touch_login(self, digest: str) -> None:
        """A session is used now."""

        def touch(session: Session) -> None:
            row = session.get(LoginSession, digest)
            if row is not None:
                row.seen_at = datetime.now(UTC)

        self._database.write(touch)

    def end_login(self, digest: str) -> None:
        """A session ends, if there is one."""
        self._database.write(
            lambda session: session.execute(
                delete(LoginSession).where(LoginSession.digest == digest)
            )
        )

    def end_logins_unused_since(self, instant: datetime) -> None:
        """Sessions that were last used before `instant` end."""
        self._database.write(
            lambda session: session.execute(
                delete(LoginSession).where(LoginSession.seen_at < instant)
            )
        )
