"""What goes over the wire; converted by hand from the services' types."""

from __future__ import annotations

import math
from datetime import datetime
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from app.services.inspections import InspectionView
from app.services.live import Update
from app.services.observations import U95, ObservationView, WallGrid, WallUnder
from app.storage.tables import Inspection


class _In(BaseModel):
    """Strict: JSON false is no number, NaN is none, unknown fields are refused."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


# No control characters: names go into files, tables and logs.
_LINE = r"^[^\x00-\x1f\x7f]*$"
_TEXT = r"^[^\x00-\x08\x0b\x0c\x0e-\x1f\x7f]*$"

Name = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200, pattern=_LINE)
]
HeaderName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,49}$")]
HeaderText = Annotated[str, StringConstraints(max_length=2000, pattern=_TEXT)]
Header = Annotated[
    dict[HeaderName, HeaderText | int | float | bool | None],
    Field(
        max_length=100,
        description="What was inspected, by whom, for whom: asset_id, start_node, direction, "
        "known_length_m, operator, client, ...",
    ),
]
Letter = Annotated[str, StringConstraints(pattern=r"^[A-Z][A-Z0-9]?$")]
Clock = Annotated[int, Field(ge=1, le=12)]


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
    """A camera on the network."""

    kind: Literal["live"]
    url: Annotated[str, Field(min_length=1, max_length=2000)]


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


class ObservationIn(_In):
    """What a person enters; everything else is derived. Only `frame` is needed: tag first."""

    frame: Annotated[int, Field(ge=0, le=2**31)]
    pixel: Annotated[list[float], Field(min_length=2, max_length=2)] | None = Field(
        None, description="[u, v] of the wall point; without it the camera's distance counts."
    )
    code: Annotated[str, StringConstraints(pattern=r"^[A-Z][A-Z0-9]{1,7}$")] | None = None
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


class SourceOut(BaseModel):
    """The original file."""

    kind: str
    filename: str
    size: int
    sha256: str


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
    distance_u95_m: float | None
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
            distance_u95_m=metres(None if sigma_mm is None else U95 * sigma_mm),
            defects=view.defects,
            worst_severity=view.worst_severity,
            error=_error(row),
            warning=row.warning,
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
    """None until the frame is tracked."""
    distance_u95_m: float | None
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
            distance_u95_m=metres(place.u95_mm) if place else None,
            clock=view.clock,
            at_joint=place.joint_no is not None if place else None,
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
            clock_h=None if grid.clock_h is None else _table(grid.clock_h),
        )


class CodeOut(BaseModel):
    """A row of the code pack."""

    code: str
    char1: str
    char2: str
    label: str
    group: str
    needs_clock: str
    needs_q1: str
    needs_q2: str
    unit_q1: str | None
    unit_q2: str | None
    continuous_allowed: bool


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


def live_header(update: Update) -> dict[str, Any]:
    """Header of one message of the live socket."""
    last = update.estimates[-1] if update.estimates else None
    progress = update.progress
    pose = {
        name: getattr(last, name, None)
        for name in (
            "frame", "time_s", "x_mm", "y_mm", "yaw_deg", "distance_mm", "sigma_distance_mm",
            "quality", "status",
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
