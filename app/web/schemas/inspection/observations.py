"""Observations and their places on the wall."""

from __future__ import annotations

import math
from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Literal, Self, get_type_hints

from pydantic import BaseModel, Field, create_model

from app.survey import rounding
from app.survey.adjustment.adjusted_track import Source
from app.survey.given import Pixel
from app.survey.observations.tag import Tag
from app.survey.places.measure import Figure
from app.survey.places.place import ObservationView, WallGrid, WallUnder
from app.web.schemas.out import Hundredths, Out, metres
from vo_core import Pose


class FrameAtOut(BaseModel):
    """The frame and pixel that show a place of the wall; null if no frame shows it."""

    frame: int | None
    pixel: Pixel | None


class MeasuredOut(Out):
    """The size that a measure has on the wall, with half of its 95 % interval."""

    value: Hundredths
    """mm, or mm2; of a step positive into the pipe."""
    u95: float
    unit: Literal["mm", "mm2"]
    percent: Hundredths | None
    """Of the diameter, for a depth."""
    percent_u95: Hundredths | None

    @classmethod
    def of(cls, figure: Figure) -> Self:
        """Convert a figure."""
        unit = "mm2" if figure.kind == "area" else "mm"
        return cls.read_from(figure, u95=rounding.rounded_up(figure.u95, 2), unit=unit)


if TYPE_CHECKING:
    _Stated = Out
else:  # the fields of a tag, without the bounds of a request
    _STATED = {name: (kind, ...) for name, kind in get_type_hints(Tag).items()}
    _Stated = create_model(
        "_Stated", __base__=Out, **{name: _STATED[name] for name in Tag.model_fields}
    )


class ObservationOut(_Stated):
    """An observation with everything derived from its frame, its pixel, the track and the rig."""

    id: str
    seq: int
    pixel: Annotated[list[float], Field(min_length=2, max_length=2)] | None
    measured: list[MeasuredOut | None]
    """Figures of `measures`, in their order; None where nothing can be derived (yet)."""
    distance_m: float | None
    """Corrected distance; None until the frame is tracked."""
    distance_u95_m: float | None
    distance_raw_m: float | None
    """The same distance in the raw track."""
    distance_source: Source | None
    clock: int | None
    at_joint: bool | None
    joint_no: int | None
    time_s: float | None
    photo: str | None
    photo_error: str | None
    created_at: datetime
    created_by: str
    edited_at: datetime | None
    version: str
    """Version of what was entered: the `If-Match` of a change, in quotation marks."""

    @classmethod
    def of(cls, view: ObservationView) -> ObservationOut:
        """Convert the service's view."""
        row, place = view.row, view.place
        path = f"/api/inspections/{row.inspection_id}/observations/{row.id}/photo"
        return cls.read_from(
            row,
            row.tag,
            view,
            measured=[MeasuredOut.of(figure) if figure else None for figure in view.figures],
            distance_m=metres(place.distance_mm) if place else None,
            distance_u95_m=place.u95_m if place else None,
            distance_raw_m=metres(place.raw_mm) if place else None,
            distance_source=place.source if place else None,
            at_joint=view.at_joint if place else None,
            joint_no=place.joint_no if place else None,
            time_s=place.time_s if place else None,
            # The address contains the frame, so that a browser does not show an earlier photo.
            photo=f"{path}?frame={row.frame}" if row.has_photo else None,
        )


class ObservationsOut(BaseModel):
    """The observations of an inspection, in the order of their numbers."""

    observations: list[ObservationOut]
    next_stretch: int
    """First stretch number that was never used."""


class WallPointOut(BaseModel):
    """The wall point that a pixel of a frame shows."""

    distance_m: float
    clock: float | None
    """Exact hours in (0, 12]; None on a floor."""
    y_mm: float
    """World Y: to the right of the axis."""

    @classmethod
    def of(cls, wall: WallUnder) -> WallPointOut:
        """Convert the service's result."""
        return cls(
            distance_m=rounding.metres(wall.distance_mm),
            clock=None if wall.clock_h is None else rounding.rounded(wall.clock_h, 3),
            y_mm=round(wall.lateral_mm, 2),
        )


class StartOut(Out):
    """Pose of the camera in the first frame, from the pipe's axis or from the floor."""

    y_mm: float
    z_mm: float
    yaw_deg: float
    pitch_deg: float
    roll_deg: float

    @classmethod
    def of(cls, pose: Pose) -> StartOut:
        """Convert a pose."""
        turns_rad = (pose.yaw_rad, pose.pitch_rad, pose.roll_rad)
        yaw_deg, pitch_deg, roll_deg = (math.degrees(turn) for turn in turns_rad)
        return cls.read_from(pose, yaw_deg=yaw_deg, pitch_deg=pitch_deg, roll_deg=roll_deg)


class WallGridOut(Out):
    """The rays of a grid of pixels, the pipe and pose 0: the wall under any pixel follows."""

    cols: int
    rows: int
    u: list[float]
    v: list[float]
    rays: list[list[Annotated[list[float], Field(min_length=3, max_length=3)] | None]]
    """Unit rays [ahead, right, down] of the robot, in rows; None outside the lens."""
    radius_mm: float | None
    """None on a floor."""
    start: StartOut
    scale: float
    """True length over the length of the raw track, by the corrections."""

    @classmethod
    def of(cls, grid: WallGrid) -> WallGridOut:
        """Convert the service's arrays."""
        rows, cols, _ = grid.rays.shape
        return cls.read_from(
            grid,
            cols=cols,
            rows=rows,
            u=grid.u_px,
            v=grid.v_px,
            rays=[[_ray(ray) for ray in row] for row in grid.rays.tolist()],
            start=StartOut.of(grid.start),
        )


def _ray(ray: list[float]) -> list[float] | None:
    return [round(part, 7) for part in ray] if all(map(math.isfinite, ray)) else None
