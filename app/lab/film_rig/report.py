"""Draws the wall's grid, as the rig found sees it, on the film."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.lab.film_rig.bundle import Bundle
from app.lab.film_rig.calibrate import FilmRig
from vo_core.geometry.wall import Pose, enclose, robot_pixels, sight
from vo_core.types import Matrix

PLACES = 5
"""Number of places in the film that are drawn."""

RINGS = (1, 2, 3, 4, 6, 8)
"""Axial distances of the rings from the camera, in radii."""

GENERATORS = 12
"""Straight lines along the pipe, one for each hour of the clock."""


def plot(found: FilmRig, file: Path) -> None:
    """Draw rings at 1, 2, 3 ... radii ahead and the generators on the film, at five places.

    Args:
        found: The result to draw.
        file: Where the picture goes; its suffix decides the format (.png, .pdf, .svg).
    """
    # matplotlib is imported only for plots.
    from matplotlib.figure import Figure

    bundle = found.bundle
    places = _places(bundle)
    width, height = bundle.scene.prior.size_wh
    figure = Figure(figsize=(15, 2 * 5.3 * height / width + 1.2), layout="constrained")
    axes = figure.subplots(2, 3).ravel()
    for plot_at in axes:
        plot_at.set_axis_off()
    for plot_at, (part, k) in zip(axes, places, strict=False):
        tracks = bundle.parts[part].tracks
        pose = bundle.scene.poses(bundle.camera, bundle.parts[part].views)[k]
        plot_at.imshow(tracks.images[k], cmap="gray", vmin=0, vmax=255)
        for radii, uv in _rings(bundle, pose):
            plot_at.plot(*uv.T, lw=1.0, color="tab:orange")
            top = uv[len(uv) // 2]
            if np.isfinite(top).all() and 0 <= top[0] < width and 0 <= top[1] < height:
                plot_at.text(*top, f"{radii}R", color="tab:orange", fontsize=8, clip_on=True)
        for uv in _generators(bundle, pose):
            plot_at.plot(*uv.T, lw=0.6, color="tab:cyan")
        seen = tracks.uv_px[tracks.keyframe == k]
        plot_at.plot(*seen.T, ".", ms=2, color="tab:green")
        plot_at.plot(bundle.camera.cx, bundle.camera.cy, "+", ms=10, color="white")
        plot_at.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
        plot_at.set_title(f"{tracks.t_s[k]:.1f} s", fontsize=9)
    rows = [f"{name}: {value}" for name, value in found.rows()]
    axes[-1].text(0, 1, "\n".join([*rows, "", *found.findings()]), va="top", fontsize=8, wrap=True)
    figure.suptitle("Rings of the wall ahead of the camera, in radii; points followed (green)")
    figure.savefig(file, dpi=110)


def _places(bundle: Bundle) -> list[tuple[int, int]]:
    """Part and keyframe of five places, spread over the film."""
    all_places = [
        (number, k) for number, part in enumerate(bundle.parts) for k in range(len(part.views))
    ]
    chosen = np.linspace(0, len(all_places) - 1, min(PLACES, len(all_places))).round().astype(int)
    return [all_places[i] for i in chosen]


def _rings(bundle: Bundle, pose: Matrix) -> list[tuple[int, Matrix]]:
    radius_mm = bundle.scene.radius_mm
    arc = np.linspace(-np.pi, np.pi, 181) * radius_mm + np.pi * radius_mm
    return [
        (radii, _pixels(bundle, pose, np.stack([np.full_like(arc, radii * radius_mm), arc], 1)))
        for radii in RINGS
    ]


def _generators(bundle: Bundle, pose: Matrix) -> list[Matrix]:
    radius_mm = bundle.scene.radius_mm
    ahead = radius_mm * np.geomspace(0.5, 12, 60)
    return [
        _pixels(bundle, pose, np.stack([ahead, np.full_like(ahead, turn * radius_mm)], 1))
        for turn in np.arange(GENERATORS) * 2 * np.pi / GENERATORS
    ]


def _pixels(bundle: Bundle, pose: Matrix, places_mm: Matrix) -> Matrix:
    """Pixels of wall points (axial from the camera, arc), mm; nan outside the lens."""
    rig = bundle.scene.rig(bundle.camera)
    here = Pose.of(np.concatenate([[0.0], pose[1:]]))
    return robot_pixels(rig, sight(rig, here, enclose(rig, places_mm)))
