"""Sessions of browsers in the database, by the SHA-256 of their cookies, and the use of tokens."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import delete, func, or_, select
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import LoginSession, TokenUse


class AccessStore(Store):
    """Returns detached rows: changing them does not change the database."""

    @reading
    def login(self, session: Session, digest: str) -> LoginSession | None:
        """Return the session with this digest of its cookie, or None."""
        return session.get(LoginSession, digest)

    @writing
    def add_login(
        self,
        session: Session,
        digest: str,
        token_digest: str,
        *,
        unused_since: datetime,
        begun_before: datetime,
    ) -> None:
        """Add a session; remove those that are too old or unused for too long."""
        now = datetime.now(UTC)
        row = LoginSession(digest=digest, token_digest=token_digest, created_at=now, seen_at=now)
        session.execute(
            delete(LoginSession).where(
                or_(LoginSession.seen_at < unused_since, LoginSession.created_at < begun_before)
            )
        )
        session.add(row)

    @writing
    def touch_login(self, session: Session, digest: str) -> None:
        """Record that a session is used now."""
        row = session.get(LoginSession, digest)
        if row is not None:
            row.seen_at = datetime.now(UTC)

    @writing
    def note_use(self, session: Session, token_digest: str) -> None:
        """Record that a token is used now."""
        session.merge(TokenUse(token_digest=token_digest, seen_at=datetime.now(UTC)))

    @reading
    def uses(self, session: Session) -> dict[str, datetime]:
        """Return when each token was last used, by its digest."""
        return {row.token_digest: row.seen_at for row in session.scalars(select(TokenUse))}

    @reading
    def logins(
        self, session: Session, *, unused_since: datetime, begun_before: datetime
    ) -> dict[str, int]:
        """Return the number of sessions of each token that are neither too old nor unused."""
        query = (
            select(LoginSession.token_digest, func.count())
            .where(LoginSession.seen_at >= unused_since, LoginSession.created_at >= begun_before)
            .group_by(LoginSession.token_digest)
        )
        return {digest: number for digest, number in session.execute(query)}  # noqa: C416

    @writing
    def end_login(self, session: Session, digest: str) -> None:
        """End a session, if it exists."""
        session.execute(delete(LoginSession).where(LoginSession.digest == digest))
