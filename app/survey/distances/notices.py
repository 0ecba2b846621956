"""Notices where picture and rig disagree, with what to check."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from app.survey.adjustment.adjusted_track import Adjusted
from vo_core import Rig
from vo_core.geometry.tilt import MountTilt

Turn = Literal[
    "looks_ahead", "looks_back", "looks_left", "looks_right", "looks_up", "looks_down",
    "turned_clockwise", "turned_anticlockwise",
]  # fmt: skip
"""How a camera differs from its rig, seen in the direction of travel."""

NoticeCode = (
    Literal[
        "scale_changes",
        "rig_doubted",
        "height_doubted",
        "joints_doubted",
        "rings_uncounted",
        "waves_unstated",
        "pitch_doubted",
        "counter_doubts_rig",
    ]
    | Turn
)


UNEXPLAINED = ("unexplained_scale", "undecided_scale")
"""Reasons to refuse joints: they need a scale that the rig does not explain."""

UNEXPLAINED_PITCH = "unexplained_pitch"
"""The same for crests."""

MANY_RINGS = 4
"""Least number of rings from which it can be judged that they do not lie where joints are."""


OTHER_SCALE = 0.05
"""From this share on, the scale by a counter says that the rig is wrong."""

CERTAIN = 2.0
"""Standard deviations, of the stated and the measured tilt together, beyond which a tilt counts.

Below that the tolerance explains it, and the tracker allows for it."""

_TURNS: dict[str, tuple[tuple[Turn, Turn], tuple[Turn, Turn]]] = {
    "down": (("looks_ahead", "looks_back"), ("looks_left", "looks_right")),
    "forward": (("looks_up", "looks_down"), ("turned_clockwise", "turned_anticlockwise")),
}
"""For each view of a rig, the meaning of a positive and a negative pitch, then of a roll."""


@dataclass(frozen=True)
class Notice:
    """Something to look into."""

    code: NoticeCode
    params: dict[str, float] = field(default_factory=dict)


def notices_of(adjusted: Adjusted, tilt: MountTilt | None = None) -> list[Notice]:
    """Return the notices, the most serious first.

    Args:
        adjusted: The track with its rig.
        tilt: The tilt of the mount against that rig, if it was measured.
    """
    turned = [] if tilt is None else _turns(adjusted.rig, tilt)
    return [*_notices(adjusted), *turned]


def _turns(rig: Rig, tilt: MountTilt) -> Iterator[Notice]:
    pitch, roll = _TURNS[rig.mount.view]
    turns = (
        (pitch, tilt.pitch_deg, tilt.pitch_sigma_deg, rig.mount.pitch_deg),
        (roll, tilt.roll_deg, tilt.roll_sigma_deg, rig.mount.roll_deg),
    )
    tolerance_deg = rig.tolerance.tilt_deg
    # Along its axis a round pipe looks the same from any roll.
    shown = turns[:1] if rig.looks_along_pipe else turns
    for (above, below), turned_deg, sigma_deg, stated_deg in shown:
        if abs(turned_deg) > CERTAIN * math.hypot(tolerance_deg, sigma_deg):
            yield Notice(
                above if turned_deg > 0 else below,
                {
                    "turned_deg": round(abs(turned_deg), 1),
                    "tolerance_deg": tolerance_deg,
                    "seen_deg": round(stated_deg + turned_deg, 1),
                },
            )


def _notices(adjusted: Adjusted) -> Iterator[Notice]:
    done, segment_mm = adjusted.correction, adjusted.rig.pipe.segment_length_mm
    if adjusted.waves_mm is not None and adjusted.rig.pipe.corrugation is None:
        yield Notice("waves_unstated", {"pitch_mm": round(adjusted.waves_mm, 1)})
    carried = adjusted.carried
    if carried is not None and carried.is_whole and adjusted.carrier == "counter":
        by_counter = carried.scale or 1.0
        if abs(by_counter - 1) > OTHER_SCALE:
            yield Notice("counter_doubts_rig", {"scale": round(by_counter, 2)})
    refusal = adjusted.joints_refusal
    asked = refusal.values.get("scale") if refusal and refusal.reason in UNEXPLAINED else None
    if isinstance(asked, float) and segment_mm is not None:
        yield Notice(
            "joints_doubted",
            {"scale": asked, "segment_mm": segment_mm},
        )
    elif refusal is not None and refusal.reason == UNEXPLAINED_PITCH:
        yield Notice("pitch_doubted", {name: float(mm) for name, mm in refusal.values.items()})
    elif refusal is not None and adjusted.rings >= MANY_RINGS:
        yield Notice("rings_uncounted", {"n": adjusted.rings, "segment_mm": segment_mm or 0.0})
    if done is not None and (scales := done.changing_scales):
        yield Notice("scale_changes", {"least": min(scales), "greatest": max(scales)})
    elif done is not None and done.doubts_rig:
        height = adjusted.height
        scale = {"scale": round(done.scale, 3)}
        if height is None:
            yield Notice("rig_doubted", scale)
        else:
            stated_mm = adjusted.rig.mount.height_mm
            yield Notice(
                "height_doubted",
                {
                    **scale,
                    "height_mm": round(height.height_mm, 1),
                    "stated_mm": stated_mm,
                    "tolerance_mm": adjusted.rig.tolerance.height_mm,
                },
            )
