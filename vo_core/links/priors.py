"""What is known of the parameters of an alignment before it: reference, motion, rates, coding."""

from __future__ import annotations

import numpy as np

from vo_core.geometry.motion import (
    MOUNT,
    MOVING,
    OF_REFERENCE,
    PARAMETERS,
    POSE,
    RATES,
    REFERENCE,
    CodedMotion,
    RollingMotion,
    WallMotion,
    relief_modes,
    ring_modes,
    shear_mode,
)
from vo_core.geometry.rectify import PatchGrid
from vo_core.geometry.wall import Points, Pose
from vo_core.links.fix import Outlook
from vo_core.links.picture import Reference
from vo_core.matching.align import START_PX, Prior, Unknowns, inverse
from vo_core.rig import Rig
from vo_core.state import RATE_SIGMA
from vo_core.types import Matrix

ASIDE_ANYWHERE = 0.15
"""Distance of a camera that looks ahead from where the rig states it, one sigma, as a share of the
diameter."""

CODING_PX = 0.15
"""Displacement by coding, px of the patch, one sigma, where the camera looks along the pipe.

From one picture to the next the wall moves by a pixel or two, and coding would place the camera
tens of millimetres beside the axis, with a small uncertainty."""

RELIEF_PX = 1.0
"""Way, px of the patch, over which the relief of a corrugated wall shows even at a standstill: the
start of an alignment may be wrong by as much."""

_GAZE = [MOVING.start + 2, MOVING.start + 4]
_BY_GAZE = np.zeros((2, PARAMETERS))
_BY_GAZE[[0, 1, 1], [*_GAZE, MOUNT.start]] = 1.0


class Priors:
    """States the unknowns of each alignment of one rig; it keeps no state between them."""

    def __init__(self, rig: Rig, grid: PatchGrid, nodes_px: Points) -> None:
        self._has_rolling_shutter = rig.camera.readout_ms > 0
        self._mm_per_px = grid.mm_per_px
        self._relief_modes = relief_modes(rig, grid.to_mm(nodes_px))
        self._looks_along_pipe = rig.looks_along_pipe
        self._aside_mm = np.inf
        self._coding_modes = shear_mode(nodes_px)
        if rig.looks_along_pipe:
            self._aside_mm = ASIDE_ANYWHERE * (rig.pipe.diameter_mm or np.inf)
            self._coding_modes = ring_modes(rig, grid, nodes_px)

    def unknowns(
        self, motion: WallMotion, reference: Reference, start: Pose, outlook: Outlook
    ) -> Unknowns:
        """The parameters of an alignment that starts from a pose, and their priors."""
        parameters = reference.parameters(start)
        reach_mm = START_PX * self._mm_per_px
        if outlook.is_around:
            reach_mm = 0.3  # way of a robot that stands, one sigma
        exact: WallMotion | RollingMotion = motion
        unknowns = Unknowns(
            exact,
            parameters,
            motion.scales,
            self._known(reference, parameters, outlook),
            self._usual(reference, start, parameters, outlook, reach_mm),
        )
        if self._has_rolling_shutter:
            rates = outlook.rate_at(start) if outlook.rate is None else outlook.rate
            before = reference.state.rate
            information = np.zeros((2 * RATES, 2 * RATES))
            information[:RATES, :RATES] = np.diag(1 / np.square(RATE_SIGMA))
            information[RATES:, RATES:] = before.information
            prior = Prior(np.append(rates, before.mean), information)
            scales = np.append(RATE_SIGMA, RATE_SIGMA)
            exact = RollingMotion(motion)
            unknowns = unknowns.with_further(exact, prior, scales)
        modes, sigma = self._modes(outlook, abs(start.x_mm - reference.pose.x_mm))
        if len(sigma) > 0:
            coded = CodedMotion(exact, modes)
            prior = Prior(np.zeros(len(sigma)), np.diag(sigma**-2))
            unknowns = unknowns.with_further(coded, prior, coded.scales)
        return unknowns

    def _known(self, reference: Reference, parameters: Matrix, outlook: Outlook) -> Prior:
        """Prior of the reference pose and the mount, and of the gaze: pitch is pose and mount."""
        information = np.zeros((PARAMETERS, PARAMETERS))
        information[np.ix_(OF_REFERENCE, OF_REFERENCE)] = reference.information
        mean = parameters.copy()
        if np.isfinite(self._aside_mm):
            mean[[1, 3]] = 0.0
            information[[1, 3], [1, 3]] += self._aside_mm**-2
        if outlook.gaze is not None:
            mean[_GAZE] = outlook.gaze - (0.0, mean[MOUNT][0])
            information += _BY_GAZE.T @ _BY_GAZE / outlook.gaze_rad**2
        return Prior(mean, information)

    def _usual(
        self,
        reference: Reference,
        start: Pose,
        parameters: Matrix,
        outlook: Outlook,
        reach_mm: float,
    ) -> Prior:
        """Prior of the step from the reference to the picture, see `MotionPrior`.

        Along the pipe the standard deviation is `reach_mm`.
        """
        motion, way_mm = outlook.motion, start.x_mm - reference.pose.x_mm
        kept = motion.kept(way_mm)
        follows = np.zeros((POSE, PARAMETERS))
        follows[:, MOVING], follows[:, REFERENCE] = np.eye(POSE), -np.diag(kept)
        mean = parameters.copy()
        before = parameters[REFERENCE] - motion.mean(reference.pose)
        mean[MOVING] = motion.mean(start) + kept * before
        mean[0] = start.x_mm
        weight = np.zeros((POSE, POSE))
        weight[0, 0] = reach_mm**-2
        weight[1:, 1:] = inverse(motion.covariance(way_mm))
        return Prior(mean, follows.T @ weight @ follows)

    def _modes(self, outlook: Outlook, way_mm: float) -> tuple[Matrix, Matrix]:
        """(k, 2, N) displacements that are no motion, and (k,) sigmas of their parameters.

        They are those by the relief over a way, and those by coding.
        """
        way_px = way_mm / self._mm_per_px
        relief_sigma = np.full(len(self._relief_modes), way_px + RELIEF_PX)
        coding = CODING_PX if self._looks_along_pipe else outlook.shear_rad
        if coding <= 0:
            return self._relief_modes, relief_sigma
        sigma = np.append(relief_sigma, np.full(len(self._coding_modes), coding))
        return np.concatenate([self._relief_modes, self._coding_modes]), sigma
