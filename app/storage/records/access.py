"""Sessions of browsers in the database, by the SHA-256 of their cookies, and the use of tokens."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import delete, func, or_, select
from sqlalchemy.orm import Session

from app.storage.database.database import Database
from app.storage.database.tables import LoginSession, TokenUse


class AccessStore:
    """Returns detached rows: changing them does not change the database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def login(self, digest: str) -> LoginSession | None:
        """Return the session with this digest of its cookie, or None."""
        with self._database.read() as session:
            return session.get(LoginSession, digest)

    def add_login(
        self, digest: str, token_digest: str, *, unused_since: datetime, begun_before: datetime
    ) -> None:
        """Add a session; remove those that are too old or unused for too long."""
        now = datetime.now(UTC)
        row = LoginSession(digest=digest, token_digest=token_digest, created_at=now, seen_at=now)

        def begin(session: Session) -> None:
            session.execute(
                delete(LoginSession).where(
                    or_(LoginSession.seen_at < unused_since, LoginSession.created_at < begun_before)
                )
            )
            session.add(row)

        self._database.write(begin)

    def touch_login(self, digest: str) -> None:
        """Record that a session is used now."""

        def touch(session: Session) -> None:
            row = session.get(LoginSession, digest)
            if row is not None:
                row.seen_at = datetime.now(UTC)

        self._database.write(touch)

    def note_use(self, token_digest: str) -> None:
        """Record that a token is used now."""
        row = TokenUse(token_digest=token_digest, seen_at=datetime.now(UTC))
        self._database.write(lambda session: session.merge(row))

    def uses(self) -> dict[str, datetime]:
        """Return when each token was last used, by its digest."""
        with self._database.read() as session:
            return {row.token_digest: row.seen_at for row in session.scalars(select(TokenUse))}

    def logins(self, *, unused_since: datetime, begun_before: datetime) -> dict[str, int]:
        """Return the number of sessions of each token that are neither too old nor unused."""
        query = (
            select(LoginSession.token_digest, func.count())
            .where(LoginSession.seen_at >= unused_since, LoginSession.created_at >= begun_before)
            .group_by(LoginSession.token_digest)
        )
        with self._database.read() as session:
            return {digest: number for digest, number in session.execute(query)}  # noqa: C416

    def end_login(self, digest: str) -> None:
        """End a session, if it exists."""
        self._database.write(
            lambda session: session.execute(
                delete(LoginSession).where(LoginSession.digest == digest)
            )
        )
