"""Stated rigs drawn from the tolerances of the true one."""

from itertools import islice

import cv2
import numpy as np
import pytest

from app.lab.simulation import SCENARIOS, drawn_rigs, with_drawn_rig
from app.lab.simulation.camera import camera_rays
from vo_core import InvalidRig

TRUE = SCENARIOS["nominal"].rig


def test_drawn_rigs_scatter_around_the_true_one_as_its_tolerance_says():
    drawn = list(islice(drawn_rigs(TRUE, seed=1), 2000))
    tolerance = TRUE.tolerance
    for values, true, sigma in (
        ([rig.mount.height_mm for rig in drawn], 230, tolerance.height_mm),
        ([rig.mount.pitch_deg for rig in drawn], 0, tolerance.tilt_deg),
        ([rig.mount.roll_deg for rig in drawn], 0, tolerance.tilt_deg),
        ([rig.camera.fx for rig in drawn], 1194, 11.94 * tolerance.focal_percent),
        ([rig.pipe.diameter_mm for rig in drawn], 300, tolerance.diameter_mm),
        ([rig.pipe.segment_length_mm for rig in drawn], 1500, tolerance.segment_length_mm),
    ):
        assert np.mean(values) == pytest.approx(true, abs=sigma / 10)
        assert np.std(values) == pytest.approx(sigma, rel=0.1)
    assert all(rig.camera.fx == rig.camera.fy for rig in drawn)
    assert {rig.tolerance for rig in drawn} == {tolerance}


def test_equal_seeds_draw_equal_rigs():
    first, second, other = (list(islice(drawn_rigs(TRUE, seed), 3)) for seed in (1, 1, 2))
    assert first == second
    assert first != other


def test_floor_has_no_diameter_and_a_camera_near_the_wall_stays_in_its_pipe():
    floor = next(drawn_rigs(SCENARIOS["tiled_floor"].rig, seed=1))
    assert floor.pipe.diameter_mm is None
    low = TRUE.model_copy(update={"mount": TRUE.mount.model_copy(update={"height_mm": 1.0})})
    assert all(rig.mount.height_mm > 0 for rig in islice(drawn_rigs(low, seed=1), 50))


CROOKED = SCENARIOS["forward_crooked"]
STREAM = SCENARIOS["forward_stream"]


def test_drawn_crew_cameras_differ_within_what_crews_have():
    drawn = [with_drawn_rig(CROOKED, seed) for seed in range(1, 201)]
    rigs = [scenario.rendered_rig for scenario in drawn]
    focal_px = np.array([rig.camera.fx for rig in rigs])
    off_mm = [np.hypot(rig.mount.lateral_mm, rig.mount.height_mm - 150) for rig in rigs]
    tilt_deg = [np.hypot(one.rendered_rig.mount.pitch_deg, one.aside_deg) for one in drawn]
    for values, low, high in (
        (focal_px, 300, 700),
        (off_mm, 5, 30),
        (tilt_deg, 1, 5),
    ):
        assert low <= min(values) < low + 0.1 * (high - low)
        assert max(values) <= high
    assert len({one.seed for one in drawn}) == len(drawn)


def test_only_lens_is_stated_where_the_scenario_hides_its_mount():
    crooked, stream = with_drawn_rig(CROOKED, 3), with_drawn_rig(STREAM, 3)
    assert crooked.rig.mount == CROOKED.rig.mount
    assert crooked.rig.camera == crooked.rendered_rig.camera != CROOKED.rig.camera
    assert crooked.is_stated_wrong
    assert stream.rig == stream.rendered_rig
    assert stream.aside_deg == 0
    assert not stream.is_stated_wrong


def test_equal_seeds_draw_equal_scenarios_and_other_names_others():
    assert with_drawn_rig(STREAM, 1) == with_drawn_rig(STREAM, 1)
    rigs = [with_drawn_rig(one, seed).rig.camera.fx for one in (CROOKED, STREAM) for seed in (1, 2)]
    assert len(set(rigs)) == 4


def test_drawn_lens_shows_each_pixel_once():
    for seed in range(1, 31):
        camera = with_drawn_rig(STREAM, seed).rig.camera
        rays = camera_rays(camera)[::20, ::20].reshape(-1, 1, 3)
        still = np.zeros(3)
        seen, _ = cv2.projectPoints(rays, still, still, camera.matrix, np.array(camera.distortion))
        v, u = np.mgrid[0:480:20, 0:640:20]
        np.testing.assert_allclose(seen.reshape(-1, 2), np.c_[u.ravel(), v.ravel()], atol=0.01)


def test_lens_and_mount_are_drawn_for_a_forward_pinhole_only():
    for name in ("nominal", "forward_wide"):
        with pytest.raises(InvalidRig, match="pinhole that looks forward"):
            with_drawn_rig(SCENARIOS[name], 1)
