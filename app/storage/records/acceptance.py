"""Links by which clients accept inspections, and what they said, in the database."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from uuid import uuid4

from sqlalchemy import ColumnElement, func, select
from sqlalchemy.orm import Session

from app.errors import (
    AnswerNotFound,
    DeliveryChanged,
    InspectionNotFound,
    LinkNotFound,
    StillRunning,
    TooManyAnswers,
)
from app.storage.database.database import Database, batches
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import (
    ENDED,
    AcceptanceAnswer,
    AcceptanceLink,
    AcceptanceSection,
    EventRow,
    Inspection,
)
from app.storage.records.inspections import existing
from app.storage.records.notices import note
from app.survey.fields.header import asset_of, project_of
from app.survey.observations.acceptance import MOST_ANSWERS, AnswerKind, Standing, standing
from app.survey.observations.records import (
    CLIENT_ACCEPTED,
    CLIENT_ANSWERED,
    CLIENT_ASKED,
    DELIVERED,
    LABELLED,
    NOT_NOTIFIED,
    REVIEWED,
)
from app.survey.observations.review import REOPENED, is_for_admins, may_follow

EVENT = "acceptance.answered"
"""Of the webhook."""
_NO_CONTENT = (
    REVIEWED, LABELLED, NOT_NOTIFIED, DELIVERED, CLIENT_ACCEPTED, CLIENT_ASKED, CLIENT_ANSWERED,
    "finding_rejected", "finding_reopened", "told", "accepted", "question", "comment", "settled",
    "unsettled", "withdrawn",
)  # fmt: skip
"""Actions that change nothing of what a client sees."""
_MOST_LISTED = 500


@dataclass(frozen=True)
class SectionView:
    """An inspection of a link."""

    place: int
    inspection_id: str
    name: str
    """When the link was made."""
    asset: str | None
    project: str | None
    is_deleted: bool
    is_changed: bool
    """Since the link was made."""
    version: str | None
    """Of the inspection now; None if it was deleted."""
    standing: Standing
    answers: Sequence[AcceptanceAnswer]


@dataclass(frozen=True)
class LinkView:
    """A link with what was said by it."""

    row: AcceptanceLink
    sections: Sequence[SectionView]


@dataclass(frozen=True)
class Answer:
    """What a client says about a section."""

    id: str
    kind: AnswerKind
    person: str
    text: str
    version: str
    """Of what was seen."""


class AcceptanceStore(Store):
    """Returns detached rows."""

    def __init__(self, database: Database, *, has_webhook: bool) -> None:
        super().__init__(database)
        self._has_webhook = has_webhook

    @writing
    def make(
        self, session: Session, digest: str, note_: str, ids: Sequence[str], days: int, who: str
    ) -> str:
        """Store a link to some inspections; return its id.

        Raises:
            InspectionNotFound: One of them does not exist.
            StillRunning: One of them is queued or running.
        """
        rows = [existing(session, inspection_id) for inspection_id in ids]
        if running := [row.name for row in rows if row.status not in ENDED]:
            raise StillRunning(f"{running[0]!r} has not ended; it can be shown to a client then.")
        now = datetime.now(UTC)
        link = AcceptanceLink(
            id=uuid4().hex,
            digest=digest,
            note=note_,
            made_at=now,
            made_by=who,
            expires_at=now + timedelta(days=days),
        )
        session.add(link)
        versions = versions_of(session, ids)
        for place, row in enumerate(rows, 1):
            session.add(
                AcceptanceSection(
                    link_id=link.id,
                    place=place,
                    inspection_id=row.id,
                    name=row.name,
                    version=versions[row.id],
                )
            )
            session.add(EventRow.now(row, DELIVERED, who, remark=note_ or None))
        return link.id

    @writing
    def revoke(self, session: Session, link_id: str, who: str) -> None:
        """End a link; one that is revoked stays as it is.

        Raises:
            LinkNotFound: No link has this id.
        """
        row = session.get(AcceptanceLink, link_id)
        sections = select(AcceptanceSection.place).where(AcceptanceSection.link_id == link_id)
        if row is None or session.scalar(sections.limit(1)) is None:  # it sees none of them
            raise LinkNotFound("There is no such link.")
        if row.revoked_at is None:
            row.revoked_at, row.revoked_by = datetime.now(UTC), who

    @reading
    def links(self, session: Session, inspection_id: str | None = None) -> list[LinkView]:
        """Return the newest links, those that show one inspection or all."""
        query = select(AcceptanceLink).order_by(AcceptanceLink.made_at.desc(), AcceptanceLink.id)
        shows = select(AcceptanceSection.link_id)
        if inspection_id is not None:
            shows = shows.where(AcceptanceSection.inspection_id == inspection_id)
        # Without any section that it sees, a token that is limited to projects sees no link.
        query = query.where(AcceptanceLink.id.in_(shows))
        return _views(session, list(session.scalars(query.limit(_MOST_LISTED))))

    @reading
    def link(self, session: Session, link_id: str) -> LinkView:
        """Return a link, valid or not.

        Raises:
            LinkNotFound: No link has this id.
        """
        row = session.get(AcceptanceLink, link_id)
        if row is None:
            raise LinkNotFound("There is no such link.")
        return _views(session, [row])[0]

    @reading
    def valid(self, session: Session, digest: str) -> LinkView | None:
        """Return the link whose secret has this digest; None if there is none that is valid."""
        row = session.scalar(_valid(AcceptanceLink.digest == digest))
        return None if row is None else _views(session, [row])[0]

    @writing
    def note_opened(self, session: Session, link_id: str) -> None:
        """Count that the page of a link was opened."""
        row = session.get_one(AcceptanceLink, link_id)
        row.opened, row.opened_at = row.opened + 1, datetime.now(UTC)

    @writing
    def answer(self, session: Session, link_id: str, place: int, answer: Answer) -> None:
        """Store what a client said, also in the history; one that is stored stays as it is.

        A question returns an inspection that waits for its review to its inspector; only an admin
        reopens what is approved.

        Raises:
            LinkNotFound: The link is valid no more, or has no such section.
            InspectionNotFound: The inspection was deleted.
            DeliveryChanged: It is no longer what the client saw.
            TooManyAnswers: The section has as many answers as it may have.
        """
        link = session.scalar(_valid(AcceptanceLink.id == link_id))
        section = session.get(AcceptanceSection, (link_id, place))
        if link is None or section is None:
            raise LinkNotFound("This link is not valid.")
        if session.get(AcceptanceAnswer, answer.id) is not None:
            return
        row = existing(session, section.inspection_id)
        if answer.version != versions_of(session, [row.id])[row.id]:
            raise DeliveryChanged("The inspection was changed meanwhile; look at it again.")
        of_section = (AcceptanceAnswer.link_id == link_id, AcceptanceAnswer.place == place)
        number = session.scalar(select(func.count()).where(*of_section)) or 0
        if number >= MOST_ANSWERS:
            raise TooManyAnswers(f"This section has {number} answers; write to who sent the link.")
        session.add(
            AcceptanceAnswer(
                **vars(answer),
                link_id=link_id,
                place=place,
                inspection_id=row.id,
                at=datetime.now(UTC),
            )
        )
        who = author(answer.person, link.note)
        is_question = answer.kind == "question"
        action = CLIENT_ASKED if is_question else CLIENT_ACCEPTED
        session.add(EventRow.now(row, action, who, remark=answer.text or None))
        if is_question:
            _return(session, row, who, answer.text)
        if self._has_webhook:
            note(session, EVENT, f"/inspections/{row.id}", _message(row, link, answer))

    @writing
    def reply(
        self, session: Session, inspection_id: str, answer_id: str, text: str, who: str
    ) -> None:
        """Answer what a client said; the client sees it by the link.

        Raises:
            AnswerNotFound: The inspection has no such answer of a client.
        """
        row = session.get(AcceptanceAnswer, answer_id)
        if row is None or row.inspection_id != inspection_id:
            raise AnswerNotFound("There is no such answer of a client.")
        row.reply, row.replied_at, row.replied_by = text, datetime.now(UTC), who
        inspection = existing(session, inspection_id)
        session.add(EventRow.now(inspection, CLIENT_ANSWERED, who, remark=text))

    @reading
    def said(self, session: Session, inspection_id: str) -> list[tuple[AcceptanceAnswer, str]]:
        """Return what clients said about an inspection, the oldest first, each with the note of
        its link.
        """
        query = (
            select(AcceptanceAnswer, AcceptanceLink.note)
            .join(AcceptanceLink, AcceptanceLink.id == AcceptanceAnswer.link_id)
            .where(AcceptanceAnswer.inspection_id == inspection_id)
            .order_by(AcceptanceAnswer.at, AcceptanceAnswer.id)
        )
        return [(answer, note_) for answer, note_ in session.execute(query)]

    @reading
    def version(self, session: Session, inspection_id: str) -> str:
        """Return the version of what a client sees of an inspection now.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        found = versions_of(session, [inspection_id])
        if inspection_id not in found:
            raise InspectionNotFound("There is no such inspection.")
        return found[inspection_id]


