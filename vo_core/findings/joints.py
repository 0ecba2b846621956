"""Joints on a patch: rings are no cracks, and a wide or uneven gap is a finding."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.findings.finding import Finding, Size
from vo_core.findings.surface import Surface
from vo_core.image.resample import reduce_to
from vo_core.joints.finder import RING_WIDTHS_MM, SECTORS
from vo_core.joints.rings import find_rings
from vo_core.types import GrayImage, Matrix

NEAR_MM = 30.0
"""The gap of a joint lies within this of its ring."""

STRAIGHT_MM = 2.0
"""Largest deviation of a ring from a plane across the pipe; a crack around the pipe winds more."""

LEAST_ARC_MM = 200.0
"""Around at least so much of the wall a narrow line must be straight to be a joint."""

GAP_OF_JOINT_MM = 4.0
"""A gap as wide is a joint's, even if only a strip of the wall is in view."""

LEAST_SEEN_MM = 80.0
"""A joint of which less is in view is not judged: a wet streak looks the same."""

WHOLE = 0.7
"""Share of the visible wall around which a joint is dark; silt may hide the rest."""

BESIDE_MM = 4.0
"""Broken edges and mortar beside a gap belong to the joint."""

OPEN_MM = 16.0
"""Gap from which a joint is open: joints of concrete pipes are laid with up to some 12 mm."""

UNEVEN_MM = 6.0
"""Difference between the widest and the narrowest place from which a joint is displaced."""

SURE = 3.0
"""A size counts as exceeded where it is by so many standard uncertainties."""


@dataclass(frozen=True)
class Gap:
    """The gap of one joint."""

    axial_mm: float
    arcs_mm: Matrix
    """(n,) places around the pipe where it was measured."""
    widths_mm: Matrix
    """(n,) width of the gap there."""

    @property
    def width(self) -> Size:
        """Median width."""
        middle = float(np.median(self.widths_mm))
        scatter = 1.4826 * float(np.median(np.abs(self.widths_mm - middle)))
        return Size(middle, float(np.hypot(0.1 * middle, scatter / len(self.widths_mm) ** 0.5)))

    def unevenness(self, girth_mm: float) -> Size:
        """Difference of the width between opposite places, by one wave around the pipe."""
        angles = 2 * np.pi * self.arcs_mm / girth_mm
        waves = np.stack([np.ones_like(angles), np.cos(angles), np.sin(angles)], 1)
        fit, *_ = np.linalg.lstsq(waves, self.widths_mm, rcond=None)
        rest = self.widths_mm - waves @ fit
        variance = float(rest @ rest) / max(len(rest) - 3, 1)
        sigma = (variance * float(np.linalg.pinv(waves.T @ waves)[1:, 1:].trace())) ** 0.5
        return Size(2 * float(np.hypot(fit[1], fit[2])), 2 * sigma)


def gaps(surface: Surface) -> list[Gap]:
    """Find the joints of a patch by the rings that they leave."""
    rows = np.flatnonzero(surface.seen.any(axis=1))
    if len(rows) < SECTORS:
        return []
    band = slice(int(rows[0]), int(rows[-1]) + 1)
    size_wh = (surface.seen.shape[1], SECTORS)
    count = reduce_to(surface.seen[band].astype(np.float32), size_wh)
    light = np.where(surface.seen[band], np.exp(surface.contrast[band]), 0).astype(np.float32)
    total = reduce_to(light, size_wh)
    column_mm = float(surface.step_mm[0])
    rings = find_rings(total, count, [width / column_mm for width in RING_WIDTHS_MM])
    measured = (_measured(surface, ring.at_px) for ring in rings if ring.contrast < 0)
    return [gap for gap in measured if gap is not None]


def without(crest: GrayImage, surface: Surface, joints: list[Gap]) -> GrayImage:
    """Crests that belong to no joint."""
    columns = np.arange(crest.shape[1])
    axial = surface.to_mm(np.stack([columns, columns], 1).astype(np.float64))[:, 0]
    for gap in joints:
        half_mm = float(np.percentile(gap.widths_mm, 90)) / 2 + BESIDE_MM
        crest = crest * (np.abs(axial - gap.axial_mm) > half_mm)
    return crest


