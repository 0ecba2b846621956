"""What is burnt into a film: the readings of its counter, one for each frame, and its date."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

import numpy as np
from numpy.typing import NDArray

from app.burnt_in.finder import CounterPlace

HEADER = "frame,time_s,reading,unit,confidence"


@dataclass(frozen=True)
class CounterReadings:
    """The readings of the counter, one for each frame."""

    time_s: NDArray[np.float64]
    """(N,)."""
    reading: NDArray[np.float64]
    """(N,) in the unit of the counter; NaN where it is not legible."""
    confidence: NDArray[np.float64]
    """(N,) in [0, 1]; 0 where it is not legible."""
    place: CounterPlace | None
    """None if the film shows no counter."""
    problem: str | None
    """A sentence that says why the film ended early or what was skipped."""

    def __str__(self) -> str:
        """How many frames have a reading, and what the first and last are, for a person."""
        legible = self.reading[~np.isnan(self.reading)]
        found = f"{len(legible)} of {len(self.reading)} frames have a reading"
        if self.place is None or len(legible) == 0:
            return found
        first, last = (f"{value:.{self.place.decimals}f}" for value in legible[[0, -1]])
        return f"{found}, from {first} to {last} {self.place.unit}".rstrip()

    def to_csv(self) -> str:
        """Write `frame,time_s,reading,unit,confidence`; both are empty where it is not legible."""
        unit = "" if self.place is None else self.place.unit
        decimals = 0 if self.place is None else self.place.decimals
        columns = (self.time_s.tolist(), self.reading.tolist(), self.confidence.tolist())
        rows = [
            f"{frame},{t_s:.6f},,,0.000"
            if np.isnan(reading)
            else f"{frame},{t_s:.6f},{reading:.{decimals}f},{unit},{confidence:.3f}"
            for frame, (t_s, reading, confidence) in enumerate(zip(*columns, strict=True))
        ]
        return "\n".join([HEADER, *rows]) + "\n"

    @classmethod
    def from_csv(
        cls, text: str, place: CounterPlace | None, problem: str | None = None
    ) -> CounterReadings:
        """Read the output of `to_csv`.

        Raises:
            ValueError: It is no such table.
        """
        header, *rows = text.splitlines()
        if header != HEADER:
            raise ValueError(f"The table begins with {header[:60]!r}, not with {HEADER}.")
        # (N, 5) as text; an unreadable frame has neither a reading nor a unit
        columns = list(zip(*(row.split(",") for row in rows), strict=True)) or [()] * 5
        frame, time_s, reading, _, confidence = columns
        if list(frame) != [str(n) for n in range(len(rows))]:
            raise ValueError("The rows are not the frames from 0 on.")
        return cls(
            np.array(time_s, np.float64),
            np.array([value or "nan" for value in reading], np.float64),
            np.array(confidence, np.float64),
            place,
            problem,
        )


@dataclass(frozen=True)
class BurntIn:
    """What is burnt into a film."""

    place: CounterPlace | None
    """None if the film shows no counter."""
    film_date: date | None
    """None if it shows no date."""
    width: int
    height: int
    """Of the picture."""


@dataclass(frozen=True)
class ReadFilm:
    """A film of which every frame was read."""

    found: BurntIn
    csv: str
    """The readings as `CounterReadings.to_csv` writes them."""
    problem: str | None
    """What was wrong with the film."""
