"""The classical detector: what stands out on the wall, by filters in millimetres."""

from __future__ import annotations

import numpy as np

from vo_core.findings.areas import apart, areas
from vo_core.findings.finding import Finding
from vo_core.findings.joints import gaps, odd_joints, without
from vo_core.findings.measuring import direction_of, length_of, measured, smoothed
from vo_core.findings.patches import WallPatch
from vo_core.findings.ridges import LEAST_MM, STRONG, components, crests, main_line, ridges
from vo_core.findings.surface import Surface
from vo_core.types import GrayImage

VERSION = "1"
"""Another one whenever it proposes something else."""

LEAST_WIDTH_MM = 0.6
"""Narrower lines are hair cracks of the surface."""


class Classical:
    """Finds cracks, joints and areas without any training."""

    def propose(self, patch: WallPatch) -> list[Finding]:
        """Find what is on a patch."""
        if not patch.weight.any():
            return []
        surface = Surface.of(patch)
        joints = gaps(surface)
        strength, direction = ridges(surface)
        crest = without(crests(strength, direction), surface, joints)
        wide = areas(surface, crest, joints)
        return cracks(surface, crest, wide) + wide + odd_joints(surface, joints)


def cracks(surface: Surface, crest: GrayImage, wide: list[Finding]) -> list[Finding]:
    """Dark lines that belong to no joint and to no area."""
    found = []
    step_mm = float(surface.step_mm.mean())
    for pixels in components(crest, step_mm):
        line_px, width = measured(surface, smoothed(main_line(pixels, step_mm), step_mm))
        line_mm = surface.to_mm(line_px)
        length = length_of(line_mm)
        if length.mm < LEAST_MM or width.mm < LEAST_WIDTH_MM or not apart(line_mm, wide):
            continue
        columns, rows = pixels.T
        mean = float(crest[rows, columns].mean())
        score = float(1 / (1 + np.exp(-(mean - STRONG) / 3)))
        found.append(Finding("crack", line_mm, length, width, direction_of(line_mm), score))
    return found
