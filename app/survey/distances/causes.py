"""Why a film was tracked badly or not at all: what was seen, and what repairs it.

A rig that is wrong shows in three ways: in the pictures, which show the pipe's axis elsewhere than
the rig has it; in the rig itself, which no inspection camera has; and in the sources of the
interval.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, get_args

from app.survey.assets.search_terms import Problem
from app.survey.distances.film_quality import PROBLEMS, FilmQuality
from app.survey.distances.uncertainty_budget import PartName
from vo_core import Rig

Repair = Literal["axis", "pipe", "lens", "again", "film"]
"""The axis on a picture, the pipe, the lens; only another try; another film."""

CauseCode = (
    Literal[
        "looks_along", "axis_elsewhere", "sees_little", "tilted", "no_axis", "unknown",
        "wrong_rig", "wrong_size", "try_again", "wrong_film",
    ]
    | Problem
    | PartName
)  # fmt: skip

MANY_LOST = 0.1
"""Share of lost frames from which a film is doubtful, however narrow its interval is."""

APART_DEG = 5.0
"""Angle between the axis in the pictures and in the rig that no tolerance explains."""

LEAST_VIEW_DEG = 20.0
"""Narrowest view across the picture that an inspection camera has."""

_OF_ERRORS: dict[str, tuple[CauseCode, Repair]] = {
    "no_wall_in_view": ("wrong_rig", "axis"),
    "invalid_rig": ("wrong_rig", "axis"),
    "rig_video_mismatch": ("wrong_size", "lens"),
    "unreadable_video": ("wrong_film", "film"),
    "nothing_recorded": ("wrong_film", "film"),
    "blob_not_found": ("wrong_film", "film"),
}
_OF_PARTS: dict[PartName, Repair | None] = {
    "height": "pipe", "focal": "lens", "diameter": "pipe", "tilt": "axis", "joints": "pipe",
    "segment": "pipe",
}  # fmt: skip


@dataclass(frozen=True)
class AxisSeen:
    """What the pictures of a film show of the pipe's axis."""

    looked_at: int
    sure: int
    """Number of pictures in which it is certain."""
    pitch_deg: float | None = None
    """Mount's pitch by the clearest of them, nose up; None if the rig does not look ahead."""
    u95_deg: float = 0.0

    @property
    def is_seen(self) -> bool:
        """Whether so many show it that the camera looks along the pipe."""
        return self.sure >= max(2, self.looked_at / 4)


@dataclass(frozen=True)
class Cause:
    """What probably is wrong."""

    code: CauseCode
    repair: Repair | None
    """None: nothing can be changed afterwards."""
    params: dict[str, float] = field(default_factory=dict)


def of_error(code: str) -> Cause:
    """Return what repairs a film that was not tracked to its end; by default another try."""
    return Cause(*_OF_ERRORS.get(code, ("try_again", "again")))


def causes_of(
    rig: Rig, axis: AxisSeen, quality: FilmQuality | None, largest: PartName | None
) -> list[Cause]:
    """Return what probably made the distances of a film useless, the most probable first.

    Args:
        rig: As it was stated.
        axis: What the pictures show.
        quality: Shares of the frames with a fault.
        largest: The largest source of the interval; None if it is not known.
    """
    found = [*_of_axis(rig, axis), *_of_view(rig), *_of_pictures(quality)]
    if rig.looks_along_pipe and not axis.sure:
        found.append(_of_no_axis(rig, axis))
    if largest is not None and largest != "tracking":
        found.append(Cause(largest, _OF_PARTS.get(largest)))
    return found or [Cause("unknown", "axis" if rig.looks_along_pipe else "lens")]


def _of_axis(rig: Rig, axis: AxisSeen) -> Iterator[Cause]:
    if not rig.looks_along_pipe:
        if axis.is_seen:
            yield Cause("looks_along", "axis", {"sure": axis.sure, "looked_at": axis.looked_at})
    elif axis.pitch_deg is not None:
        stated_deg = rig.mount.pitch_deg
        if abs(axis.pitch_deg - stated_deg) > max(APART_DEG, axis.u95_deg):
            yield Cause(
                "axis_elsewhere",
                "axis",
                {"stated_deg": round(stated_deg, 1), "seen_deg": round(axis.pitch_deg, 1)},
            )


def _of_no_axis(rig: Rig, axis: AxisSeen) -> Cause:
    """The cause of a film in whose pictures the axis is not certain: perhaps the rig is tilted."""
    stated_deg = rig.mount.pitch_deg
    if abs(stated_deg) > APART_DEG:
        return Cause("tilted", "axis", {"stated_deg": round(stated_deg, 1)})
    return Cause("no_axis", "axis", {"looked_at": axis.looked_at})


def _of_view(rig: Rig) -> Iterator[Cause]:
    camera = rig.camera
    half = camera.width / 2 / camera.fx
    view_deg = math.degrees(2 * (half if camera.model == "fisheye" else math.atan(half)))
    if view_deg < LEAST_VIEW_DEG:
        yield Cause("sees_little", "lens", {"view_deg": round(view_deg, 1)})


def _of_pictures(quality: FilmQuality | None) -> Iterator[Cause]:
    if quality is None:
        return
    shares: dict[Problem, float] = {
        problem: getattr(quality, PROBLEMS[problem][0]) or 0.0
        for problem in get_args(Problem)
        if problem != "lost"
    }
    for problem, share in sorted(shares.items(), key=lambda one: -one[1]):
        if share > PROBLEMS[problem][1]:
            yield Cause(problem, None, {"percent": round(100 * share)})
