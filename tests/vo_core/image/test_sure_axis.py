"""The axis is proposed only where it is certain."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from app.lab.simulation import SCENARIOS
from app.lab.simulation.render import render
from vo_core.geometry.wall import robot_pixels
from vo_core.image.axis import AxisFinder
from vo_core.image.sure_axis import SureAxis


def first_picture(name: str) -> np.ndarray:
    (frame,) = islice(render(replace(SCENARIOS[name], length_mm=20.0)), 1)
    return np.rint(16 + frame.image * (219 / 255)).astype(np.uint8)  # as a film has it


def find(image: np.ndarray) -> SureAxis:
    return SureAxis((image.shape[1], image.shape[0]))


@pytest.mark.parametrize("name", ["forward", "forward_crooked"])
def test_it_lies_within_the_stated_interval(name: str) -> None:
    image = first_picture(name)
    axis = find(image)(image)
    assert axis is not None
    rig = SCENARIOS[name].rendered_rig
    aside_rad = np.radians(SCENARIOS[name].aside_deg)
    ahead = np.array([[np.cos(aside_rad), -np.sin(aside_rad), 0.0]])
    ((u, v),) = robot_pixels(rig, ahead).tolist()
    assert np.hypot(axis.pixel_uv[0] - u, axis.pixel_uv[1] - v) < 2.45 * axis.sigma_px
    assert axis.sigma_px < 0.03 * image.shape[1]


@pytest.mark.parametrize("name", ["weak_spot_light", "mist", "dirty_lens"])
def test_a_place_that_only_seems_to_be_the_axis_is_not_proposed(name: str) -> None:
    image = first_picture(name)
    assert find(image)(image) is None


def test_the_search_alone_is_sure_of_the_light_of_a_lamp() -> None:
    image = first_picture("weak_spot_light")
    assert AxisFinder((image.shape[1], image.shape[0]))(image) is not None
