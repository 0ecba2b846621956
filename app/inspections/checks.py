"""Runs the report checks on an inspection."""

from __future__ import annotations

from app.inspections.corrections import Corrections
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.inspections.purpose import Purpose
from app.storage.blobs import keys
from app.storage.records.inspections import InspectionStore
from app.storage.storage import Stored
from app.survey.observations.checks import Case, Issue, no_longer_fit, run
from app.survey.places.place import ObservationView
from app.tracking.tracks import Tracks


class Checks:
    """Runs all rules on an inspection."""

    def __init__(
        self,
        stored: Stored,
        observations: Observations,
        corrections: Corrections,
        tracks: Tracks,
        packs: Packs,
        purpose: Purpose,
    ) -> None:
        self._inspections = InspectionStore(stored.database)
        self._observations = observations
        self._corrections = corrections
        self._tracks = tracks
        self._packs = packs
        self._purpose = purpose
        self._blobs = stored.blobs

    def run(self, inspection_id: str, views: list[ObservationView] | None = None) -> list[Issue]:
        """Return the issues, those that block first, each kind in the order of the rules.

        Args:
            inspection_id: An inspection in any state.
            views: Its observations, if the caller has just listed them.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return run(self._case(inspection_id, views))

    def with_pack(self, inspection_id: str, pack_id: str | None) -> list[Issue]:
        """Return what would no longer fit if the inspection were coded with another pack.

        Args:
            inspection_id: An inspection in any state.
            pack_id: The other pack; None is the built-in one.

        Raises:
            InspectionNotFound: No inspection has this id.
            PackNotFound: No pack has this id, or it belongs to another project.
        """
        table = self._packs.table(pack_id)
        case = self._case(inspection_id)
        self._packs.require({**case.header, "code_pack": pack_id})
        return no_longer_fit(case, table)

    def _case(self, inspection_id: str, views: list[ObservationView] | None = None) -> Case:
        row = self._inspections.get(inspection_id)
        photos = {blob.key for blob in self._blobs.listed(keys.photos(inspection_id))}

        def photo_is_there(view: ObservationView) -> bool:
            return keys.photo(inspection_id, view.row.id, view.row.frame) in photos

        return Case(
            header=row.header,
            views=self._observations.all(inspection_id) if views is None else views,
            table=self._packs.table_of(row.header),
            corrected=self._corrections.get(inspection_id),
            track=self._corrections.track(inspection_id),
            health=self._tracks.health(inspection_id).columns(),
            photo_is_there=photo_is_there,
            is_outdated=row.is_outdated,
            use=self._purpose.get(),
        )
