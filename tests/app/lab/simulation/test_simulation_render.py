"""What the pictures show, checked against positions worked out by OpenCV's projection."""

import sys
from dataclasses import replace
from itertools import islice, pairwise

import cv2
import numpy as np
import pytest
from films import half_sized
from projection import project
from shares import first_of
from skimage import data

from app.lab.simulation import SCENARIOS, render
from app.lab.simulation.motion import Trajectory
from app.lab.simulation.scenario import NO_SILT, Shaking, Silt
from app.lab.simulation.wall import PhotographNotAvailable
from vo_core import Pose, Rig


def clean(name: str, **changes):
    """A scenario without noise and flicker, over a few centimetres."""
    return replace(SCENARIOS[name], noise_grey=0.0, flicker=0.0, **{"length_mm": 60.0, **changes})


def last_frame(scenario):
    """The frame at the end of the way; few lie before it."""
    *_, frame = render(replace(scenario, frames_per_s=10))
    return frame


def nth_frame(scenario, number):
    return next(islice(render(scenario), number, None))


@pytest.mark.parametrize(
    "name",
    first_of(
        3,
        ["turned_camera", "wide_lens", "pitched_mount"]
        + ["nominal", "large_sway", "burnt_in_text", "climb"],
    ),
)
def test_joint_appears_where_projection_puts_it(name):
    joint_mm = 75.0
    scenario = clean(name, first_joint_mm=joint_mm, sway_mm=14.0, yaw_deg=6.0)
    frame = last_frame(scenario)
    pose = Pose(
        frame.x_mm, frame.y_mm, np.radians(frame.yaw_deg),
        frame.z_mm, np.radians(frame.pitch_deg), np.radians(frame.roll_deg),
    )  # fmt: skip
    assert abs(frame.y_mm) > 1
    assert abs(frame.yaw_deg) > 0.5

    arc_mm = np.linspace(-30, 30, 200)
    away_mm = np.linspace(-10, 10, 201)
    seen = []
    for away in away_mm:
        u, v = project(scenario.rendered_rig, pose, np.full_like(arc_mm, joint_mm + away), arc_mm)
        line = cv2.remap(frame.image, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR)
        seen.append(line.mean())
    gap = away_mm[np.array(seen) < (min(seen) + np.median(seen)) / 2]

    assert np.median(seen) - min(seen) > 20
    # The broken lips of the joint move its middle by up to 0.3 mm over 60 mm of arc.
    assert abs(gap[0] + gap[-1]) / 2 < 0.4


def test_content_of_a_floor_moves_by_the_pinhole_equation():
    scenario = clean("tiled_floor", sway_mm=0.0, yaw_deg=0.0, length_mm=100.0, contrast=1.0)
    before, after = islice(render(scenario), 10, 12)
    window = cv2.createHanningWindow((640, 480), cv2.CV_32F)
    (dx_px, dy_px), _ = cv2.phaseCorrelate(
        before.image.astype(np.float32), after.image.astype(np.float32), window
    )
    camera, height_mm = scenario.rig.camera, scenario.rig.mount.height_mm
    expected_px = -(after.x_mm - before.x_mm) * camera.fx / height_mm
    # The lamp and the vignette stay where they are and pull the peak a little towards zero.
    assert dx_px == pytest.approx(expected_px, abs=0.3)
    assert dy_px == pytest.approx(0, abs=0.3)


def test_every_scenario_renders_usable_pictures(is_long):
    failures = []
    names = list(SCENARIOS) if is_long else list(SCENARIOS)[::4]
    for name in names:
        scenario = SCENARIOS[name]
        six_frames_mm = 6 * scenario.speed_mm_s / scenario.frames_per_s
        short = half_sized(half_sized(scenario.shortened(max(40.0, six_frames_mm))))
        frames = list(islice(render(short), 6))
        images = np.stack([frame.image for frame in frames])
        first = frames[0]
        means = images.mean(axis=(1, 2))
        if not (
            [frame.index for frame in frames] == [0, 1, 2, 3, 4, 5]
            and (first.x_mm, first.y_mm, first.yaw_deg) == (0, 0, 0)
            and images.shape == (6, 120, 160)
            and images.dtype == np.uint8
            and 10 < means.min() <= means.max() < 160
            and (images == 255).mean(axis=(1, 2)).max() < 0.01
            and not np.array_equal(images[0], images[5])
        ):
            failures.append(f"{name}: {images.shape}, means {means.round()}")
    assert not failures, "\n".join(failures)


def test_equal_scenarios_give_equal_pictures_and_other_seeds_others():
    scenario = SCENARIOS["dirty_lens"].shortened(20)
    first, second = (last_frame(scenario).image for _ in range(2))
    other = last_frame(replace(scenario, seed=2)).image
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)


