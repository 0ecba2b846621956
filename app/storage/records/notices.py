"""The outbox of the webhook's other messages: what clients accept, and how far work orders are."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import Notice
from app.storage.records.alerts import TOO_MANY, WAITING_AT_MOST


def note(session: Session, event: str, path: str, body: Mapping[str, Any]) -> None:
    """Queue a message within the session that stores what it tells, so that both are on the disk
    or neither.
    """
    waiting = select(func.count()).where(Notice.state == "waiting")
    is_full = (session.scalar(waiting) or 0) >= WAITING_AT_MOST
    now = datetime.now(UTC)
    session.add(
        Notice(
            id=str(uuid4()),
            event=event,
            path=path,
            body=dict(body),
            state="given_up" if is_full else "waiting",
            tries=0,
            created_at=now,
            next_at=now,
            error=TOO_MANY.sentence if is_full else None,
        )
    )


class NoticeStore(Store):
    """Returns detached rows."""

    @reading
    def next_waiting(self, session: Session) -> Notice | None:
        """Return the message with the earliest next try, due or not."""
        query = select(Notice).where(Notice.state == "waiting")
        return session.scalar(query.order_by(Notice.next_at, Notice.created_at).limit(1))

    @writing
    def record_sent(self, session: Session, notice_id: str) -> None:
        """Record that the client has accepted the message."""
        row = session.get_one(Notice, notice_id)
        row.state, row.told_at, row.error = "told", datetime.now(UTC), None
        row.tries += 1

    @writing
    def record_failure(
        self, session: Session, notice_id: str, error: str, next_at: datetime | None
    ) -> None:
        """Record a failed try; without a next one, the message is given up."""
        row = session.get_one(Notice, notice_id)
        row.error = error
        row.tries += 1
        if next_at is not None:
            row.next_at = next_at
        else:
            row.state = "given_up"
