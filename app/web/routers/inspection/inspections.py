"""Inspections: create, list, change, stop, track again, delete; their track and wall points."""

from __future__ import annotations

from inspect import signature
from typing import Annotated, Literal

from fastapi import APIRouter, BackgroundTasks, Depends, Query, Request, Response

from app import errors
from app.inspections.corrections import Corrections
from app.inspections.films.filmed import Filmed
from app.inspections.films.films import Films
from app.inspections.films.recordings import Recordings
from app.inspections.inspections import Inspections
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.survey.assets.search_terms import InspectionFilter, InspectionSort, Page, ProjectFilter
from app.survey.given import LINE
from app.survey.labels import distinct
from app.survey.observations.review import ReviewState
from app.tracking.films.queue import Tracking
from app.tracking.recorder import Recorder
from app.tracking.tracks import Tracks
from app.viewer.scenes import Scenes
from app.web import columns
from app.web.deps import InspectionId, PrincipalDep, Service, of_projects, operator, viewer
from app.web.queries import Descending, Name, NoProject, SeverityFrom
from app.web.schemas.failures import content, failures
from app.web.schemas.inspection.frames import track_columns
from app.web.schemas.inspection.inspections import (
    ContinueIn,
    FinishIn,
    FoundOut,
    IdsOut,
    InspectionChange,
    InspectionIn,
    InspectionOut,
    InspectionsMeant,
    InspectionsOut,
    LabelOut,
    LabelsIn,
    LabelsInUseOut,
    LabelsOut,
    LiveSource,
    QueuedOut,
    RigIn,
)
from app.web.schemas.inspection.observations import WallGridOut, WallPointOut
from app.web.slow import slow
from app.web.versions import Replaced, tag_with
from vo_core.errors import InvalidRig, NoWallInView, RigVideoMismatch, UnreadableVideo

router = APIRouter(prefix="/api/inspections", tags=["inspections"])

_MOST_IDS = 10_000


@router.post(
    "",
    status_code=201,
    responses=failures(
        errors.PackNotFound,
        errors.UploadNotFound,
        errors.UploadIncomplete,
        errors.UploadBusy,
        errors.LiveSourceRefused,
        InvalidRig,
        NoWallInView,
        UnreadableVideo,
        RigVideoMismatch,
        errors.PixelOutsidePicture,
        errors.MediaFailed,
        errors.MediaTimeout,
    ),
)
@operator
@of_projects
@slow
def create(
    body: InspectionIn,
    response: Response,
    packs: Service[Packs],
    films: Service[Films],
    recordings: Service[Recordings],
    inspections: Service[Inspections],
    principal: PrincipalDep,
) -> InspectionOut:
    """Make an inspection of a complete upload, which is queued for tracking, or of a live source,
    which is recorded and tracked at once.
    """
    packs.require(body.header)
    if isinstance(body.source, LiveSource):
        inspection_id = recordings.create_live(
            body.name, body.source.url, body.rig, body.header, principal.name
        )
    else:
        inspection_id = films.create_from_upload(
            body.name,
            body.source.upload_id,
            body.rig,
            body.header,
            principal.name,
            body.counter.to_kept(),
        )
    response.headers["Location"] = f"/api/inspections/{inspection_id}"
    return InspectionOut.of(inspections.get(inspection_id))


def _wanted(
    search: Annotated[
        str | None,
        Query(
            max_length=200,
            pattern=LINE,
            description="Words in the name, the file's name or the header.",
        ),
    ] = None,
    status: Literal["queued", "running", "done", "failed", "cancelled"] | None = None,
    review: ReviewState | None = None,
    project: Name = None,
    no_project: NoProject = False,
    asset: Name = None,
    severity_from: SeverityFrom = None,
    label: Annotated[str | None, Query(max_length=50, pattern=LINE)] = None,
    outdated: Annotated[
        bool, Query(description="Only those whose film an older program tracked.")
    ] = False,
) -> InspectionFilter:
    return InspectionFilter(
        search=search or "",
        status=status,
        review=review,
        of=ProjectFilter(name=project, is_none=no_project),
        asset=asset,
        severity_from=severity_from,
        label=label,
        outdated=outdated,
    )


Wanted = Annotated[InspectionFilter, Depends(_wanted)]
_PARAMETERS = signature(_wanted).parameters.keys() | {"sort", "descending", "offset", "limit"}
"""Those of the list; others, which browsers and proxies add, change nothing."""


