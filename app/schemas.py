"""What goes over the wire; converted by hand from the services' types."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import datetime
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

from app.catalogue.header import HeaderField, faults
from app.errors import EVERYWHERE, STATUS
from app.interval import half_width_m
from app.reports.report import Written
from app.services.adjustment import Stated
from app.services.checks import Issue
from app.services.clicks import Click
from app.services.corrections import Corrected, reason_of, result_of
from app.services.inspections import InspectionView
from app.services.live import CameraStatus, Update
from app.services.makeup import Makeup, PartName
from app.services.meter_counter import Connection
from app.services.notices import Notice
from app.services.observations import ObservationView, WallGrid, WallUnder
from app.services.packs import PackView
from app.services.samples import SampleState
from app.services.sources import ListedSource
from app.services.tracks import HealthColumns
from app.services.unrolled import Tile
from app.storage.tables import ENDED, Alert, Event, Inspection
from app.viewer.scene import PinHit
from vo_core.health import Health, complaints
from vo_core.mosaic import Layout
from vo_core.scale import TAPE_SIGMA_MM
from vo_core.track import Estimate


class _In(BaseModel):
    """Strict: JSON false is no number, NaN is none, unknown fields are refused."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


# No control characters: names go into files, tables and logs.
_LINE = r"^[^\x00-\x1f\x7f-\x9f]*$"
_TEXT = r"^[^\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]*$"

Name = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200, pattern=_LINE)
]


def _known_fields_fit(header: dict[str, Any]) -> dict[str, Any]:
    """Other fields may hold anything, since surveys are imported from other programs."""
    if found := faults(header):
        raise ValueError("; ".join(found))
    return header


HeaderName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,49}$")]
HeaderText = Annotated[str, StringConstraints(max_length=2000, pattern=_TEXT)]
_EXACT = Field(ge=1 - 2**53, le=2**53 - 1)
"""Whole numbers that every reader of JSON can hold, browsers too."""
Header = Annotated[
    dict[HeaderName, HeaderText | Annotated[int, _EXACT] | Annotated[float, _EXACT] | bool | None],
    Field(
        max_length=100,
        description="What was inspected, by whom, for whom; /api/header-fields lists the fields "
        "that are known and what they may hold.",
    ),
    AfterValidator(_known_fields_fit),
]
CodeName = Annotated[str, StringConstraints(pattern=r"^[A-Z][A-Z0-9]{1,7}$")]
PackName = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=100, pattern=_LINE)
]
PackId = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]
Letter = Annotated[str, StringConstraints(pattern=r"^[A-Z][A-Z0-9]?$")]
Clock = Annotated[int, Field(ge=1, le=12)]
Pixel = Annotated[
    list[Annotated[float, Field(ge=-100_000, le=100_000)]], Field(min_length=2, max_length=2)
]
"""Whether the picture has it is for the service to say."""


class LoginIn(_In):
    """The access token, exchanged for a session cookie."""

    token: Annotated[str, Field(min_length=1, max_length=500)]


class SessionOut(BaseModel):
    """Who is logged in."""

    name: str
    role: str


class UploadSource(_In):
    """A complete upload."""

    kind: Literal["upload"]
    upload_id: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]


class LiveSource(_In):
    """A camera on the network, or one of those that the server lists."""

    kind: Literal["live"]
    url: Annotated[str, Field(min_length=1, max_length=2000)] = Field(
        description="rtsp://, rtsps://, http:// or https:// (MJPEG), or an address of /api/sources."
    )


class InspectionIn(_In):
    """A new inspection."""

    name: Name
    source: Annotated[UploadSource | LiveSource, Field(discriminator="kind")]
    rig: dict[str, Any] = Field(description="The rig file: camera, mount and pipe.")
    header: Header = Field(default_factory=dict)


class InspectionChange(_In):
    """What is to change; what is left out stays."""

    name: Name | None = None
    header: Header | None = None


class ImportedOut(BaseModel):
    """What has become of a file."""

    inspections: list[InspectionOut]
    """In the order of the file."""
    warnings: list[str]
    """What is odd in it or left out, in sentences."""