def test_drop_outs_are_black_or_frozen_and_never_longer_than_stated():
    scenario = half_sized(SCENARIOS["drop_outs"].shortened(700))
    images = [frame.image for frame in render(scenario)]
    black = [image.mean() < 10 for image in images]
    frozen = [False] + [np.array_equal(a, b) for a, b in pairwise(images)]
    assert any(black)
    assert any(frozen)
    faulty = "".join("x" if b or f else "." for b, f in zip(black, frozen, strict=True))
    assert max(map(len, faulty.split("."))) <= 8
    assert faulty.startswith("." * 20)


def test_low_texture_has_a_few_grey_levels_of_contrast():
    for name, low, high in (("low_texture", 1.0, 3.5), ("nominal", 9.0, 20.0)):
        image = last_frame(clean(name, lamp_width=9.0, first_joint_mm=700.0)).image
        flat = image.astype(np.float32) - cv2.GaussianBlur(image.astype(np.float32), (0, 0), 60)
        assert low < flat.std() < high


def test_motion_blur_softens_along_the_motion_only():
    def sharpness(name):
        image = nth_frame(clean(name), 0).image  # it stands
        moving = nth_frame(clean(name, length_mm=300.0, frames_per_s=3), 2).image
        return [
            float(np.abs(np.diff(moving.astype(np.float32), axis=axis)).mean())
            / float(np.abs(np.diff(image.astype(np.float32), axis=axis)).mean())
            for axis in (1, 0)
        ]

    along, across = sharpness("blur")
    assert along < 0.75 * across


def test_text_stays_in_its_place_while_the_clock_runs():
    frames = [frame.image for frame in islice(render(clean("burnt_in_text")), 8)]
    ink = [image == 245 for image in frames]
    assert np.array_equal(ink[0][:60], ink[7][:60])
    assert ink[0][:60].sum() > 500
    assert not np.array_equal(ink[0][-40:], ink[7][-40:])


@pytest.mark.parametrize(
    ("name", "joint_mm", "radius_px"),
    [
        ("forward", 300.0, 400 * 150 / 300),  # f tan(angle to the axis)
        ("forward_wide", 120.0, 210 * np.arctan2(150, 120)),  # f times the angle
    ],
)
def test_forward_camera_sees_the_whole_ring_of_the_pipe(name, joint_mm, radius_px):
    scenario = clean(name, first_joint_mm=joint_mm, length_mm=5.0)
    image = cv2.blur(next(iter(render(scenario))).image, (3, 3)).astype(float)
    # The joint lies on one circle around the optical axis; it is dark at the crown too.
    for clock in np.radians(np.arange(0, 360, 30)):
        samples = [
            image[
                round(239.5 + (radius_px + away) * np.sin(clock)),
                round(319.5 + (radius_px + away) * np.cos(clock)),
            ]
            for away in (-14, 0, 14)
        ]
        assert samples[1] < 0.8 * min(samples[0], samples[2])


def joint_gaps_mm(scenario, number, joint_mm):
    """How far, at 24 places around the pipe, a joint is drawn from its place; nan: not in view."""
    from_start = Trajectory(scenario).pose(number / scenario.frames_per_s)
    frame = nth_frame(scenario, number)
    image = cv2.GaussianBlur(frame.image, (0, 0), 0.7).astype(np.float32)
    away_mm = np.arange(-12.0, 12.01, 0.1)
    gaps = []
    for clock in np.arange(24) * np.pi / 12:
        arc_mm = 150.0 * clock + np.arange(-12, 13)
        x_mm, arcs_mm = np.meshgrid(joint_mm + away_mm, arc_mm)
        rig = scenario.rendered_rig
        u, v = project(rig, from_start, x_mm.ravel(), arcs_mm.ravel())
        inside = (u > 2) & (u < 637) & (v > 2) & (v < 477)
        grey = cv2.remap(
            image, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR
        ).reshape(x_mm.shape)
        profile = grey.mean(axis=0)
        gap = away_mm[profile < (profile.min() + np.median(profile)) / 2]
        gaps.append((gap[0] + gap[-1]) / 2 if inside.all() else np.nan)
    return np.array(gaps)


