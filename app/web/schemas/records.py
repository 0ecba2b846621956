"""What stands against a report, what a format loses, who was notified, who changed what."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel

from app.reports.report import Written
from app.storage.tables import Alert
from app.survey.checks import Issue
from app.survey.records import Event


class IssueOut(BaseModel):
    """Something to put right, or to look at, before a report is issued."""

    level: Literal["block", "warn"]
    code: str
    detail: str
    observation_id: str | None
    params: dict[str, str | int | float]

    @classmethod
    def of(cls, issue: Issue) -> IssueOut:
        """From the service's."""
        return cls(
            level=issue.level,
            code=issue.code,
            detail=issue.detail,
            observation_id=issue.observation_id,
            params=dict(issue.params),
        )


class IssuesOut(BaseModel):
    """What stands against a report; nothing if the list is empty."""

    checks: list[IssueOut]


class LossOut(BaseModel):
    """Something that a format cannot hold."""

    detail: str
    observation_id: str | None


class LossesOut(BaseModel):
    """What is not in the export, or not in a place of its own; nothing if the list is empty."""

    losses: list[LossOut]

    @classmethod
    def of(cls, written: Written) -> LossesOut:
        """From the format's."""
        return cls(
            losses=[
                LossOut(detail=loss.detail, observation_id=loss.entry.id if loss.entry else None)
                for loss in written.losses
            ]
        )


class AlertOut(BaseModel):
    """Whether the client was notified of a severe observation."""

    id: str
    observation_id: str
    state: Literal["waiting", "told", "withdrawn", "given_up"]
    tries: int
    created_at: datetime
    next_at: datetime | None
    told_at: datetime | None
    error: str | None

    @classmethod
    def of(cls, alert: Alert) -> AlertOut:
        """From the table."""
        return cls(
            id=alert.id,
            observation_id=alert.observation_id,
            state=alert.state,  # type: ignore[arg-type]  # one of ALERT_STATES
            tries=alert.tries,
            created_at=alert.created_at,
            next_at=alert.next_at if alert.state == "waiting" else None,
            told_at=alert.told_at,
            error=alert.error,
        )


class AlertsOut(BaseModel):
    """What the client is notified of."""

    is_configured: bool
    """Whether there is a client to be notified."""
    alerts: list[AlertOut]


class EventOut(BaseModel):
    """Something that was done."""

    at: datetime
    who: str
    action: str
    observation_id: str | None
    before: dict[str, Any] | None
    after: dict[str, Any] | None
    remark: str | None

    @classmethod
    def of(cls, event: Event) -> EventOut:
        """From the table."""
        return cls(**{name: getattr(event, name) for name in cls.model_fields})


class EventsOut(BaseModel):
    """Who did what, the newest first."""

    events: list[EventOut]
