"""Waves along the pipe: recognised by the picture, doubted where the rig does not state them."""

import numpy as np
import pytest
from textures import make_rig, texture

from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.waves import Waves

RIG = make_rig()
GRID = Rectifier(RIG).grid
VALID = np.ones(GRID.shape, np.uint8)
PITCH_MM = 67.7
WAY_MM = np.arange(0.0, 2000.0, 10.0)
ROWS, COLUMNS = np.indices(GRID.shape)
TEXTURE = np.hstack([texture((GRID.shape[0], 6400), 3, finest_px=3.0)])


def crests(x_mm, helix=0.0):
    """Brightness of a corrugated wall, about 1, seen from a distance."""
    along_mm = GRID.axial_mm + COLUMNS * GRID.mm_per_px + x_mm
    return 1 + 0.1 * np.cos(2 * np.pi * (along_mm / PITCH_MM + helix * ROWS / GRID.shape[0]))


def concrete(x_mm):
    begin = round(x_mm / GRID.mm_per_px)
    return 1 + 0.05 * TEXTURE[:, begin : begin + GRID.shape[1]]


def driven(wall, rig=RIG, way_mm=WAY_MM):
    """Drive along a wall under a lamp; return what follows its waves, and the doubt on the way."""
    waves, doubt_mm = Waves(rig, GRID), []
    lamp = 80 * np.exp(-(((COLUMNS / GRID.shape[1] - 0.4) / 0.4) ** 2))
    for x_mm in way_mm:
        waves.take((lamp * wall(x_mm)).astype(np.float32), VALID, x_mm)
        doubt_mm.append(waves.doubt.mm)
    return waves, np.array(doubt_mm)


def corrugated(x_mm):
    return crests(x_mm) * concrete(x_mm)


def test_a_wall_of_waves_is_recognised_within_a_few_and_widens_the_interval():
    waves, doubt_mm = driven(corrugated)
    assert waves.wave is not None
    assert waves.wave.pitch_mm == pytest.approx(PITCH_MM, rel=0.01)
    # Waves of this pitch have some 13 mm: 2.8 % of the way to a wall 230 mm away.
    late = WAY_MM > 150
    assert (doubt_mm[late] > 0.028 * WAY_MM[late] / 2).all()
    assert (doubt_mm < 0.05 * WAY_MM + 1e-9).all()


def test_other_walls_hardly_have_waves():
    _, doubt_mm = driven(concrete)
    assert (doubt_mm <= 0.002 * WAY_MM + 0.1).all()


def test_stripes_that_stand_still_in_the_picture_are_no_waves_of_the_wall():
    _, doubt_mm = driven(lambda x_mm: crests(0.0) * concrete(x_mm))
    assert (doubt_mm <= 0.002 * WAY_MM + 0.1).all()


def test_waves_that_run_around_the_pipe_as_a_helix_are_recognised():
    _, doubt_mm = driven(lambda x_mm: crests(x_mm, helix=0.9) * concrete(x_mm))
    assert doubt_mm[-1] > 0.028 * WAY_MM[-1] / 2


def test_on_the_way_back_the_doubt_is_given_back():
    _, doubt_mm = driven(corrugated, way_mm=np.concatenate([WAY_MM, WAY_MM[::-1]]))
    assert abs(doubt_mm[-1]) < 0.1 * doubt_mm.max()


def test_waves_that_the_rig_states_are_no_doubt():
    stated = make_rig(pipe={"corrugation": {"pitch_mm": PITCH_MM, "depth_mm": 13.0}})
    waves, doubt_mm = driven(corrugated, stated)
    assert not doubt_mm.any()
    assert waves.wave is not None


def test_crests_keep_their_place_on_the_wall_while_the_camera_passes():
    waves, off_mm = Waves(RIG, GRID), []
    for x_mm in WAY_MM:
        waves.take((80 * corrugated(x_mm)).astype(np.float32), VALID, x_mm)
        if x_mm > 500 and waves.wave is not None:
            off_mm.append((waves.wave.crest_mm + PITCH_MM / 2) % PITCH_MM - PITCH_MM / 2)
    assert np.ptp(off_mm) < 3.0
    assert np.abs(off_mm).max() < 3.0
