"""Findings in the database, and how far their search is; every decision writes an event."""

from __future__ import annotations

import uuid
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Float, ForeignKey, String, Text, func, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from app.errors import FindingDecided, FindingNotFound, InvalidRequest
from app.storage.database.database import Database
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import Base, EventRow
from app.storage.records.inspections import existing, unlocked
from app.storage.records.observations import ObservationStore
from app.survey.findings.matching import Places
from app.survey.findings.records import (
    ACCEPTED,
    REJECTED,
    REOPENED,
    STATES,
    DetectorCount,
    Finding,
    FindingState,
    Point,
    Proposal,
    SearchStatus,
    Size,
)
from app.survey.observations.tag import StatedTag

_SIZES = ("length", "width")


class FindingRow(Base):
    """A row of `app.survey.findings.records.Finding`."""

    __tablename__ = "findings"

    inspection_id: Mapped[str] = mapped_column(
        String(32), ForeignKey("inspections.id", ondelete="CASCADE"), primary_key=True
    )
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    kind: Mapped[str] = mapped_column(String(40))
    outline: Mapped[dict[str, Any]]
    """`{"mm": [[axial, arc], ...]}`, raw."""
    length_mm: Mapped[float | None] = mapped_column(Float)
    length_sigma_mm: Mapped[float | None] = mapped_column(Float)
    width_mm: Mapped[float | None] = mapped_column(Float)
    width_sigma_mm: Mapped[float | None] = mapped_column(Float)
    direction: Mapped[str | None] = mapped_column(String(10))
    score: Mapped[float] = mapped_column(Float)
    code: Mapped[dict[str, Any] | None]
    detector: Mapped[str] = mapped_column(String(100))
    version: Mapped[str] = mapped_column(String(20))
    frame: Mapped[int | None]
    u: Mapped[float | None] = mapped_column(Float)
    """The pixel of the frame."""
    v: Mapped[float | None] = mapped_column(Float)
    found_at: Mapped[datetime]
    state: Mapped[str] = mapped_column(String(10))
    decided_by: Mapped[str | None] = mapped_column(String(100))
    decided_at: Mapped[datetime | None]
    observation_id: Mapped[str | None] = mapped_column(String(36))

    @classmethod
    def of(cls, finding: Finding) -> FindingRow:
        """Make a row to add to a session."""
        row = cls()
        row.take(finding)
        return row

    def take(self, finding: Finding) -> None:
        """Take all values of a finding."""
        values = vars(finding) | {
            "outline": {"mm": [list(point) for point in finding.outline_mm]},
            "u": finding.pixel[0] if finding.pixel else None,
            "v": finding.pixel[1] if finding.pixel else None,
        }
        for name in _SIZES:
            size: Size | None = values.pop(name)
            values[f"{name}_mm"] = size.mm if size else None
            values[f"{name}_sigma_mm"] = size.sigma_mm if size else None
        del values["outline_mm"], values["pixel"]
        for name, value in values.items():
            setattr(self, name, value)

    def record(self) -> Finding:
        """Return the record, detached from the session."""
        values = self.values()
        for name in _SIZES:
            mm, sigma_mm = values.pop(f"{name}_mm"), values.pop(f"{name}_sigma_mm")
            values[name] = None if mm is None else Size(mm, sigma_mm)
        u, v = values.pop("u"), values.pop("v")
        outline = tuple((x, y) for x, y in values.pop("outline")["mm"])
        return Finding(**values, outline_mm=outline, pixel=None if u is None else (u, v))


class FindingSearchRow(Base):
    """A row of `app.survey.findings.records.SearchStatus`."""

    __tablename__ = "finding_searches"

    inspection_id: Mapped[str] = mapped_column(
        String(32), ForeignKey("inspections.id", ondelete="CASCADE"), primary_key=True
    )
    state: Mapped[str] = mapped_column(String(10), index=True)
    detector: Mapped[str | None] = mapped_column(String(100))
    detail: Mapped[str | None] = mapped_column(Text)
    searched_to_mm: Mapped[float | None] = mapped_column(Float)


