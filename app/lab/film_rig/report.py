"""Draws the wall's grid, as the rig found sees it, on the film."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.lab.film_rig.bundle import Bundle
from app.lab.film_rig.calibrate import FilmRig
from vo_core.geometry.grid import grid
from vo_core.geometry.wall import Pose

PLACES = 5
"""Number of places in the film that are drawn."""

RINGS_RADII = (1, 2, 3, 4, 6, 8)
"""Axial distances of the rings from the camera: far ones show whether the axis is right."""


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
        wall = grid(bundle.scene.rig(bundle.camera), Pose.of(pose), rings_radii=RINGS_RADII)
        for radii, uv in zip(RINGS_RADII, wall.rings_uv, strict=True):
            plot_at.plot(*uv.T, lw=1.0, color="tab:orange")
            top = uv[len(uv) // 2]
            if np.isfinite(top).all() and 0 <= top[0] < width and 0 <= top[1] < height:
                plot_at.text(*top, f"{radii}R", color="tab:orange", fontsize=8, clip_on=True)
        for uv in wall.generators_uv:
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
