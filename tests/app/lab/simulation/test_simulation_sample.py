"""The sample inspection: its defects are where its tags say."""

from dataclasses import replace

import numpy as np
import pytest

from app.lab.simulation import render
from app.lab.simulation.motion import Trajectory
from app.lab.simulation.sample import SAMPLE, tags
from vo_core import wall_point

SHORT = replace(SAMPLE.shortened(800), frames_per_s=5)


@pytest.fixture(scope="module")
def pair():
    """The frame of the first tag, with the defects and without."""
    frame = tags(SHORT)[0].frame
    return [
        next(picture.image for picture in render(scenario) if picture.index == frame)
        for scenario in (SHORT, replace(SHORT, defects=()))
    ]


def test_each_tag_points_at_the_centre_of_its_defect():
    found = []
    for tag in tags(SAMPLE):
        pose = Trajectory(SAMPLE).pose(tag.frame / SAMPLE.frames_per_s)
        point = wall_point(SAMPLE.rig, tag.pixel, pose)
        found.append((round(point.distance_mm), round(point.arc_mm)))
    assert found == [(750, 70), (1500, -85), (3000, 100)]


def test_a_shorter_sample_has_the_tags_that_its_camera_comes_to():
    assert [tag.code for tag in tags(SHORT)] == ["BAB"]
    assert tags(SAMPLE.shortened(60)) == []


def test_a_defect_is_seen_where_its_tag_points_and_nowhere_far_away(pair):
    drawn, bare = (image.astype(int) for image in pair)
    u, v = (round(value) for value in tags(SHORT)[0].pixel)
    assert (drawn[v - 4 : v + 5, u] - bare[v - 4 : v + 5, u]).min() < -30
    np.testing.assert_array_equal(drawn[:200, :500], bare[:200, :500])
