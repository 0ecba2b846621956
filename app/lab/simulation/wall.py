"""Draws the developed wall over (axial mm, arc mm): concrete, tiles, or a photograph."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import cv2
import numpy as np
from numpy.typing import NDArray

from app.lab.simulation.camera import FloatImage
from app.lab.simulation.defects import draw_defects
from app.lab.simulation.scenario import Scenario
from vo_core.errors import ChainageError

MEAN_REFLECTANCE = 0.5
TEXTURE_SD = 0.07
"""Standard deviation of the reflectance of concrete at contrast 1."""

_JOINT_HALF_MM = 4.0
_GROUT_HALF_MM = 2.0
_LEVELS = 6
_MARGIN = 1 << _LEVELS
"""Texels around the requested area, so that the coarsest level has a border too."""


class PhotographNotAvailable(ChainageError):
    """The photograph of a scenario belongs to a package that is not installed."""


@dataclass(frozen=True)
class Wall:
    """Reflectance of the wall, at full resolution and at repeatedly halved ones.

    Texel (row i, column j) of level n lies at axial x0_mm + j 2^n texel_x_mm and at
    arc arc0_mm + i 2^n texel_arc_mm.
    """

    levels: tuple[FloatImage, ...]
    x0_mm: float
    arc0_mm: float
    texel_x_mm: float
    texel_arc_mm: float


@dataclass(frozen=True)
class _Sheet:
    """The grid on which a wall is drawn, with the millimetres of its columns and rows."""

    rng: np.random.Generator
    texel_mm: float
    x_mm: FloatImage
    arc_mm: FloatImage

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.arc_mm), len(self.x_mm)

    def noise(self, length_mm: float, *, stretch_arc: float = 1.0) -> FloatImage:
        """Smooth noise of unit variance with features of `length_mm`."""
        rows, columns = self.shape
        cell = max(length_mm / self.texel_mm, 1.0)
        coarse = self.rng.standard_normal(
            (int(rows / (cell * stretch_arc)) + 3, int(columns / cell) + 3), dtype=np.float32
        )
        fine = cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_CUBIC)
        return _standardised(np.asarray(fine, np.float32))


def make_wall(
    scenario: Scenario,
    *,
    x_range_mm: tuple[float, float],
    arc_range_mm: tuple[float, float],
    texel_mm: float,
) -> Wall:
    """Draw the visible wall of a scenario.

    If the range spans most of the circumference, all of it is drawn and closed without a seam.

    Raises:
        PhotographNotAvailable: The wall is a photograph of scikit-image, which is not installed.
    """
    diameter_mm = scenario.rendered_rig.pipe.diameter_mm
    start_mm, end_mm = arc_range_mm
    girth_mm = np.inf if diameter_mm is None else pi * diameter_mm
    closed = end_mm - start_mm > 0.85 * girth_mm
    if closed:
        start_mm, end_mm = -girth_mm / 2, girth_mm / 2
    rows = round((end_mm - start_mm) / texel_mm)
    texel_arc_mm = (end_mm - start_mm) / rows
    columns = round((x_range_mm[1] - x_range_mm[0]) / texel_mm) + 2 * _MARGIN
    x0_mm = x_range_mm[0] - _MARGIN * texel_mm
    arc0_mm = start_mm - _MARGIN * texel_arc_mm

    drawn_rows = rows + 2 * _MARGIN
    sheet = _Sheet(
        rng=np.random.default_rng(scenario.seed),
        texel_mm=texel_mm,
        x_mm=(x0_mm + texel_mm * np.arange(columns)).astype(np.float32),
        arc_mm=(arc0_mm + texel_arc_mm * np.arange(drawn_rows)).astype(np.float32),
    )
    reflectance = _surface(scenario, sheet)
    reflectance *= TEXTURE_SD * scenario.contrast
    reflectance += MEAN_REFLECTANCE
    if scenario.tile_mm is not None:
        _lay_tiles(reflectance, sheet, scenario.tile_mm)
    _cut_joints(reflectance, sheet, scenario)
    draw_defects(
        reflectance,
        scenario.defects,
        x0_mm=x0_mm,
        arc0_mm=arc0_mm,
        texel_mm=texel_mm,
        seed=scenario.seed,
    )
    if closed:
        reflectance = _without_seam(reflectance, rows)
    np.clip(reflectance, 0.02, 1.0, out=reflectance)

    levels = [_blurred(reflectance, 0.6)]
    while len(levels) < _LEVELS:
        levels.append(np.asarray(cv2.pyrDown(levels[-1]), np.float32))
    return Wall(tuple(levels), x0_mm, arc0_mm, texel_mm, texel_arc_mm)


def _surface(scenario: Scenario, sheet: _Sheet) -> FloatImage:
    """Draw the material of the wall, with zero mean and unit variance."""
    if scenario.photo is not None:
        return _photograph(sheet, scenario.photo, scenario.photo_mm)
    return _concrete(sheet) if scenario.tile_mm is None else _tile_surface(sheet)


def _photograph(sheet: _Sheet, name: str, side_mm: float) -> FloatImage:
    """Tile a photograph of scikit-image, mirrored so that no seam shows."""
    try:
        from skimage import data
    except ImportError as error:
        raise PhotographNotAvailable(
            f"The photograph of this wall ({name}) comes with scikit-image, which is not "
            "installed: pip install scikit-image."
        ) from error
    photo = np.asarray(getattr(data, name)(), np.float32)
    side_px = round(side_mm / sheet.texel_mm)
    enlarge = side_px > photo.shape[1]
    tile = cv2.resize(
        photo, (side_px, side_px), interpolation=cv2.INTER_CUBIC if enlarge else cv2.INTER_AREA
    )
    rows, columns = sheet.shape
    padding = [(0, max(0, size - side_px)) for size in sheet.shape]
    mirrored = np.pad(tile, padding, mode="symmetric")[:rows, :columns]
    return _standardised(np.asarray(mirrored, np.float32))


def _concrete(sheet: _Sheet) -> FloatImage:
    """Draw spun concrete of zero mean and unit variance: stains, sand, pits, stones and cracks."""
    tone = 0.3 * sheet.noise(180) + 0.3 * sheet.noise(60) + 0.25 * sheet.noise(22)
    tone += 0.2 * sheet.noise(30, stretch_arc=12)  # rings left by the spinning
    tone += 0.2 * sheet.noise(14, stretch_arc=4)  # dried trickles
    for length_mm, share in ((8, 0.25), (3, 0.25), (1.4, 0.3), (0.7, 0.45), (0.35, 0.55)):
        tone += share * sheet.noise(length_mm)
    _scatter_stones(tone, sheet)

    depth = _pits(sheet) + _cracks(sheet)
    # The lamp stands behind the camera's view: near edges fall into shadow, far edges shine.
    relief = 0.12 * sheet.noise(0.8) + 0.4 * sheet.noise(4) - depth
    tone += cv2.Sobel(relief, cv2.CV_32F, 1, 0, ksize=3, scale=0.1 / sheet.texel_mm)
    tone -= 1.6 * depth
    return _standardised(tone)


def _standardised(image: FloatImage) -> FloatImage:
    mean, deviation = cv2.meanStdDev(image)
    image -= np.float32(mean[0, 0])
    image /= np.float32(deviation[0, 0])
    return image


def _blurred(image: FloatImage, sigma_px: float) -> FloatImage:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), np.float32)


def _scatter(sheet: _Sheet, per_mm2: float) -> tuple[FloatImage, FloatImage, int]:
    """Random columns and rows, and their number."""
    rows, columns = sheet.shape
    count = int(per_mm2 * rows * columns * sheet.texel_mm**2)
    return (
        sheet.rng.uniform(0, columns, count).astype(np.float32),
        sheet.rng.uniform(0, rows, count).astype(np.float32),
        count,
    )


_SUBPIXEL_BITS = 4


def _fixed(*columns: NDArray[np.floating]) -> list[list[int]]:
    """Rows of values as the fixed-point numbers of OpenCV's drawing functions."""
    rows: list[list[int]] = (
        np.rint(np.stack(columns, axis=-1) * (1 << _SUBPIXEL_BITS)).astype(int).tolist()
    )
    return rows


