"""The review of an inspection."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import Field, StringConstraints, model_validator

from app.inspections.reviews import ReviewView
from app.storage.database.tables import AcceptanceAnswer, Inspection, RemarkRow
from app.survey.given import TEXT, Given
from app.survey.observations.acceptance import AnswerKind
from app.survey.observations.records import Event
from app.survey.observations.review import REOPENED, RemarkKind, ReviewState
from app.web.deps import OBSERVATION_ID
from app.web.schemas.out import Out

Sentence = Annotated[str, StringConstraints(strip_whitespace=True, max_length=2000, pattern=TEXT)]


class ReviewIn(Given):
    """The next state of a review."""

    state: ReviewState
    reason: Sentence | None = Field(None, description="Required to reopen an inspection.")

    @model_validator(mode="after")
    def _says_why(self) -> Self:
        if self.state == REOPENED and not self.reason:
            raise ValueError("reopening needs a reason")
        return self


class RemarkIn(Given):
    """A remark on one observation."""

    observation: Annotated[str, Field(pattern=OBSERVATION_ID)]
    kind: RemarkKind
    text: Sentence = Field(description="May be empty for an acceptance.")
    version: Annotated[str, StringConstraints(max_length=16)] | None = Field(
        None,
        description="Version of the observation that the author saw. If another one is stored by "
        "now, nothing is said, and the answer is 412 with the stored one. Without it, the remark "
        "is about what is stored.",
    )

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if self.kind != "accepted" and not self.text:
            raise ValueError(f"a {self.kind} needs a text")
        return self


class SettledIn(Given):
    """Whether a question is settled."""

    settled: bool


class ReviewStateOut(Out):
    """The state of a review, and who has set it."""

    state: ReviewState
    at: datetime | None
    """None while it is a draft that was never submitted."""
    by: str | None

    @classmethod
    def of(cls, row: Inspection, **more: Any) -> Self:
        """Convert the stored row."""
        return cls.read_from(state=row.review_state, at=row.reviewed_at, by=row.reviewed_by, **more)


class StepOut(Out):
    """A change of the state."""

    state: ReviewState
    at: datetime
    by: str
    reason: str | None

    @classmethod
    def of(cls, event: Event) -> Self:
        """Convert the event."""
        state = (event.after or {})["review"]
        return cls(state=state, at=event.at, by=event.who, reason=event.remark)


class RemarkOut(Out):
    """A remark on one observation."""

    id: str
    observation: str
    kind: RemarkKind
    text: str
    version: str
    """Version of the observation that was seen: after an edit, an acceptance counts no more."""
    at: datetime
    by: str
    settled_at: datetime | None
    settled_by: str | None

    @classmethod
    def of(cls, row: RemarkRow) -> Self:
        """Convert the stored row."""
        return cls.read_from(row, observation=row.observation_id, at=row.made_at, by=row.made_by)


class ReplyIn(Given):
    """An answer to a client."""

    reply: Annotated[Sentence, StringConstraints(min_length=1)]


class ClientAnswerOut(Out):
    """What a client said by a link, and what was replied."""

    id: str
    link: str
    """What the link is called; may be empty."""
    kind: AnswerKind
    person: str
    """The name that the client typed; nobody has checked it."""
    text: str
    at: datetime
    is_changed: bool
    """Whether the inspection is no longer what the client saw."""
    reply: str | None
    replied_at: datetime | None
    replied_by: str | None

    @classmethod
    def of(cls, answer: AcceptanceAnswer, note: str, version: str | None) -> Self:
        """Convert the stored row."""
        return cls.read_from(answer, link=note, is_changed=answer.version != version)


class ReviewOut(ReviewStateOut):
    """A review with everything said in it."""

    steps: list[StepOut]
    """Every change of the state, oldest first."""
    remarks: list[RemarkOut]
    """On observations that are not deleted, oldest first."""
    said: list[ClientAnswerOut]
    """By clients, oldest first."""

    @classmethod
    def whole(cls, view: ReviewView) -> ReviewOut:
        """Convert the service's view."""
        return cls.of(
            view.row,
            steps=[StepOut.of(step) for step in view.steps],
            remarks=[RemarkOut.of(row) for row in view.remarks],
            said=[ClientAnswerOut.of(row, note, view.version) for row, note in view.said],
        )
