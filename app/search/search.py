"""Answers questions about all inspections, from the index."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.search.indexer import IndexWorker
from app.storage.defect_index import (
    Asset,
    DefectIndex,
    FoundDefect,
    FoundInspection,
)
from app.storage.tables import IndexedInspection
from app.survey.asset_history import Seen, Survey, Trace, traces_of
from app.survey.search_terms import DefectFilter, DefectSort, Page, Problem, QualitySort

_MOST_SURVEYS = 50
"""Newest inspections in the history of an asset."""
_UNKNOWN = "unknown"


@dataclass(frozen=True)
class History:
    """The inspections of an asset, oldest first, and what became of their defects."""

    total: int
    """Number of its inspections, of which the newest are in the next field."""
    inspections: list[tuple[FoundInspection, list[FoundDefect]]]
    traces: list[Trace]


class Search:
    """Searches the index; whatever is not indexed yet is counted, and indexed soon."""

    def __init__(self, index: DefectIndex, worker: IndexWorker) -> None:
        self._index = index
        self._worker = worker

    def pending(self) -> int:
        """Return how many inspections are not indexed in their present state."""
        number = self._index.pending()
        if number:
            self._worker.look()
        return number

    def defects(
        self, wanted: DefectFilter, page: Page[DefectSort]
    ) -> tuple[int, list[FoundDefect]]:
        """Return the number of defects that fit, and a page of them."""
        return self._index.defects(wanted, page)

    def assets(self, text: str, offset: int, limit: int) -> tuple[int, list[Asset]]:
        """Return the number of assets with these words, and a page of them, sorted by name."""
        return self._index.assets(text, offset, limit)

    def films(
        self, problem: Problem | None, page: Page[QualitySort]
    ) -> tuple[int, list[IndexedInspection]]:
        """Return the number of measured films, or of those with a problem, and a page of them."""
        return self._index.films(problem, page)

    def history(self, asset: str) -> History:
        """Return the inspections of an asset, none if there is no such asset."""
        total, inspections = self._index.inspections_of(asset, _MOST_SURVEYS)
        ids = [found.row.inspection_id for found in inspections]
        by_id: dict[str, list[FoundDefect]] = {inspection_id: [] for inspection_id in ids}
        for defect in self._index.defects_of(ids):
            by_id[defect.row.inspection_id].append(defect)
        with_defects = [(found, by_id[found.row.inspection_id]) for found in inspections]
        return History(total, with_defects, traces_of([_survey(*one) for one in with_defects]))


def _survey(found: FoundInspection, defects: Sequence[FoundDefect]) -> Survey:
    return Survey(
        found.row.surveyed_on,
        str(found.inspection.header.get("direction") or _UNKNOWN),
        [
            Seen(
                one.row.inspection_id,
                one.row.observation_id,
                one.row.code,
                one.row.distance_m,
                one.row.distance_u95_m,
                one.row.clock,
                one.row.severity,
            )
            for one in defects
            if one.row.code is not None and one.row.distance_m is not None
        ],
    )
