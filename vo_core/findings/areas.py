"""Areas that differ from the wall beside them along the pipe: in tone, in texture, in lines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.findings.finding import Finding, Size
from vo_core.findings.joints import BESIDE_MM, Gap
from vo_core.findings.ridges import STRONG
from vo_core.findings.surface import Mask, Surface
from vo_core.image.resample import reduce_to
from vo_core.types import GrayImage, Matrix

CELL_MM = 4.0
"""Cell in which tone and texture are compared."""

FINE_MM = 2.0
"""Sigma below which brightness is texture."""

DEVIATIONS = 5.0
"""An area differs by so many robust deviations of the wall in the patch."""

LEAST_TONE, LEAST_TEXTURE = 0.16, 0.45
"""And at least by so much: of the logarithm of the brightness, and of that of the texture."""

LEAST_LINES = 0.13
"""Length of strong lines for each area, mm / mm^2, where there are many: one crack has 0.05 in the
cells around it, and 0.1 where it branches."""

GLINT, LEAST_GLINTS = 0.5, 0.015
"""Tone of a reflection, and their share where water runs."""

THREADS = 0.9
"""Texture of a dark area from which it consists of threads and their shadows."""

NEAR_JOINT_MM = 24.0
"""An area goes on over a joint, which hides less than this."""

SKIRT_MM = 5.0
"""Tone and texture beside a strong line belong to the line."""

LEAST_AREA_MM2 = 700.0
"""Smallest area."""

HOLE_TONE, STAIN_TONE = -1.1, -0.16
"""Tones below which an area is a hole, and is darker than the wall."""

EDGE_MM = 6.0
"""Standard uncertainty of an area's extent: edges are ragged and cells are coarse."""


@dataclass(frozen=True)
class Cells:
    """Differences of each cell from the wall along the pipe."""

    step_mm: Matrix
    seen: Mask
    tone: GrayImage
    texture: GrayImage
    glints: GrayImage
    """Share of reflections, along some way."""
    lines: GrayImage
    """Length of strong lines for each area, mm / mm^2."""

    @classmethod
    def of(cls, surface: Surface, crest: GrayImage, joints: list[Gap]) -> Cells:
        """Compare the cells of a patch; joints count as unseen."""
        height, width = surface.seen.shape
        size_wh = tuple(
            max(round(side * step / CELL_MM), 5)
            for side, step in zip((width, height), surface.step_mm.tolist(), strict=True)
        )
        size_wh = (size_wh[0], size_wh[1])
        beside = surface.seen & _beside(surface, joints)
        is_line = (crest >= STRONG).astype(np.float32)
        side = 2 * round(SKIRT_MM / surface.step_mm.mean()) + 1
        seen = beside & (cv2.dilate(is_line, np.ones((side, side), np.uint8)) == 0)
        share = reduce_to(seen.astype(np.float32), size_wh)
        is_seen = reduce_to(beside.astype(np.float32), size_wh) > 0.5

        def mean(values: GrayImage) -> GrayImage:
            total = reduce_to(np.asarray(values * seen, np.float32), size_wh)
            return _filled(total, share)

        fine = surface.log - cv2.GaussianBlur(surface.log, (0, 0), FINE_MM / surface.step_mm.min())
        texture = np.log(mean(fine**2) + np.float32(1e-4)) / 2
        tone = _against_row(mean(surface.log), is_seen)
        fine_tone = surface.log - _usual(surface.log, surface.seen)
        glints = cv2.blur(mean((fine_tone > GLINT).astype(np.float32)), (21, 3))
        lines = cv2.blur(reduce_to(is_line, size_wh), (5, 5)) / surface.step_mm.mean()
        return cls(
            step_mm=surface.step_mm * np.array([width, height]) / size_wh,
            seen=is_seen,
            tone=tone,
            texture=_against_row(np.asarray(texture, np.float32), is_seen),
            glints=np.asarray(glints, np.float32),
            lines=np.asarray(lines, np.float32),
        )


def _filled(total: GrayImage, share: GrayImage) -> GrayImage:
    """Mean of each cell; where lines leave less than a fifth of it, that of the cells around."""
    around = cv2.blur(total, (7, 7)) / np.maximum(cv2.blur(share, (7, 7)), 1e-3)
    own = total / np.maximum(share, 1e-3)
    return np.asarray(np.where(share > 0.2, own, around), np.float32)


def areas(surface: Surface, crest: GrayImage, joints: list[Gap]) -> list[Finding]:
    """Find the areas of a patch."""
    cells = Cells.of(surface, crest, joints)
    tone_limit = max(DEVIATIONS * _deviation(cells.tone, cells.seen), LEAST_TONE)
    texture_limit = max(DEVIATIONS * _deviation(cells.texture, cells.seen), LEAST_TEXTURE)
    odd = np.abs(cells.tone) > tone_limit
    odd |= np.abs(cells.texture) > texture_limit
    odd |= (cells.lines > LEAST_LINES) | (cells.glints > LEAST_GLINTS)
    odd = (odd & cells.seen) | _over_joints(odd & cells.seen, ~cells.seen)
    return [_finding(surface, cells, area) for area in _components(odd, cells)]


