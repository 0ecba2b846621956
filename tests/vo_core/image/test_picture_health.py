"""Detection of faults in pictures, on rendered ones whose faults are made here."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from films import film, half_sized
from worlds import FRAME_S, World, floor_rig, glass, small_rig, speckle, stored

from app.lab.simulation import SCENARIOS
from vo_core import Odometry, Pose
from vo_core.geometry.rectify import Rectifier
from vo_core.image.health import Health, HealthGauge, complaints, detail

GOOD = Health(overlap=0.9, brightness=0.4, overexposed=0.0, sharpness=0.9, fixed_pattern=0.01)


def watch(rig, pictures):
    """Health of every picture of a run."""
    odometry, seen = Odometry(rig), []
    for n, picture in enumerate(pictures):
        odometry.step(picture, n * FRAME_S)
        seen.append(odometry.measuring_health()())
    return seen


def drive(step_mm=8.0, frames=60, light=1.0, contrast_grey=20.0, noise_grey=1.5, rig=None):
    rig = rig or small_rig()
    world = World(rig, speckle(3), contrast_grey)
    pictures = [
        stored(world.view(step_mm * n, 2 * np.sin(n / 9)) * light, n, noise_grey)
        for n in range(frames)
    ]
    return watch(rig, pictures)


def said(healths, begin=20):
    """Share of the frames that each complaint is made of."""
    rows = [complaints(health) for health in healths[begin:]]
    words = {word for row in rows for word in row}
    return {word: sum(word in row for row in rows) / len(rows) for word in words}


@pytest.mark.parametrize(
    "changes",
    [{}, {"contrast_grey": 3.0}, {"light": glass(small_rig(), dust=0)}, {"rig": floor_rig()}],
    ids=["plain", "weak texture", "spot of light", "floor"],
)
def test_good_pictures_have_no_faults(changes):
    assert said(drive(**changes)) == {}


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"overlap": 0.5}, "too_fast"),
        ({"brightness": 0.1}, "too_dark"),
        ({"overexposed": 0.2}, "too_bright"),
        ({"sharpness": 0.4}, "blurred"),
        ({"fixed_pattern": 0.3}, "lens_dirty"),
    ],
)
def test_each_fault_has_its_word(changes, word):
    assert complaints(GOOD) == ()
    assert complaints(replace(GOOD, **changes)) == (word,)


def test_overlap_is_the_share_of_wall_that_the_frame_before_showed():
    grid = Rectifier(small_rig()).grid
    length_mm = grid.shape[1] * grid.mm_per_px
    seen = drive(step_mm=0.25 * length_mm, frames=12)
    assert [health.overlap for health in seen[4:]] == pytest.approx([0.75] * 8, abs=0.02)
    assert grid.common(Pose(), Pose(2 * length_mm)) == 0


def test_brightness_is_measured_on_the_wall_only():
    dark = drive(light=0.2, frames=3)[-1]
    assert dark.brightness == pytest.approx(0.2 * 110 / 255, abs=0.01)
    assert "too_dark" in complaints(dark)
    burnt = drive(light=2.2, frames=3)[-1]
    assert burnt.overexposed > 0.4
    assert "too_bright" in complaints(burnt)


def test_a_black_frame_is_dark_and_nothing_else():
    rig = small_rig()
    seen = watch(rig, [np.zeros((240, 320), np.uint8)] * 3)
    assert complaints(seen[-1]) == ("too_dark",)


@pytest.mark.parametrize("sigma_px", [2.0, 3.0])
def test_a_lens_that_fogs_up_is_detected_at_any_contrast(sigma_px):
    rig = small_rig()
    for contrast_grey in (4.0, 20.0):
        world = World(rig, speckle(3), contrast_grey)
        views = [world.view(8.0 * n) for n in range(60)]
        foggy = [cv2.GaussianBlur(view, (0, 0), sigma_px) for view in views[30:]]
        seen = watch(rig, [stored(view, n) for n, view in enumerate([*views[:30], *foggy])])
        assert all("blurred" not in complaints(health) for health in seen[:30])
        assert all("blurred" in complaints(health) for health in seen[50:])


def test_blur_is_detected_when_the_robot_speeds_up():
    rig = small_rig()
    world = World(rig, speckle(3))

    def exposed(x_mm):
        return np.mean([world.view(x_mm + 5.0 * k / 9) for k in range(10)], axis=0)

    light = [(exposed if n >= 30 else world.view)(6.0 * n) for n in range(60)]
    pictures = [stored(picture, n) for n, picture in enumerate(light)]
    seen = watch(rig, pictures)
    assert said(seen[:30]) == {}
    assert said(seen, begin=48)["blurred"] == 1


def test_dirt_is_detected_and_a_water_line_is_no_dirt():
    rig = small_rig()
    world = World(rig, speckle(3), contrast_grey=10.0)
    rng = np.random.default_rng(4)
    drops = np.ones((240, 320), np.float32)
    for _ in range(60):
        centre = rng.integers((0, 0), (320, 240)).tolist()
        cv2.circle(drops, centre, int(rng.integers(4, 12)), 0.5, -1)
    line = np.ones((240, 320), np.float32)
    line[150:156] = 0.6  # along the pipe, where the water stands
    dirty, wet = (
        watch(rig, [stored(world.view(8.0 * n) * glas, n) for n in range(70)])
        for glas in (cv2.GaussianBlur(drops, (0, 0), 1), line)
    )
    assert "lens_dirty" in complaints(dirty[-1])
    assert "lens_dirty" not in complaints(wet[-1])


def test_detail_does_not_depend_on_contrast_noise_or_shading():
    rng = np.random.default_rng(1)
    picture = 100 + 20 * speckle(3)[:240, :320]
    plain = detail(picture)
    noisy = picture + rng.normal(0, 4, picture.shape).astype(np.float32)
    shaded = picture * np.linspace(0.4, 1, 320, dtype=np.float32)
    assert detail(20 + 0.1 * picture) == pytest.approx(plain, rel=0.01)
    assert detail(noisy) == pytest.approx(plain, rel=0.25)
    assert detail(shaded) == pytest.approx(plain, rel=0.1)
    assert detail(cv2.GaussianBlur(picture, (0, 0), 3)) < 0.6 * plain
    assert np.isnan(detail(np.full((40, 320), 7, np.float32)))


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("nominal", None),
        ("dirty_lens", "lens_dirty"),
        ("fast", "too_fast"),
        pytest.param("dim", "too_dark", marks=pytest.mark.long),
        pytest.param("blur", "blurred", marks=pytest.mark.long),
    ],
)
def test_the_fault_of_each_rendered_scenario_is_detected(name, word):
    scenario = half_sized(SCENARIOS[name].shortened(1200 if name == "fast" else 600))
    pictures = [frame.image for frame in film(scenario)]
    shares = said(watch(scenario.rig, pictures), begin=len(pictures) * 2 // 5)
    shares = {each: share for each, share in shares.items() if share > 0.1}
    assert set(shares) == ({word} if word else set())


def test_a_pattern_that_no_wall_has_is_no_fault_of_the_program():
    """Bands of 4 and 16 px in one direction, nothing in the other: a damaged film showed them."""
    along = np.arange(256)
    bands = 128 + 30 * np.sin(np.pi * along / 2 + 0.3) + 30 * np.sin(np.pi * along / 8)
    patch = np.tile(bands, (160, 1)).astype(np.float32)
    gauge = HealthGauge(np.full(patch.shape, 255, np.uint8))
    assert 0 <= gauge.take(patch, overlap=1.0, fixed_pattern=0.0).sharpness <= 1
