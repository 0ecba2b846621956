"""Findings of an inspection: listed with their places, accepted, rejected, shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.errors import FrameNotFound
from app.inspections.findings.sighting import FindingView, views_of
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.storage.records.findings import FindingStore
from app.storage.records.inspections import InspectionStore
from app.survey.findings.records import DetectorCount
from app.survey.observations.tag import Tag
from app.survey.places.place import ObservationView
from app.tracking.live import Live


@dataclass(frozen=True)
class Listed:
    """The findings of an inspection, along the pipe."""

    counts: tuple[DetectorCount, ...]
    views: Sequence[FindingView]


class Findings:
    """Lists findings, and stores what people decide about them."""

    def __init__(
        self,
        inspections: InspectionStore,
        store: FindingStore,
        observations: Observations,
        packs: Packs,
        live: Live,
    ) -> None:
        self._inspections = inspections
        self._store = store
        self._observations = observations
        self._packs = packs
        self._live = live

    def all(self, inspection_id: str) -> Listed:
        """Return all findings.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        row = self._inspections.get(inspection_id)
        found = self._store.listed(inspection_id)
        table = self._packs.table_of(row.header)
        views = views_of(self._observations.trajectory(inspection_id), found, table)
        return Listed(self._store.counts(inspection_id), views)

    def get(self, inspection_id: str, finding_id: str) -> FindingView:
        """Return a finding.

        Raises:
            InspectionNotFound, FindingNotFound: There is none.
        """
        found = self._store.get(inspection_id, finding_id)
        table = self._packs.table_of(self._inspections.get(inspection_id).header)
        (view,) = views_of(self._observations.trajectory(inspection_id), [found], table)
        return view

    def accept(
        self,
        inspection_id: str,
        finding_id: str,
        observation_id: str,
        changes: Mapping[str, Any],
        who: str,
    ) -> ObservationView:
        """Make an observation of a finding; repeated with the same id it changes nothing.

        Args:
            inspection_id, finding_id: The finding.
            observation_id: Id of the observation.
            changes: Fields of the tag that differ from the suggested ones.
            who: Name for the history.
        Raises:
            InspectionNotFound, FindingNotFound: There is none.
            InspectionLocked: The inspection is approved.
            FindingDecided: Somebody has decided otherwise.
            FrameNotFound: No frame shows it, and the changes name none.
            FrameOutsideVideo, PixelOutsidePicture: The changes name another one.
            ObservationNotFound: It was accepted, and the observation was deleted since.
        """
        view = self.get(inspection_id, finding_id)
        known = view.finding
        if (known.state, known.observation_id) != ("accepted", observation_id):
            stated = self._observations.checked(inspection_id, _tag_of(view, changes))
            if self._store.accept(inspection_id, finding_id, observation_id, stated, who):
                self._live.observations_changed(inspection_id)
                self._live.findings_changed(inspection_id)
        return self._observations.get(inspection_id, observation_id)

    def reject(self, inspection_id: str, finding_id: str, who: str) -> FindingView:
        """Reject a finding: it is never offered again.

        Raises:
            InspectionNotFound, FindingNotFound: There is none.
            InspectionLocked: The inspection is approved.
            FindingDecided: Somebody has accepted it.
        """
        if self._store.reject(inspection_id, finding_id, who):
            self._live.findings_changed(inspection_id)
        return self.get(inspection_id, finding_id)

    def reopen(self, inspection_id: str, finding_id: str, who: str) -> FindingView:
        """Undo a decision; the observation of an accepted finding is deleted.

        Raises:
            InspectionNotFound, FindingNotFound: There is none.
            InspectionLocked: The inspection is approved.
        """
        if self._store.reopen(inspection_id, finding_id, who):
            self._live.observations_changed(inspection_id)
            self._live.findings_changed(inspection_id)
        return self.get(inspection_id, finding_id)


def _tag_of(view: FindingView, changes: Mapping[str, Any]) -> Tag:
    fields = dict(view.suggested)
    if view.seen is not None:
        fields |= {"frame": view.seen.frame, "pixel": list(view.seen.pixel)}
    fields |= changes
    if "frame" not in fields:
        raise FrameNotFound("No tracked frame shows this finding; tag it in the film.")
    return Tag.model_validate(fields)
