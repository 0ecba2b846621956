"""Sightings of rings, the joints that they are of, and their file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields

import numpy as np

from vo_core.csv_rows import number_columns
from vo_core.drift import row_of
from vo_core.track import Track
from vo_core.types import Matrix

SAME_JOINT_MM = 50.0
"""Sightings closer than this are one joint: half the shortest segment that a rig may state."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """One sighting of a ring; on a way there and back a ring has two."""

    frame: int
    """Frame in which the ring is nearest to the middle of the view."""
    ahead_mm: float
    """Axial distance from the camera in this frame to the ring; so the ring follows the track."""
    sigma_mm: float
    """Standard deviation of `ahead_mm`."""
    contrast: float
    """Brightness relative to the wall beside the ring, minus 1: negative for a dark ring."""


_COLUMNS = tuple(field.name for field in fields(Sighting))


def places_mm(track: Track, sightings: Sequence[Sighting]) -> Matrix:
    """Axial coordinates of the rings by a track, (N,).

    Raises:
        InvalidCorrection: The track does not have the frame of a sighting.
    """
    rows = [row_of(track, sighting.frame) for sighting in sightings]
    ahead = np.array([sighting.ahead_mm for sighting in sightings])
    return np.asarray(track.distance_mm[rows] + ahead)


def numbered(track: Track, sightings: Sequence[Sighting]) -> list[int]:
    """Number the joint of each sighting, from 0 in the order of the distance."""
    at_mm = places_mm(track, sightings)
    order = np.argsort(at_mm)
    number = np.zeros(len(order), np.int64)
    number[order[1:]] = np.cumsum(np.diff(at_mm[order]) > SAME_JOINT_MM)
    return [int(n) for n in number]


def to_csv(
    track: Track, sightings: Sequence[Sighting], metadata: Mapping[str, object] | None = None
) -> str:
    """Write joints.csv: `# key: value` lines, the header, and a row for each sighting.

    `joint` and `distance_mm` are for people: they follow from the track and are ignored on reading.
    """
    lines = [f"# {key}: {value}" for key, value in (metadata or {}).items()]
    lines.append(",".join(("joint", *_COLUMNS, "distance_mm")))
    numbers, at_mm = numbered(track, sightings), places_mm(track, sightings)
    for number, sighting, distance_mm in zip(numbers, sightings, at_mm, strict=True):
        frame, *values = astuple(sighting)
        lines.append(
            ",".join([str(number), str(frame), *(f"{v:.4f}" for v in (*values, distance_mm))])
        )
    return "\n".join(lines) + "\n"


def from_csv(text: str) -> list[Sighting]:
    """Read joints.csv.

    Raises:
        InvalidTrack: A column is missing or a value is not a finite number.
    """
    columns = number_columns(text, _COLUMNS, "file of joints")
    rows = zip(*(columns[name].tolist() for name in _COLUMNS), strict=True)
    return [Sighting(int(frame), *values) for frame, *values in rows]
