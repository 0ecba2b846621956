"""The recorded figures of the short sequences, and which figures have changed beyond their noise.

Each sequence is recorded with several draws of the sensor noise, which differ by chance alone.
With a figure's loss, what it is worse by than the best possible, it is worse beyond its noise if

    loss > worst + (worst - best) + floor + share * |worst|

where worst and best are those of the draws.  Draws tell how much chance there is in a row:
a track that is lost by a hair has much.  The floor is for the last digits of a good one.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.lab.bench.run import BenchRow

Row = Mapping[str, float | None]
"""Figures of one sequence by their names; None where it has no such figure."""
Record = Mapping[str, Sequence[Row]]
"""Each draw of the noise by the name of the sequence, first the one that is measured again."""


@dataclass(frozen=True)
class Figure:
    """One column of the table."""

    heading: str
    form: str
    """Format of a value."""
    of: Callable[[BenchRow], float | None]
    floor: float
    """In the unit of the figure."""
    loss: Callable[[float], float] = abs
    share: float = 0.25
    is_held: bool = True
    """Whether a worse one fails; the time of a step depends on what else the machine does."""

    def verdict(self, before: Sequence[float], now: float) -> int:
        """Return 1 if a figure is worse beyond its noise, -1 if it is better, else 0."""
        loss, losses = self.loss(now), [self.loss(value) for value in before]
        worst, best = max(losses), min(losses)
        chance = worst - best + self.floor
        if loss > worst + chance + self.share * abs(worst):
            return 1
        return -1 if best > loss + chance + self.share * abs(loss) else 0


def _joints(row: BenchRow) -> float | None:
    if row.wrong_rig is None:
        return None
    return 0.0 if row.wrong_rig.joined is None else float(row.wrong_rig.joined.joints)


FIGURES: Mapping[str, Figure] = {
    "end_percent": Figure("end (%)", "+.3f", lambda row: row.evaluation.end_error_percent, 0.02),
    "worst_mm": Figure("worst (mm)", ".2f", lambda row: row.evaluation.max_error_mm, 0.3),
    "ate_mm": Figure("ATE (mm)", ".2f", lambda row: row.evaluation.ate_mm, 0.3),
    "yaw_deg": Figure("yaw (°)", ".3f", lambda row: row.evaluation.yaw_rms_deg, 0.03),
    "y_mm": Figure("y (mm)", ".2f", lambda row: row.evaluation.y_rms_mm, 0.2),
    "within": Figure(
        "in 3σ", ".3f", lambda row: row.evaluation.coverage, 0.02, lambda share: 1 - share
    ),
    "within_registration": Figure(
        "in 3σ of reg.", ".3f", lambda row: row.evaluation.registration_coverage, 0.05,
        lambda share: 1 - share,
    ),
    "registration_mm": Figure(
        "σ of reg. (mm)", ".2f", lambda row: row.evaluation.end_registration_mm, 0.2
    ),
    "lost": Figure("lost", ".0f", lambda row: float(row.evaluation.lost_frames), 1.0),
    "joints": Figure("joints", ".0f", _joints, 0.0, lambda count: -count, share=0.0),
    "time_ratio": Figure("time", ".2f", lambda row: row.time.ratio, 0.1, is_held=False),
}  # fmt: skip
"""By their names in the file: end error in percent of the path, root mean squares of yaw and y,
shares of the frames within three of both sigmas, the registration's sigma at the end, joints that
are counted where the rig is wrong, and the time of a step over that of a windowed
`cv2.phaseCorrelate`."""


@dataclass(frozen=True)
class Change:
    """A figure that differs from the recorded one beyond its noise."""

    sequence: str
    figure: str
    before: Sequence[float]
    """Of each draw."""
    now: float
    is_worse: bool

    @property
    def fails(self) -> bool:
        """Whether the bench fails because of it."""
        return self.is_worse and FIGURES[self.figure].is_held

    def __str__(self) -> str:
        figure = FIGURES[self.figure]
        first, low, high, now = (
            format(value, figure.form)
            for value in (self.before[0], min(self.before), max(self.before), self.now)
        )
        chance = "" if low == high else f" ({low} to {high})"
        return f"{self.sequence}: {figure.heading} {first}{chance} -> {now}"


def figures_of(row: BenchRow) -> Row:
    """Take the figures of one run, rounded as the file holds them."""
    values = {name: figure.of(row) for name, figure in FIGURES.items()}
    return {name: None if value is None else round(value, 4) for name, value in values.items()}


def changes(before: Record, now: Record) -> Iterator[Change]:
    """Yield what has changed beyond its noise, of the sequences that both have."""
    for sequence, (row, *_) in now.items():
        for name, figure in FIGURES.items():
            was = [one for draw in before.get(sequence, ()) if (one := draw.get(name)) is not None]
            is_now = row[name]
            if is_now is not None and was and (verdict := figure.verdict(was, is_now)):
                yield Change(sequence, name, was, is_now, is_worse=verdict > 0)


def read(file: Path) -> Record:
    """Read the recorded figures."""
    record: dict[str, list[Row]] = {}
    with file.open(encoding="utf-8", newline="") as lines:
        for line in csv.DictReader(lines):
            draws = record.setdefault(line.pop("sequence"), [])
            draws.append({name: float(value) if value else None for name, value in line.items()})
    return record


def write(file: Path, record: Record) -> None:
    """Record figures, in place of those that the file holds."""
    with file.open("w", encoding="utf-8", newline="") as lines:
        table = csv.writer(lines, lineterminator="\n")
        table.writerow(["sequence", *FIGURES])
        for sequence, draws in record.items():
            for row in draws:
                values = ["" if row[name] is None else f"{row[name]:g}" for name in FIGURES]
                table.writerow([sequence, *values])


def cells(before: Row, now: Row, names: Sequence[str]) -> list[str]:
    """Show figures; one that reads otherwise than the recorded one stands beside it."""

    def shown(row: Row, name: str) -> str:
        value = row.get(name)
        return "-" if value is None else format(value, FIGURES[name].form)

    pairs = [(shown(before, name), shown(now, name)) for name in names]
    return [is_now if was in (is_now, "-") else f"{was} → {is_now}" for was, is_now in pairs]