class FindingStore(Store):
    """Keeps proposals and decisions; returned records are independent of the database."""

    def __init__(self, database: Database, observations: ObservationStore) -> None:
        super().__init__(database)
        self._observations = observations

    @reading
    def listed(self, session: Session, inspection_id: str) -> list[Finding]:
        """Return all findings.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        existing(session, inspection_id)
        query = select(FindingRow).where(FindingRow.inspection_id == inspection_id)
        return [row.record() for row in session.scalars(query.order_by(FindingRow.id))]

    @reading
    def get(self, session: Session, inspection_id: str, finding_id: str) -> Finding:
        """Return a finding.

        Raises:
            InspectionNotFound, FindingNotFound: There is none.
        """
        existing(session, inspection_id)
        return _row(session, inspection_id, finding_id).record()

    @reading
    def counts(self, session: Session, inspection_id: str) -> tuple[DetectorCount, ...]:
        """Return what became of the proposals of each detector, sorted by its name."""
        query = (
            select(FindingRow.detector, FindingRow.version, FindingRow.state, func.count())
            .where(FindingRow.inspection_id == inspection_id)
            .group_by(FindingRow.detector, FindingRow.version, FindingRow.state)
        )
        found: dict[str, dict[str, int]] = {}
        for detector, version, state, number in session.execute(query):
            found.setdefault(f"{detector} {version}", dict.fromkeys(STATES, 0))[state] = number
        return tuple(DetectorCount(name, **found[name]) for name in sorted(found))

    @reading
    def state(self, session: Session, inspection_id: str) -> Hashable:
        """Return a value that differs after every search and every decision."""
        query = (
            select(FindingRow.state, func.count(), func.max(FindingRow.found_at))
            .where(FindingRow.inspection_id == inspection_id)
            .group_by(FindingRow.state)
            .order_by(FindingRow.state)
        )
        return tuple(tuple(row) for row in session.execute(query))

    @writing
    def accept(
        self,
        session: Session,
        inspection_id: str,
        finding_id: str,
        observation_id: str,
        tag: StatedTag,
        who: str,
    ) -> bool:
        """Make an observation of an offered finding; return False if this was done already.

        Raises:
            InspectionNotFound, FindingNotFound: There is none.
            InspectionLocked: The inspection is approved.
            FindingDecided: Somebody has decided otherwise.
            InvalidRequest: Another observation has this id.
        """
        unlocked(session, inspection_id)
        row = _row(session, inspection_id, finding_id)
        if (row.state, row.observation_id) == ("accepted", observation_id):
            return False
        _require_offered(row)
        self._observations.put_within(
            session, inspection_id, observation_id, tag, who, _require_none
        )
        _decide(session, row, "accepted", ACCEPTED, who, observation_id)
        return True

    @writing
    def reject(self, session: Session, inspection_id: str, finding_id: str, who: str) -> bool:
        """Reject an offered finding for good; return False if this was done already.

        Raises:
            InspectionNotFound, FindingNotFound: There is none.
            InspectionLocked: The inspection is approved.
            FindingDecided: Somebody has accepted it.
        """
        unlocked(session, inspection_id)
        row = _row(session, inspection_id, finding_id)
        if row.state == "rejected":
            return False
        _require_offered(row)
        _decide(session, row, "rejected", REJECTED, who)
        return True

    @writing
    def reopen(self, session: Session, inspection_id: str, finding_id: str, who: str) -> bool:
        """Undo a decision, and delete the observation of an accepted finding; return False if
        there is nothing to undo.

        Raises:
            InspectionNotFound, FindingNotFound: There is none.
            InspectionLocked: The inspection is approved.
        """
        unlocked(session, inspection_id)
        row = _row(session, inspection_id, finding_id)
        if row.state == "offered":
            return False
        if row.observation_id is not None:
            self._observations.delete_within(session, inspection_id, row.observation_id, who)
        _decide(session, row, "offered", REOPENED, who)
        return True

    @writing
    def settle(
        self,
        session: Session,
        inspection_id: str,
        found: Sequence[Finding],
        places: Mapping[str, Point],
        *,
        before: SearchStatus,
        after: SearchStatus,
        replaces: str | None = None,
    ) -> bool:
        """Keep the result of a search; return False if it is not wanted any more.

        What is known is not offered again: a decided finding stays as it is, an offered one keeps
        its id.

        Args:
            inspection_id: The inspection.
            found: New findings, with ids of their own.
            places: Where known findings are on the present track, by their ids, raw.
            before: How far the search was when it began.
            after: How far it is now.
            replaces: Detector whose other offers are withdrawn; None after a part of the wall.
        Raises:
            InspectionNotFound: No inspection has this id.
        """
        existing(session, inspection_id)
        search = session.get(FindingSearchRow, inspection_id)
        if search is None or _status(search) != before:
            return False
        session.merge(FindingSearchRow(inspection_id=inspection_id, **asdict(after)))
        query = select(FindingRow).where(FindingRow.inspection_id == inspection_id)
        rows = {row.id: row for row in session.scalars(query)}
        _follow_track(rows.values(), places)
        known = Places([row.record() for row in rows.values()])
        left = {
            row.id for row in rows.values() if row.state == "offered" and row.detector == replaces
        }
        added: list[Finding] = []
        for each in found:
            match = known.of(each)
            if match is None:
                added.append(each)
            elif match.id in left:
                left.discard(match.id)
                rows[match.id].take(replace(each, id=match.id))
        for finding_id in left:
            session.delete(rows[finding_id])
        session.add_all([FindingRow.of(each) for each in added])
        return True

    @reading
    def search(self, session: Session, inspection_id: str) -> SearchStatus:
        """Return how far the search is.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        existing(session, inspection_id)
        row = session.get(FindingSearchRow, inspection_id)
        return SearchStatus() if row is None else _status(row)

    @writing
    def put_search(self, session: Session, inspection_id: str, status: SearchStatus) -> None:
        """Store how far the search is.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        existing(session, inspection_id)
        session.merge(FindingSearchRow(inspection_id=inspection_id, **asdict(status)))

    @reading
    def waiting(self, session: Session) -> list[str]:
        """Return the inspections whose search waits, or was interrupted."""
        query = select(FindingSearchRow.inspection_id).where(FindingSearchRow.state == "waiting")
        return list(session.scalars(query))


def new_finding(
    inspection_id: str,
    proposal: Proposal,
    detector: tuple[str, str],
    seen: tuple[int, Point] | None,
) -> Finding:
    """Return a new finding that is offered.

    Args:
        inspection_id: Its inspection.
        proposal: What the detector says.
        detector: Its name and version.
        seen: The frame and pixel that show it best; None if no frame does.
    """
    return Finding(
        **vars(proposal),
        inspection_id=inspection_id,
        id=str(uuid.uuid4()),
        detector=detector[0],
        version=detector[1],
        frame=seen[0] if seen else None,
        pixel=seen[1] if seen else None,
        found_at=datetime.now(UTC),
    )


def _follow_track(rows: Iterable[FindingRow], places: Mapping[str, Point]) -> None:
    """Move what is known to where its frame and pixel are on the present track."""
    for row in rows:
        if row.id not in places:
            continue
        known = row.record()
        axial_mm, arc_mm = (
            now - then for now, then in zip(places[row.id], known.middle_mm, strict=True)
        )
        if abs(axial_mm) + abs(arc_mm) > _STILL_MM:
            row.take(known.moved(axial_mm, arc_mm))


_STILL_MM = 2.0
"""A pixel that shows the middle of a finding is exact within this."""


def _row(session: Session, inspection_id: str, finding_id: str) -> FindingRow:
    row = session.get(FindingRow, (inspection_id, finding_id))
    if row is None:
        raise FindingNotFound("There is no such finding; a newer search may have withdrawn it.")
    return row


def _require_offered(row: FindingRow) -> None:
    if row.state != "offered":
        raise FindingDecided(
            f"{row.decided_by} has {row.state} this finding already. Read the list again; it can "
            "be reopened."
        )


def _require_none(stored: Mapping[str, Any] | None) -> None:
    if stored is not None:
        raise InvalidRequest("observation_id is that of another observation; make a new one.")


def _decide(
    session: Session,
    row: FindingRow,
    state: FindingState,
    action: str,
    who: str,
    observation_id: str | None = None,
) -> None:
    decided = {"finding": row.id, "kind": row.kind}
    about = row.observation_id
    row.state, row.observation_id = state, observation_id
    is_open = state == "offered"
    row.decided_by = None if is_open else who
    row.decided_at = None if is_open else datetime.now(UTC)
    event = EventRow.now(row, action, who, decided, decided)
    event.observation_id = observation_id or about
    session.add(event)


def _status(row: FindingSearchRow) -> SearchStatus:
    values = row.values()
    del values["inspection_id"]
    return SearchStatus(**values)
