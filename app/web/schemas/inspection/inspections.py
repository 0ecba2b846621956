"""Inspections: their beginning, progress and end."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, Field, StringConstraints, model_validator

from app.inspections.films.samples import SampleState
from app.inspections.inspections import InspectionView
from app.jobs.live.load import Shed
from app.storage.database.tables import IMPORTED, Inspection
from app.storage.index.inspection_list import Found
from app.survey.distances.interval import half_width_m
from app.survey.fields.header import asset_of, project_of
from app.survey.given import TEXT, Given, Header, Name
from app.survey.labels import Labels
from app.web.schemas.failures import ErrorOut
from app.web.schemas.inspection.counter import CounterIn
from app.web.schemas.inspection.reviews import ReviewStateOut
from app.web.schemas.out import Hundredths, Out, Tenths, Thousandths, metres


class UploadSource(Given):
    """A complete upload."""

    kind: Literal["upload"]
    upload_id: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]


Url = Annotated[
    str,
    Field(
        min_length=1,
        max_length=2000,
        description="rtsp://, rtsps://, http:// or https:// (MJPEG), or one of /api/sources.",
    ),
]


class LiveSource(Given):
    """A network camera, or a source that the server lists."""

    kind: Literal["live"]
    url: Url


class InspectionIn(Given):
    """A new inspection."""

    name: Name
    source: Annotated[UploadSource | LiveSource, Field(discriminator="kind")]
    rig: dict[str, Any] = Field(description="The rig file: camera, mount and pipe.")
    header: Header = Field(default_factory=dict)
    counter: CounterIn = Field(
        default_factory=lambda: CounterIn(is_present=True, box=None, unit=None),
        description="The burnt-in counter of an upload; by default it is searched.",
    )


class InspectionChange(Given):
    """The fields to change; omitted ones stay."""

    name: Name | None = None
    header: Header | None = None


class ArchiveIn(Given):
    """An archive file that was uploaded."""

    upload_id: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]


class InspectionsMeant(Given):
    """Inspections by their ids."""

    ids: Annotated[
        list[Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]],
        Field(max_length=10_000),
    ]


class QueuedOut(BaseModel):
    """How many inspections were queued to be tracked."""

    queued: int


class ImportedOut(BaseModel):
    """The result of an import."""

    inspections: list[InspectionOut]
    """Inspections in the order of the file."""
    warnings: list[str]
    """Sentences about what is odd or left out."""


class FinishIn(Given):
    """How a survey ended."""

    end_condition: Literal["complete", "abandoned"]
    abandon_reason: (
        Annotated[str, StringConstraints(strip_whitespace=True, max_length=2000, pattern=TEXT)]
        | None
    ) = Field(None, description="Required for an abandoned survey.")
    known_length_m: Annotated[float, Field(gt=0, le=100_000)] | None = None

    @model_validator(mode="after")
    def _says_why(self) -> Self:
        if self.end_condition == "abandoned" and not self.abandon_reason:
            raise ValueError("an abandoned inspection needs a reason (abandon_reason)")
        return self


class RigIn(Given):
    """Another rig for the same film."""

    rig: dict[str, Any] = Field(description="The whole rig file: camera, mount and pipe.")


class ContinueIn(Given):
    """The next part of a recording."""

    url: Url
    robot: Literal["stood_still", "moved"] = Field(
        description="Movement of the robot since the previous part. Use `moved` also if nobody "
        "knows: the distance continues from the last one, uncertain by 10 m and by the distance "
        "so far."
    )


class ProgressOut(Out):
    """Progress of the tracking."""

    frames_done: int
    frames_total: int | None
    fps: Tenths | None
    eta_s: Tenths | None


class SourceOut(BaseModel):
    """The original file."""

    kind: str
    filename: str
    size: int
    sha256: str


class LiveOut(Out):
    """A camera during its recording."""

    connected: bool
    reconnects: int
    dropped: int
    """Frames that are in the recording but came too fast to be tracked."""
    skipped_share: Thousandths
    """Share of them in the last seconds."""
    shed: list[Shed]
    """What the machine leaves out for that reason, in this order; never tags or the recording."""
    recorded_s: Hundredths
    detail: str | None
    """Why there is no picture."""
    free_bytes: int
    """Free space for the rest of the recording."""
    is_recording: bool
    """False while the disk is full: tracking continues, recording resumes when there is room."""
    is_ending: bool
    """Whether the recording has ended, and what was captured is still being tracked."""


class VideoOut(BaseModel):
    """Properties of the original file."""

    width: int
    height: int
    duration_s: float | None
    codec: str
    pixel_aspect: float = 1.0
    """Width of a pixel by its height; pictures and photos have square pixels."""
    playable: bool
    """Whether browsers play it; otherwise single frames are fetched."""


class InspectionOut(Out):
    """An inspection."""

    id: str
    name: str
    project: str | None
    """Header field project, else job_ref, else client_job_ref."""
    asset: str | None
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: ProgressOut
    distance_m: float | None
    """Corrected distance of the last frame."""
    distance_u95_m: float | None
    is_useful: bool | None
    """Whether that is as narrow as `/api/intended-use` asks for; None if nobody measured it."""
    useful_within_m: Thousandths
    """Widest half of a 95 % interval that is of use in it."""
    distance_raw_m: float | None
    """The same distance in the raw track."""
    revision: int
    """Rises with every correction; distances must then be read again."""
    version: str
    """Version of name and header: the `If-Match` of a change, in quotation marks."""
    corrected: bool
    observations: int
    defects: int
    """Those of its observations that are defects: a stretch is one, start and end are none."""
    worst_severity: int | None
    review: ReviewStateOut
    open_questions: int
    """Questions of reviewers that are not settled."""
    labels: list[str]
    tracked_with: str | None
    """Program that tracked the film; None if that is not known."""
    outdated: bool
    """Whether an older program tracked the film: today's might measure it otherwise."""
    error: ErrorOut | None
    warning: str | None
    created_at: datetime
    finished_at: datetime | None
    rig: dict[str, Any]
    header: dict[str, Any]
    source: SourceOut
    video: VideoOut
    live: LiveOut | None
    """State of the camera during a recording."""

    @classmethod
    def of(cls, view: InspectionView) -> InspectionOut:
        """Convert the service's view."""
        row, sigma_mm = view.row, view.sigma_distance_mm
        return cls.read_from(
            row,
            view,
            project=project_of(row.header),
            asset=asset_of(row.header),
            progress=view.progress,
            distance_m=metres(view.distance_mm),
            distance_u95_m=None if sigma_mm is None else half_width_m(sigma_mm),
            distance_raw_m=metres(view.raw_distance_mm),
            corrected=view.is_corrected,
            review=ReviewStateOut.of(row),
            outdated=row.is_outdated,
            error=_error(row),
            warning=view.warning,
            source=SourceOut(
                kind=row.source_kind if row.has_film else IMPORTED,
                filename=row.source_filename,
                size=row.source_size,
                sha256=row.source_sha256,
            ),
            video=_video(row),
            live=view.camera,
        )


