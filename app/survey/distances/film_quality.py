"""How suitable a whole film was for measuring: the share of its frames with each fault.

What is a fault of one frame is decided in `vo_core.image.health` and by the tracking; here is only
how many frames may have it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.survey.assets.search_terms import Problem
from app.survey.distances.track_rows import is_unmeasured
from app.survey.rounding import rounded
from vo_core import Track
from vo_core.image.health import complained

LOST_PERCENT = 1.0
"""Largest share of frames that may be lost, in percent."""
POOR_PERCENT = 5.0
"""Largest share of frames that may have the same complaint of picture health, in percent."""

_DECIMALS = 3
"""Shares are compared and shown in tenths of a percent."""


@dataclass(frozen=True)
class FilmQuality:
    """Shares of the tracked frames, from 0 to 1; None where the health was not measured."""

    frames: int
    weak_share: float
    """Measured with low confidence."""
    lost_share: float
    """Without a lock: the motion before them goes on."""
    too_fast_share: float | None
    dark_share: float | None
    overexposed_share: float | None
    blurred_share: float | None
    dirty_lens_share: float | None


PROBLEMS: Mapping[Problem, tuple[str, float]] = {
    "lost": ("lost_share", LOST_PERCENT / 100),
    "too_fast": ("too_fast_share", POOR_PERCENT / 100),
    "too_dark": ("dark_share", POOR_PERCENT / 100),
    "overexposed": ("overexposed_share", POOR_PERCENT / 100),
    "blurred": ("blurred_share", POOR_PERCENT / 100),
    "lens_dirty": ("dirty_lens_share", POOR_PERCENT / 100),
}
"""For each problem of a film, the share that shows it, and the largest one without it."""


def problems_of(shares: Mapping[str, float | None]) -> list[Problem]:
    """Return the problems that these shares show, by the names of `FilmQuality`."""
    return [
        problem
        for problem, (name, most) in PROBLEMS.items()
        if (value := shares[name]) is not None and value > most
    ]


def quality_of(track: Track, health: Mapping[str, NDArray[np.floating]]) -> FilmQuality | None:
    """Return the quality of a film; None where no film was measured.

    Args:
        track: Its track.
        health: Health of each frame, (N,), by the fields of `Health`; empty columns if unknown.
    """
    if not len(track) or is_unmeasured(track):
        return None
    faults = complained(health)
    return FilmQuality(
        frames=len(track),
        weak_share=share(track.status == "weak"),
        lost_share=share(track.status == "lost"),
        too_fast_share=_known_share(faults["too_fast"]),
        dark_share=_known_share(faults["too_dark"]),
        overexposed_share=_known_share(faults["too_bright"]),
        blurred_share=_known_share(faults["blurred"]),
        dirty_lens_share=_known_share(faults["lens_dirty"]),
    )


def share(frames: NDArray[np.bool_]) -> float:
    """Return the share of true values, to a tenth of a percent; 0 of none."""
    return rounded(float(frames.mean()), _DECIMALS) if len(frames) else 0.0


def _known_share(frames: NDArray[np.bool_]) -> float | None:
    return share(frames) if len(frames) else None
