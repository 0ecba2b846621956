"""Single rows of a track and the wall points they show."""

from __future__ import annotations

from vo_core.geometry.wall import WallPoint, wall_point
from vo_core.rig import Rig
from vo_core.track import COLUMNS, Estimate, Track

_NUMBERS = tuple(name for name in COLUMNS if name not in ("frame", "status"))


def estimate_at(track: Track, frame: int) -> Estimate | None:
    """Return the estimate of one frame, or None until it is tracked."""
    if not 0 <= frame < len(track):
        return None
    values = {name: float(getattr(track, name)[frame]) for name in _NUMBERS}
    return Estimate(frame=frame, status=str(track.status[frame]), **values)  # type: ignore[arg-type]


def wall_point_of(rig: Rig, pixel: tuple[float, float], estimate: Estimate) -> WallPoint | None:
    """Return the wall point that a pixel of a frame shows, or None where none is seen."""
    return wall_point(rig, pixel, estimate.pose)


def is_unmeasured(track: Track) -> bool:
    """Return whether another program measured the distances, which then have no sigma or
    quality.
    """
    return not (track.sigma_distance_mm.any() or track.quality.any())


def since(track: Track, frame: int) -> Track:
    """Return the rows from `frame` on."""
    columns = {name: getattr(track, name)[frame:] for name in ("frame", "status", *_NUMBERS)}
    return Track(**columns)
