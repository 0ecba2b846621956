"""Joints before a camera that looks along the pipe and learns on the way where it stands in it."""

import numpy as np
import pytest
from worlds import FINER, WALL_SHAPE, World, small_rig, speckle, stored

from vo_core import Estimate
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.joints.finder import JointFinder

RIG = small_rig(mount={"view": "forward"})
STANDS = InitialPose(y_mm=12.0, yaw_deg=2.5)
JOINT_MM, KNOWN_MM = 300.0, 700.0
PERIOD_MM = WALL_SHAPE[1] * RIG.mount.height_mm / RIG.camera.fx / FINER
"""The wall, with its joint, repeats."""
SEEN_MM = [JOINT_MM + PERIOD_MM, JOINT_MM + 2 * PERIOD_MM]
"""The first one is too near to be seen as often as the others."""
WAY_MM = np.arange(0.0, 1100.0, 15.0)


def piped():
    """Pictures of a pipe with dark joints, from where the camera stands."""
    along_mm = np.arange(WALL_SHAPE[1]) / WALL_SHAPE[1] * PERIOD_MM
    wall = 0.4 * speckle(0) - 3.0 * (np.abs(along_mm - JOINT_MM) < 5)
    world = World(RIG, wall.astype(np.float32))
    return [stored(world.view(x, STANDS.y_mm, STANDS.yaw_deg), n) for n, x in enumerate(WAY_MM)]


def found(images, smoothed=None):
    """Sightings where the place of the camera in the pipe is known from `KNOWN_MM` on only."""
    finder = JointFinder(RIG)
    for n, (image, x_mm) in enumerate(zip(images, WAY_MM, strict=True)):
        pose = Estimate(n, n / 30, x_mm, 0.0, 0.0, x_mm, 0.1, 1.0, "ok", 0.1)
        initial_pose = STANDS if x_mm > KNOWN_MM else AS_STATED
        finder.add(image, pose, initial_pose=initial_pose, smoothed=smoothed)
    return [(WAY_MM[s.frame] + s.ahead_mm, s.sigma_mm) for s in finder.finish()]


@pytest.fixture(scope="module")
def images():
    return piped()


def test_rings_are_sharp_although_the_camera_learns_its_place_after_the_first(images):
    rings = found(images)
    assert [at for at, _ in rings] == pytest.approx(SEEN_MM, abs=1.0)
    assert max(sigma_mm for _, sigma_mm in rings) < 1.0


def test_the_first_frames_have_the_poses_that_all_of_them_show(images):
    aside = Estimate(0, 0.0, 0.0, 40.0, 6.0, 0.0, 0.1, 1.0, "ok", 0.1)
    rings = found(images, lambda: [aside] * len(WAY_MM))
    assert rings[0][0] != pytest.approx(SEEN_MM[0], abs=5.0)
