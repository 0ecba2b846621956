"""Across all inspections: their defects, projects, assets and the history of one, the quality of
the films, and everything as tables.
"""

from __future__ import annotations

from datetime import date
from typing import Annotated

from fastapi import APIRouter, Path, Query, Response
from starlette.responses import StreamingResponse

from app import errors
from app.inspections.compared.changes import Changes
from app.search.export import MEDIA_TYPE, ArchiveExport, Format
from app.search.search import Search
from app.survey.assets.search_terms import (
    AssetFilter,
    AssetSort,
    DefectFilter,
    DefectSort,
    Page,
    Problem,
    ProjectSort,
    QualitySort,
)
from app.survey.given import LINE
from app.survey.places.clock_hours import hour_bits
from app.web.deps import Service, of_projects, viewer
from app.web.queries import Descending, Limit, Name, Offset, OfProject, SeverityFrom, Text
from app.web.schemas.failures import content, failures
from app.web.schemas.library.search import (
    AssetsOut,
    FilmOut,
    FilmsOut,
    FoundDefectOut,
    FoundDefectsOut,
    HistoryOut,
    ProjectsOut,
)
from app.web.slow import PersonDep, slow, streamed

router = APIRouter(prefix="/api/archive", tags=["search"])

_CLOCK = r"^([1-9]|1[0-2])(-([1-9]|1[0-2]))?$"
Distance = Annotated[float | None, Query(ge=-1e6, le=1e6, allow_inf_nan=False)]


@router.get("/defects")
@viewer
@of_projects
@slow
def defects(
    index: Service[Search],
    code: Annotated[
        str,
        Query(pattern=r"^([A-Z][A-Z0-9]{0,7})?$", description="The code or how it begins."),
    ] = "",
    severity_from: SeverityFrom = None,
    text: Text = "",
    project: Name = None,
    asset: Name = None,
    from_m: Distance = None,
    to_m: Distance = None,
    clock: Annotated[
        str | None,
        Query(pattern=_CLOCK, description="An hour, or hours clockwise: 11-1 is around the crown."),
    ] = None,
    after: Annotated[date | None, Query(description="First day of the surveys.")] = None,
    before: Annotated[date | None, Query(description="Last day of the surveys.")] = None,
    sort: DefectSort = "created_at",
    descending: Descending = True,
    offset: Offset = 0,
    limit: Limit = 50,
) -> FoundDefectsOut:
    """Return the defects of all inspections that fit, with the places by the present corrections.

    Project and asset are whole names; `text` finds parts of them.
    """
    wanted = DefectFilter(
        code=code,
        severity_from=severity_from,
        text=text,
        project=project,
        asset=asset,
        from_m=from_m,
        to_m=to_m,
        clock_hours=None if clock is None else hour_bits(*map(int, clock.split("-"))),
        after=after,
        before=before,
    )
    page = Page(sort=sort, descending=descending, offset=offset, limit=limit)
    pending = index.pending()
    total, found = index.defects(wanted, page)
    return FoundDefectsOut(
        total=total, pending=pending, defects=[FoundDefectOut.of(defect) for defect in found]
    )


@router.get("/projects")
@viewer
@of_projects
@slow
def projects(
    index: Service[Search],
    of: OfProject,
    search: Text = "",
    sort: ProjectSort = "project",
    descending: Descending = False,
    offset: Offset = 0,
    limit: Limit = 50,
) -> ProjectsOut:
    """Return the projects of inspections and of registered assets, and what belongs to none.

    `project` is a whole name; `search` finds parts of it and of its inspections and assets.
    """
    page = Page(sort=sort, descending=descending, offset=offset, limit=limit)
    pending = index.pending()
    total, found = index.projects(search, of, page)
    return ProjectsOut(total=total, pending=pending, projects=found)


@router.get("/assets")
@viewer
@of_projects
@slow
def assets(
    index: Service[Search],
    of: OfProject,
    search: Text = "",
    sort: AssetSort = "asset",
    descending: Descending = False,
    offset: Offset = 0,
    limit: Limit = 50,
) -> AssetsOut:
    """Return the assets that were inspected or are in the register."""
    page = Page(sort=sort, descending=descending, offset=offset, limit=limit)
    pending = index.pending()
    total, found = index.assets(AssetFilter(text=search, of=of), page)
    return AssetsOut(total=total, pending=pending, assets=found)


@router.get("/assets/{asset:path}")
@viewer
@of_projects
@slow
def asset_history(
    asset: Annotated[str, Path(min_length=1, max_length=20_000, pattern=LINE)],
    index: Service[Search],
    changes: Service[Changes],
) -> HistoryOut:
    """Return the inspections of an asset, oldest first, and what became of its defects.

    Surveys whose walls were compared are matched by the places on the wall.

    An asset that was never inspected has an empty history.
    """
    pending = index.pending()
    return HistoryOut.of(asset, index.history(asset, changes.alignments), pending)


@router.get("/quality")
@viewer
@of_projects
@slow
def quality(
    index: Service[Search],
    problem: Annotated[
        Problem | None, Query(description="Only films in which too many frames have it.")
    ] = None,
    sort: QualitySort = "lost_share",
    descending: Descending = True,
    offset: Offset = 0,
    limit: Limit = 50,
) -> FilmsOut:
    """Return how suitable the films were for measuring, the worst first."""
    page = Page(sort=sort, descending=descending, offset=offset, limit=limit)
    pending = index.pending()
    total, found = index.films(problem, page)
    return FilmsOut(total=total, pending=pending, films=[FilmOut.of(row) for row in found])


@router.get(
    "/export",
    response_class=Response,
    responses=content(MEDIA_TYPE) | failures(errors.ExportNotAvailable),
)
@viewer
@of_projects
def export(
    archive_export: Service[ArchiveExport],
    person: PersonDep,
    format: Annotated[  # noqa: A002
        Format, Query(description="Of the tables; Parquet needs `chainage[archive]` installed.")
    ] = "json",
    tracks: Annotated[bool, Query(description="With a row for each frame of each film.")] = False,
) -> StreamingResponse:
    """Return everything for analysis: a ZIP with a table of inspections, defects and film quality.

    It is made while it is sent, from the index; `pending` in its `schema.json` says how many
    inspections are not indexed in their present state.
    """
    blocks = archive_export.blocks(format, with_tracks=tracks)
    headers = {"Content-Disposition": 'attachment; filename="chainage-archive.zip"'}
    return StreamingResponse(streamed(blocks, person), media_type=MEDIA_TYPE, headers=headers)
