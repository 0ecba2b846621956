"""The issue's figures for `register`: pictures shifted exactly, by the Fourier theorem.

Natural pictures are mirrored before they are shifted, so that nothing jumps at their borders, and
the views are cut from the inside.
"""

from functools import cache, lru_cache

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shares import first_of
from skimage import data
from textures import shifted, texture
from worlds import rms

from vo_core import register

PHOTOGRAPHS = ("brick", "gravel", "grass", "camera")
SPECKLES = {"fine speckle": 0.8, "speckle": 1.5, "coarse speckle": 3.0}
PICTURES = ["gravel", "speckle", "camera", "grass", "brick", "fine speckle", "coarse speckle"]
EVERY = pytest.mark.parametrize("name", first_of(2, PICTURES))
SIZE_WH, CORNER = (320, 240), (90, 100)
FRACTIONS = np.arange(8) / 8
FINER = 4


@cache
def whole(name):
    """A picture that repeats without a jump, 512 px wide and high or more."""
    if name in SPECKLES:
        return 110 + 25 * texture((512, 512), 3, SPECKLES[name])
    return mirrored(getattr(data, name)().astype(float))


def mirrored(picture):
    """Followed by its mirror images, so that it repeats without a jump."""
    double = np.concatenate([picture, picture[:, ::-1]], axis=1)
    return np.concatenate([double, double[::-1]])


@lru_cache(maxsize=64)
def moved(name, dx_px, dy_px):
    return shifted(whole(name), dx_px, dy_px)


def views(name, shift_px, size_wh=SIZE_WH, corner=CORNER):
    """The same window of a picture and of the shifted picture."""
    (x, y), (width, height) = corner, size_wh
    window = np.s_[y : y + height, x : x + width]
    return whole(name)[window], moved(name, *shift_px)[window]


def error_px(name, shift_px, **window):
    found = register(*views(name, shift_px, **window))
    assert found.quality > 0.5
    return np.array([found.dx_px - shift_px[0], found.dy_px - shift_px[1]])


@EVERY
def test_sub_pixel_shifts_are_exact_and_do_not_lock_to_pixels(name):
    shifts = [(base + q, -base - 0.3 * q) for base in (0, 3) for q in FRACTIONS]
    errors = np.array([error_px(name, shift) for shift in shifts])
    assert rms(errors) <= 0.005
    # Pixel locking is an error that goes with the sine of the fraction.
    locking = 2 * np.mean(errors[:, 0] * np.sin(2 * np.pi * np.tile(FRACTIONS, 2)))
    assert abs(locking) <= 0.003


@EVERY
def test_a_third_of_the_picture_is_found(name):
    for across, down in ((1 / 3, 0), (-1 / 3, 0), (0, 1 / 3), (0.3, -0.2)):
        shift = (across * SIZE_WH[0] + 0.3, down * SIZE_WH[1] - 0.2)
        assert np.abs(error_px(name, shift)).max() < 0.02


