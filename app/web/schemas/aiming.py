"""The rig of a camera that looks along the pipe."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from pydantic import Field

from app.inspections.films.aiming import Aim
from app.jobs.requests.media import FirstPicture
from app.survey.given import Given, Pixel
from app.web.schemas.out import Hundredths, Out
from vo_core.geometry.wall import Points


class FirstPictureOut(Out):
    """The first picture of a film."""

    width: int
    height: int
    pixel_aspect: float
    """Width of a pixel by its height."""
    axis: tuple[float, float] | None
    """Pixel of the pipe's axis; None if it does not show."""

    @classmethod
    def of(cls, picture: FirstPicture) -> Self:
        """Convert what the media process has found."""
        axis = None if picture.axis_uv is None else _pixel(picture.axis_uv)
        return cls.read_from(picture, axis=axis)


class AimIn(Given):
    """A rig, and where its picture shows the pipe's axis."""

    rig: dict[str, Any] = Field(description="The rig file: camera, mount and pipe.")
    axis: Pixel


class AimOut(Out):
    """Where the camera looks, and the wall as lines in its picture."""

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
            rings=[line_out(line) for line in aim.grid.rings_uv],
            generators=[line_out(line) for line in aim.grid.generators_uv],
        )


def line_out(points: Points) -> list[tuple[float, float] | None]:
    """Round the (N, 2) pixels of a line; None where the lens does not see it."""
    return [_pixel(point) if np.isfinite(point).all() else None for point in points.tolist()]


def _pixel(point: tuple[float, float]) -> tuple[float, float]:
    u, v = point
    return round(u, 1), round(v, 1)