class FinishIn(_In):
    """How a run ended."""

    end_condition: Literal["complete", "abandoned"]
    abandon_reason: (
        Annotated[str, StringConstraints(strip_whitespace=True, max_length=2000, pattern=_TEXT)]
        | None
    ) = Field(None, description="Required of an abandoned one.")
    known_length_m: Annotated[float, Field(gt=0, le=100_000)] | None = None

    @model_validator(mode="after")
    def _says_why(self) -> Self:
        if self.end_condition == "abandoned" and not self.abandon_reason:
            raise ValueError("an abandoned inspection needs a reason (abandon_reason)")
        return self


class ObservationIn(_In):
    """What a person enters; everything else is derived. Only `frame` is needed: tag first."""

    frame: Annotated[int, Field(ge=0, le=2**31)]
    pixel: Pixel | None = Field(
        None, description="[u, v] of the wall point; without it the camera's distance counts."
    )
    code: CodeName | None = None
    char1: Letter | None = None
    char2: Letter | None = None
    quant1: Annotated[float, Field(ge=-1e6, le=1e6)] | None = None
    quant2: Annotated[float, Field(ge=-1e6, le=1e6)] | None = None
    clock_from: Clock | None = None
    clock_to: Clock | None = None
    severity: Annotated[int, Field(ge=0, le=5)] | None = Field(
        None, description="0 note, 1 as new, 2 slight, 3 watch, 4 plan repair, 5 act now."
    )
    continuous: Annotated[str, StringConstraints(pattern=r"^[ABC][1-9][0-9]{0,2}$")] | None = Field(
        None, description="Of a stretch: A1 starts, C1 changes, B1 finishes number 1."
    )
    remark: Annotated[str, StringConstraints(max_length=4000, pattern=_TEXT)] | None = None


def click_message(click: Click) -> dict[str, object]:
    """What a live socket reports of a shift-click in the 3D view."""
    if isinstance(click, PinHit):
        return {"type": "pin_click", "observation": click.id}
    return {
        "type": "wall_click",
        "distance_m": round(click.distance_m, 4),
        "clock_h": None if click.clock_h is None else round(click.clock_h, 3),
        "lateral_m": round(click.lateral_m, 4),
    }


class FrameAtOut(BaseModel):
    """The frame that shows a place of the wall, and where."""

    frame: int
    pixel: Pixel


Frame = Annotated[int, Field(ge=0, le=2**31)]
Metres = Annotated[float, Field(gt=0, le=100_000)]


class ZeroIn(_In):
    """Set zero here."""

    frame: Frame
    offset_m: Annotated[float, Field(ge=-10_000, le=10_000)] = Field(
        0.0, description="From the zero point to the camera in this frame, positive ahead."
    )


class LengthIn(_In):
    """A length that somebody knows."""

    first_frame: Frame
    last_frame: Frame
    length_m: Metres
    sigma_mm: Annotated[float, Field(gt=0, le=100_000)] = Field(
        TAPE_SIGMA_MM, description="One sigma: a tape 5, a drawing 50 or more."
    )
    kind: Literal["tape", "known"] = Field(
        "tape", description="known: of the whole asset, which gives the closure."
    )


class MarkIn(_In):
    """A joint that somebody clicked on."""

    frame: Frame
    pixel: Pixel


class LeftOutIn(_In):
    """A ring that is no joint."""

    frame: Frame


class JointsIn(_In):
    """Which joints count."""

    use: Annotated[
        bool | None,
        Field(description="null: they count by themselves where they can be counted for certain."),
    ] = None
    marked: Annotated[list[MarkIn], Field(max_length=1000)] = Field(default_factory=list)
    left_out: Annotated[list[LeftOutIn], Field(max_length=10_000)] = Field(default_factory=list)


class RigSigmaIn(_In):
    """How well the rig is known, one sigma."""

    height_mm: Annotated[float, Field(gt=0, le=1000)]
    focal_px: Annotated[float, Field(ge=0, le=1000)] = 0.0


Remark = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=4000, pattern=_TEXT)
]


class StatedIn(_In):
    """All that is known about the distances of an inspection."""

    zero: ZeroIn | None = None
    lengths: Annotated[list[LengthIn], Field(max_length=100)] = Field(default_factory=list)
    joints: JointsIn = Field(default_factory=JointsIn)
    rig_sigma: RigSigmaIn | None = None
    forced: Remark | None = Field(
        None, description="Why a known length holds although the track contradicts it."
    )

    def to_stated(self) -> Stated:
        """For the service."""
        return Stated.from_json(self.model_dump(include=set(StatedIn.model_fields)))


