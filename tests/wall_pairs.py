"""Surveys of one rendered culvert by different rigs, and the walls that they unroll."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi

import cv2
import numpy as np

from app.jobs.track.onlooker import wall_tile
from app.lab.simulation.render import RenderedFrame, render
from app.lab.simulation.scenario import Scenario
from app.lab.simulation.variants import NOMINAL, paper_rig
from app.lab.simulation.wall import Wall as Surface
from app.lab.simulation.wall import make_wall
from vo_core import Estimate, Odometry, Rig
from vo_core.alignment.raster import Wall
from vo_core.mosaic.mosaic import Mosaic

LENS = {"width": 320, "height": 240, "fx": 597.0, "fy": 597.0, "cx": 159.5, "cy": 119.5}
WIDER = {"width": 352, "height": 288, "fx": 420.0, "fy": 420.0, "cx": 175.5, "cy": 143.5}
FISHEYE = {"model": "fisheye", "width": 320, "height": 240, "fx": 105.0, "fy": 105.0,
           "cx": 159.5, "cy": 119.5}  # fmt: skip
RIGS: Mapping[str, Rig] = {
    "narrow": paper_rig(camera=LENS),
    "wider, lower": paper_rig(camera=WIDER, mount={"height_mm": 205.0}),
    "fisheye ahead": paper_rig(camera=FISHEYE, mount={"view": "forward", "height_mm": 150.0}),
}
TEXEL_MM = 0.4
_REACH_MM = 700.0
_LEVELS = 6


@dataclass(frozen=True)
class Survey:
    """One film's unrolled wall, with the true and the estimated way of its camera."""

    rig: Rig
    tiles: Mapping[int, bytes]
    """JPEG files, as the server keeps them."""
    wall: Wall
    true_mm: np.ndarray
    """True axial place of the camera in the culvert in each frame."""
    raw_mm: np.ndarray
    """Its place in the coordinates of the wall."""


def culvert(
    seed: int, length_mm: float, *, arc_mm: float = 130.0, contrast: float = 1.0
) -> Surface:
    """Draw the wall of a culvert, `arc_mm` to either side of the invert or all of it."""
    scenario = replace(NOMINAL, seed=seed)
    half_mm = min(arc_mm, 150 * pi)
    return make_wall(
        scenario,
        x_range_mm=(-_REACH_MM, length_mm + _REACH_MM),
        arc_range_mm=(-half_mm, half_mm),
        texel_mm=TEXEL_MM,
    )


def dirtied(surface: Surface, seed: int, share: float) -> Surface:
    """Cover a share of the wall with dirt that shows nothing of it."""
    rng = np.random.default_rng([seed, 20])
    base = surface.levels[0]
    rows, columns = base.shape
    cells = (int(columns * surface.texel_x_mm / 35) + 3, int(rows * surface.texel_arc_mm / 35) + 3)
    noise = cv2.resize(rng.standard_normal(cells[::-1]).astype(np.float32), base.shape[::-1],
                       interpolation=cv2.INTER_CUBIC)  # fmt: skip
    edge = np.quantile(noise[::9, ::9], 1 - share)
    cover = 1 / (1 + np.exp(-np.clip((noise - edge) * 12, -30, 30)))
    fine = rng.standard_normal(base.shape, dtype=np.float32)
    mud = 0.33 + 0.03 * cv2.GaussianBlur(fine, (0, 0), 3 / surface.texel_x_mm) * 8
    return _rebuilt(surface, (base * (1 - cover) + mud * cover).astype(np.float32))


def turned(surface: Surface, length_mm: float) -> Surface:
    """The culvert of this length as it lies before a camera that comes from the other end."""
    base = np.ascontiguousarray(surface.levels[0][::-1, ::-1])
    end_mm = surface.x0_mm + (base.shape[1] - 1) * surface.texel_x_mm
    arc_end_mm = surface.arc0_mm + (base.shape[0] - 1) * surface.texel_arc_mm
    return replace(_rebuilt(surface, base), x0_mm=length_mm - end_mm, arc0_mm=-arc_end_mm)


def _rebuilt(surface: Surface, base: np.ndarray) -> Surface:
    levels = [base]
    while len(levels) < _LEVELS:
        levels.append(np.asarray(cv2.pyrDown(levels[-1]), np.float32))
    return replace(surface, levels=tuple(levels))


def scenario(rig: Rig, length_mm: float, **changes: object) -> Scenario:
    """One drive, at a frame rate at which neighbouring frames still overlap well."""
    return replace(NOMINAL, rig=rig, length_mm=length_mm, **changes)


def survey(film: Scenario, surface: Surface, *, start_mm: float = 0.0, is_tracked: bool = False,
           drift: float = 0.0, wave_mm: float = 0.0) -> Survey:  # fmt: skip
    """Drive along a wall from a place of the culvert, and unroll it.

    Args:
        film: The drive.
        surface: The wall.
        start_mm: Where it starts in the culvert.
        is_tracked: Whether the film is tracked; otherwise poses are the true ones but for
        drift: the relative error of the scale, and
        wave_mm: an error of the distance that comes and goes over 1.7 m.
    """
    moved = replace(surface, x0_mm=surface.x0_mm - start_mm)
    mosaic, tiles = Mosaic(film.rig), {}
    odometry = Odometry(film.rig) if is_tracked else None
    true_mm, raw_mm = [], []
    for frame in render(film, moved):
        estimate = _true(frame, drift, wave_mm)
        if odometry is not None:
            estimate = odometry.step(frame.image, frame.t_s)
            estimate = odometry.initial_pose.added_to(estimate)
        true_mm.append(frame.x_mm + start_mm)
        raw_mm.append(estimate.distance_mm)
        if mosaic.wants(estimate):
            mosaic.add(cv2.cvtColor(frame.image, cv2.COLOR_GRAY2BGR), estimate)
        tiles |= {tile.index: tile.picture for tile in mosaic.left()}
    tiles |= {tile.index: tile.picture for tile in mosaic.finish()}
    files = {index: wall_tile(index, picture).content for index, picture in tiles.items()}
    return Survey(film.rig, files, wall_of(film.rig, files), np.array(true_mm), np.array(raw_mm))


def wall_of(rig: Rig, tiles: Mapping[int, bytes]) -> Wall:
    """The unrolled wall as the server reads it."""
    from vo_core.mosaic.layout import Layout

    def read(index: int) -> np.ndarray | None:
        jpeg = tiles.get(index)
        return (
            None if jpeg is None else cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        )

    radius_mm = rig.pipe.radius_mm
    girth_mm = None if radius_mm is None else 2 * pi * radius_mm
    return Wall(Layout.of(rig), girth_mm, range(min(tiles), max(tiles) + 1), read)


def _true(frame: RenderedFrame, drift: float, wave_mm: float) -> Estimate:
    x_mm = frame.x_mm * (1 + drift) + wave_mm * np.sin(2 * pi * frame.x_mm / 1700)
    return Estimate(
        frame.index, frame.t_s, x_mm, frame.y_mm, frame.yaw_deg, x_mm, 0.0, 1.0, "ok", 0.0,
        z_mm=frame.z_mm, pitch_deg=frame.pitch_deg, roll_deg=frame.roll_deg,
    )  # fmt: skip
