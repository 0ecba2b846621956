"""What a rig sees: a ruler on its wall, and a judgement before any drive."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import BaseModel, Field

from app.jobs.messages import Calibrated, FilmedBoard
from app.survey.given import Given
from app.web.schemas.aiming import line_out
from vo_core.advice import Advice
from vo_core.geometry.ruling import Line, Ruling


class RigIn(Given):
    """A rig that is being entered."""

    rig: dict[str, Any] = Field(description="The rig file: camera, mount and pipe.")


class LineOut(BaseModel):
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


class RulingOut(BaseModel):
    """The wall in the picture as lines."""

    step_mm: int
    """Distance between two lines across."""
    across: list[LineOut]
    along: list[LineOut]

    @classmethod
    def of(cls, ruling: Ruling) -> Self:
        """Convert the core's lines."""
        return cls(
            step_mm=ruling.step_mm,
            across=[LineOut.of(line) for line in ruling.across],
            along=[LineOut.of(line) for line in ruling.along],
        )


class AdviceOut(BaseModel):
    """How a rig is expected to measure."""

    verdict: str
    """fit, fit with care, not fit."""
    findings: list[str]
    """What speaks against it: forward, fast, hurried, near, coarse, oblique."""
    seen_mm: float
    """Length of the wall along the pipe on which motion is measured."""
    mm_per_px: float
    """Wall under a pixel of the measured picture."""
    good_speed_mm_s: float
    limit_speed_mm_s: float
    height_error_percent: float
    """Error of the distance if the camera stands 1 mm higher than stated."""
    measured_share: float
    """Share of the picture that shows the wall finely enough to measure on."""

    @classmethod
    def of(cls, advice: Advice) -> Self:
        """Round the figures."""
        return cls(
            verdict=advice.verdict.value,
            findings=[finding.name for finding in advice.findings],
            seen_mm=round(advice.measured_axial_mm, 1),
            mm_per_px=round(advice.measured_mm_per_px, 3),
            good_speed_mm_s=round(advice.good_speed_mm_s, 1),
            limit_speed_mm_s=round(advice.speed_limit_mm_s, 1),
            height_error_percent=round(advice.height_error_percent, 3),
            measured_share=round(advice.measured_share, 3),
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


class CalibratedOut(BaseModel):
    """A measured camera."""

    camera: dict[str, Any]
    """The camera of a rig file."""
    focal_percent: float
    """For `tolerance.focal_percent`."""
    pictures: int
    rms_px: float
    coverage: float
    """Share of the picture that the boards covered."""
    weaknesses: list[str]
    """What to do better; empty for a good calibration."""

    @classmethod
    def of(cls, found: Calibrated) -> Self:
        """Round the figures."""
        return cls(
            camera=found.camera,
            focal_percent=round(found.focal_percent, 4),
            pictures=found.pictures,
            rms_px=round(found.rms_px, 3),
            coverage=round(found.coverage, 3),
            weaknesses=found.weaknesses,
        )
