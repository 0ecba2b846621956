"""The outbox of the webhook: what the client is to be notified of, and whether that was done."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.storage.database import Database
from app.storage.tables import ALERT_STATES, Alert, EventRow, ObservationRow

EMERGENCY = 5
"""The severity that must not wait."""
SENDER = "Chainage"
"""Who is named in the history."""
_WAITING_AT_MOST = 1000


def note_emergency(
    session: Session, row: ObservationRow, before: dict[str, Any] | None, *, was_deleted: bool
) -> None:
    """Within the session that stores an observation: have the client notified if it became severe.

    Args:
        session: So that the observation and the alert are on the disk together, or neither.
        row: As it is stored now.
        before: Its fields until now; None for a new one.
        was_deleted: Whether it comes back.
    """
    if row.fields.get("severity") != EMERGENCY:
        return
    of_this = select(Alert.state).where(
        Alert.inspection_id == row.inspection_id, Alert.observation_id == row.id
    )
    last = session.scalar(of_this.order_by(Alert.created_at.desc()).limit(1))
    was_severe = (before or {}).get("severity") == EMERGENCY
    # What was deleted before anybody was notified of it is new to the client when it comes back.
    is_new = not was_severe or (was_deleted and last == "withdrawn")
    if not is_new or last == "waiting":  # one that waits reports the state of then
        return
    waiting = select(func.count()).where(Alert.state == "waiting")
    is_full = (session.scalar(waiting) or 0) >= _WAITING_AT_MOST
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
            error=f"{_WAITING_AT_MOST} others wait already." if is_full else None,
        )
    )


class AlertStore:
    """Rows come back detached: what is done to them stays without effect on the database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def of(self, inspection_id: str) -> list[Alert]:
        """All of an inspection, the oldest first."""
        query = (
            select(Alert)
            .where(Alert.inspection_id == inspection_id)
            .order_by(Alert.created_at, Alert.id)
        )
        with self._database.read() as session:
            return list(session.scalars(query))

    def next_waiting(self) -> Alert | None:
        """The one whose turn is next, now or later."""
        query = (
            select(Alert).where(Alert.state == "waiting").order_by(Alert.next_at, Alert.id).limit(1)
        )
        with self._database.read() as session:
            return session.scalar(query)

    def counts(self) -> dict[str, int]:
        """How many have each state."""
        query = select(Alert.state, func.count()).group_by(Alert.state)
        with self._database.read() as session:
            found = {state: number for state, number in session.execute(query)}  # noqa: C416
        return {state: found.get(state, 0) for state in ALERT_STATES}

    def record_told(self, alert_id: str) -> None:
        """The client has taken it; the history says so."""

        def record(row: Alert, now: datetime) -> EventRow:
            row.state, row.told_at, row.error = "told", now, None
            row.tries += 1
            return _event(row, "told", now)

        self._change(alert_id, record)

    def record_failure(self, alert_id: str, error: str, next_at: datetime | None) -> None:
        """A try has failed; without a next one the history says that nobody was notified."""

        def record(row: Alert, now: datetime) -> EventRow | None:
            row.error = error
            row.tries += 1
            if next_at is not None:
                row.next_at = next_at
                return None
            row.state = "given_up"
            return _event(row, "not_told", now, error)

        self._change(alert_id, record)

    def withdraw(self, alert_id: str) -> None:
        """The observation was deleted or lowered before anybody was notified."""

        def record(row: Alert, now: datetime) -> None:
            row.state = "withdrawn"

        self._change(alert_id, record)

    def _change(self, alert_id: str, record: Callable[[Alert, datetime], EventRow | None]) -> None:
        def apply(session: Session) -> None:
            row = session.get(Alert, alert_id)
            if row is None:
                return  # its inspection was deleted meanwhile
            event = record(row, datetime.now(UTC))
            if event is not None:
                session.add(event)

        self._database.write(apply)


def _event(row: Alert, action: str, at: datetime, remark: str | None = None) -> EventRow:
    return EventRow(
        inspection_id=row.inspection_id,
        observation_id=row.observation_id,
        action=action,
        who=SENDER,
        at=at,
        remark=remark,
    )
