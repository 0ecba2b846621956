"""Sightings of rings and of the crests of waves, the joints that they are of, and their file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields

import numpy as np

from vo_core.csv_rows import number_columns
from vo_core.drift import row_of
from vo_core.track import Track
from vo_core.types import Matrix

EDGE_SIGMA_MM = 0.5
"""Position error of a sighting, one sigma: broken and filled edges look different in another
light."""

SAME_JOINT_MM = 50.0
"""Sightings closer than this are one joint: half the shortest segment that a rig may state."""

CREST_EVERY_MM = 500.0
"""Way from one sighting of a crest to the next, where the wall is one wave after the other."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """One sighting of a ring, or of a crest where the wall is one wave after the other.

    On a way there and back a ring has two.
    """

    frame: int
    """Frame in which the ring is nearest to the middle of the view; for a crest the frame up to
    which its waves were seen."""
    ahead_mm: float
    """Axial distance from the camera in this frame to the ring; so the ring follows the track."""
    sigma_mm: float
    """Standard deviation of `ahead_mm`."""
    contrast: float
    """Brightness relative to the wall beside the ring, minus 1: negative for a dark ring."""
    wave_mm: float = 0.0
    """From crest to crest by the track around a crest that was seen; 0 for a ring."""


_COLUMNS = tuple(field.name for field in fields(Sighting))
_NEWER = ("wave_mm",)
"""Columns that older files lack."""


def rings(sightings: Sequence[Sighting]) -> list[Sighting]:
    """Those that may be joints."""
    return [sighting for sighting in sightings if sighting.wave_mm == 0]


def crests(sightings: Sequence[Sighting]) -> list[Sighting]:
    """Those of the crests of waves."""
    return [sighting for sighting in sightings if sighting.wave_mm > 0]


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

    `joint`, which a crest has none of, and `distance_mm` are for people: they follow from the track
    and are ignored on reading.
    """
    lines = [f"# {key}: {value}" for key, value in (metadata or {}).items()]
    lines.append(",".join(("joint", *_COLUMNS, "distance_mm")))
    numbers, at_mm = iter(numbered(track, rings(sightings))), places_mm(track, sightings)
    for sighting, distance_mm in zip(sightings, at_mm, strict=True):
        frame, *values = astuple(sighting)
        joint = str(next(numbers)) if sighting.wave_mm == 0 else ""
        lines.append(",".join([joint, str(frame), *(f"{v:.4f}" for v in (*values, distance_mm))]))
    return "\n".join(lines) + "\n"


def from_csv(text: str) -> list[Sighting]:
    """Read joints.csv.

    Raises:
        InvalidTrack: A column is missing or a value is not a finite number.
    """
    needed = [name for name in _COLUMNS if name not in _NEWER]
    columns = number_columns(text, needed, "file of joints", further=_NEWER)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [Sighting(int(frame), *values) for frame, *values in rows]


def seen_variance(sightings: Sequence[Sighting]) -> Matrix:
    """(N,) variance of the joints' positions relative to the camera, mm^2."""
    return np.asarray(np.square([s.sigma_mm for s in sightings]) + EDGE_SIGMA_MM**2)
