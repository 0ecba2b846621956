"""The columns of every frame of a run that the page needs; row i is frame i."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from vo_core.image.health import complained
from vo_core.track import Status, Track

_EXACT = ("time_s", "x_mm", "distance_mm")
"""Columns in double precision; for the others seven digits are enough."""
_NEARLY = ("y_mm", "z_mm", "yaw_deg", "pitch_deg", "roll_deg", "sigma_distance_mm", "quality")
_STATUSES: tuple[Status, ...] = get_args(Status)


def track_columns(
    track: Track, since: int, sources: NDArray[np.uint8] | None = None
) -> dict[str, NDArray[Any]]:
    """Return the page's columns of a track from a frame on; `status` is 0 ok, 1 weak, 2 lost.

    `sources` may be shorter than the track: what was added since has the last of them.
    """
    exact = {name: getattr(track, name)[since:] for name in _EXACT}
    nearly = {name: getattr(track, name)[since:].astype(np.float32) for name in _NEARLY}
    status = np.zeros(len(track.status[since:]), np.uint8)
    for rank, name in enumerate(_STATUSES):
        status[track.status[since:] == name] = rank
    around = track.looking_around[since:].astype(np.uint8)
    columns = {**exact, **nearly, "status": status, "looking_around": around}
    if sources is None:
        return columns
    missing = len(track) - len(sources)
    source = np.pad(sources, (0, missing), "edge" if len(sources) else "constant")
    return {**columns, "source": source[since:]}


def health_columns(
    health: Mapping[str, NDArray[np.float32]], since: int
) -> dict[str, NDArray[Any]]:
    """Return the page's columns of picture health; bit n of `complaints` is the nth complaint."""
    shown = {name: column[since:] for name, column in health.items()}
    found = complained(shown)
    bits = np.array([1 << n for n in range(len(found))], np.uint8)
    return {
        "overlap": shown["overlap"],
        "fixed_pattern": shown["fixed_pattern"],
        "complaints": bits @ np.array(list(found.values()), np.uint8),
    }
