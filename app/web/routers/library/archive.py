"""The archive: many films at once; adding, starting, stopping, repairing them, and their rules."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Response

from app import errors
from app.archive.archive import Archive, Where, version_of_rules
from app.archive.rules import Rules
from app.web.deps import PrincipalDep, Service, of_projects, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.library.archive import (
    AdditionIn,
    AdditionOut,
    ArchiveProgressOut,
    ChangedOut,
    FailuresOut,
    FilmOut,
    FilmsChangeIn,
    FilmsMeant,
    FilmsOut,
    FoldersOut,
    GroupOut,
    Sort,
    State,
    WhereIn,
    WishIn,
    Words,
)
from app.web.slow import heavy, slow
from app.web.versions import Replaced, tag_with
from vo_core.errors import InvalidRig, NoWallInView

router = APIRouter(prefix="/api/archive", tags=["archive"])


def _where(
    search: Annotated[
        Words | None, Query(description="Part of name, path, project or asset.")
    ] = None,
    state: State | None = None,
    project: Words | None = None,
    asset: Words | None = None,
    reason: Annotated[Words | None, Query(description="The reason of a group of failures.")] = None,
    outdated: Annotated[
        bool, Query(description="Only films that an older program tracked.")
    ] = False,
) -> Where:
    return WhereIn(
        search=search,
        state=state,
        project=project,
        asset=asset,
        reason=reason,
        outdated=outdated,
    ).to_where()


Filters = Annotated[Where, Depends(_where)]


@router.get("/films")
@viewer
@of_projects
def list_films(
    archive: Service[Archive],
    where: Filters,
    sort: Annotated[Sort | None, Query(description="By path unless stated.")] = None,
    descending: bool = False,
    offset: Annotated[int, Query(ge=0, le=2**31)] = 0,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
) -> FilmsOut:
    """Return one page of the films."""
    total, films = archive.films(where, sort, descending=descending, offset=offset, limit=limit)
    return FilmsOut(total=total, films=[FilmOut.of(view) for view in films])


@router.get("/folders", responses=failures(errors.FolderNotAllowed, errors.NoSuchFilm))
@slow
def folders(
    archive: Service[Archive],
    path: Annotated[
        str | None, Query(max_length=20_000, description="Without it: those to begin with.")
    ] = None,
) -> FoldersOut:
    """Return the folders in a folder of this machine that films may be added from."""
    return FoldersOut.model_validate(archive.folders(path))


@router.post(
    "/films/preview",
    responses=failures(errors.FolderNotAllowed, errors.NoSuchFilm, errors.InvalidTable),
)
@heavy
def preview(body: AdditionIn, archive: Service[Archive]) -> AdditionOut:
    """Return what each film would get; nothing changes."""
    return AdditionOut.of(archive.preview(body.to_request(archive.rules())))


@router.post(
    "/films", responses=failures(errors.FolderNotAllowed, errors.NoSuchFilm, errors.InvalidTable)
)
@heavy
def add(body: AdditionIn, archive: Service[Archive], principal: PrincipalDep) -> AdditionOut:
    """Add films of the server's machine; those that are in the archive already stay as they are."""
    return AdditionOut.of(archive.add(body.to_request(archive.rules()), principal.name))


@router.patch("/films", responses=failures(InvalidRig, NoWallInView))
@operator
@slow
def change(body: FilmsChangeIn, archive: Service[Archive], principal: PrincipalDep) -> ChangedOut:
    """Change films; a new rig counts from the next try on, project, asset and header at once."""
    changed = archive.change(body.to_where(), principal.name, body.to_change())
    return ChangedOut(changed=changed)


@router.delete("/films")
@operator
def delete(body: FilmsMeant, archive: Service[Archive], principal: PrincipalDep) -> ChangedOut:
    """Take films off the list; their inspections stay."""
    return ChangedOut(changed=archive.delete(body.to_where(), principal.name))


@router.post("/start")
@operator
def start(body: WishIn, archive: Service[Archive], principal: PrincipalDep) -> ChangedOut:
    """Let ready and paused films wait for their turn."""
    changed = archive.start(body.to_where(), principal.name, body.priority)
    return ChangedOut(changed=changed)


@router.post("/pause")
@operator
@slow
def pause(body: FilmsMeant, archive: Service[Archive], principal: PrincipalDep) -> ChangedOut:
    """Stop films that wait, are queued or running, until they are resumed."""
    return ChangedOut(changed=archive.pause(body.to_where(), principal.name))


@router.post("/resume")
@operator
def resume(body: WishIn, archive: Service[Archive], principal: PrincipalDep) -> ChangedOut:
    """Let paused films wait for their turn again."""
    changed = archive.resume(body.to_where(), principal.name, body.priority)
    return ChangedOut(changed=changed)


@router.post("/cancel")
@operator
@slow
def cancel(body: FilmsMeant, archive: Service[Archive], principal: PrincipalDep) -> ChangedOut:
    """Stop films; those that were not begun are ready again."""
    return ChangedOut(changed=archive.cancel(body.to_where(), principal.name))


@router.post("/retry")
@operator
@slow
def retry(body: WishIn, archive: Service[Archive], principal: PrincipalDep) -> ChangedOut:
    """Let films that failed, were cancelled or refused wait for another try; films that an older
    program tracked are tracked again if they are named by their ids or by `outdated`.
    """
    changed = archive.retry(body.to_where(), principal.name, body.priority)
    return ChangedOut(changed=changed)


@router.get("/rules")
@viewer
def rules(archive: Service[Archive], response: Response) -> Rules:
    """Return the rules; the first that fits a film wins."""
    found = archive.rules()
    tag_with(response, version_of_rules(found))
    return found


@router.put("/rules", responses=failures(InvalidRig, NoWallInView, errors.ChangedMeanwhile))
@operator
def put_rules(
    body: Rules,
    archive: Service[Archive],
    principal: PrincipalDep,
    replaced: Replaced,
    response: Response,
) -> Rules:
    """Replace the rules; films that are in the archive keep what they got."""
    found = archive.put_rules(body, principal.name, replaced)
    tag_with(response, version_of_rules(found))
    return found


@router.get("/progress")
@viewer
def progress(archive: Service[Archive], where: Filters) -> ArchiveProgressOut:
    """Return the progress of the films as a whole."""
    return ArchiveProgressOut.model_validate(archive.progress(where))


@router.get("/failures")
@viewer
@of_projects
def list_failures(archive: Service[Archive], where: Filters) -> FailuresOut:
    """Return the films that failed or were refused, grouped by reason."""
    groups = archive.failures(where)
    return FailuresOut(groups=[GroupOut.model_validate(group) for group in groups])