def _scatter_stones(tone: FloatImage, sheet: _Sheet) -> None:
    """Draw faces of the aggregate onto `tone`, a little darker or lighter than the cement."""
    faces = np.zeros(sheet.shape, np.float32)
    us, vs, count = _scatter(sheet, 1 / 60)
    radii = sheet.rng.lognormal(np.log(0.9), 0.45, count) / sheet.texel_mm
    for centre, axes, shade, turn in zip(
        _fixed(us, vs),
        _fixed(radii, 0.65 * radii),
        sheet.rng.normal(0, 1.1, count).tolist(),
        sheet.rng.uniform(0, 180, count).tolist(),
        strict=True,
    ):
        cv2.ellipse(faces, centre, axes, turn, 0, 360, shade, -1, cv2.LINE_8, _SUBPIXEL_BITS)
    tone += 1.3 * _blurred(faces, 0.25 / sheet.texel_mm)


def _pits(sheet: _Sheet) -> FloatImage:
    """Depth of air bubbles left in the surface, about 0 to 2."""
    depth = np.zeros(sheet.shape, np.float32)
    us, vs, count = _scatter(sheet, 1 / 110)
    radii = np.minimum(sheet.rng.lognormal(np.log(0.45), 0.7, count), 5.0) / sheet.texel_mm
    deep = np.minimum(1.2 + 0.25 * radii * sheet.texel_mm, 2.4).tolist()
    for centre, (radius,), grey in zip(_fixed(us, vs), _fixed(radii), deep, strict=True):
        cv2.circle(depth, centre, radius, grey, -1, cv2.LINE_8, _SUBPIXEL_BITS)
    return _blurred(depth, 0.3 / sheet.texel_mm)