class LabelsIn(Given):
    """All labels of an inspection; two that differ in case or accents only are one."""

    labels: Labels


class LabelsOut(BaseModel):
    """All labels of an inspection, sorted."""

    labels: list[str]


class LabelOut(BaseModel):
    """A label that is in use."""

    label: str
    inspections: int


class LabelsInUseOut(BaseModel):
    """All labels in use, the most used first."""

    labels: list[LabelOut]


class IdsOut(BaseModel):
    """The ids of the inspections that fit."""

    ids: list[str]


class InspectionsOut(Out):
    """All inspections, the newest first."""

    inspections: list[InspectionOut]


class GraveOut(Out):
    """An inspection with a defect of severity 5."""

    id: str
    name: str
    at: datetime
    """When such a defect was last stored or edited."""


class FoundOut(InspectionsOut):
    """A page of the inspections that fit."""

    total: int
    """Inspections that fit."""
    stored: int
    """All inspections, whether they fit or not."""
    grave: list[GraveOut]
    """The inspections with the newest severe defects, newest first, whether they fit or not."""

    @classmethod
    def of(cls, found: Found, views: list[InspectionView]) -> FoundOut:
        """Convert the service's answer."""
        return cls.read_from(found, inspections=[InspectionOut.of(view) for view in views])


def _video(row: Inspection) -> VideoOut:
    """Return the video; that of an import cannot be played."""
    columns = {name: row.video[name] for name in VideoOut.model_fields if name in row.video}
    return VideoOut(**columns | {"playable": columns["playable"] and row.has_film})


def _error(row: Inspection) -> ErrorOut | None:
    if row.error_code is None:
        return None
    return ErrorOut(code=row.error_code, detail=row.error_detail or "")


class SampleOut(Out):
    """Progress of the sample inspection, which is rendered once and kept in the data folder."""

    state: Literal["none", "rendering", "ready", "failed"]
    progress: Thousandths
    """From 0 to 1."""
    inspection_id: str | None
    """Set when the sample is ready."""
    error: ErrorOut | None

    @classmethod
    def of(cls, state: SampleState) -> SampleOut:
        """Convert the service's state."""
        fault = state.fault
        error = None if fault is None else ErrorOut(code="sample_failed", detail=fault)
        return cls.read_from(state, error=error)
