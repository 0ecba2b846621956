"""What the index and the register say together of projects and assets.

An asset is known by its inspections, by the register, or by both: what both know is one asset if
they write its id alike. It belongs to the project of the register and to those of its inspections.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Subquery,
    case,
    exists,
    func,
    or_,
    select,
    union,
)
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading
from app.storage.database.tables import (
    IndexedInspection,
    Inspection,
    MadeProject,
    RegisteredAsset,
)
from app.storage.index.queries import (
    NEWEST_LAST,
    WITH_INSPECTION,
    FoundInspection,
    a_page,
    counted,
    of_project,
    unknown_last,
    with_words,
)
from app.storage.records.assets import AssetStore
from app.survey.assets.search_terms import AssetFilter, AssetSort, Page, ProjectFilter, ProjectSort
from app.survey.folding import normalised_id
from app.survey.observations.review import APPROVED


@dataclass(frozen=True)
class Asset:
    """An asset with its inspections in figures."""

    asset: str
    project: str | None
    """Of the register, else of its newest survey."""
    inspections: int
    last_at: date | None
    """Day of its newest survey; None if it was never inspected, like the next ones."""
    worst_severity: int | None
    """Of its newest survey."""
    filmed_id: str | None
    """That survey, if its film is here."""
    is_registered: bool
    also_written: tuple[str, ...]
    """Other ids with the same letters and digits: probably the same asset."""


@dataclass(frozen=True)
class Project:
    """A project with its inspections in figures."""

    project: str | None
    """None for all that belongs to no project."""
    assets: int
    inspections: int
    done: int
    approved: int
    last_at: date | None
    worst_severity: int | None
    """Of the newest survey of each of its assets."""


class AssetIndex(Store):
    """Answers questions about projects and assets."""

    @reading
    def assets(
        self, session: Session, wanted: AssetFilter, page: Page[AssetSort]
    ) -> tuple[int, list[Asset]]:
        """Return the number of assets that fit, and a page of them."""
        rows = _ASSETS
        query = select(rows).where(*_fitting_assets(rows.c.asset, wanted))
        order = (unknown_last(_column_of(rows, page.sort), page), rows.c.asset)
        total, found = a_page(session, query, order, page)
        alike = AssetStore(self.database).ids_alike(row[0] for row in found)
        return total, [Asset(*(*row, _others(alike, row[0]))) for row in found]

    @reading
    def projects(
        self, session: Session, text: str, wanted: ProjectFilter, page: Page[ProjectSort]
    ) -> tuple[int, list[Project]]:
        """Return the number of projects that fit, and a page of them.

        Args:
            text: Words that all occur in its name, or in those of one of its inspections or assets.
            wanted: One project, or all.
            page: Their order, and which of them.
        """
        rows = _PROJECTS
        query = select(rows).where(*of_project(rows.c.project, wanted))
        if text:
            query = query.where(or_(*_projects_with_words(rows.c.project, text)))
        order = (unknown_last(_column_of(rows, page.sort), page), rows.c.project.asc().nulls_last())
        total, found = a_page(session, query, order, page)
        return total, [Project(*row) for row in found]

    def also_written(self, asset: str) -> tuple[str, ...]:
        """Return other ids with the same letters and digits: probably the same asset."""
        return _others(AssetStore(self.database).ids_alike([asset]), asset)

    @reading
    def inspections_of(
        self, session: Session, asset: str, limit: int
    ) -> tuple[int, list[FoundInspection]]:
        """Return the number of inspections of an asset, and the newest of them, oldest first."""
        conditions = (IndexedInspection.asset == asset,)
        query = (
            WITH_INSPECTION.where(*conditions)
            .order_by(IndexedInspection.surveyed_on.desc(), Inspection.created_at.desc())
            .limit(limit)
        )
        total = counted(session, select(IndexedInspection.inspection_id).where(*conditions))
        found = [FoundInspection(*row) for row in session.execute(query)]
        return total, found[::-1]


def _ranked(of: Any) -> Subquery:
    """Return the inspections with their rank among those of the same asset: 1 is its newest
    survey.
    """
    newest_first = [column.desc() for column in NEWEST_LAST]
    return (
        select(
            IndexedInspection,
            Inspection.status,
            Inspection.review_state,
            Inspection.video_file,
            func.rank().over(partition_by=of, order_by=newest_first).label("rank"),
        )
        .join(Inspection, Inspection.id == IndexedInspection.inspection_id)
        .subquery()
    )


def _column_of(rows: Subquery, sort: AssetSort | ProjectSort) -> ColumnElement[Any]:
    return rows.c["last_at" if sort == "last_on" else sort]


def _of_newest(inspections: Subquery, column: ColumnElement[Any]) -> ColumnElement[Any]:
    return func.max(case((inspections.c.rank == 1, column)))


def _all_assets() -> Subquery:
    """Return every asset once; the columns are the fields of `Asset`."""
    known = union(
        select(IndexedInspection.asset.label("asset")).where(IndexedInspection.asset.is_not(None)),
        select(RegisteredAsset.asset_id),
    ).subquery()
    ranked = _ranked(IndexedInspection.asset)
    filmed = case((ranked.c.video_file != "", ranked.c.inspection_id))
    inspected = (
        select(
            ranked.c.asset,
            func.count().label("inspections"),
            _of_newest(ranked, ranked.c.surveyed_on).label("last_at"),
            _of_newest(ranked, ranked.c.worst_severity).label("worst_severity"),
            _of_newest(ranked, ranked.c.project).label("project"),
            _of_newest(ranked, filmed).label("filmed_id"),
        )
        .group_by(ranked.c.asset)
        .subquery()
    )
    return (
        select(
            known.c.asset,
            func.coalesce(RegisteredAsset.project, inspected.c.project).label("project"),
            func.coalesce(inspected.c.inspections, 0).label("inspections"),
            inspected.c.last_at,
            inspected.c.worst_severity,
            inspected.c.filmed_id,
            RegisteredAsset.asset_id.is_not(None).label("is_registered"),
        )
        .outerjoin(inspected, inspected.c.asset == known.c.asset)
        .outerjoin(RegisteredAsset, RegisteredAsset.asset_id == known.c.asset)
        .subquery()
    )


def _belongings() -> Subquery:
    """Return the pairs of project and asset, each once.

    The project is None for an asset to which neither the register nor an inspection gives one.
    """
    pairs = union(
        select(IndexedInspection.project.label("project"), IndexedInspection.asset).where(
            IndexedInspection.asset.is_not(None)
        ),
        select(RegisteredAsset.project, RegisteredAsset.asset_id),
    ).subquery()
    with_project = union(
        select(IndexedInspection.asset).where(
            IndexedInspection.asset.is_not(None), IndexedInspection.project.is_not(None)
        ),
        select(RegisteredAsset.asset_id).where(RegisteredAsset.project.is_not(None)),
    ).subquery()
    has_none = pairs.c.asset.not_in(select(with_project))
    return select(pairs).where(or_(pairs.c.project.is_not(None), has_none)).subquery()


def _all_projects() -> Subquery:
    """Return every project once, with what has none; the columns are the fields of `Project`."""
    assets = (
        select(_BELONGINGS.c.project, func.count().label("assets"))
        .group_by(_BELONGINGS.c.project)
        .subquery()
    )
    # An inspection without an asset stands for itself.
    of = func.coalesce(IndexedInspection.asset, IndexedInspection.inspection_id)
    ranked = _ranked(of)
    inspected = (
        select(
            ranked.c.project,
            func.count().label("inspections"),
            func.sum(case((ranked.c.status == "done", 1), else_=0)).label("done"),
            func.sum(case((ranked.c.review_state == APPROVED, 1), else_=0)).label("approved"),
            func.max(ranked.c.surveyed_on).label("last_at"),
            _of_newest(ranked, ranked.c.worst_severity).label("worst_severity"),
        )
        .group_by(ranked.c.project)
        .subquery()
    )
    known = union(
        select(assets.c.project), select(inspected.c.project), select(MadeProject.name)
    ).subquery()
    same = known.c.project.is_not_distinct_from
    return (
        select(
            known.c.project,
            func.coalesce(assets.c.assets, 0).label("assets"),
            func.coalesce(inspected.c.inspections, 0).label("inspections"),
            func.coalesce(inspected.c.done, 0).label("done"),
            func.coalesce(inspected.c.approved, 0).label("approved"),
            inspected.c.last_at,
            inspected.c.worst_severity,
        )
        .outerjoin(assets, same(assets.c.project))
        .outerjoin(inspected, same(inspected.c.project))
        .subquery()
    )


_BELONGINGS = _belongings()
_ASSETS = _all_assets()
_PROJECTS = _all_projects()


def _fitting_assets(
    asset: ColumnElement[Any], wanted: AssetFilter
) -> Iterator[ColumnElement[bool]]:
    if wanted.text:
        in_names = with_words(IndexedInspection.folded, wanted.text)
        in_register = with_words(RegisteredAsset.folded, wanted.text)
        yield or_(
            asset.in_(select(IndexedInspection.asset).where(*in_names)),
            asset.in_(select(RegisteredAsset.asset_id).where(*in_register)),
        )
    if wanted.of.is_set:
        belongs = of_project(_BELONGINGS.c.project, wanted.of)
        yield asset.in_(select(_BELONGINGS.c.asset).where(*belongs))


def _projects_with_words(project: ColumnElement[Any], text: str) -> Iterator[ColumnElement[bool]]:
    for table in (IndexedInspection, RegisteredAsset):
        is_same = project.is_not_distinct_from(table.project)
        yield exists().where(is_same, *with_words(table.folded, text))
    yield exists().where(project == MadeProject.name, *with_words(MadeProject.folded, text))


def _others(alike: Mapping[str, Sequence[str]], asset: str) -> tuple[str, ...]:
    """Return the other ids that are spelled like this one, of all ids by normalised id."""
    return tuple(other for other in alike.get(normalised_id(asset), ()) if other != asset)
