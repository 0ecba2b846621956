"""Stated rigs drawn from the tolerances of the true one."""

from itertools import islice

import numpy as np
import pytest

from app.lab.simulation import SCENARIOS, drawn_rigs

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
