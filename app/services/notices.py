"""Where picture and rig disagree: what people are to be shown at once, with what to check."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from app.services.adjustment import Adjusted

NoticeCode = Literal[
    "scale_changes", "rig_doubted", "height_doubted", "joints_doubted", "rings_uncounted"
]


MANY_RINGS = 4
"""Of fewer nobody can say yet that they lie elsewhere than joints do."""


@dataclass(frozen=True)
class Notice:
    """Something to look into."""

    code: NoticeCode
    params: dict[str, float] = field(default_factory=dict)


def notices_of(adjusted: Adjusted) -> list[Notice]:
    """The most serious first."""
    return list(_notices(adjusted))


def _notices(adjusted: Adjusted) -> Iterator[Notice]:
    done, segment_mm = adjusted.correction, adjusted.rig.pipe.segment_length_mm
    if adjusted.refused_scale is not None and segment_mm is not None:
        yield Notice(
            "joints_doubted",
            {"scale": round(adjusted.refused_scale, 3), "segment_mm": segment_mm},
        )
    elif adjusted.joints_refusal is not None and adjusted.rings >= MANY_RINGS:
        yield Notice("rings_uncounted", {"n": adjusted.rings, "segment_mm": segment_mm or 0.0})
    if done is not None and done.stretches:
        scales = [stretch.scale for stretch in done.stretches]
        yield Notice("scale_changes", {"first": round(scales[0], 3), "last": round(scales[-1], 3)})
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