class CorrectionsIn(StatedIn):
    """The same, to be kept."""

    remark: Remark | None = None


class CorrectionsOut(BaseModel):
    """What was stated, what came out, what is wrong with it."""

    stated: dict[str, Any]
    result: dict[str, Any] | None
    error: ErrorOut | None
    reason: dict[str, Any] | None
    """Code and params of the error, where there is more to say than its sentence."""

    @classmethod
    def of(cls, corrected: Corrected) -> CorrectionsOut:
        """From the service's result."""
        error, refusal = corrected.error, corrected.refusal
        return cls(
            stated=corrected.stated.to_json(),
            result=result_of(corrected),
            error=ErrorOut(**error) if error else None,
            reason=reason_of(refusal) if refusal else None,
        )


class PartOut(BaseModel):
    """One cause of an interval; they add up in quadrature."""

    name: PartName
    u95_m: float


class TapedOut(BaseModel):
    """What one more taped length would make of it."""

    length_m: float
    u95_m: float


class MakeupOut(BaseModel):
    """What the interval of the distance of a frame is made of, the largest part first."""

    frame: int
    distance_m: float
    distance_u95_m: float
    parts: list[PartOut]
    taped: TapedOut | None
    """None if a tape would not help much."""

    @classmethod
    def of(cls, makeup: Makeup) -> MakeupOut:
        """From the service's."""
        taped = makeup.taped
        return cls(
            frame=makeup.frame,
            distance_m=makeup.distance_m,
            distance_u95_m=makeup.half_width_m,
            parts=[PartOut(name=part.name, u95_m=part.half_width_m) for part in makeup.parts],
            taped=TapedOut(length_m=taped.length_m, u95_m=taped.half_width_m) if taped else None,
        )


class IntervalOut(BaseModel):
    """The interval of a frame; null where nobody knows it."""

    interval: MakeupOut | None


class IssueOut(BaseModel):
    """Something to put right, or to look at, before a report is issued."""

    level: Literal["block", "warn"]
    code: str
    detail: str
    observation_id: str | None
    params: dict[str, str | int | float]

    @classmethod
    def of(cls, issue: Issue) -> IssueOut:
        """From the service's."""
        return cls(
            level=issue.level,
            code=issue.code,
            detail=issue.detail,
            observation_id=issue.observation_id,
            params=dict(issue.params),
        )


class IssuesOut(BaseModel):
    """What stands against a report; nothing if the list is empty."""

    checks: list[IssueOut]


class LossOut(BaseModel):
    """Something that a format cannot hold."""

    detail: str
    observation_id: str | None


class LossesOut(BaseModel):
    """What is not in the export, or not in a place of its own; nothing if the list is empty."""

    losses: list[LossOut]

    @classmethod
    def of(cls, written: Written) -> LossesOut:
        """From the format's."""
        return cls(
            losses=[
                LossOut(detail=loss.detail, observation_id=loss.entry.id if loss.entry else None)
                for loss in written.losses
            ]
        )


class AlertOut(BaseModel):
    """Whether the client was notified of a severe observation."""

    id: str
    observation_id: str
    state: Literal["waiting", "told", "withdrawn", "given_up"]
    tries: int
    created_at: datetime
    next_at: datetime | None
    told_at: datetime | None
    error: str | None

    @classmethod
    def of(cls, alert: Alert) -> AlertOut:
        """From the table."""
        return cls(
            id=alert.id,
            observation_id=alert.observation_id,
            state=alert.state,  # type: ignore[arg-type]  # one of ALERT_STATES
            tries=alert.tries,
            created_at=alert.created_at,
            next_at=alert.next_at if alert.state == "waiting" else None,
            told_at=alert.told_at,
            error=alert.error,
        )


class AlertsOut(BaseModel):
    """What the client is notified of."""

    is_configured: bool
    """Whether there is a client to be notified."""
    alerts: list[AlertOut]


