"""A measure: what a person points at on the wall to size a defect. Its figures are derived."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, model_validator

from app.survey.given import Frame, Given, Pixel

MeasureKind = Literal["length", "width", "area", "gap", "step", "depth"]
POINTS: dict[str, tuple[int, int]] = {
    "length": (2, 40),
    "width": (2, 2),
    "area": (3, 40),
    "gap": (2, 2),
    "step": (2, 2),
    "depth": (2, 2),
}
"""Least and largest number of points of each kind; static/core/wall/measure.js has the same."""


class MeasurePoint(Given):
    """A point of the wall, by the picture that shows it."""

    frame: Frame
    pixel: Pixel


class Measure(Given):
    """Points on the wall and what they measure."""

    kind: MeasureKind = Field(
        description="length and width of a line along the wall, mm; area of a polygon, mm2; gap of "
        "a joint along the axis, mm; step at a joint across it, mm: the near wall first, then the "
        "edge; depth of a bed or of water between its two edges, mm and % of the diameter."
    )
    points: Annotated[list[MeasurePoint], Field(min_length=2, max_length=40)]

    @model_validator(mode="after")
    def _has_its_points(self) -> Measure:
        least, most = POINTS[self.kind]
        if not least <= len(self.points) <= most:
            wanted = f"{least}" if least == most else f"{least} to {most}"
            raise ValueError(f"{self.kind} needs {wanted} points, not {len(self.points)}")
        return self


MOST_MEASURES = 8
"""Measures of one observation: two quantities, and some for the record."""

Measures = Annotated[list[Measure], Field(max_length=MOST_MEASURES)]


@dataclass(frozen=True)
class Figure:
    """The size that a measure has on the wall."""

    kind: MeasureKind
    value: float
    """mm, or mm2 of an area; of a step positive into the pipe."""
    u95: float
    """Half of the 95 % interval, in the same unit: clicks, the rig's tolerances, the track."""
    percent: float | None
    """Of the diameter, for a depth; with `percent_u95`."""
    percent_u95: float | None
    points_mm: tuple[tuple[float, float, float], ...] = ()
    """Where it was measured: X along the axis of the corrected track, Y right, Z down."""