def _cracks(sheet: _Sheet) -> FloatImage:
    """Depth of hairline cracks, most of them around the pipe, about one every 0.45 m."""
    rows, columns = sheet.shape
    depth = np.zeros(sheet.shape, np.float32)
    for _ in range(max(1, round(columns * sheet.texel_mm / 450))):
        steps = int(sheet.rng.uniform(40, 140))
        heading = sheet.rng.choice([pi / 2, pi / 2, 0.0]) + sheet.rng.normal(0, 0.2)
        turns = heading + np.cumsum(sheet.rng.normal(0, 0.22, steps)) * 0.35
        turns += sheet.rng.normal(0, 0.45, steps)
        ways = 1.5 / sheet.texel_mm * np.stack([np.cos(turns), np.sin(turns)], axis=-1)
        start = sheet.rng.uniform((0, 0), (columns, rows))
        points = np.rint((start + np.cumsum(ways, axis=0)) * (1 << _SUBPIXEL_BITS))
        cv2.polylines(
            depth,
            [points.astype(np.int32)],
            isClosed=False,
            color=2.2,
            thickness=max(1, round(0.45 / sheet.texel_mm)),
            lineType=cv2.LINE_8,
            shift=_SUBPIXEL_BITS,
        )
    return _blurred(depth, 0.2 / sheet.texel_mm)


def _cut_joints(reflectance: FloatImage, sheet: _Sheet, scenario: Scenario) -> None:
    """Draw joint rings onto `reflectance`, centred exactly on first + k segment.

    Between the edges of silt, which hides the wall, a ring continues as a faint line.
    """
    segment_mm = scenario.rendered_rig.pipe.segment_length_mm
    if segment_mm is None:
        return
    first_mm = scenario.first_joint_mm
    clean = min(1.0, 0.35 + 0.65 * scenario.contrast)
    first = np.ceil((sheet.x_mm[0] - first_mm) / segment_mm)
    last = np.floor((sheet.x_mm[-1] - first_mm) / segment_mm)
    for joint in np.arange(first, last + 1):
        right_mm = sheet.x_mm - np.float32(first_mm + joint * segment_mm)
        near = np.flatnonzero(np.abs(right_mm) < 8 * _JOINT_HALF_MM)
        if not near.size:
            continue
        columns = slice(near[0], near[-1] + 1)
        is_silt = np.abs(sheet.arc_mm) < _silt_edge_mm(scenario, first_mm + joint * segment_mm)
        strength = np.where(is_silt, scenario.silt.joint_share * clean, clean)[:, None]
        right = right_mm[None, columns]
        gap = _rise(right + _JOINT_HALF_MM + _lip(sheet)) * _rise(
            _JOINT_HALF_MM + _lip(sheet) - right
        )
        mortar = np.exp(-0.5 * ((np.abs(right) - 2.5 * _JOINT_HALF_MM) / _JOINT_HALF_MM) ** 2)
        reflectance[:, columns] *= 1 - 0.75 * strength * gap
        reflectance[:, columns] += 0.06 * strength * mortar