class MeterCounterOut(BaseModel):
    """How it is with the software that takes Chainage for its meter counter."""

    peer: str | None
    """Its address; None where none is configured."""
    is_connected: bool
    detail: str | None
    """Why not, in a sentence."""

    @classmethod
    def of(cls, connection: Connection) -> MeterCounterOut:
        """From the service's."""
        return cls(**asdict(connection))


class EventOut(BaseModel):
    """Something that was done."""

    at: datetime
    who: str
    action: str
    observation_id: str | None
    before: dict[str, Any] | None
    after: dict[str, Any] | None
    remark: str | None

    @classmethod
    def of(cls, event: Event) -> EventOut:
        """From the table."""
        return cls(**{name: getattr(event, name) for name in cls.model_fields})


class EventsOut(BaseModel):
    """Who did what, the newest first."""

    events: list[EventOut]


class ProgressOut(BaseModel):
    """How far tracking is."""

    frames_done: int
    frames_total: int | None
    fps: float | None
    eta_s: float | None


class ErrorOut(BaseModel):
    """The one body of every failure."""

    code: str
    detail: str


Responses = dict[int | str, dict[str, Any]]


def failures(*kinds: type[Exception]) -> Responses:
    """For `responses=` of a route: how it may refuse, besides what is refused everywhere."""
    codes = {status: list(names) for status, names in EVERYWHERE.items()}
    for status, code in (STATUS[kind] for kind in kinds):
        codes.setdefault(status, []).append(code)
    return {
        status: {"model": ErrorOut, "description": ", ".join(f"`{name}`" for name in names)}
        for status, names in codes.items()
    }


def content(*media_types: str) -> Responses:
    """For `responses=` of a route that does not answer with JSON."""
    return {200: {"content": {media_type: {} for media_type in media_types}}}


class SourceOut(BaseModel):
    """The original file."""

    kind: str
    filename: str
    size: int
    sha256: str


class ListedSourceOut(BaseModel):
    """A live source that the server has found."""

    url: str
    kind: Literal["usb", "folder", "pipe"]
    name: str


class SourcesOut(BaseModel):
    """Live sources that the server has found."""

    sources: list[ListedSourceOut]

    @classmethod
    def of(cls, listed: Sequence[ListedSource]) -> SourcesOut:
        """From the service's list."""
        return cls(
            sources=[ListedSourceOut(url=it.url, kind=it.kind, name=it.name) for it in listed]
        )


class LiveOut(BaseModel):
    """A camera while it is recorded."""

    connected: bool
    reconnects: int
    dropped: int
    """Frames that are in the recording but came too fast to be tracked."""
    recorded_s: float
    detail: str | None
    """Why there is no picture."""
    free_bytes: int
    """Room on the disk for the rest of the recording."""

    @classmethod
    def of(cls, camera: CameraStatus) -> LiveOut:
        """From the service's state."""
        return cls(
            connected=camera.connected,
            reconnects=camera.reconnects,
            dropped=camera.dropped,
            recorded_s=round(camera.recorded_s, 2),
            detail=camera.detail,
            free_bytes=camera.free_bytes,
        )


class VideoOut(BaseModel):
    """What the original file holds."""

    width: int
    height: int
    duration_s: float | None
    codec: str
    playable: bool
    """Whether browsers play it; otherwise single frames are fetched."""


