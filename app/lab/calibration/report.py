"""Draws the data behind a calibration."""

from __future__ import annotations

from pathlib import Path

from app.lab.calibration.fitting import Calibration


def plot(calibration: Calibration, file: Path) -> None:
    """Draw where the boards were in the picture, and the residual of each picture.

    Args:
        calibration: The result to draw.
        file: Where the picture goes; its suffix decides the format (.png, .pdf, .svg).
    """
    # matplotlib is imported only for plots.
    from matplotlib.figure import Figure

    camera, fits = calibration.camera, calibration.fits
    figure = Figure(figsize=(13, max(5.5, 0.2 * len(fits))), layout="constrained")
    picture, bars = figure.subplots(1, 2, width_ratios=[1.4, 1])
    extent = (-0.5, camera.width - 0.5, camera.height - 0.5, -0.5)
    picture.imshow(calibration.covered, cmap="Greens", vmin=0, vmax=2, extent=extent)
    for fit in fits:
        picture.plot(*fit.view.corners_px.T, ".", ms=3)
    picture.plot(camera.cx, camera.cy, "k+", ms=12)
    picture.set(
        title=f"Corners seen: {calibration.covered.mean():.0%} of the picture covered (green)",
        xlabel="u (px)",
        ylabel="v (px)",
    )
    bars.barh([fit.view.name for fit in fits], [fit.rms_px for fit in fits], color="tab:blue")
    bars.axvline(calibration.rms_px, color="k", ls="--", lw=1)
    bars.invert_yaxis()
    bars.set(title=f"Residual, {calibration.rms_px:.3f} px over all", xlabel="rms (px)")
    figure.savefig(file, dpi=110)
