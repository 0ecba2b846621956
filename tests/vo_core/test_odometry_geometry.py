"""A rig that is not quite what its file says: what each error of the mount costs, and no more.

Expected are the closed forms of the error budget: scale goes with the height, the focal length and
the tilt of the camera, and with what water and a rolling shutter do to the picture.
"""

import numpy as np
import pytest
from shares import first_of
from worlds import World, floor_rig, follow, small_rig, speckle, stored

RIGS = {"pipe": small_rig, "floor": floor_rig}
EVERYWHERE = pytest.mark.parametrize("shape", RIGS)
FORWARD = {"view": "forward"}
WIDE = {"fx": 133.0, "fy": 133.0}
STEP_PX = 6.0


def drive(world, view=None, frames=40, step_px=STEP_PX):
    """Pictures of an even drive and its positions; `view` sees otherwise than the world."""
    x_mm = step_px * world.mm_per_px * np.arange(frames)
    return [stored((view or world.view)(x), n) for n, x in enumerate(x_mm)], x_mm


def scale_error(track, x_mm):
    """Of the measured distance to the true one, less 1."""
    return float(np.polyfit(x_mm, track.distance_mm, 1)[0]) - 1


@EVERYWHERE
@pytest.mark.parametrize(
    "mount",
    first_of(
        3,
        [
            {"pitch_deg": -5.0},
            {"roll_deg": -5.0},
            {"lateral_mm": 10.0, "rotation_deg": 123.0},
            {"pitch_deg": 2.0},
            {"roll_deg": 2.0},
            {},
        ],
    ),
)
def test_a_known_mount_gives_the_true_distance(shape, mount):
    rig = RIGS[shape](mount=mount)
    images, x_mm = drive(World(rig, speckle(0)))
    track = follow(rig, images)
    assert np.abs(track.distance_mm - x_mm).max() < 0.08
    assert np.abs(track.yaw_deg).max() < 0.25


@EVERYWHERE
@pytest.mark.parametrize("wrong_mm", first_of(1, [-2.0, 2.0]))
def test_a_height_that_is_wrong_by_2_mm_costs_its_share_of_the_distance(shape, wrong_mm):
    true_rig = RIGS[shape](mount={"height_mm": 150.0 - wrong_mm})
    images, x_mm = drive(World(true_rig, speckle(0)))
    found = scale_error(follow(RIGS[shape](), images), x_mm)
    # 1/Z on a plane; a little less in a pipe, whose sides stay where they are.
    assert found == pytest.approx(wrong_mm / 150, rel=0.1)


@EVERYWHERE
@pytest.mark.parametrize("wrong_px", first_of(1, [-1.0, 1.0]))
def test_a_focal_length_that_is_wrong_by_a_pixel_costs_its_share(shape, wrong_px):
    lens = {"fx": 266.0 - wrong_px, "fy": 266.0 - wrong_px}
    images, x_mm = drive(World(RIGS[shape](camera=lens), speckle(0)))
    found = scale_error(follow(RIGS[shape](), images), x_mm)
    assert found == pytest.approx(-wrong_px / 266, rel=0.15)


@pytest.mark.parametrize(
    ("shape", "mount", "most_percent"),
    [
        # cos^2 of the pitch and cos of the roll on a plane, twice for what the shear adds.
        ("floor", {"pitch_deg": 2.0}, 0.25),
        ("floor", {"pitch_deg": 5.0}, 1.5),
        ("floor", {"roll_deg": 2.0}, 0.15),
        ("floor", {"roll_deg": 5.0}, 0.8),
        ("pipe", {"pitch_deg": 1.0}, 0.12),
        ("pipe", {"pitch_deg": 2.0}, 0.25),
        # On the axis of a pipe a roll is a turn about it: it does not matter.
        ("pipe", {"roll_deg": 2.0}, 0.03),
        ("pipe", {"roll_deg": 5.0}, 0.03),
        ("pipe", {"lateral_mm": 2.0}, 0.03),
    ],
)
def test_a_tilt_that_nobody_measured_costs_little_distance(shape, mount, most_percent):
    images, x_mm = drive(World(RIGS[shape](mount=mount), speckle(0)))
    track = follow(RIGS[shape](), images)
    assert 100 * abs(scale_error(track, x_mm)) < most_percent