class InspectionOut(BaseModel):
    """An inspection."""

    id: str
    name: str
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: ProgressOut
    distance_m: float | None
    """Of the last frame, corrected."""
    distance_u95_m: float | None
    distance_raw_m: float | None
    """As it was measured."""
    revision: int
    """Rises with every correction: distances are then to be read again."""
    corrected: bool
    defects: int
    worst_severity: int | None
    error: ErrorOut | None
    warning: str | None
    created_at: datetime
    finished_at: datetime | None
    rig: dict[str, Any]
    header: dict[str, Any]
    source: SourceOut
    video: VideoOut
    live: LiveOut | None
    """While a camera is recorded."""

    @classmethod
    def of(cls, view: InspectionView) -> InspectionOut:
        """From the service's view."""
        row = view.row
        sigma_mm = view.sigma_distance_mm
        return cls(
            id=row.id,
            name=row.name,
            status=row.status,  # type: ignore[arg-type]  # checked by pydantic
            progress=ProgressOut(
                frames_done=view.progress.frames_done,
                frames_total=view.progress.frames_total,
                fps=_rounded(view.progress.fps, 1),
                eta_s=_rounded(view.progress.eta_s, 1),
            ),
            distance_m=metres(view.distance_mm),
            distance_u95_m=None if sigma_mm is None else half_width_m(sigma_mm),
            distance_raw_m=metres(view.raw_distance_mm),
            revision=row.revision,
            corrected=view.is_corrected,
            defects=view.defects,
            worst_severity=view.worst_severity,
            error=_error(row),
            warning=view.warning,
            created_at=row.created_at,
            finished_at=row.finished_at,
            rig=row.rig,
            header=row.header,
            source=SourceOut(
                kind=row.source_kind,
                filename=row.source_filename,
                size=row.source_size,
                sha256=row.source_sha256,
            ),
            video=VideoOut(**{name: row.video[name] for name in VideoOut.model_fields}),
            live=LiveOut.of(view.camera) if view.camera else None,
        )


class InspectionsOut(BaseModel):
    """All inspections, the newest first."""

    inspections: list[InspectionOut]


class ObservationOut(BaseModel):
    """An observation with all that is derived from its frame, its pixel, the track and the rig."""

    id: str
    seq: int
    frame: int
    pixel: list[float] | None
    code: str | None
    char1: str | None
    char2: str | None
    quant1: float | None
    quant2: float | None
    clock_from: int | None
    clock_to: int | None
    severity: int | None
    continuous: str | None
    remark: str | None
    distance_m: float | None
    """Corrected; None until the frame is tracked."""
    distance_u95_m: float | None
    distance_raw_m: float | None
    """As it was measured."""
    distance_source: Literal["odometry", "joint", "closure", "typed"] | None
    clock: int | None
    at_joint: bool | None
    joint_no: int | None
    time_s: float | None
    photo: str | None
    photo_error: str | None
    created_at: datetime
    created_by: str
    edited_at: datetime | None

    @classmethod
    def of(cls, view: ObservationView) -> ObservationOut:
        """From the service's view."""
        row, place = view.row, view.place
        path = f"/api/inspections/{row.inspection_id}/observations/{row.id}/photo"
        entered: dict[str, Any] = {
            name: row.fields.get(name) for name in ObservationIn.model_fields
        }
        return cls(
            **entered,
            id=row.id,
            seq=row.seq,
            distance_m=metres(place.distance_mm) if place else None,
            distance_u95_m=place.u95_m if place else None,
            distance_raw_m=metres(place.raw_mm) if place else None,
            distance_source=place.source if place else None,
            clock=view.clock,
            at_joint=place.joint is not None if place else None,
            joint_no=place.joint_no if place else None,
            time_s=place.time_s if place else None,
            # The frame stands in the address, so that a browser does not show an earlier photo.
            photo=f"{path}?frame={row.frame}" if row.photo_frame == row.frame else None,
            photo_error=row.photo_error,
            created_at=row.created_at,
            created_by=row.created_by,
            edited_at=row.edited_at,
        )


class ObservationsOut(BaseModel):
    """The observations of an inspection, in the order of their numbers."""

    observations: list[ObservationOut]
    next_stretch: int
    """First number of a stretch that was never used."""


class WallPointOut(BaseModel):
    """What a pixel of a frame looks at."""

    distance_m: float
    clock: float | None
    """Exact hours in (0, 12]; None on a floor."""
    y_mm: float
    """World Y: to the right of the axis."""

    @classmethod
    def of(cls, wall: WallUnder) -> WallPointOut:
        """From the service's result."""
        return cls(
            distance_m=round(wall.distance_mm / 1000, 4),
            clock=_rounded(wall.clock_h, 3),
            y_mm=round(wall.lateral_mm, 2),
        )