@pytest.mark.parametrize(
    ("name", "frames_per_s", "frame", "joint_mm", "least_in_view"),
    [
        pytest.param("forward_crooked", 5, 1, 420.0, 24, marks=pytest.mark.long),
        pytest.param("forward_slow", 1, 1, 500.0, 24, marks=pytest.mark.long),
        ("forward_wobble", 1, 3, 700.0, 20),  # it has turned by 5 degrees and moved by 20 mm
        ("forward_looking_around", 1, 4, 300.0, 6),  # it holds at 50 degrees aside, 10 up
    ],
)
def test_forward_camera_of_a_crew_sees_a_joint_where_projection_puts_it(
    name, frames_per_s, frame, joint_mm, least_in_view
):
    length_mm = {"forward_wobble": 600.0}.get(name, 200.0)
    scenario = clean(
        name, first_joint_mm=joint_mm, contrast=0.1, length_mm=length_mm, text=False,
        frames_per_s=frames_per_s,
    )  # fmt: skip
    if scenario.looks:
        scenario = replace(scenario, looks=scenario.looks[:1], legs=(0.5, 0.5))
    gaps_mm = joint_gaps_mm(scenario, frame, joint_mm)
    assert np.isfinite(gaps_mm).sum() >= least_in_view
    # The broken lips of the joint move its middle by up to half a millimetre.
    assert np.nanmax(np.abs(gaps_mm)) < 1.0
    assert abs(np.nanmean(gaps_mm)) < 0.25


def test_light_follows_the_view_of_a_camera_that_looks_around():
    scenario = clean("forward_looking_around", contrast=0.0, first_joint_mm=5000.0)
    scenario = replace(
        scenario, looks=scenario.looks[:1], legs=(0.5, 0.5), length_mm=200.0, frames_per_s=1
    )
    frames = islice(render(half_sized(scenario)), 5)
    ahead, *_, aside = (frame.image.astype(float) for frame in frames)
    rows = slice(100, 140)
    assert ahead[rows, 150:170].mean() < 15  # the dark end of the pipe
    assert aside[rows, 150:170].mean() > 40  # the wall beside the camera
    assert aside[rows, 300:].mean() > 40
    assert (
        aside[rows, :10].mean() < 0.7 * aside[rows, 150:170].mean()
    )  # towards the dark end, which has left the picture


def test_parts_of_the_robot_stay_in_the_picture_while_the_wall_passes():
    scenario = replace(clean("forward_parts"), length_mm=400.0, text=False, frames_per_s=5)
    images = np.array([frame.image for frame in islice(render(scenario), 7)], float)
    change = images.std(axis=0)
    assert change[440:, 160:480].max() < 0.6  # the skid
    assert change[5:60, 600:].max() < 0.6  # the frame of the lamp
    assert np.median(change[100:380, 20:100]) > 2  # the wall


def test_mud_hides_one_half_of_the_rings_for_a_stretch():
    (mud,) = SCENARIOS["forward_parts"].defects
    scenario = replace(
        clean("forward_parts", parts=False, text=False, lamp_width=9.0),
        defects=(replace(mud, x_mm=300.0),),
    )
    image = next(iter(render(scenario))).image.astype(np.float32)
    texture = np.abs(image - cv2.GaussianBlur(image, (0, 0), 3))
    ring = {
        clock: texture[
            round(239.5 + 200 * np.cos(clock)) - 12 : round(239.5 + 200 * np.cos(clock)) + 12,
            round(319.5 + 200 * np.sin(clock)) - 12 : round(319.5 + 200 * np.sin(clock)) + 12,
        ].mean()
        for clock in np.arange(12) * np.pi / 6
    }  # 0 at the invert, to the right
    muddy = [value for clock, value in ring.items() if 0 < clock < 2.6]
    clear = [value for clock, value in ring.items() if 3 < clock < 6]
    assert max(muddy) < 0.5 * min(clear)


def test_pumping_exposure_swings_by_its_factor():
    scenario = clean("forward_pumping", contrast=0.0, length_mm=1800.0, first_joint_mm=5000.0)
    images = (frame.image[5:20, 5:20] for frame in render(half_sized(half_sized(scenario))))
    light = np.array([image.mean() for image in images]) - 4.0
    assert light.max() / light.min() == pytest.approx(2.0, rel=0.05)
    assert np.abs(np.diff(np.log(light))).max() < 0.06  # a joint passes, too


def test_stream_covers_its_width_and_leaves_the_wall_beside_it():
    wet, dry = (
        next(iter(render(half_sized(clean("forward_stream", water=water))))).image.astype(float)
        for water in (True, False)
    )
    changed = np.abs(wet - dry)
    # At 100 px from the axis the stream reaches 60 mm of arc, 23 degrees, to either side.
    for degrees_, is_wet in ((0, True), (17, True), (-14, True), (32, False), (90, False)):
        clock = np.radians(degrees_)
        v, u = round(119.5 + 100 * np.cos(clock)), round(159.5 + 100 * np.sin(clock))
        assert (changed[v - 3 : v + 3, u - 3 : u + 3].mean() > 2) == is_wet