def author(person: str, note_: str) -> str:
    """Return how the history names a client, whose name nobody has checked."""
    return f"{person[:50]} (client via link{f' {note_}' if note_ else ''}"[:99] + ")"


def versions_of(session: Session, ids: Iterable[str]) -> dict[str, str]:
    """Return the version of what a client sees of each inspection that exists: it rises with every
    event that changes it and with every change of its distances.
    """
    found: dict[str, str] = {}
    for some in batches(ids):
        newest = (
            select(EventRow.inspection_id, func.max(EventRow.id).label("event"))
            .where(EventRow.inspection_id.in_(some), EventRow.action.not_in(_NO_CONTENT))
            .group_by(EventRow.inspection_id)
            .subquery()
        )
        rows = session.execute(
            select(Inspection.id, Inspection.revision, Inspection.attempt, newest.c.event)
            .outerjoin(newest, newest.c.inspection_id == Inspection.id)
            .where(Inspection.id.in_(some))
        )
        for inspection_id, revision, attempt, event in rows:
            found[inspection_id] = f"{revision}.{attempt}.{event or 0}"
    return found


def _valid(condition: ColumnElement[bool]):  # type: ignore[no-untyped-def]
    return select(AcceptanceLink).where(
        condition,
        AcceptanceLink.revoked_at.is_(None),
        AcceptanceLink.expires_at > datetime.now(UTC),
    )