class WallGridOut(BaseModel):
    """Wall points of a grid of pixels at pose 0, from the camera; None where no wall is seen."""

    cols: int
    rows: int
    u: list[float]
    v: list[float]
    axial_mm: list[list[float | None]]
    right_mm: list[list[float | None]]
    down_mm: list[list[float | None]]
    clock_h: list[list[float | None]] | None
    """None on a floor."""

    @classmethod
    def of(cls, grid: WallGrid) -> WallGridOut:
        """From the service's arrays."""
        rows, cols = grid.axial_mm.shape
        return cls(
            cols=cols,
            rows=rows,
            u=grid.u_px,
            v=grid.v_px,
            axial_mm=_table(grid.axial_mm),
            right_mm=_table(grid.right_mm),
            down_mm=_table(grid.down_mm),
            clock_h=None if grid.clock_h is None else _table(grid.clock_h),
        )


class CodeOut(BaseModel):
    """A row of the code pack."""

    code: str
    char1: str
    char2: str
    label: str
    label_ms: str
    group: str
    needs_clock: str
    needs_q1: str
    needs_q2: str
    unit_q1: str | None
    unit_q2: str | None
    continuous_allowed: bool
    grade_s: float | None
    grade_o: float | None
    hotkey: str | None
    icon: str | None


class PackOut(BaseModel):
    """A code pack that somebody has imported."""

    id: str
    name: str
    codes: int
    created_at: datetime
    created_by: str

    @classmethod
    def of(cls, view: PackView) -> PackOut:
        """From the service's view."""
        row = view.row
        return cls(
            id=row.id,
            name=row.name,
            codes=view.codes,
            created_at=row.created_at,
            created_by=row.created_by,
        )


class PacksOut(BaseModel):
    """The imported code packs by name; the built-in one has no id and is not among them."""

    packs: list[PackOut]


class HeaderFieldOut(BaseModel):
    """A field of the header that is known."""

    name: str
    group: Literal["required", "auto", "more"]
    kind: Literal["text", "number", "choice", "date", "time", "bool"]
    choices: list[str]
    unit: str | None
    minimum: float | None
    maximum: float | None

    @classmethod
    def of(cls, field: HeaderField) -> HeaderFieldOut:
        """From the catalogue's field."""
        return cls(**asdict(field) | {"choices": list(field.choices)})


class HeaderFieldsOut(BaseModel):
    """The known fields in the order of a form."""

    fields: list[HeaderFieldOut]


class QuickCode(_In):
    """What a digit key tags."""

    code: CodeName
    char1: Letter | None
    char2: Letter | None


class PreferencesIn(_In):
    """All that a person has chosen for the page."""

    language: Literal["en", "ms"] | None = Field(description="null: that of the browser.")
    units: Literal["m", "ft"]
    quick_codes: Annotated[list[QuickCode], Field(max_length=9)] = Field(
        description="Of the keys 1 to 9, in this order."
    )
    pack: PackId | None = Field(description="Code pack of new inspections; null: the built-in.")


class MeOut(BaseModel):
    """Who is logged in, and what he has chosen."""

    name: str
    role: str
    preferences: PreferencesIn


class SampleOut(BaseModel):
    """How far the sample inspection is; it is rendered once and then kept in the data folder."""

    state: Literal["none", "rendering", "ready", "failed"]
    progress: float
    """0 to 1."""
    inspection_id: str | None
    """When it is ready."""
    error: ErrorOut | None

    @classmethod
    def of(cls, state: SampleState) -> SampleOut:
        """From the service's state."""
        fault = state.fault
        return cls(
            state=state.state,
            progress=round(state.progress, 3),
            inspection_id=state.inspection_id,
            error=None if fault is None else ErrorOut(code="sample_failed", detail=fault),
        )


class PresetOut(BaseModel):
    """A rig to begin with."""

    name: str
    rig: dict[str, Any]


class PresetsOut(BaseModel):
    """Rigs to begin with."""

    presets: list[PresetOut]


class CheckOut(BaseModel):
    """One part of the server."""

    name: str
    ok: bool
    detail: str


class ReadyOut(BaseModel):
    """The server takes work."""

    status: Literal["ready"]
    checks: list[CheckOut]


class AliveOut(BaseModel):
    """The server runs."""

    status: Literal["alive"]


def health_of(health: Health | None) -> dict[str, Any] | None:
    """Of one frame, for the header of the live socket."""
    if health is None:
        return None
    numbers = {name: round(value, 3) for name, value in asdict(health).items()}
    return numbers | {"complaints": list(complaints(health))}


