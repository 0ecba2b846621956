"""Two pictures of one wall, by different cameras and in different light, come into register."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from vo_core import InvalidRig
from vo_core.alignment.align import ANCHOR_MM, align
from vo_core.alignment.raster import Wall
from vo_core.mosaic.layout import Layout

pytestmark = pytest.mark.unit

PX_MM = 4.0
GIRTH_MM = 480.0
RING = Layout(500.0, PX_MM, -GIRTH_MM / 2, GIRTH_MM / 2, width_px=125, height_px=120)
STRIP = Layout(500.0, PX_MM, -120.0, 120.0, width_px=125, height_px=60)


def surface(seed, length_mm, rows=120):
    """Grey texture around a pipe with joints every 1.5 m, whatever the seed."""
    rng = np.random.default_rng(seed)
    shape = (rows, round(length_mm / PX_MM))
    grey = np.full(shape, 118.0, np.float32)
    for weight, sigma in ((5, 0.8), (18, 2.0), (72, 8.0)):
        noise = rng.standard_normal(shape).astype(np.float32)
        grey += weight * cv2.GaussianBlur(noise, (0, 0), sigma)
    for joint in range(100, shape[1], round(1500 / PX_MM)):
        grey[:, joint : joint + 2] -= 60
    return grey


def wall(grey, layout=RING, girth_mm=GIRTH_MM, first=0, noise=0):
    """A wall that shows a picture from its column 0 on."""
    rng = np.random.default_rng(noise)
    grey = grey + rng.normal(0, 3, grey.shape)
    picture = np.clip(np.rint(grey), 50, 255).astype(np.uint8)
    width = layout.width_px

    def read(index):
        k = index - first
        tile = picture[: layout.height_px, k * width : (k + 1) * width]
        return cv2.cvtColor(np.ascontiguousarray(tile), cv2.COLOR_GRAY2BGR)

    return Wall(layout, girth_mm, range(first, first + grey.shape[1] // width), read)


def stretched(grey, scale, offset_px):
    """Column c shows column offset + c * scale of another picture."""
    columns = int((grey.shape[1] - offset_px - 2) / scale)
    x = (offset_px + np.arange(columns) * scale).astype(np.float32)
    at = np.meshgrid(x, np.arange(len(grey), dtype=np.float32))
    return cv2.remap(grey.astype(np.float32), *at, cv2.INTER_LINEAR)


def test_a_wall_on_itself_is_where_it_is():
    one = wall(surface(1, 4000))
    found = align(one, one)
    assert found.direction == "same"
    assert len(found.stretches) == 1
    assert max(abs(node.earlier_mm - node.axial_mm) for node in found.nodes) < 0.5
    assert found.gaps == []


@pytest.mark.parametrize("is_opposite", [False, True])
def test_another_scale_light_roll_and_direction_are_found(is_opposite):
    grey = surface(2, 6000)
    seen = np.roll(stretched(grey, 1.006, 200), 10, axis=0)
    lit = seen * np.linspace(0.5, 1.1, seen.shape[1]) * np.linspace(1, 0.7, 120)[:, None]
    if is_opposite:
        lit = lit[::-1, ::-1]
    whole = lit[:, : lit.shape[1] // 125 * 125]
    found = align(wall(grey), wall(whole, first=-2, noise=1))
    assert found.direction == ("opposite" if is_opposite else "same")
    for at_mm in np.linspace(-800, 3500, 9):
        place = found.earlier(at_mm)
        column = (at_mm + 1000) / PX_MM - 0.5
        true = 200 + 1.006 * (lit.shape[1] - 1 - column if is_opposite else column) + 0.5
        assert place.axial_mm == pytest.approx(true * PX_MM, abs=4 * place.sigma_mm)
        assert place.sigma_mm < 3
        assert abs(place.arc_mm) == pytest.approx(40, abs=3)
        back = found.later(place.axial_mm, place.arc_mm)
        assert (back.axial_mm, back.arc_mm) == pytest.approx((at_mm, 0), abs=1)


def test_other_culverts_with_the_same_segments_are_never_recognised():
    for seed in range(3, 6):
        assert align(wall(surface(seed, 4000)), wall(surface(seed + 50, 3000))).nodes == []


def test_a_wall_without_texture_gives_no_place():
    blank = np.full((120, 1000), 118.0)
    found = align(wall(blank, noise=1), wall(blank, noise=2))
    assert found.nodes == []
    assert [gap.reason for gap in found.gaps] == ["unlike"]


def test_one_tile_is_too_short_to_be_recognised():
    grey = surface(1, 4000)
    found = align(wall(grey), wall(grey[:, 250:375], noise=3))
    assert (found.nodes, [gap.reason for gap in found.gaps]) == ([], ["short"])
    assert ANCHOR_MM > 500


def test_where_the_wall_was_lined_or_not_seen_the_map_does_not_hold():
    grey = surface(1, 9000)
    new = grey.copy()
    new[:, 750:1375] = surface(99, 2500)
    later = wall(new, noise=4)
    found = align(wall(grey), replace(later, read=lambda k: None if k >= 16 else later.read(k)))
    reasons = [(round(gap.from_mm, -2), round(gap.to_mm, -2), gap.reason) for gap in found.gaps]
    assert [reason for *_, reason in reasons] == ["unlike", "unseen"]
    assert found.earlier(4200.0) is None
    assert found.earlier(6500.0).axial_mm == pytest.approx(6500, abs=1)


def test_after_a_loss_the_wall_goes_on_at_its_place():
    grey = surface(5, 9000)
    jumped = np.hstack([grey[:, :750], grey[:, 1250:2000]])
    found = align(wall(grey), wall(jumped, noise=5))
    assert len(found.stretches) == 2
    assert found.earlier(2000.0).axial_mm == pytest.approx(2000, abs=1)
    assert found.earlier(4500.0).axial_mm == pytest.approx(6500, abs=1)


def test_a_strip_is_found_on_a_ring():
    grey = surface(6, 4000)
    strip = wall(grey[30:90, 250:1000], layout=STRIP, noise=6)
    place = align(wall(grey), strip).earlier(1000.0)
    assert (place.axial_mm, place.arc_mm) == pytest.approx((2000.0, 0.0), abs=1)


def test_pipes_of_different_diameters_are_refused():
    other = replace(RING, arc_from_mm=-400.0, arc_to_mm=400.0)
    with pytest.raises(InvalidRig, match="different pipes: 153 mm wide, and 255 mm wide"):
        align(wall(surface(1, 1000)), wall(surface(1, 1000), other, girth_mm=800.0))
    with pytest.raises(InvalidRig, match="a floor"):
        align(wall(surface(1, 1000)), wall(surface(1, 1000), girth_mm=None))
