"""The share of another exposure in a picture, by how the picture agrees with a reference."""

import numpy as np
import pytest

from vo_core.mixing import CLEAR, share_of_other

HALF = np.arange(100) < 50
NOISE = np.random.default_rng(0).normal(0.0, 0.03, 100)


def likeness(trust):
    return np.clip(trust * np.ones(100) + NOISE, 0, 1), float(np.mean(trust))


@pytest.mark.parametrize("share", [0.17, 0.33, 0.5])
def test_both_exposures_in_all_blocks_are_a_mixture(share):
    parts = np.array([1 - share, share]) / np.hypot(1 - share, share) * 0.97
    assert share_of_other(*map(likeness, parts), rho=0.0) == pytest.approx(share, abs=0.01)


def test_blocks_that_show_one_motion_each_are_no_mixture():
    wall, water = np.where(HALF, 0.95, 0.05), np.where(HALF, 0.05, 0.95)
    assert share_of_other(likeness(wall), likeness(water), rho=0.0) == 0


def test_a_wall_that_repeats_itself_is_no_mixture():
    assert share_of_other(likeness(0.95), likeness(0.93), rho=0.98) == 0


def test_what_coding_repeats_of_the_last_picture_is_no_clear_mixture():
    both = likeness(0.43), likeness(0.3)
    assert share_of_other(*both, rho=0.0) > 0.3
    assert share_of_other(*both, rho=0.0, least=CLEAR) == 0
