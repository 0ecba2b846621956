"""The prior of the motion beside the way: learnt from the drive, and never surer than its proof."""

import numpy as np
import pytest
from textures import make_rig

from vo_core.geometry.motion_prior import MotionPrior
from vo_core.geometry.wall import Pose

CERTAIN, HARDLY_SEEN = 1e-6 * np.eye(12), np.diag([25.0, 25.0, 0.01, 25.0, 0.01, 0.01] * 2)


def driven(rig, yaw_deg, covariance, steps=200):
    """Standard deviation of the heading over 300 mm, degrees, after steps of 60 mm."""
    prior, noise = MotionPrior(rig), np.random.default_rng(5)
    yaw_rad = np.radians(yaw_deg * noise.normal(size=steps))
    before = Pose()
    for n in range(steps):
        now = Pose(60.0 * (n + 1), 0.0, float(yaw_rad[n]))
        prior.learn(before, now, covariance)
        before = now
    return float(np.degrees(np.sqrt(prior.steps[1, 1])))


def test_a_robot_that_turns_more_has_a_wider_prior():
    rig = make_rig()
    assert driven(rig, 3.0, CERTAIN) > 2 * driven(rig, 1.0, CERTAIN)


def test_a_straight_drive_narrows_the_prior_but_never_to_nothing():
    assert 1.0 < driven(make_rig(), 0.0, CERTAIN) < 2.0


def test_steps_that_the_pictures_hardly_show_teach_nothing():
    """The square of an unseen step is its variance, so the prior does not collapse."""
    assert driven(make_rig(), 0.0, HARDLY_SEEN) > 2.5


@pytest.mark.parametrize("z_mm", [1.0, 5.0])
def test_a_height_that_stays_wrong_is_no_swinging_on_springs(z_mm):
    prior = MotionPrior(make_rig())
    for n in range(200):
        prior.learn(Pose(60.0 * n, z_mm=z_mm), Pose(60.0 * n + 60.0, z_mm=z_mm), CERTAIN)
    assert np.sqrt(prior.steps[2, 2]) < 0.2 * z_mm


def test_a_climb_takes_the_camera_about_the_axis_of_the_pipe():
    prior = MotionPrior(make_rig(mount={"height_mm": 230.0}))
    assert prior.mean(Pose(roll_rad=0.1))[3] == pytest.approx(80.0 * (1 - np.cos(0.1)))
    assert np.all(
        MotionPrior(make_rig(pipe={"shape": "flat", "diameter_mm": None})).mean(Pose(roll_rad=0.1))
        == 0
    )