class HealthOut(BaseModel):
    """How good the pictures were to measure on; all numbers in [0, 1]."""

    columns: dict[str, list[float] | list[str]]
    """overlap, brightness, overexposed, sharpness, fixed_pattern; and complaints, separated by
    spaces: too_fast too_dark too_bright blurred lens_dirty."""

    @classmethod
    def of(cls, columns: HealthColumns, since: int) -> HealthOut:
        """From the service's columns."""
        rows = columns.since(since)
        numbers: dict[str, list[float] | list[str]] = {
            name: [round(getattr(health, name), 3) for health in rows] for name in columns.columns
        }
        said = [" ".join(complaints(health)) for health in rows]
        return cls(columns=numbers | {"complaints": said})


class WallTileOut(BaseModel):
    """A picture of a piece of the wall."""

    index: int
    revision: int
    from_m: float
    """Corrected distance of its left border."""
    to_m: float


class UnrolledOut(BaseModel):
    """The unrolled wall; row 0 of a picture is at arc_from_mm, columns run with the distance."""

    tile_m: float
    mm_per_px: float
    arc_from_mm: float
    arc_to_mm: float
    width_px: int
    height_px: int
    tiles: list[WallTileOut]

    @classmethod
    def of(
        cls, layout: Layout, tiles: Sequence[Tile], chainage_mm: Callable[[float], float]
    ) -> UnrolledOut:
        """From the service's tiles; `chainage_mm` corrects a raw distance."""
        return cls(
            tile_m=layout.tile_mm / 1000,
            mm_per_px=layout.mm_per_px,
            arc_from_mm=layout.arc_from_mm,
            arc_to_mm=layout.arc_to_mm,
            width_px=layout.width_px,
            height_px=layout.height_px,
            tiles=[
                WallTileOut(
                    index=tile.index,
                    revision=tile.revision,
                    from_m=round(chainage_mm(tile.index * layout.tile_mm) / 1000, 4),
                    to_m=round(chainage_mm((tile.index + 1) * layout.tile_mm) / 1000, 4),
                )
                for tile in tiles
            ],
        )


def live_header(
    update: Update,
    told: Estimate | None,
    revision: int | None,
    joints: int | None,
    notices: Sequence[Notice],
    now_s: float,
) -> dict[str, Any]:
    """Header of one message of the live socket.

    Args:
        update: What is published.
        told: Its last estimate, corrected.
        revision: Of the corrections; None if the inspection has been deleted.
        joints: How many are known, seen or expected; None likewise.
        notices: Where picture and rig disagree.
        now_s: By `time.monotonic`.
    """
    last = update.estimates[-1] if update.estimates else None
    progress, camera = update.progress, update.camera
    age_s = None if update.captured_s is None else now_s - update.captured_s
    pose = {
        name: getattr(told, name, None)
        for name in (
            "frame", "time_s", "x_mm", "y_mm", "yaw_deg", "distance_mm", "sigma_distance_mm",
            "quality", "status", "z_mm", "pitch_deg", "roll_deg",
        )
    }  # fmt: skip
    return pose | {
        "seq": update.seq,
        "state": update.state,
        "progress": {
            "frames_done": progress.frames_done,
            "frames_total": progress.frames_total,
            "fps": _rounded(progress.fps, 1),
            "eta_s": _rounded(progress.eta_s, 1),
        },
        "revision": revision,
        "joints": joints,
        "notices": [notice.code for notice in notices],
        "distance_raw_mm": last.distance_mm if last else None,
        "age_ms": None if age_s is None else round(1000 * age_s, 1),
        "camera": None
        if camera is None or update.state in ENDED
        else ("connected" if camera.connected else "reconnecting"),
        "dropped": 0 if camera is None else camera.dropped,
        "health": health_of(update.health),
    }


def metres(mm: float | None) -> float | None:
    """Metres to a tenth of a millimetre."""
    return None if mm is None else round(mm / 1000, 4)


def _table(values: NDArray[np.float64]) -> list[list[float | None]]:
    return [
        [round(value, 4) if math.isfinite(value) else None for value in row]
        for row in values.tolist()
    ]


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)


def _error(row: Inspection) -> ErrorOut | None:
    if row.error_code is None:
        return None
    return ErrorOut(code=row.error_code, detail=row.error_detail or "")
