"""The outbox of the webhook: severe observations and whether the client was notified."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import ALERT_STATES, Alert, EventRow, ObservationRow
from app.survey.observations.records import NOT_NOTIFIED
from app.survey.observations.undelivered import Undelivered

EMERGENCY = 5
"""The severity that is notified at once."""
SENDER = "Chainage"
"""Author of its entries in the history."""
WAITING_AT_MOST = 1000
TOO_MANY = Undelivered("too_many", {"n": str(WAITING_AT_MOST)})


def note_emergency(
    session: Session, row: ObservationRow, before: dict[str, Any] | None, *, was_deleted: bool
) -> None:
    """Queue a notification if an observation became severe, within the session that stores it.

    Args:
        session: The session that stores the observation, so that both are on the disk or neither.
        row: The row as stored now.
        before: Its fields before the change; None for a new one.
        was_deleted: Whether it is being restored.
    """
    if row.fields.get("severity") != EMERGENCY:
        return
    of_this = select(Alert.state).where(
        Alert.inspection_id == row.inspection_id, Alert.observation_id == row.id
    )
    last = session.scalar(of_this.order_by(Alert.created_at.desc()).limit(1))
    was_severe = (before or {}).get("severity") == EMERGENCY
    # An observation deleted before its notification is new to the client when it is restored.
    is_new = not was_severe or (was_deleted and last == "withdrawn")
    if not is_new or last == "waiting":  # its message reports the latest state
        return
    waiting = select(func.count()).where(Alert.state == "waiting")
    is_full = (session.scalar(waiting) or 0) >= WAITING_AT_MOST
    now = datetime.now(UTC)
    session.add(
        Alert(
            id=str(uuid4()),
            inspection_id=row.inspection_id,
            observation_id=row.id,
            state="given_up" if is_full else "waiting",
            tries=0,
            created_at=now,
            next_at=now,
            error=TOO_MANY.sentence if is_full else None,
        )
    )


class AlertStore(Store):
    """Returns detached rows: changing them does not change the database."""

    @reading
    def of(self, session: Session, inspection_id: str) -> list[Alert]:
        """Return all alerts of an inspection, the oldest first."""
        query = (
            select(Alert)
            .where(Alert.inspection_id == inspection_id)
            .order_by(Alert.created_at, Alert.id)
        )
        return list(session.scalars(query))

    @reading
    def next_waiting(self, session: Session) -> Alert | None:
        """Return the alert with the earliest next try, due or not."""
        query = (
            select(Alert).where(Alert.state == "waiting").order_by(Alert.next_at, Alert.id).limit(1)
        )
        return session.scalar(query)

    @reading
    def counts(self, session: Session) -> dict[str, int]:
        """Return the number of alerts in each state."""
        query = select(Alert.state, func.count()).group_by(Alert.state)
        found = {state: number for state, number in session.execute(query)}  # noqa: C416
        return {state: found.get(state, 0) for state in ALERT_STATES}

    @writing
    def record_sent(self, session: Session, alert_id: str) -> None:
        """Record that the client has accepted the alert, also in the history."""
        row = session.get(Alert, alert_id)
        if row is not None:  # else its inspection was deleted meanwhile
            row.state, row.told_at, row.error = "told", datetime.now(UTC), None
            row.tries += 1
            session.add(EventRow.now(row, "told", SENDER))

    @writing
    def record_failure(
        self, session: Session, alert_id: str, error: str, next_at: datetime | None
    ) -> None:
        """Record a failed try; without a next one, the history says that the client was not
        notified.
        """
        row = session.get(Alert, alert_id)
        if row is None:
            return
        row.error = error
        row.tries += 1
        if next_at is not None:
            row.next_at = next_at
        else:
            row.state = "given_up"
            session.add(EventRow.now(row, NOT_NOTIFIED, SENDER, remark=error))

    @writing
    def withdraw(self, session: Session, alert_id: str) -> None:
        """Withdraw an alert whose observation was deleted or made less severe before it was
        sent.
        """
        row = session.get(Alert, alert_id)
        if row is not None:
            row.state = "withdrawn"
