"""Registration against shifts that are exact by construction."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from textures import pair, texture

from vo_core import ShapeMismatch, Shift, register

VGA = (480, 640)
SIZES = [VGA, (240, 320), (241, 321), (239, 319), (225, 243), (375, 405), (64, 96)]


def errors_px(shape, shifts, **kind):
    found = [register(*pair(shape, s, seed=n, **kind)) for n, s in enumerate(shifts)]
    assert all(shift.quality > 0 for shift in found)
    return np.array([(f.dx_px - s[0], f.dy_px - s[1]) for f, s in zip(found, shifts, strict=True)])


@pytest.mark.parametrize("shape", SIZES)
def test_sub_pixel_shifts_are_found_in_pictures_of_any_size(shape):
    shifts = [(0.25, -0.5), (1.37, 2.8), (-2.6, 0.9), (3.1, -1.7)]
    # Small pictures hold less texture; the bound scales with the information of a picture.
    bound_px = 0.012 * np.sqrt(240 * 320 / min(shape[0] * shape[1], 240 * 320)) + 0.005
    assert np.abs(errors_px(shape, shifts)).max() < bound_px


def test_weak_texture_under_noise_costs_hundredths_of_a_pixel():
    shifts = [(2.3, 1.2), (-4.6, 3.3), (7.7, -0.4)]
    assert np.abs(errors_px(VGA, shifts, contrast_grey=3, noise_grey=2)).max() < 0.05


def test_a_shift_of_a_third_of_the_picture_is_found():
    shifts = [(210.4, 0.3), (-205.7, 40.2), (15.3, 155.6)]
    assert np.abs(errors_px(VGA, shifts)).max() < 0.05


def test_a_picture_against_itself_has_not_moved():
    image, _ = pair(VGA, (0, 0))
    shift = register(image, image)
    assert np.abs([shift.dx_px, shift.dy_px, shift.rotation_rad]).max() < 1e-6
    assert shift.quality > 0.99


def test_swapping_the_pictures_negates_the_shift():
    a, b = pair(VGA, (5.3, -2.9))
    there, back = register(a, b), register(b, a)
    assert there.dx_px == pytest.approx(-back.dx_px, abs=0.02)
    assert there.dy_px == pytest.approx(-back.dy_px, abs=0.02)


@pytest.mark.parametrize("angle_deg", [-9.5, -3.0, -0.3, 0.05, 0.4, 2.0, 10.0])
def test_rotation_about_the_centre_is_found_with_the_shift(angle_deg):
    whole = (110 + 25 * texture((800, 900), 3)).astype(np.float32)
    centre, shift_px = np.array([449.5, 399.5]), np.array([5.3, -3.2])
    angle = np.radians(angle_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    matrix = np.column_stack([turn, centre - turn @ centre + shift_px])
    turned = cv2.warpAffine(whole, matrix, (900, 800), flags=cv2.INTER_LANCZOS4)
    view = np.s_[160:640, 130:770]  # 640x480 about the same centre
    found = register(whole[view], turned[view])
    assert np.degrees(found.rotation_rad) == pytest.approx(angle_deg, abs=0.01)
    assert (found.dx_px, found.dy_px) == pytest.approx(tuple(shift_px), abs=0.02)


def two_depths(share, nearer_px, further_px, noise_grey=2.0):
    """Two walls side by side, the left one over so much of the picture, each with its shift."""
    left = pair((240, 320), nearer_px, seed=1, noise_grey=noise_grey)
    right = pair((240, 320), further_px, seed=2, noise_grey=noise_grey)
    is_left = np.arange(320) < share * 320
    return [np.where(is_left, a, b) for a, b in zip(left, right, strict=True)]


@pytest.mark.parametrize("apart_px", [(30.0, 4.0), (12.0, -7.0), (5.0, 2.0), (-2.5, 1.0)])
@pytest.mark.parametrize("share", [0.6, 0.75])
def test_of_two_depths_the_larger_part_is_answered_and_the_quality_says_so(share, apart_px):
    shift = np.array([5.3, -2.9])
    found = register(*two_depths(share, tuple(shift), tuple(shift + apart_px)))
    assert (found.dx_px, found.dy_px) == pytest.approx(tuple(shift), abs=0.05)
    assert 0.3 < found.quality < register(*two_depths(1.0, tuple(shift), (0.0, 0.0))).quality - 0.05


@pytest.mark.parametrize("shift_px", [(0.6, -0.3), (5.4, 3.7), (14.8, -9.1)])
def test_a_blurred_wall_under_noise_is_locked_however_many_steps_it_takes(shift_px):
    # The noise is finer than the texture: every step falls short, as on dim cloth (issue 11).
    kind = {"contrast_grey": 4.0, "noise_grey": 3.0, "finest_px": 8.0}
    there, back = (register(*images) for images in both_ways(pair(VGA, shift_px, **kind)))
    assert there.quality > 0
    assert (there.dx_px, there.dy_px) == pytest.approx(shift_px, abs=0.2)
    assert (back.dx_px, back.dy_px) == pytest.approx((-there.dx_px, -there.dy_px), abs=0.05)


def both_ways(images):
    return images, images[::-1]


@given(gain=st.floats(0.4, 1.6), offset=st.floats(-30, 30))
def test_gain_and_offset_do_not_matter(gain, offset):
    a, b = pair((240, 320), (3.4, -1.6), contrast_grey=20)
    found = register(a, b * gain + offset)
    assert (found.dx_px, found.dy_px) == pytest.approx((3.4, -1.6), abs=0.02)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("colour", [False, True])
def test_every_type_is_taken_and_left_unchanged(dtype, colour):
    scale = 257 if dtype == np.uint16 else 1
    images = [(np.clip(v, 0, 255) * scale).astype(dtype) for v in pair((96, 128), (2.0, 1.0))]
    if colour:
        images = [
            cv2.merge([v, v, v]) if dtype != np.float64 else np.dstack([v] * 3) for v in images
        ]
    before = [image.copy() for image in images]
    found = register(*images)
    assert (found.dx_px, found.dy_px) == pytest.approx((2.0, 1.0), abs=0.06)
    assert all(np.array_equal(a, b) for a, b in zip(images, before, strict=True))


NOTHING = Shift(0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_unrelated_textures_have_no_quality(seed):
    a, b = (110 + 25 * texture(VGA, seed + k) for k in (0, 50))
    assert register(a, b) == NOTHING


@pytest.mark.parametrize("seed", range(3))
def test_pure_noise_has_no_quality(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.normal(110, 5, (2, *VGA)).clip(0, 255).astype(np.uint8)
    assert register(a, b) == NOTHING


@pytest.mark.parametrize("level", [0, 128, 255])
def test_blank_pictures_have_no_quality(level):
    blank = np.full(VGA, level, np.uint8)
    assert register(blank, blank) == NOTHING


def test_straight_lines_have_no_quality():
    rng = np.random.default_rng(1)
    lines = 120 + 40 * np.repeat(texture((1, 640), 2), 480, 0)
    before, after = (np.clip(lines + rng.normal(0, 8, VGA), 0, 255) for _ in range(2))
    assert register(before, after).quality == 0


def test_a_picture_too_long_to_be_resampled_is_refused():
    strip = np.zeros((32, 16001), np.uint8)
    with pytest.raises(ShapeMismatch, match="at most 16000 px"):
        register(strip, strip)


def test_pictures_of_two_sizes_are_refused():
    with pytest.raises(ShapeMismatch, match=r"480, 640.*240, 320"):
        register(np.zeros(VGA), np.zeros((240, 320)))


@pytest.mark.parametrize("shape", [(31, 64), (64,), (64, 64, 2)])
def test_what_is_no_picture_is_refused(shape):
    with pytest.raises(ShapeMismatch):
        register(np.zeros(shape), np.zeros(shape))
