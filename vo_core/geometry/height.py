"""What the height of the camera, or its focal length, has to do with the scale of a track.

Let the rig state a height that is wrong by a factor 1 + e.  How far is one factor right for a
track?  Measured on rendered runs of 6 m with e = 3 %:
- Over a flat floor x, y and distance are wrong by 1 + e exactly, and yaw is right.
- In a circular pipe the depth of the wall beside the invert changes less than the height.  The
  distance is wrong by one factor all along still (what scaling leaves is below 0.05 mm at 30
  degrees of view and 0.3 mm with a fisheye), but by one nearer to 1: see `reading`.
- There y is shown by the shear that an offset from the axis gives when driving on, whatever the
  height.  Scaled with the rest it becomes wrong by e y: less than 0.5 mm on 14 mm of sway.
- A camera that looks along the pipe measures by the diameter; its height hardly matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vo_core.errors import InvalidRig
from vo_core.geometry.rectify import Rectifier, developed
from vo_core.geometry.wall import (
    NOMINAL,
    Pose,
    cast,
    enclose,
    robot_pixels,
    robot_rays,
    sight,
)
from vo_core.rig import Rig
from vo_core.types import Matrix

LEAST_INFLUENCE = 0.2
"""Relative change of the distance over that of the height, below which no height is derived."""

_SMALL = 1e-3
"""Relative change by which derivatives are taken."""


@dataclass(frozen=True)
class Height:
    """The height that the rig should have had."""

    height_mm: float
    sigma_mm: float


def implied_height(rig: Rig, scale: float, sigma: float) -> Height | None:
    """The height that explains a scale, if all else in the rig is right; with its uncertainty.

    None where the height hardly matters (a camera that looks along the pipe), and where no rig may
    have it, as it would be outside the pipe.
    """
    height_mm, pixels = rig.mount.height_mm, _patch_pixels(rig)
    for _ in range(8):  # Newton's method; the reading is close to a power of the height
        truth = _with_height(rig, height_mm)
        read = _mean_reading(rig, truth, pixels)
        higher = _mean_reading(rig, _with_height(rig, height_mm * (1 + _SMALL)), pixels)
        power = _power(read, higher)
        if not abs(power) > LEAST_INFLUENCE:  # nor when it is nan
            return None
        height_mm *= float(np.exp(-np.log(scale * read) / power))
    try:
        truth = Rig.parse(_with_height(rig, height_mm).model_dump())
    except InvalidRig:
        return None
    # Where a wide view does not read evenly, the measurement need not weigh it as the mean does.
    uneven = np.nanstd(_readings(rig, truth, pixels))
    return Height(height_mm, float(np.hypot(sigma / scale, uneven) * height_mm / abs(power)))


@dataclass(frozen=True)
class ScaleEffects:
    """Relative errors of the distance by one standard uncertainty of what the rig states, signed.

    Positive where the track of a rig that states too much reads too long.
    """

    height: float
    focal: float
    diameter: float
    tilt: float
    """Pitch and roll of the mount together, not below 0."""

    @property
    def sigma(self) -> float:
        """All of them, added in quadrature."""
        return float(np.linalg.norm([self.height, self.focal, self.diameter, self.tilt]))


def scale_effects(rig: Rig) -> ScaleEffects:
    """What each tolerance of the rig does to the distance.

    The lengths by their derivatives; a tilt of the mount has none where the camera looks straight
    down, so it is tried to either side.
    """
    tolerance, pixels = rig.tolerance, _patch_pixels(rig)
    camera, mount, pipe = rig.camera, rig.mount, rig.pipe
    read = _mean_reading(rig, rig, pixels)

    def effect(truth: Rig) -> float:
        return float(np.log(_mean_reading(rig, truth, pixels) / read))

    def share(truth: Rig, relative: float) -> float:
        """Of a relative uncertainty, by a rig whose true value is larger by `_SMALL`."""
        return -effect(truth) * relative / _SMALL

    longer = {"fx": camera.fx * (1 + _SMALL), "fy": camera.fy * (1 + _SMALL)}
    focal = rig.model_copy(update={"camera": camera.model_copy(update=longer)})
    diameter = 0.0
    if pipe.diameter_mm is not None:
        wider = pipe.model_copy(update={"diameter_mm": pipe.diameter_mm * (1 + _SMALL)})
        diameter = share(
            rig.model_copy(update={"pipe": wider}), tolerance.diameter_mm / pipe.diameter_mm
        )
    tilts = []
    for name in ("pitch_deg", "roll_deg"):
        sides = (getattr(mount, name) + side * tolerance.tilt_deg for side in (-1, 1))
        tilted = (
            rig.model_copy(update={"mount": mount.model_copy(update={name: tilt})})
            for tilt in sides
        )
        tilts.append(max(map(effect, tilted), key=abs))
    return ScaleEffects(
        height=share(
            _with_height(rig, mount.height_mm * (1 + _SMALL)),
            tolerance.height_mm / mount.height_mm,
        ),
        focal=share(focal, tolerance.focal_percent / 100),
        diameter=diameter,
        tilt=float(np.linalg.norm(tilts)),
    )


def scale_sigma(rig: Rig) -> float:
    """Relative standard uncertainty of the distance by the rig's tolerances."""
    return scale_effects(rig).sigma


def reading(rig: Rig, truth: Rig) -> float:
    """What a track made with `rig` reads for each millimetre that a camera of `truth` drives.

    The mean over the wall on which motion is measured; in a pipe not all of it moves alike.
    Tracks of rendered pipes with the height wrong by 3 % read the same to 0.0002 at 30 degrees of
    view; with a fisheye in the axis 2.5 % instead of 1.7 %, as the invert counts for more.
    """
    return _mean_reading(rig, truth, _patch_pixels(rig))


def _mean_reading(rig: Rig, truth: Rig, pixels: Matrix) -> float:
    return float(np.nanmean(_readings(rig, truth, pixels)))


def _patch_pixels(rig: Rig) -> Matrix:
    """(N, 2) where the rig sees points of its patch; that takes longer than all the rest here."""
    rectifier = Rectifier(rig)
    row, column = np.nonzero(rectifier.valid[::8, ::8])
    patch_mm = rectifier.grid.to_mm(8.0 * np.column_stack([column, row]).astype(np.float64))
    return robot_pixels(rig, sight(rig, NOMINAL, enclose(rig, patch_mm)))


def _readings(rig: Rig, truth: Rig, pixels: Matrix) -> Matrix:
    """(N,) at points of the patch: the pixels of the true camera, taken to the wall by the rig."""
    wall = cast(truth, NOMINAL, robot_rays(truth, pixels))
    step_mm = _SMALL * truth.mount.height_mm
    behind, ahead = (
        developed(rig, robot_pixels(truth, sight(truth, at, wall)))[:, 0]
        for at in (Pose(-step_mm), Pose(step_mm))
    )
    return np.asarray((behind - ahead) / (2 * step_mm))


def _power(read: float, changed: float) -> float:
    """Relative change of a reading over the relative change, `_SMALL`, that makes `changed`."""
    return float(np.log(changed / read) / np.log1p(_SMALL))


def _with_height(rig: Rig, height_mm: float) -> Rig:
    mount = rig.mount.model_copy(update={"height_mm": height_mm})
    return rig.model_copy(update={"mount": mount})