def odd_joints(surface: Surface, joints: list[Gap]) -> list[Finding]:
    """Joints that are open, or displaced so that their gap differs around the pipe."""
    found = []
    for gap in joints:
        width, length_mm = gap.width, float(np.ptp(gap.arcs_mm))
        if length_mm < LEAST_SEEN_MM:
            continue
        girth_mm = surface.patch.girth_mm
        uneven = gap.unevenness(girth_mm) if girth_mm is not None else Size(0.0, 0.0)
        if width.mm - SURE * width.sigma_mm / 2 > OPEN_MM:
            kind, excess = "joint_open", width.mm / OPEN_MM
        elif uneven.mm - SURE * uneven.sigma_mm > UNEVEN_MM:
            kind, excess = "joint_displaced", uneven.mm / UNEVEN_MM
        else:
            continue
        half_mm = float(gap.widths_mm.max()) / 2
        low, high = float(gap.arcs_mm.min()), float(gap.arcs_mm.max())
        outline = np.array([[-half_mm, low], [half_mm, low], [half_mm, high], [-half_mm, high]])
        outline[:, 0] += gap.axial_mm
        length = Size(length_mm, length_mm / len(gap.arcs_mm))
        found.append(Finding(kind, outline, length, width, None, 1 - 0.5 / excess))
    return found


def _measured(surface: Surface, at_px: float) -> Gap | None:
    """Measure the gap of a ring in each sector; None if it is no joint."""
    column_mm = float(surface.step_mm[0])
    reach = round(NEAR_MM / column_mm)
    left = max(round(at_px) - reach, 0)
    columns = slice(left, round(at_px) + reach + 1)
    seen = surface.seen[:, columns]
    rows = np.flatnonzero(seen.all(axis=1))
    if len(rows) < SECTORS:
        return None
    lack = 1 - np.exp(_against_wall(surface.log[rows, columns]))
    sectors = np.array_split(np.arange(len(rows)), SECTORS)
    profiles = np.stack([np.median(lack[sector], axis=0) for sector in sectors])
    smooth = cv2.GaussianBlur(profiles, (0, 0), 2.0 / column_mm, sigmaY=0.01)
    darkest = smooth.argmax(axis=1)
    depth = smooth.max(axis=1)
    edges = np.array([_edges(row, at) for row, at in zip(profiles, darkest, strict=True)])
    at, widths = edges.mean(axis=1), np.ptp(edges, axis=1)
    off_mm = np.abs(at - np.median(at)) * column_mm
    middles = np.array([np.median(rows[sector]) for sector in sectors])
    axial = surface.to_mm(np.array([[left + np.median(at), 0.0]]))[0, 0]
    arcs = surface.to_mm(np.stack([middles, middles], 1))[:, 1]
    gap = Gap(float(axial), arcs, widths * column_mm)
    is_long = float(np.ptp(arcs)) > LEAST_ARC_MM or gap.width.mm > GAP_OF_JOINT_MM
    is_whole = np.mean(depth > np.median(depth) / 2) >= WHOLE
    return gap if np.median(off_mm) < STRAIGHT_MM and is_long and is_whole else None


def _against_wall(log: GrayImage) -> GrayImage:
    """Logarithm of the brightness against that of the wall on both sides."""
    quarter = max(log.shape[1] // 6, 1)
    sides = np.hstack([log[:, :quarter], log[:, -quarter:]])
    return np.asarray(log - np.median(sides, axis=1, keepdims=True), np.float32)


def _edges(profile: Matrix, at: int) -> tuple[float, float]:
    """Edges (px) of a dark profile at half of its depth, around its darkest place."""
    half = float(profile[at]) / 2
    low = high = at
    while low > 0 and profile[low - 1] > half:
        low -= 1
    while high < len(profile) - 1 and profile[high + 1] > half:
        high += 1

    def part(inner: int, outer: int) -> float:
        """Part of a pixel between the last dark place and the next."""
        if not 0 <= outer < len(profile):
            return 0.0
        fall = float(profile[inner] - profile[outer])
        return float(np.clip((profile[inner] - half) / fall, 0, 1)) if fall > 0 else 0.0

    return low - part(low, low - 1), high + part(high, high + 1)