@cache
def finer(name):
    """The picture `FINER` times larger, exactly, by zeros around its spectrum."""
    picture = whole(name)[:400, :500] if name in PHOTOGRAPHS else whole(name)
    if name in PHOTOGRAPHS:
        picture = mirrored(picture)
    height, width = picture.shape
    spectrum = np.fft.fftshift(np.fft.fft2(picture))
    around = [((FINER - 1) * n // 2,) * 2 for n in (height, width)]
    fine = np.fft.ifft2(np.fft.ifftshift(np.pad(spectrum, around))).real * FINER**2
    return fine.astype(np.float32)


@pytest.mark.parametrize("name", first_of(1, ["gravel", "camera", "speckle"]))
@pytest.mark.parametrize("angle_deg", [-7.3, -0.2, 1.0, 10.0])
def test_rotation_is_found_to_a_hundredth_of_a_degree(name, angle_deg):
    (x, y), (width, height) = CORNER, SIZE_WH
    centre = np.array([x + (width - 1) / 2, y + (height - 1) / 2])
    angle, shift = np.radians(angle_deg), np.array([2.3, -1.6])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    rows, columns = np.indices((height, width))
    # moving(p) = reference(R^-1 (p - c - d) + c)
    source = (np.stack([columns + x, rows + y], -1) - centre - shift) @ turn + centre
    places = np.moveaxis((source * FINER).astype(np.float32), -1, 0)
    turned = cv2.remap(finer(name), *places, cv2.INTER_LINEAR)
    found = register(views(name, (0, 0))[0], turned)
    assert np.degrees(found.rotation_rad) == pytest.approx(angle_deg, abs=0.01)
    assert (found.dx_px, found.dy_px) == pytest.approx(tuple(shift), abs=0.02)


@pytest.mark.parametrize(
    ("size_wh", "most_px"),
    [((32, 32), 0.3), ((48, 40), 0.2), ((64, 64), 0.1), ((96, 96), 0.02), ((128, 160), 0.01)],
)
@pytest.mark.parametrize("name", first_of(1, ["gravel", "grass", "speckle"]))
def test_small_pictures_are_registered_too(name, size_wh, most_px):
    errors = [
        error_px(name, shift, size_wh=size_wh, corner=corner)
        for shift in ((0.3, -0.2), (2.4, 1.7))
        for corner in ((30, 20), (100, 200), (250, 300))
    ]
    assert rms(errors) <= most_px


@given(
    name=st.sampled_from(PICTURES),
    dx_px=st.floats(-60, 60),
    dy_px=st.floats(-50, 50),
)
def test_any_shift_is_found_and_shifts_add_up(name, dx_px, dy_px):
    there = error_px(name, (dx_px, dy_px))
    first, middle = views(name, (dx_px / 3, dy_px / 3))
    last = views(name, (dx_px, dy_px))[1]
    steps = [register(first, middle), register(middle, last)]
    assert np.abs(there).max() < 0.02
    assert sum(step.dx_px for step in steps) == pytest.approx(dx_px, abs=0.03)
    assert sum(step.dy_px for step in steps) == pytest.approx(dy_px, abs=0.03)


def test_read_only_and_strided_pictures_are_taken_as_they_are():
    a, b = (view.astype(np.float32) for view in views("gravel", (2.4, -1.3)))
    expected = register(a, b)
    wide = [np.repeat(view, 2, axis=1)[:, ::2] for view in (a, b)]
    for view in wide:
        view.flags.writeable = False
    assert register(*wide) == expected


def svd_phase_shift(reference, moving):
    """Shift of the content by the phase matrix's rank one part (Hoge 2003), windowed (Stone 2001).

    After Stone the borders are tapered by Blackman's window, and frequencies are left out that are
    high (aliased) or weak. The whole pixels come from phase correlation and are cut away first.
    """
    shape = np.array(reference.shape)
    surface = np.fft.ifft2(unit(cross_spectrum(reference, moving))).real
    row, column = np.unravel_index(surface.argmax(), surface.shape)
    whole_px = (np.array([row, column]) + shape // 2) % shape - shape // 2
    here, there = (
        tuple(slice(at, at + n) for at, n in zip(start, shape - np.abs(whole_px), strict=True))
        for start in (np.maximum(-whole_px, 0), np.maximum(whole_px, 0))
    )
    centred = np.fft.fftshift(cross_spectrum(reference[here], moving[there]))
    middle, reach = np.array(centred.shape) // 2, (0.3 * np.array(centred.shape)).astype(int)
    low = centred[tuple(slice(m - r, m + r + 1) for m, r in zip(middle, reach, strict=True))]
    strong = np.abs(low) > np.median(np.abs(low))
    left, _, right = np.linalg.svd(unit(low) * strong)
    sides = zip(
        (right[0], left[:, 0]), reach[::-1], centred.shape[::-1], whole_px[::-1], strict=True
    )
    return [float(pixels + phase_slope_px(vector, r, n)) for vector, r, n, pixels in sides]


def cross_spectrum(reference, moving):
    window = np.outer(*(np.blackman(n) for n in reference.shape))
    before, now = (np.fft.fft2((v - v.mean()) * window) for v in (reference, moving))
    return now * np.conj(before)


def unit(product):
    return product / np.maximum(np.abs(product), 1e-12)


def phase_slope_px(vector, reach, length):
    """Shift that a singular vector's phase shows, a line through its clear part."""
    frequency, weight = np.arange(-reach, reach + 1) / length, np.abs(vector)
    clear = weight > 0.1 * weight.max()
    phase = np.unwrap(np.angle(vector))[clear]
    slope, _ = np.polyfit(frequency[clear], phase, 1, w=weight[clear])
    return -slope / (2 * np.pi)


@pytest.mark.parametrize("noise_grey", [0.0, 3.0])
@pytest.mark.parametrize("size_wh", first_of(1, [(128, 128), (96, 96), (320, 240)]))
def test_the_worst_error_on_speckle_is_below_that_of_the_svd_phase_method(size_wh, noise_grey):
    ours, theirs = [], []
    for n, name in enumerate(("fine speckle", "speckle")):
        for k, shift in enumerate([(0.25, -0.5), (0.5, 0.5), (1.37, 2.8), (-2.6, 0.9)]):
            noise = noise_grey * np.random.default_rng(10 * n + k).normal(size=(2, *size_wh[::-1]))
            seen = [
                np.clip(np.rint(view + grain), 0, 255).astype(np.uint8)
                for view, grain in zip(views(name, shift, size_wh), noise, strict=True)
            ]
            found = register(*seen)
            ours.append(np.subtract((found.dx_px, found.dy_px), shift))
            theirs.append(np.subtract(svd_phase_shift(*seen), shift))
    assert np.abs(theirs).max() < 0.1  # the peer works too
    assert np.abs(ours).max() < np.abs(theirs).max()
    if not noise_grey:
        assert np.abs(ours).max() < 0.004