def _silt_edge_mm(scenario: Scenario, x_mm: float) -> float:
    """Arc from the invert at which the bed of the silt meets the wall."""
    diameter_mm = scenario.rendered_rig.pipe.diameter_mm
    depth_mm = float(scenario.silt.depth_mm(np.array(x_mm)))
    if diameter_mm is None or depth_mm <= 0:
        return 0.0
    return float(np.arccos(1 - 2 * depth_mm / diameter_mm)) * diameter_mm / 2


def _lip(sheet: _Sheet) -> FloatImage:
    """Broken edge of a joint in mm, (rows, 1); zero on average, so the joint stays centred."""
    rows = len(sheet.arc_mm)
    lip = np.zeros((rows, 1), np.float32)
    for length_mm, size_mm in ((12.0, 0.6), (3.0, 0.4), (1.0, 0.2)):
        count = int(rows * sheet.texel_mm / length_mm) + 3
        coarse = sheet.rng.normal(0, size_mm, (count, 1)).astype(np.float32)
        lip += cv2.resize(coarse, (1, rows), interpolation=cv2.INTER_CUBIC)
    lip -= lip.mean()
    return lip


def _rise(distance_mm: FloatImage) -> FloatImage:
    """A soft step from 0 to 1 at zero distance."""
    step: FloatImage = 1 / (1 + np.exp(-np.clip(distance_mm / np.float32(0.3), -30, 30)))
    return step


def _tile_surface(sheet: _Sheet) -> FloatImage:
    """Draw glazed clay of zero mean and unit variance: clouds, specks and scratches."""
    tone = 0.8 * sheet.noise(40) + 0.5 * sheet.noise(12)
    for length_mm in (4, 1.6, 0.8):
        tone += 0.4 * sheet.noise(length_mm)
    _scatter_stones(tone, sheet)
    tone -= 0.5 * _cracks(sheet)
    return _standardised(tone)


def _lay_tiles(reflectance: FloatImage, sheet: _Sheet, tile_mm: float) -> None:
    """Draw the tones of tiles and the grout between them; one tile has a corner at (0, 0)."""

    def index_and_grout(position_mm: FloatImage) -> tuple[np.ndarray, FloatImage]:
        phase = position_mm / tile_mm
        away_mm = np.abs(phase - np.rint(phase)) * tile_mm
        index = np.floor(phase).astype(int)
        return index - index.min(), _rise(_GROUT_HALF_MM - away_mm)

    column, grout_x = index_and_grout(sheet.x_mm)
    row, grout_arc = index_and_grout(sheet.arc_mm)
    tones = sheet.rng.normal(0, 0.03, (row.max() + 1, column.max() + 1)).astype(np.float32)
    reflectance += tones[row][:, column]
    grout = np.maximum(grout_arc[:, None], grout_x[None, :])
    reflectance *= 1 - 0.55 * grout


def _without_seam(reflectance: FloatImage, rows: int) -> FloatImage:
    """Close a sheet of `rows` plus margins to a ring; its last rows fade into its first."""
    ring = reflectance[_MARGIN : _MARGIN + rows].copy()
    ramp = np.linspace(0, 1, _MARGIN, dtype=np.float32)[:, None]
    ring[:_MARGIN] *= ramp
    ring[:_MARGIN] += (1 - ramp) * reflectance[_MARGIN + rows : 2 * _MARGIN + rows]
    return np.pad(ring, ((_MARGIN, _MARGIN), (0, 0)), mode="wrap")
