"""The advice on a rig as a table and as the paper's figures 2 to 4."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vo_core.advice import Advice, DisplacementField, Spread


def rows(advice: Advice) -> Iterator[tuple[str, str]]:
    """Name and value of every figure, for a table."""
    move, rate = advice.move, advice.frame_rate_hz
    yield "motion between two frames", f"{move.x_mm:g} mm forward, {move.y_mm:g} mm to the right"
    yield "displacement in the picture", _spread(advice.raw_px, "px")
    yield "paper's method, raw picture", "fit" if advice.is_even else "not fit: shifts differ"
    yield "displacement on the wall", _spread(advice.developed_mm, "mm")
    yield "- by the motion along the pipe", _spread(advice.developed_drive_mm, "mm")
    yield (
        "wall under a pixel",
        f"{advice.finest_mm_per_px:.3g} to {advice.coarsest_mm_per_px:.3g} mm, "
        f"measured at {advice.measured_mm_per_px:.3g} mm",
    )
    yield (
        "wall in the picture",
        f"{_extent(advice.axial_mm)} along, {_extent(advice.arc_mm)} around",
    )
    yield (
        "wall measured on",
        f"{advice.measured_axial_mm:.0f} x {advice.measured_arc_mm:.0f} mm, "
        f"{advice.measured_share:.0%} of the picture",
    )
    yield "common wall after the motion", f"{advice.overlap:.0%}"
    yield f"good speed, {rate:g} frames/s", f"up to {advice.good_speed_mm_s:.0f} mm/s"
    yield f"limit, {rate:g} frames/s", f"{advice.speed_limit_mm_s:.0f} mm/s"
    yield "camera 1 mm higher than stated", f"{advice.height_error_percent:+.2f} % of distance"


def _spread(spread: Spread, unit: str) -> str:
    return (
        f"{spread.smallest:.1f} to {spread.largest:.1f} {unit}, mean {spread.mean:.1f}, "
        f"spread {spread.relative:.1%}"
    )


def _extent(low_high: tuple[float, float]) -> str:
    return f"{low_high[0]:.0f} to {low_high[1]:.0f} mm"


def plot(field: DisplacementField, title: str, file: Path) -> None:
    """Draw the displacement field in the manner of the paper's figures 2, 3 and 4.

    On the left are the wall points with the displacement of their pixels; on the right are its two
    components around the pipe, one line for each axial position.

    Args:
        field: The displacement.
        title: Title of the figure.
        file: Where the picture goes; its suffix decides the format (.png, .pdf, .svg).
    """
    # matplotlib is imported only for plots.
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 6), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplot_mosaic([["wall", "u"], ["wall", "v"]], width_ratios=[1.35, 1])

    points, displacement = field.wall_mm[:, ::2], field.exact_px[:, ::2]
    arrows = axes["wall"].quiver(
        *np.moveaxis(points, -1, 0),
        *np.moveaxis(displacement, -1, 0),
        np.linalg.norm(displacement, axis=-1),
        angles="xy",
        width=0.002,
    )
    figure.colorbar(arrows, ax=axes["wall"], label="displacement (px)")
    axes["wall"].set(
        title="Points on the wall and the displacement (u, v) of their pixels",
        xlabel="along the pipe from the camera (mm)",
        ylabel="around the pipe from the invert, right positive (mm)",
    )

    columns = np.linspace(0, field.wall_mm.shape[1] - 1, 9).astype(int)
    for part, name in enumerate("uv"):
        for colour, column in zip(
            colormaps["viridis"](columns / columns[-1]), columns, strict=True
        ):
            axial_mm, arc_mm = field.wall_mm[0, column, 0], field.wall_mm[:, column, 1]
            label = f"{round(axial_mm)} mm along"
            axes[name].plot(arc_mm, field.exact_px[:, column, part], color=colour, label=label)
            axes[name].plot(arc_mm, field.derivative_px[:, column, part], ".", ms=3, color=colour)
        axes[name].axhline(0, color="0.7", lw=1)  # 0 shows the scale of the unevenness
        axes[name].set(
            title=f"d{name}: exact (lines), total derivative (dots)",
            xlabel="around the pipe (mm)",
            ylabel=f"d{name} (px)",
        )
    handles, labels = axes["u"].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", fontsize="small")
    figure.savefig(file, dpi=110)