def _over_joints(odd: Mask, unseen: Mask) -> Mask:
    """Unseen cells between odd ones on both sides along the pipe, as at a joint."""
    across = np.ones((1, 2 * round(NEAR_JOINT_MM / CELL_MM) + 1), np.uint8)
    closed = cv2.morphologyEx(odd.astype(np.uint8), cv2.MORPH_CLOSE, across)
    return np.asarray((closed > 0) & unseen)


def _beside(surface: Surface, joints: list[Gap]) -> Mask:
    """Places that belong to no joint."""
    columns = np.arange(surface.seen.shape[1], dtype=np.float64)
    axial = surface.to_mm(np.stack([columns, columns], 1))[:, 0]
    beside = np.ones(surface.seen.shape, bool)
    for gap in joints:
        half_mm = float(np.percentile(gap.widths_mm, 90)) / 2 + 2 * BESIDE_MM
        beside &= np.abs(axial - gap.axial_mm) > half_mm
    return beside


def _usual(values: GrayImage, seen: Mask) -> GrayImage:
    """Median along the pipe, (rows, 1); 0 where nothing was seen."""
    usual = np.zeros((len(values), 1), np.float32)
    for row, is_seen in enumerate(seen):
        if is_seen.any():
            usual[row] = np.median(values[row, is_seen])
    return usual


def _against_row(values: GrayImage, seen: Mask) -> GrayImage:
    """Difference from the median along the pipe, free of what is narrow; 0 where not seen."""
    differs = np.where(seen, values - _usual(values, seen), 0).astype(np.float32)
    return np.asarray(cv2.medianBlur(differs, 5), np.float32)


def _deviation(values: GrayImage, seen: Mask) -> float:
    """Robust standard deviation."""
    return 1.4826 * float(np.median(np.abs(values[seen]))) if seen.any() else np.inf


def _components(odd: Mask, cells: Cells) -> Iterator[Mask]:
    """Yield the connected areas that are large enough; parts that nearly touch are one."""
    near = cv2.morphologyEx(odd.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    solid = cv2.morphologyEx(near, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(solid, connectivity=8)
    for label in range(1, count):
        if stats[label, cv2.CC_STAT_AREA] * cells.step_mm.prod() >= LEAST_AREA_MM2:
            yield labels == label


def _finding(surface: Surface, cells: Cells, area: Mask) -> Finding:
    contours, _ = cv2.findContours(
        area.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
    )
    contour = max(contours, key=cv2.contourArea)[:, 0].astype(np.float64)
    from_mm = np.array([surface.patch.axial_from_mm, surface.patch.arc_from_mm])
    outline = from_mm + (contour + 0.5) * cells.step_mm
    along, around = (np.ptp(outline, axis=0) + cells.step_mm).tolist()
    kind, excess = _kind(cells, area, along, around)
    return Finding(
        kind,
        outline,
        Size(along, float(np.hypot(EDGE_MM, 0.1 * along))),
        Size(around, float(np.hypot(EDGE_MM, 0.1 * around))),
        None,
        1 - 0.5 / max(excess, 1.0),
    )


def _kind(cells: Cells, area: Mask, along_mm: float, around_mm: float) -> tuple[str, float]:
    """What an area looks like, and how many times the least difference it has."""
    tone = float(np.median(cells.tone[area]))
    texture = float(np.median(cells.texture[area]))
    lines = float(np.mean(cells.lines[area]))
    glints = float(np.mean(cells.glints[area]))
    excess = max(abs(tone) / LEAST_TONE, abs(texture) / LEAST_TEXTURE, lines / LEAST_LINES)
    if glints > LEAST_GLINTS:
        return "water", max(excess, glints / LEAST_GLINTS)
    if float(np.percentile(cells.tone[area], 25)) < HOLE_TONE:
        return "hole", excess
    if lines > LEAST_LINES or (tone < STAIN_TONE and texture > THREADS):
        return "roots", excess
    if tone < STAIN_TONE:
        if around_mm > 1.5 * along_mm:
            return "water", excess
        return ("deposit" if texture < -LEAST_TEXTURE else "stain"), excess
    return ("spall" if texture > LEAST_TEXTURE else "deposit"), excess


def apart(lines_mm: Matrix, found: list[Finding]) -> bool:
    """Whether a line (n, 2) lies mostly outside of all areas."""
    inside = np.zeros(len(lines_mm), bool)
    for finding in found:
        outline = finding.outline_mm.astype(np.float32)
        inside |= [
            cv2.pointPolygonTest(outline, point, measureDist=True) > -2 * CELL_MM
            for point in lines_mm.tolist()
        ]
    return bool(inside.mean() < 0.5)
