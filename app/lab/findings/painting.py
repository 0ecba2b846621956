"""Walls with defects of known place and size, painted at the resolution of the mosaic.

The wall is that of the renderer; what a run would do to it is drawn at random: resolution and
sharpness of the camera, light that is left, colour, noise, dirt that stays in the picture, borders
of what was seen, and the coding of the tiles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi

import cv2
import numpy as np
from numpy.typing import NDArray

from app.lab.simulation.defects import Defect, draw_defects
from app.lab.simulation.variants import NOMINAL, paper_rig
from app.lab.simulation.wall import MEAN_REFLECTANCE, make_wall
from vo_core.findings.patches import WallPatch, blocks_of, patch_of
from vo_core.mosaic.lamp import WALL_GREY
from vo_core.mosaic.layout import UNSEEN_GREY, Layout
from vo_core.mosaic.mosaic import Tile
from vo_core.types import Matrix

TILES = 8
"""Tiles of a painted wall: four metres, with six defects."""

TEXEL_MM = 0.4
GAP_REFLECTANCE = (0.03, 0.12)
SEAM_MM = 30.0
"""Cracks stay as far from the joints and from the end of the view."""

_Image = NDArray[np.float32]


@dataclass(frozen=True)
class Truth:
    """A defect that was drawn; its outline is closed, or the line of a crack."""

    kind: str
    outline_mm: Matrix
    length_mm: float
    width_mm: float
    is_line: bool = True
    """Whether the outline of a crack is its line; otherwise it is the box in which it winds."""
    is_visible: bool = True
    """Whether most of it is in view; a finding on a part of it is not false in any case."""


@dataclass(frozen=True)
class PaintedWall:
    """Patches of a wall with all that is on it."""

    tiles: dict[int, Tile]
    layout: Layout
    girth_mm: float | None
    truth: tuple[Truth, ...]

    @property
    def metres(self) -> float:
        """Length of the wall."""
        return len(self.tiles) * self.layout.tile_mm / 1000

    def patches(self) -> Iterator[WallPatch]:
        """Patches in ascending order."""
        for block in blocks_of(self.tiles):
            yield patch_of(self.layout, block, self.tiles.get, girth_mm=self.girth_mm)


def painted_wall(seed: int) -> PaintedWall:
    """Paint a wall; equal seeds give equal walls."""
    rng = np.random.default_rng([seed, 35])
    layout, girth_mm = _layout(rng)
    scenario = replace(
        NOMINAL,
        rig=paper_rig(pipe={**_PIPE, "diameter_mm": 300.0}),
        seed=int(rng.integers(1, 2**31)),
        contrast=float(rng.uniform(0.3, 1.2)),
        first_joint_mm=float(rng.uniform(100, 700)),
    )
    length_mm = TILES * layout.tile_mm
    wall = make_wall(
        scenario,
        x_range_mm=(0.0, length_mm),
        arc_range_mm=(layout.arc_from_mm, layout.arc_to_mm),
        texel_mm=TEXEL_MM,
    )
    reflectance = wall.levels[0]
    left = round(-wall.x0_mm / wall.texel_x_mm)
    top = round((layout.arc_from_mm - wall.arc0_mm) / wall.texel_arc_mm)
    rows = round((layout.arc_to_mm - layout.arc_from_mm) / wall.texel_arc_mm)
    sheet = reflectance[top : top + rows, left : left + round(length_mm / TEXEL_MM)].copy()
    truth = _drawn_defects(sheet, layout, scenario.first_joint_mm, rng)
    picture, seen = _recorded(sheet, layout, rng, is_ring=girth_mm is not None)
    width = layout.width_px
    tiles = {
        k: _coded(picture[:, k * width :][:, :width], seen[:, k * width :][:, :width], k)
        for k in range(TILES)
    }
    return PaintedWall(tiles, layout, girth_mm, tuple(truth))


_PIPE = {"shape": "circular", "segment_length_mm": 1500.0}


def _layout(rng: np.random.Generator) -> tuple[Layout, float | None]:
    """A raster of 0.5 to 1.5 mm, around the whole pipe or over the strip of a view down."""
    mm_per_px = float(rng.uniform(0.5, 1.5))
    width_px = round(500 / mm_per_px)
    is_ring = bool(rng.random() < 0.5)
    half_mm = pi * 150.0 if is_ring else float(rng.uniform(60, 200))
    height_px = round(2 * half_mm / (500 / width_px) / 8) * 8
    layout = Layout(500.0, 500 / width_px, -half_mm, half_mm, width_px, height_px)
    return layout, 2 * pi * 150.0 if is_ring else None


def _drawn_defects(
    sheet: _Image, layout: Layout, first_joint_mm: float, rng: np.random.Generator
) -> list[Truth]:
    """Draw a crack or an area in each 0.6 m, cracks off the joints; return what was drawn."""
    truth: list[Truth] = []
    high_mm = layout.arc_to_mm - 15.0
    for from_mm in np.arange(250.0, TILES * layout.tile_mm - 500.0, 600.0).tolist():
        kind = rng.choice(["crack", "crack", "crack", "leak", "roots", "silt", "hole", "stain"])
        middle_mm = np.array([from_mm + rng.uniform(0, 150), rng.uniform(-0.6, 0.6) * high_mm])
        if kind == "crack":
            line = _crack_line(middle_mm, high_mm, first_joint_mm, rng)
            if line is None:
                continue
            width_mm = float(rng.uniform(1.0, 4.0))
            _draw_gap(sheet, line, width_mm, layout, float(rng.uniform(*GAP_REFLECTANCE)))
            length_mm = float(np.hypot(*np.diff(line, axis=0).T).sum())
            truth.append(Truth("crack", line, length_mm, width_mm))
            continue
        along, around = rng.uniform(60, 180), min(rng.uniform(60, 180), 1.2 * high_mm)
        defect = Defect(kind, float(middle_mm[0]), float(middle_mm[1]), along, around)
        draw_defects(
            sheet,
            (defect,),
            x0_mm=0.0,
            arc0_mm=layout.arc_from_mm,
            texel_mm=TEXEL_MM,
            seed=int(rng.integers(2**31)),
        )
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 * [along, around]
        truth.append(Truth(str(kind), middle_mm + corners, along, around))
    return truth


def _crack_line(
    middle_mm: Matrix, high_mm: float, first_joint_mm: float, rng: np.random.Generator
) -> Matrix | None:
    """A winding line of 100 to 400 mm that stays in view and off the joints; None if none does."""
    for _ in range(40):
        length_mm = rng.uniform(100, 400)
        angle = rng.choice([0.0, pi / 2, rng.uniform(0, pi)])
        steps = round(length_mm / 2)
        turns = angle + np.cumsum(rng.normal(0, 0.12, steps)) * 0.6
        turns += angle - turns.mean()
        ways = 2.0 * np.stack([np.cos(turns), np.sin(turns)], 1)
        line = np.vstack([[0.0, 0.0], np.cumsum(ways, axis=0)])
        line += middle_mm - line.mean(axis=0)
        to_joint = (line[:, 0] - first_joint_mm + 750) % 1500 - 750
        in_view = np.abs(line[:, 1]).max() < high_mm and line[:, 0].min() > SEAM_MM
        if in_view and np.abs(to_joint).min() > SEAM_MM:
            return np.asarray(line)
    return None


def _draw_gap(
    sheet: _Image, line_mm: Matrix, width_mm: float, layout: Layout, reflectance: float
) -> None:
    """Draw a gap with edges of one texel."""
    points = (line_mm - [0.0, layout.arc_from_mm]) / TEXEL_MM - 0.5
    low = np.maximum(points.min(axis=0) - 40, 0).astype(int)
    high = points.max(axis=0).astype(int) + 40
    window = sheet[low[1] : high[1], low[0] : high[0]]
    bare = np.ones(window.shape, np.uint8)
    fixed = np.rint((points - low) * 16).astype(np.int32)
    cv2.polylines(bare, [fixed], False, 0, 1, cv2.LINE_8, 4)
    away = cv2.distanceTransform(bare, cv2.DIST_L2, 5)
    share = np.clip(width_mm / 2 / TEXEL_MM - away + 0.5, 0, 1)
    window *= 1 - share
    window += share * np.float32(reflectance)


def _recorded(
    sheet: _Image, layout: Layout, rng: np.random.Generator, *, is_ring: bool
) -> tuple[_Image, _Image]:
    """The wall as a run would paint it, (H, W, 3), and the weight of each place."""
    size_wh = (TILES * layout.width_px, layout.height_px)
    blur = rng.uniform(0.4, 0.9) * layout.mm_per_px / TEXEL_MM
    grey = cv2.resize(cv2.GaussianBlur(sheet, (0, 0), blur), size_wh, interpolation=cv2.INTER_AREA)

    def clouds(cell_px: float) -> _Image:
        few = (round(size_wh[1] / cell_px) + 2, round(size_wh[0] / cell_px) + 2)
        coarse = rng.standard_normal(few).astype(np.float32)
        return np.asarray(cv2.resize(coarse, size_wh, interpolation=cv2.INTER_CUBIC), np.float32)

    light = np.exp(rng.uniform(0.0, 0.1) * clouds(120) + rng.uniform(0.0, 0.05) * clouds(300))
    streaks = rng.standard_normal((size_wh[1], 1)).astype(np.float32)
    row = np.arange(size_wh[1], dtype=np.float32)[:, None]
    from_edge = np.minimum(row, size_wh[1] - 1 - row)
    light *= np.exp(rng.uniform(0, 0.02) * cv2.GaussianBlur(streaks, (0, 0), 3.0))
    if is_ring:  # the light is the same on both sides of the seam
        light = light ** np.clip(from_edge / 60, 0, 1)
    grey = grey * (WALL_GREY / MEAN_REFLECTANCE) * light
    grey += rng.uniform(0.5, 4.0) * cv2.GaussianBlur(
        rng.standard_normal(grey.shape).astype(np.float32), (0, 0), 0.6
    )
    tint = 1 + rng.uniform(-0.25, 0.25, 3) * rng.integers(0, 2)
    edge = 10 + 6 * cv2.resize(
        rng.standard_normal((1, 12)).astype(np.float32),
        (size_wh[0], 1),
        interpolation=cv2.INTER_CUBIC,
    )
    row = np.arange(size_wh[1], dtype=np.float32)[:, None]
    from_edge = np.minimum(row, size_wh[1] - 1 - row) - edge
    weight = np.clip(from_edge / 12, 0, 1) if rng.random() < 0.7 else np.ones_like(from_edge)
    picture = np.where(weight[..., None] > 0, grey[..., None] * tint, UNSEEN_GREY)
    return picture.astype(np.float32), weight.astype(np.float32)


def _coded(picture: _Image, weight: _Image, index: int) -> Tile:
    """A tile after the coding in which it is stored."""
    pixels = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
    _, jpeg = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 85])
    return Tile(index, np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), np.uint8), weight)