def photographed_floor(photo_mm):
    """The photograph under a camera that stands 230 mm above it, with nothing else in the way."""
    scenario = clean("photo_wall", photo_mm=photo_mm, lamp_width=50.0, length_mm=1.0)
    flat = scenario.rig.pipe.model_copy(
        update={"shape": "flat", "diameter_mm": None, "segment_length_mm": None}
    )
    return replace(scenario, rig=scenario.rig.model_copy(update={"pipe": flat}))


def test_wall_of_a_photograph_shows_it_in_the_stated_size():
    image = next(iter(render(photographed_floor(250.0)))).image
    per_px = 1194.0 / 230.0 * 250.0 / 512  # picture pixels for one of the photograph's
    small = cv2.resize(image, None, fx=1 / per_px, fy=1 / per_px, interpolation=cv2.INTER_AREA)
    patch = small[30:-30, 30:-30]
    photo = data.gravel()
    both_ways = np.vstack([photo, photo[::-1]])
    sheet = np.hstack([both_ways, both_ways[:, ::-1]])  # whichever part of it the camera sees
    assert cv2.matchTemplate(sheet, patch, cv2.TM_CCOEFF_NORMED).max() > 0.9


def test_photograph_goes_on_without_a_seam():
    image = next(iter(render(photographed_floor(40.0)))).image.astype(float)  # some nine of them
    for axis in (0, 1):
        steps = np.abs(np.diff(image, axis=axis)).mean(axis=1 - axis)
        assert steps.max() < 2.5 * np.median(steps)


def test_photograph_that_is_not_there_is_said_with_what_to_install(monkeypatch):
    assert SCENARIOS["photo_wall"].is_available
    monkeypatch.setitem(sys.modules, "skimage", None)  # as where it is not installed
    assert not SCENARIOS["photo_wall"].is_available
    assert SCENARIOS["nominal"].is_available
    with pytest.raises(PhotographNotAvailable, match="pip install scikit-image"):
        next(iter(render(SCENARIOS["photo_wall"].shortened(20))))


def test_fields_of_an_interlaced_frame_are_half_a_frame_apart():
    woven = list(render(clean("interlaced", lamp_width=9.0)))
    # The same way at twice the rate and without fields: its frames are the fields.
    single = list(render(clean("interlaced", lamp_width=9.0, interlaced=False, frames_per_s=50)))
    for number in (5, len(woven) - 2):
        image = woven[number].image
        upper, lower = (single[2 * number + field].image for field in (0, 1))
        for rows, field, other in (
            (slice(0, None, 2), upper, lower),
            (slice(1, None, 2), lower, upper),
        ):
            near, far = (np.abs(image[rows].astype(int) - of[rows]) for of in (field, other))
            assert near.max() <= 1  # times are rounded in different places
            assert far.mean() > 5
        assert woven[number].x_mm == pytest.approx(single[2 * number].x_mm)


def test_rolling_shutter_shows_a_steady_robot_a_leaning_line():
    scenario = clean(
        "rolling_shutter", shaking=Shaking(), sway_mm=0.0, yaw_deg=0.0, length_mm=400.0,
        first_joint_mm=200.0, contrast=0.02, lamp_width=9.0, frames_per_s=10,
    )  # fmt: skip
    frame = min(render(scenario), key=lambda one: abs(one.x_mm - 200.0))
    columns = np.arange(640)

    def joint_px(rows: slice) -> float:
        profile = frame.image[rows].mean(axis=0)
        dark = np.clip(0.8 * np.median(profile) - profile, 0, None)
        return float((columns * dark).sum() / dark.sum())

    leaning_px = joint_px(slice(0, 40)) - joint_px(slice(440, 480))
    between_s = 440 / 480 * 0.024
    # The lips of the joint are broken by some tenths of a millimetre.
    px_per_mm = 1194 / 230
    assert leaning_px == pytest.approx(300 * between_s * px_per_mm, abs=4)


def test_silt_that_fills_the_view_looks_like_a_floor_that_is_nearer():
    silt = clean("silt", first_joint_mm=900.0)
    rig = silt.rig.model_dump()
    rig["mount"]["height_mm"] -= 25.0
    rig["pipe"] |= {"shape": "flat", "diameter_mm": None}
    floor = replace(silt, rig=Rig.parse(rig), silt=NO_SILT)
    ours, theirs = (last_frame(scenario).image.astype(int) for scenario in (silt, floor))
    assert np.abs(ours - theirs).max() <= 1


def test_joint_goes_on_over_silt_as_a_faint_line():
    depths = {}
    for share in (0.0, 0.3):
        scenario = clean(
            "silt", first_joint_mm=60.0, contrast=0.3, silt=Silt(start_mm=25.0, joint_share=share)
        )
        profile = last_frame(scenario).image.astype(float).mean(axis=0)
        depths[share] = np.median(profile[250:390]) - profile[300:340].min()
    assert depths[0.3] > depths[0.0] + 4