@router.get("")
@viewer
@of_projects
@slow
def list_some(
    request: Request,
    inspections: Service[Inspections],
    wanted: Wanted,
    sort: InspectionSort = "created_at",
    descending: Descending = True,
    offset: Annotated[int, Query(ge=0, le=10**9)] = 0,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> FoundOut | InspectionsOut:
    """Return the inspections, the newest first: all without these parameters, else a page of
    those that fit, with their number.

    Project, asset and label are whole names; what the index does not hold yet comes last.
    """
    if not request.query_params.keys() & _PARAMETERS:
        views = inspections.all()
        return InspectionsOut(inspections=[InspectionOut.of(view) for view in views])
    page = Page(sort=sort, descending=descending, offset=offset, limit=limit)
    return FoundOut.of(*inspections.found(wanted, page))


@router.get("/ids")
@viewer
@of_projects
@slow
def list_ids(
    inspections: Service[Inspections],
    wanted: Wanted,
    sort: InspectionSort = "created_at",
    descending: Descending = True,
) -> IdsOut:
    """Return the ids of the inspections that fit, at most ten thousand, for work on all of them."""
    page = Page(sort=sort, descending=descending, offset=0, limit=_MOST_IDS)
    return IdsOut(ids=inspections.ids(wanted, page))


@router.post("/retry")
@operator
@of_projects
@slow
def retry_some(body: InspectionsMeant, tracking: Service[Tracking]) -> QueuedOut:
    """Track inspections again; those that are approved, running or without a film stay."""
    return QueuedOut(queued=tracking.track_again(body.ids))


@router.get("/labels")
@viewer
@of_projects
def labels_in_use(inspections: Service[Inspections]) -> LabelsInUseOut:
    """Return all labels that are in use."""
    found = inspections.labels_in_use()
    return LabelsInUseOut(labels=[LabelOut(label=label, inspections=n) for label, n in found])


@router.put("/{inspection_id}/labels")
@operator
def label(
    inspection_id: InspectionId,
    body: LabelsIn,
    inspections: Service[Inspections],
    principal: PrincipalDep,
) -> LabelsOut:
    """Replace the labels, also of an approved inspection: they sort the list, and nobody approves
    them.
    """
    labels = inspections.label(inspection_id, distinct(body.labels), principal.name)
    return LabelsOut(labels=list(labels))


@router.get("/{inspection_id}")
@viewer
def get(
    inspection_id: InspectionId, inspections: Service[Inspections], response: Response
) -> InspectionOut:
    """Return the inspection."""
    view = inspections.get(inspection_id)
    tag_with(response, view.version)
    return InspectionOut.of(view)


@router.patch(
    "/{inspection_id}",
    responses=failures(errors.InspectionLocked, errors.PackNotFound, errors.ChangedMeanwhile),
)
@operator
def change(
    inspection_id: InspectionId,
    body: InspectionChange,
    inspections: Service[Inspections],
    principal: PrincipalDep,
    replaced: Replaced,
    response: Response,
) -> InspectionOut:
    """Change the name or the header."""
    view = inspections.change(
        inspection_id, principal.name, body.name, body.header, replaced=replaced
    )
    tag_with(response, view.version)
    return InspectionOut.of(view)


@router.delete(
    "/{inspection_id}",
    status_code=204,
    responses=failures(errors.InspectionLocked),
)
@slow
def delete(
    inspection_id: InspectionId, inspections: Service[Inspections], principal: PrincipalDep
) -> None:
    """Stop the inspection and delete it with all its files."""
    inspections.delete(inspection_id, principal.name)


@router.post("/{inspection_id}/cancel", responses=failures(errors.NotRunning))
@operator
@slow
def cancel(
    inspection_id: InspectionId, tracking: Service[Tracking], inspections: Service[Inspections]
) -> InspectionOut:
    """Stop tracking and keep the track so far."""
    tracking.cancel(inspection_id)
    return InspectionOut.of(inspections.get(inspection_id))


@router.post(
    "/{inspection_id}/retry",
    responses=failures(errors.InspectionLocked, errors.StillRunning, errors.NothingRecorded),
)
@operator
def retry(
    inspection_id: InspectionId, tracking: Service[Tracking], inspections: Service[Inspections]
) -> InspectionOut:
    """Track again; an inspection that was cancelled continues at its last checkpoint."""
    tracking.retry(inspection_id)
    return InspectionOut.of(inspections.get(inspection_id))


@router.put(
    "/{inspection_id}/rig",
    responses=failures(
        errors.InspectionLocked,
        errors.StillRunning,
        errors.NothingRecorded,
        InvalidRig,
        NoWallInView,
        RigVideoMismatch,
    ),
)
@operator
def track_with(
    inspection_id: InspectionId,
    body: RigIn,
    scenes: Service[Scenes],
    inspections: Service[Inspections],
    principal: PrincipalDep,
    tasks: BackgroundTasks,
) -> InspectionOut:
    """Track all frames again with this rig; tags, photos and corrections stay at their frames."""
    inspections.track_with(inspection_id, body.rig, principal.name)
    tasks.add_task(scenes.redraw, inspection_id)
    return InspectionOut.of(inspections.get(inspection_id))


@router.post(
    "/{inspection_id}/continue",
    responses=failures(
        errors.InspectionLocked,
        errors.StillRunning,
        errors.NothingRecorded,
        errors.NotAllTracked,
        errors.LiveSourceRefused,
        errors.MediaFailed,
    ),
)
@operator
@slow
def record_on(
    inspection_id: InspectionId,
    body: ContinueIn,
    recordings: Service[Recordings],
    inspections: Service[Inspections],
    principal: PrincipalDep,
) -> InspectionOut:
    """Continue the recording of a camera as the next part of the same inspection."""
    recordings.record_on(inspection_id, body.url, body.robot, principal.name)
    return InspectionOut.of(inspections.get(inspection_id))


@router.post(
    "/{inspection_id}/finish",
    responses=failures(errors.InspectionLocked, errors.OpenStretches),
)
@operator
@slow
def finish(
    inspection_id: InspectionId,
    body: FinishIn,
    recorder: Service[Recorder],
    inspections: Service[Inspections],
    principal: PrincipalDep,
) -> InspectionOut:
    """State how the survey ended; a recording ends too, and is tracked to its end meanwhile."""
    stated = body.model_dump(exclude_none=True)
    inspections.finish(inspection_id, principal.name, stated)
    recorder.finish(inspection_id)
    return InspectionOut.of(inspections.get(inspection_id))


@router.get(
    "/{inspection_id}/track",
    response_class=Response,
    responses=content("text/csv", "text/plain", "application/json", columns.MEDIA_TYPE),
)
@viewer
@slow
def track(
    inspection_id: InspectionId,
    inspections: Service[Inspections],
    filmed: Service[Filmed],
    tracks: Service[Tracks],
    corrections: Service[Corrections],
    format: Literal["csv", "tum", "json", "columns"] = "csv",  # noqa: A002  (the contract's name)
    since: Annotated[int, Query(ge=0, description="Only rows from this frame on.")] = 0,
    raw: Annotated[bool, Query(description="The raw track, without corrections.")] = False,
) -> Response:
    """Return the corrected track of the frames so far; `app.web.columns` describes `columns`."""
    if format == "columns":
        inspections.row(inspection_id)
        # Read before the rows: if another run begins in between, the next answer shows it.
        run = tracks.run_id(inspection_id)
        found = (tracks.get if raw else corrections.track)(inspection_id)
        sources = None if raw else corrections.newest(inspection_id).sources[: len(found)]
        packed = columns.packed(track_columns(found, since, sources), run=run, total=len(found))
        return Response(packed, media_type=columns.MEDIA_TYPE)
    written = filmed.raw_track_as if raw else filmed.track_as
    content, media_type = written(inspection_id, format, since)
    return Response(content, media_type=media_type)


@router.get(
    "/{inspection_id}/wall",
    responses=failures(errors.FrameNotFound, errors.PixelOutsidePicture),
)
@viewer
def wall(
    inspection_id: InspectionId,
    observations: Service[Observations],
    u: Annotated[float, Query(allow_inf_nan=False)],
    v: Annotated[float, Query(allow_inf_nan=False)],
    frame: Annotated[int, Query(ge=0)],
) -> WallPointOut:
    """Return the wall point under a pixel of a frame."""
    return WallPointOut.of(observations.wall_at(inspection_id, frame, (u, v)))


@router.get("/{inspection_id}/wallgrid")
@viewer
def wall_grid(inspection_id: InspectionId, observations: Service[Observations]) -> WallGridOut:
    """Return the rays of a grid of pixels, from which the page derives the wall under a pixel."""
    return WallGridOut.of(observations.wall_grid(inspection_id))
