"""Report checks, losses of a format, notifications, and the history."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from typing import Any, Literal, Self

from pydantic import BaseModel

from app.reports.content.translator import Translator
from app.reports.report import Loss
from app.storage.database.tables import Alert
from app.survey.observations.records import NOT_NOTIFIED, Event
from app.survey.observations.undelivered import Undelivered
from app.web.schemas.out import Out


class IssueOut(Out):
    """Something to correct or check before a report is issued."""

    level: Literal["block", "warn"]
    code: str
    detail: str
    observation_id: str | None
    params: dict[str, str | int | float]


class IssuesOut(BaseModel):
    """The issues to resolve before a report is issued; empty if there are none."""

    checks: list[IssueOut]


class LossOut(BaseModel):
    """Something that a format cannot hold."""

    detail: str
    observation_id: str | None


class LossesOut(BaseModel):
    """What the export lacks, or holds only in a remark; empty if nothing is lost."""

    losses: list[LossOut]

    @classmethod
    def of(cls, losses: Iterable[Loss], t: Translator) -> LossesOut:
        """Convert the losses of a format, in the words of the translator."""
        return cls(
            losses=[
                LossOut(detail=t.loss(loss), observation_id=loss.entry.id if loss.entry else None)
                for loss in losses
            ]
        )


class ReasonOut(Out):
    """Why the client could not be notified, for a program that says it in its own words."""

    code: str
    values: dict[str, str]

    @classmethod
    def of(cls, sentence: str | None) -> ReasonOut | None:
        """Read the sentence that was stored; None if it is another one, or none."""
        reason = Undelivered.read(sentence)
        return cls.model_validate(reason) if reason else None


class AlertOut(Out):
    """Whether the client was notified of a severe observation."""

    id: str
    observation_id: str
    state: Literal["waiting", "told", "withdrawn", "given_up"]
    tries: int
    created_at: datetime
    next_at: datetime | None
    told_at: datetime | None
    error: str | None
    reason: ReasonOut | None
    """The same as `error`."""

    @classmethod
    def of(cls, alert: Alert) -> Self:
        """Convert the row of the table."""
        next_at = alert.next_at if alert.state == "waiting" else None
        return cls.read_from(alert, next_at=next_at, reason=ReasonOut.of(alert.error))


class AlertsOut(BaseModel):
    """Notifications of the client."""

    is_configured: bool
    """Whether a client is configured."""
    alerts: list[AlertOut]


class EventOut(Out):
    """A change in the history."""

    at: datetime
    who: str
    action: str
    observation_id: str | None
    before: dict[str, Any] | None
    after: dict[str, Any] | None
    remark: str | None
    reason: ReasonOut | None
    """The same as `remark`, where the client could not be notified."""

    @classmethod
    def of(cls, event: Event) -> EventOut:
        """Convert the row of the table."""
        reason = ReasonOut.of(event.remark) if event.action == NOT_NOTIFIED else None
        return cls.read_from(event, reason=reason)


class EventsOut(BaseModel):
    """Who did what, the newest first."""

    events: list[EventOut]
