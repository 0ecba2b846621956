"""Answers questions about all inspections, from the index."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

from app.inspections.purpose import Purpose
from app.search.indexer import IndexWorker
from app.storage.database.tables import IndexedInspection
from app.storage.index.asset_index import Asset, AssetIndex, Project
from app.storage.index.defect_index import DefectIndex, FoundDefect
from app.storage.index.queries import FoundInspection
from app.storage.index.work_list import Briefs, Work, WorkList
from app.storage.records.labels import LabelStore
from app.survey.assets.asset_history import (
    Alignments,
    Change,
    Seen,
    Survey,
    Trace,
    changes_of,
    counted,
    traces_of,
)
from app.survey.assets.search_terms import (
    AssetFilter,
    AssetSort,
    DefectFilter,
    DefectSort,
    Page,
    Problem,
    ProjectFilter,
    ProjectSort,
    QualitySort,
    WorkFilter,
    WorkSort,
)
from app.survey.observations.defects import is_defect
from app.survey.observations.review import DRAFT

_MOST_SURVEYS = 50
"""Newest inspections in the history of an asset."""
_UNKNOWN = "unknown"
_AS_INDEXED = {one.name for one in fields(Seen)} - {"u95_m", "role"}


@dataclass(frozen=True)
class Past:
    """An inspection in the history of its asset."""

    found: FoundInspection
    defects: list[FoundDefect]
    labels: tuple[str, ...]
    changes: dict[Change, int]
    """Number of defects with each change that it shows."""
    is_useful: bool | None
    """Whether its end is known well enough for the intended use; None if nobody measured it."""


@dataclass(frozen=True)
class Followed:
    """A defect through the inspections, with what each of them shows about it."""

    trace: Trace
    changes: list[Change | None]


@dataclass(frozen=True)
class History:
    """The inspections of an asset, oldest first, and what became of their defects."""

    total: int
    """Number of its inspections, of which the newest are in the next field."""
    inspections: list[Past]
    followed: list[Followed]
    also_written: tuple[str, ...]
    """Other ids with the same letters and digits: probably the same asset."""


class Search:
    """Searches the index; whatever is not indexed yet is counted, and indexed soon."""

    def __init__(
        self,
        index: DefectIndex,
        assets: AssetIndex,
        work: WorkList,
        labels: LabelStore,
        worker: IndexWorker,
        purpose: Purpose,
    ) -> None:
        self._index = index
        self._assets = assets
        self._work = work
        self._labels = labels
        self._worker = worker
        self._purpose = purpose

    def pending(self) -> int:
        """Return how many inspections are not indexed in their present state."""
        number = self._index.pending()
        if number:
            self._worker.wake()
        return number

    def defects(
        self, wanted: DefectFilter, page: Page[DefectSort]
    ) -> tuple[int, list[FoundDefect]]:
        """Return the number of defects that fit, and a page of them."""
        return self._index.defects(wanted, page)

    def assets(self, wanted: AssetFilter, page: Page[AssetSort]) -> tuple[int, list[Asset]]:
        """Return the number of assets that fit, inspected or registered, and a page of them."""
        return self._assets.assets(wanted, page)

    def work(self, wanted: WorkFilter, page: Page[WorkSort]) -> Work:
        """Return the sections of the register that fit, and the number in each state."""
        return self._work.work(wanted, page, self._purpose.get())

    def around_the_work(self) -> tuple[Briefs, Briefs, Briefs]:
        """Return the inspections that are live, that wait for a reviewer, and that have ended."""
        return self._work.around(self._purpose.get())

    def projects(
        self, text: str, wanted: ProjectFilter, page: Page[ProjectSort]
    ) -> tuple[int, list[Project]]:
        """Return the number of projects that fit, and a page of them."""
        return self._assets.projects(text, wanted, page)

    def films(
        self, problem: Problem | None, page: Page[QualitySort]
    ) -> tuple[int, list[IndexedInspection]]:
        """Return the number of measured films, or of those with a problem, and a page of them."""
        return self._index.films(problem, page)

    def history(self, asset: str, alignments: Callable[[Sequence[str]], Alignments]) -> History:
        """Return the inspections of an asset, none if there is no such asset.

        Args:
            asset: Its id.
            alignments: Returns which of these inspections, oldest first, are in register.
        """
        total, inspections = self._assets.inspections_of(asset, _MOST_SURVEYS)
        ids = [found.row.inspection_id for found in inspections]
        labels = self._labels.of(ids)
        by_id: dict[str, list[FoundDefect]] = {inspection_id: [] for inspection_id in ids}
        for defect in self._index.defects_of(ids):
            by_id[defect.row.inspection_id].append(defect)
        surveys = [_survey(found, by_id[found.row.inspection_id]) for found in inspections]
        is_met = self._purpose.get().is_met
        traces = traces_of(surveys, alignments(ids))
        followed = [Followed(one, changes_of(one, surveys)) for one in traces]
        return History(
            total,
            [
                Past(
                    found,
                    [
                        one
                        for one in by_id[found.row.inspection_id]
                        if is_defect(one.row.code, one.row.severity)
                    ],
                    labels.get(found.row.inspection_id, ()),
                    counted([one.changes[place] for one in followed]),
                    is_met(found.row.distance_m, found.row.distance_u95_m),
                )
                for place, found in enumerate(inspections)
            ],
            followed,
            self._assets.also_written(asset),
        )


def _survey(found: FoundInspection, defects: Sequence[FoundDefect]) -> Survey:
    seen = [
        Seen(
            **{name: getattr(one.row, name) for name in _AS_INDEXED},
            u95_m=one.row.distance_u95_m,
            role=one.row.continuous and one.row.continuous[0],
        )
        for one in defects
        if one.row.code is not None
        and is_defect(one.row.code, one.row.severity)
        and one.row.distance_m is not None
    ]
    # A film that nobody has looked at yet shows of no defect that it is gone.
    is_looked_at = bool(defects) or found.inspection.review_state != DRAFT
    return Survey(
        on=found.row.surveyed_on,
        direction=str(found.inspection.header.get("direction") or _UNKNOWN),
        defects=seen,
        end_m=found.row.distance_m if is_looked_at else None,
    )