def test_a_wide_lens_whose_focal_length_is_wrong_is_wrong_by_one_factor():
    """The roll of a fisheye on the axis hardly shows: misfits must not carry it off, and with it
    the sway that the distance is measured beside."""
    fisheye, on_axis = {"model": "fisheye", "fx": 105.0, "fy": 105.0}, {"height_mm": 150.0}
    world = World(small_rig(camera=fisheye, mount=on_axis), speckle(1))
    x_mm = 10.0 * np.arange(90)
    poses = zip(x_mm, 4 * np.sin(x_mm / 270), np.sin(x_mm / 207), strict=True)
    images = [stored(world.view(*pose), n) for n, pose in enumerate(poses)]
    stated = small_rig(camera=fisheye | {"fx": 103.95, "fy": 103.95}, mount=on_axis)
    track = follow(stated, images)
    line = np.polyfit(x_mm, track.distance_mm, 1)
    assert line[0] == pytest.approx(1.014, abs=0.002)
    assert np.abs(track.distance_mm - np.polyval(line, x_mm)).max() < 2.5


def test_a_forward_camera_sees_the_true_distance():
    rig = small_rig(mount=FORWARD, camera=WIDE)
    images, x_mm = drive(World(rig, speckle(0)), step_px=4)
    track = follow(rig, images)
    assert np.abs(track.distance_mm - x_mm).max() < 0.25
    assert set(track.status[4:]) == {"ok"}


def test_a_forward_camera_scales_with_the_radius_and_hardly_with_its_height():
    rig = small_rig(mount=FORWARD, camera=WIDE)
    wider = small_rig(mount=FORWARD, camera=WIDE, pipe={"diameter_mm": 304.0})
    higher = small_rig(mount=FORWARD | {"height_mm": 152.0}, camera=WIDE)
    found = []
    for true_rig in (wider, higher):
        images, x_mm = drive(World(true_rig, speckle(0)), step_px=4)
        found.append(scale_error(follow(rig, images), x_mm))
    assert found[0] == pytest.approx(300 / 304 - 1, rel=0.15)
    assert abs(found[1]) < 1e-3


def rolling(world, readout_mm):
    """Pictures whose last row is taken `readout_mm` of driving after their first."""
    rows = world.rig.camera.height
    late = np.linspace(0, 1, rows, dtype=np.float32)[:, None]

    def view(x_mm):
        first, last = world.places_mm(x_mm), world.places_mm(x_mm + readout_mm)
        return world.light(tuple(a + (b - a) * late for a, b in zip(first, last, strict=True)))

    return view


@pytest.mark.parametrize("step_px", first_of(2, [-10.0, 4.0, -4.0, 10.0]))
def test_a_rolling_shutter_along_the_drive_scales_as_its_formula_says(step_px):
    rig = floor_rig(mount={"rotation_deg": 90.0})  # the picture's rows are read backwards
    world, readout = World(rig, speckle(0)), 0.8
    view = rolling(world, readout * step_px * world.mm_per_px)
    images, x_mm = drive(world, view, step_px=step_px)
    # 1 / (1 - v rho / H) with v along the readout.
    expected = 1 / (1 - step_px * readout / rig.camera.height) - 1
    assert scale_error(follow(rig, images), x_mm) == pytest.approx(expected, abs=5e-4)


@EVERYWHERE
def test_a_rolling_shutter_across_the_drive_costs_nothing(shape):
    world = World(RIGS[shape](), speckle(0))
    view = rolling(world, 0.8 * STEP_PX * world.mm_per_px)
    images, x_mm = drive(world, view)
    assert abs(scale_error(follow(world.rig, images), x_mm)) < 3e-4


def test_water_over_the_invert_lengthens_the_distance_by_its_apparent_depth():
    """Under h of water the floor appears h (1 - 1/1.333) nearer, and passes by faster."""
    rig, depth_mm = floor_rig(), 10.0
    world = World(rig, speckle(0))
    along, around = world.places_mm()
    reach = np.hypot(along, around)
    sine = np.sin(np.arctan(reach / 150)) / 1.333  # Snell
    wet = (150 - depth_mm) * reach / 150 + depth_mm * sine / np.sqrt(1 - sine**2)
    bend = wet / np.maximum(reach, 1e-6)

    def view(x_mm):
        return world.light((along * bend + np.float32(x_mm), around * bend))

    images, x_mm = drive(world, view)
    apparent_mm = 150 - depth_mm * (1 - 1 / 1.333)
    # The formula is that of the centre; towards the border water bends more, like a pitch at first.
    assert scale_error(follow(rig, images), x_mm) == pytest.approx(150 / apparent_mm - 1, rel=0.4)
