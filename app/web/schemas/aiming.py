"""The rig of a camera that looks along the pipe."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field

from app.inspections.diagnosis import Diagnosed
from app.inspections.films.aiming import Aim
from app.jobs.requests.media import AxisFound
from app.survey.distances.causes import CauseCode, Repair
from app.survey.given import Given, Pixel
from app.web.schemas.inspection.inspections import Url
from app.web.schemas.out import Hundredths, Out, Tenths
from vo_core.geometry.wall import Points

_R95 = math.sqrt(-2 * math.log(0.05))
"""Radius of the circle that holds 95 % of a normal distribution in the plane, in sigmas."""


class AxisOut(Out):
    """A picture of a film, and the axis of the pipe in it."""

    width: int
    height: int
    pixel_aspect: float
    """Width of a pixel by its height."""
    duration_s: float | None
    time_s: float
    """Of the picture, for `picture?time_s=`."""
    axis: tuple[float, float] | None
    """Pixel of the pipe's axis; None unless it is certain."""
    axis_u95_px: Tenths | None
    """Radius of the circle about it in which it lies in 95 of 100 cases."""
    looked_at: int
    """Number of pictures that were looked at."""
    sure: int
    """Number of them in which it is certain."""

    @classmethod
    def of(cls, found: AxisFound) -> Self:
        """Convert what the media process has found."""
        sigma_px = found.sigma_px
        return cls.read_from(
            found,
            time_s=found.t_s,
            axis=None if found.axis_uv is None else _pixel(found.axis_uv),
            axis_u95_px=None if sigma_px is None else _R95 * sigma_px,
        )


class CauseOut(Out):
    """What probably is wrong, and what repairs it."""

    code: CauseCode
    repair: Repair | None
    """What to change before it is tracked again; None: nothing can be changed afterwards."""
    params: dict[str, float]


class DiagnosisOut(Out):
    """Why the distances of an inspection are of no use."""

    lost_share: float | None
    """Share of the frames without a lock; None where nothing was tracked."""
    weak_share: float | None
    causes: list[CauseOut]
    """The most probable first; none if the distances are of use, or may still become so."""

    @classmethod
    def of(cls, diagnosed: Diagnosed) -> Self:
        """Convert the service's answer."""
        causes = [CauseOut.read_from(cause) for cause in diagnosed.causes]
        return cls.read_from(diagnosed, causes=causes)


class GlanceIn(Given):
    """A camera to look at, and the picture size to ask it for if it offers several."""

    url: Url
    width: Annotated[int, Field(ge=32, le=8192)] = 640
    height: Annotated[int, Field(ge=32, le=8192)] = 480


class AimIn(Given):
    """A rig, and where its picture shows the pipe's axis."""

    rig: dict[str, Any] = Field(description="The rig file: camera, mount and pipe.")
    axis: Pixel | None = Field(description="null: where the rig has it.")


class AimOut(Out):
    """Where the camera looks, and the wall as lines in its picture."""

    axis: tuple[float, float] | None
    """Pixel of the pipe's axis; None if the picture does not show it."""
    pitch_deg: Hundredths
    """For `mount.pitch_deg`."""
    right_deg: Hundredths
    """How far the camera looks to the right; the tracker finds it by itself."""
    rings: list[list[tuple[float, float] | None]]
    """One, two and three radii ahead; None where the lens does not see the wall."""
    generators: list[list[tuple[float, float] | None]]
    """One at each hour of the clock, from the invert to the right."""

    @classmethod
    def of(cls, aim: Aim) -> Self:
        """Round the figures."""
        return cls.read_from(
            aim,
            axis=None if aim.axis_uv is None else _pixel(aim.axis_uv),
            rings=[line_out(line) for line in aim.grid.rings_uv],
            generators=[line_out(line) for line in aim.grid.generators_uv],
        )


def line_out(points: Points) -> list[tuple[float, float] | None]:
    """Round the (N, 2) pixels of a line; None where the lens does not see it."""
    return [_pixel(point) if np.isfinite(point).all() else None for point in points.tolist()]


def _pixel(point: tuple[float, float]) -> tuple[float, float]:
    u, v = point
    return round(u, 1), round(v, 1)
