"""The burnt-in counter of a film."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BaseModel, Field, model_validator

from app.burnt_in.box import Box
from app.burnt_in.readings import BurntIn
from app.inspections.counters import CounterState, CounterView
from app.jobs.messages import Progress
from app.survey.distances.interval import half_width_m
from app.survey.given import Given
from app.tracking.pictures.counter_files import KeptCounter
from app.web.schemas.out import Hundredths, Out, rounded_to
from vo_core.scale.counter import CounterComparison, Unit

_LEAST_PX = 8
"""Least width and height of a drawn box; smaller text is not legible."""

Corner = Annotated[int, Field(ge=0, le=100_000)]


class CounterIn(Given):
    """What a person states about the counter; the film is then read again, unless only unit or
    uncertainty are others.
    """

    is_present: bool = Field(True, description="false: the film shows no counter.")
    box: (
        Annotated[
            list[Corner],
            Field(
                min_length=4,
                max_length=4,
                description="The part of the picture that holds it: left, top, right, bottom, px. "
                "Without it, the counter is searched.",
            ),
        ]
        | None
    ) = None
    unit: Unit | None = Field(None, description="Of a counter that shows none.")
    percent: (
        Annotated[
            float,
            Field(gt=0, le=20, description="Standard uncertainty of its way; 0.5 if not stated."),
        ]
        | None
    ) = None

    @model_validator(mode="after")
    def _box_has_a_size(self) -> Self:
        if self.box is not None:
            left, top, right, bottom = self.box
            if right - left < _LEAST_PX or bottom - top < _LEAST_PX:
                raise ValueError(f"the box must be at least {_LEAST_PX} px wide and high")
        return self

    def to_kept(self) -> KeptCounter:
        """Convert to the stored form."""
        within = None if self.box is None else Box(*self.box)
        state: Literal["waiting", "declined"] = "waiting" if self.is_present else "declined"
        return KeptCounter(state, within, self.unit, self.percent)


class CounterFoundOut(Out):
    """Where a film shows its counter."""

    width: int
    height: int
    """Of the picture."""
    box: tuple[int, int, int, int] | None
    """Left, top, right, bottom; None if there is no counter."""
    unit: Literal["m", "ft", ""]
    """Empty if it shows none."""
    film_date: date | None
    """The date burnt into the film; None if it shows none, or it may mean two days."""

    @classmethod
    def of(cls, found: BurntIn) -> Self:
        """Convert what the search has found."""
        place = found.place
        return cls.read_from(
            found,
            box=None if place is None else place.box.corners,
            unit="" if place is None else place.unit,
        )


class CounterProgressOut(BaseModel):
    """How far the film is read."""

    frames_done: int
    """0 while the counter is searched."""
    frames_total: int | None


class CounterFaultOut(Out):
    """A stretch in which the counter did not count what the camera drove."""

    kind: Literal["slip", "stuck", "reset"]
    first_frame: int
    last_frame: int
    counter_m: float
    camera_m: float
    """At the scale of the counter."""


class CounterLengthOut(Out):
    """The longest way without a fault, by the counter."""

    first_frame: int
    last_frame: int
    length_m: float
    sigma_mm: Hundredths
    camera_m: float
    """By the raw track."""
    camera_u95_m: float
    scale: Annotated[float, rounded_to(6)]
    """Way of the counter over that of the raw track."""
    scale_sigma: Annotated[float, rounded_to(6)]
    agrees: bool
    """Whether the two differ by less than two standard deviations."""


class ComparisonOut(BaseModel):
    """What counter and raw track say about each other."""

    length: CounterLengthOut | None
    """None if too little was driven without a fault."""
    faults: list[CounterFaultOut]

    @classmethod
    def of(cls, found: CounterComparison) -> Self:
        """Convert lengths to metres."""
        return cls(
            length=_length(found),
            faults=[
                CounterFaultOut.read_from(
                    fault,
                    counter_m=round(fault.counter_mm / 1000, 4),
                    camera_m=round(fault.camera_mm / 1000, 4),
                )
                for fault in found.faults
            ],
        )


class CounterOut(BaseModel):
    """What is known of a film's counter."""

    state: CounterState
    progress: CounterProgressOut | None
    """While it is read."""
    detail: str | None
    """Why it failed, or what was wrong with the film."""
    is_box_drawn: bool
    box: tuple[int, int, int, int] | None
    """Where it was read, else the drawn box: left, top, right, bottom, px."""
    unit: Unit | None
    """As shown or stated; null until somebody states it."""
    is_unit_shown: bool
    percent: float | None
    """Standard uncertainty of its way, as stated; null for the usual one of 0.5 %."""
    frames: int
    legible: int
    """Of these frames."""
    first_m: float | None
    last_m: float | None
    """First and last reading."""
    comparison: ComparisonOut | None
    film_date: date | None
    """The date burnt into the film; None if it shows none, or it may mean two days."""
    version: str
    """Of the readings; empty without them."""

    @classmethod
    def of(cls, view: CounterView, progress: Progress | None) -> Self:
        """Convert the service's result."""
        kept, place = view.kept, view.kept.place if view.kept else None
        legible_m = view.reading_m[~np.isnan(view.reading_m)]
        readings = view.readings
        within = kept.within if kept else None
        box = place.box if place else within
        return cls(
            state=view.state,
            progress=None
            if progress is None or view.state != "waiting"
            else CounterProgressOut(frames_done=progress.done, frames_total=progress.total),
            detail=kept.detail if kept else None,
            is_box_drawn=within is not None,
            box=None if box is None else box.corners,
            unit=view.unit,
            is_unit_shown=bool(place and place.unit),
            percent=kept.percent if kept else None,
            frames=0 if readings is None else len(readings.reading),
            legible=0 if readings is None else int((~np.isnan(readings.reading)).sum()),
            first_m=round(float(legible_m[0]), 4) if len(legible_m) else None,
            last_m=round(float(legible_m[-1]), 4) if len(legible_m) else None,
            comparison=None if view.comparison is None else ComparisonOut.of(view.comparison),
            film_date=kept.film_date if kept else None,
            version=view.version,
        )


def _length(found: CounterComparison) -> CounterLengthOut | None:
    if found.length is None or found.scale is None:
        return None
    return CounterLengthOut.read_from(
        found.length,
        length_m=round(found.length.length_mm / 1000, 4),
        camera_m=round(found.camera_mm / 1000, 4),
        camera_u95_m=half_width_m(found.camera_sigma_mm),
        scale=found.scale,
        scale_sigma=found.sigma,
        agrees=found.agrees,
    )