def _views(session: Session, rows: Sequence[AcceptanceLink]) -> list[LinkView]:
    ids = [row.id for row in rows]
    sections = list(
        session.scalars(
            select(AcceptanceSection)
            .where(AcceptanceSection.link_id.in_(ids))
            .order_by(AcceptanceSection.place)
        )
    )
    answers: Mapping[tuple[str, int], list[AcceptanceAnswer]] = defaultdict(list)
    for answer in session.scalars(
        select(AcceptanceAnswer)
        .where(AcceptanceAnswer.link_id.in_(ids))
        .order_by(AcceptanceAnswer.at, AcceptanceAnswer.id)
    ):
        answers[answer.link_id, answer.place].append(answer)
    shown = {section.inspection_id for section in sections}
    versions = versions_of(session, shown)
    headers = {
        inspection_id: header
        for some in batches(shown)
        for inspection_id, header in session.execute(
            select(Inspection.id, Inspection.header).where(Inspection.id.in_(some))
        )
    }
    of_link: Mapping[str, list[SectionView]] = defaultdict(list)
    for section in sections:
        version = versions.get(section.inspection_id)
        header = headers.get(section.inspection_id, {})
        said = answers[section.link_id, section.place]
        of_link[section.link_id].append(
            SectionView(
                place=section.place,
                inspection_id=section.inspection_id,
                name=section.name,
                asset=asset_of(header),
                project=project_of(header),
                is_deleted=version is None,
                is_changed=version is not None and version != section.version,
                version=version,
                standing=standing(said, version),
                answers=said,
            )
        )
    return [LinkView(row, of_link[row.id]) for row in rows]


def _return(session: Session, row: Inspection, who: str, text: str) -> None:
    """Return an inspection to its inspector, where an operator might."""
    before = row.review_state
    if may_follow(before, REOPENED) and not is_for_admins(before, REOPENED):
        row.review_state, row.reviewed_at, row.reviewed_by = REOPENED, datetime.now(UTC), who
        states = {"review": before}, {"review": REOPENED}
        session.add(EventRow.now(row, REVIEWED, who, *states, text))


def _message(row: Inspection, link: AcceptanceLink, answer: Answer) -> dict[str, object]:
    return {
        "inspection": {"id": row.id, "name": row.name, "asset": asset_of(row.header)},
        "link": {"id": link.id, "note": link.note},
        "answer": {
            "id": answer.id,
            "kind": answer.kind,
            "person": answer.person,
            "text": answer.text,
            "version": answer.version,
        },
    }
