"""The review of inspections: its states, and remarks on observations."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

from app.access.access import Principal
from app.storage.database.tables import AcceptanceAnswer, Inspection, RemarkRow
from app.storage.folder.tokens import Role
from app.storage.records.acceptance import AcceptanceStore
from app.storage.records.inspections import InspectionStore
from app.storage.records.reviews import ReviewStore
from app.survey.observations.records import Event
from app.survey.observations.review import RemarkKind, ReviewState
from app.tracking.live import Live

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class ReviewView:
    """A review with everything said in it."""

    row: Inspection
    steps: Sequence[Event]
    """Every change of the state, oldest first."""
    remarks: Sequence[RemarkRow]
    """On observations that are not deleted, oldest first."""
    said: Sequence[tuple[AcceptanceAnswer, str]]
    """By clients, oldest first, each with the note of its link."""
    version: str
    """Of what a client sees now."""


class Reviews:
    """Moves inspections through their review."""

    def __init__(
        self,
        inspections: InspectionStore,
        store: ReviewStore,
        acceptance: AcceptanceStore,
        live: Live,
    ) -> None:
        self._inspections = inspections
        self._store = store
        self._acceptance = acceptance
        self._live = live

    def get(self, inspection_id: str) -> ReviewView:
        """Return the review of an inspection.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return ReviewView(
            self._inspections.get(inspection_id),
            self._store.steps(inspection_id),
            self._store.remarks(inspection_id),
            self._acceptance.said(inspection_id),
            self._acceptance.version(inspection_id),
        )

    def move(
        self, inspection_id: str, state: ReviewState, who: Principal, reason: str | None
    ) -> None:
        """Set the state of the review; once approved, nobody changes the inspection.

        Raises:
            InspectionNotFound: No inspection has this id.
            Forbidden: Only admins approve, and reopen what is approved.
            StillRunning: It is queued or running.
            WrongReviewState: The state cannot directly follow the present one.
            OpenQuestions: It is to be approved, and a question is not settled.
        """
        is_admin = who.role.may(Role.ADMIN)
        if self._store.move(inspection_id, state, who.name, reason, is_admin=is_admin):
            logger.info("Inspection %s: %s by %s.", inspection_id, state, who.name)
            self._live.observations_changed(inspection_id)

    def remark(
        self,
        inspection_id: str,
        remark_id: str,
        observation_id: str,
        kind: RemarkKind,
        text: str,
        who: str,
        *,
        seen: str | None = None,
    ) -> None:
        """Add a remark on an observation; one that exists stays as it is.

        Args:
            inspection_id, remark_id, observation_id: The remark, and what it is about.
            kind, text: What is said.
            who: Name of its author.
            seen: Version of the observation that the author saw; None for the stored one.
        Raises:
            InspectionNotFound, ObservationNotFound: There is no such observation.
            InspectionLocked: The inspection is approved.
            ChangedMeanwhile: Another version is stored by now.
        """
        self._store.remark(inspection_id, remark_id, observation_id, kind, text, who, seen=seen)
        self._live.observations_changed(inspection_id)

    def settle(self, inspection_id: str, remark_id: str, who: str, *, is_settled: bool) -> None:
        """Settle a question, or open it again.

        Raises:
            InspectionNotFound, RemarkNotFound: There is no such remark.
            InspectionLocked: The inspection is approved.
        """
        self._store.settle(inspection_id, remark_id, who, is_settled=is_settled)
        self._live.observations_changed(inspection_id)

    def withdraw(self, inspection_id: str, remark_id: str, who: Principal) -> None:
        """Remove a remark, if it is there.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: The inspection is approved.
            Forbidden: Somebody else has made it, and `who` is no admin.
        """
        is_admin = who.role.may(Role.ADMIN)
        self._store.withdraw(inspection_id, remark_id, who.name, is_admin=is_admin)
        self._live.observations_changed(inspection_id)
