"""What a rig sees: a ruler on its wall, and a judgement before any drive."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field

from app.jobs.requests.calibrator import FilmedBoard
from app.survey.given import Given
from app.web.schemas.aiming import line_out
from app.web.schemas.out import Out, Tenths, Thousandths, rounded_to
from vo_core.geometry.ruling import Line, Ruling

if TYPE_CHECKING:
    from vo_core.advice import Advice


class RigIn(Given):
    """A rig that is being entered."""

    rig: dict[str, Any] = Field(description="The rig file: camera, mount and pipe.")


class LineOut(Out):
    """One line on the wall in the picture."""

    at: float
    """mm ahead of the camera; for a line along: hour of the clock, or mm to the right on a
    floor."""
    uv: list[tuple[float, float] | None]
    """Pixels; None where the lens does not see the wall."""

    @classmethod
    def of(cls, line: Line) -> Self:
        """Round the pixels."""
        return cls(at=line.at, uv=line_out(line.uv))


class RulingOut(Out):
    """The wall in the picture as lines."""

    step_mm: int
    """Distance between two lines across."""
    across: list[LineOut]
    along: list[LineOut]

    @classmethod
    def of(cls, ruling: Ruling) -> Self:
        """Convert the core's lines."""
        return cls.read_from(
            ruling,
            across=[LineOut.of(line) for line in ruling.across],
            along=[LineOut.of(line) for line in ruling.along],
        )


class AdviceOut(Out):
    """How a rig is expected to measure."""

    verdict: str
    """fit, fit with care, not fit."""
    findings: list[str]
    """What speaks against it: forward, fast, hurried, near, coarse, oblique, corrugated."""
    seen_mm: Tenths = Field(validation_alias="measured_axial_mm")
    """Length of the wall along the pipe on which motion is measured."""
    mm_per_px: Thousandths = Field(validation_alias="measured_mm_per_px")
    """Wall under a pixel of the measured picture."""
    good_speed_mm_s: Tenths
    limit_speed_mm_s: Tenths = Field(validation_alias="speed_limit_mm_s")
    height_error_percent: Thousandths
    """Error of the distance if the camera stands 1 mm higher than stated."""
    measured_share: Thousandths
    """Share of the picture that shows the wall finely enough to measure on."""

    @classmethod
    def of(cls, advice: Advice) -> Self:
        """Round the figures."""
        return cls.read_from(
            advice,
            verdict=advice.verdict.value,
            findings=[finding.name for finding in advice.findings],
        )


class BoardIn(Given):
    """The printed board of a film."""

    columns: int = Field(
        ge=4, le=40, description="ChArUco: squares along a row; checkerboard: inner corners."
    )
    rows: int = Field(ge=4, le=40, description="The same along a column.")
    square_mm: float = Field(ge=0.1, le=10_000, description="Side of a square in mm.")
    marker_mm: float | None = Field(
        None, gt=0, le=10_000, description="Side of a marker in mm; ChArUco only."
    )
    model: Literal["pinhole", "fisheye"] = Field(description="Lens.")

    def filmed(self) -> FilmedBoard:
        """Convert it for the calibrator."""
        return FilmedBoard(**self.model_dump())


class CalibratedOut(Out):
    """A measured camera."""

    camera: dict[str, Any]
    """The camera of a rig file."""
    focal_percent: Annotated[float, rounded_to(4)]
    """For `tolerance.focal_percent`."""
    pictures: int
    rms_px: Thousandths
    coverage: Thousandths
    """Share of the picture that the boards covered."""
    weaknesses: list[str]
    """What to do better; empty for a good calibration."""
