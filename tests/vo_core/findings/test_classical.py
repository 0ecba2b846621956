"""The classical detector on drawn walls: what it finds, of which size, and what it lets be."""

import cv2
import numpy as np
import pytest

from vo_core.findings.classical import Classical
from vo_core.findings.patches import WallPatch

pytestmark = pytest.mark.unit

FINE_MM = 0.25
PIPE_MM = 300.0


class Sheet:
    """A concrete wall of 600 mm by a strip or a ring, drawn finely and seen at `mm_per_px`."""

    def __init__(self, around_mm=240.0, seed=1, texture=0.06):
        rng = np.random.default_rng(seed)
        self.around_mm = around_mm
        rows, columns = round(around_mm / FINE_MM), round(600 / FINE_MM)
        self.light = np.ones((rows, columns), np.float32)
        for cell_mm in (1, 3, 30):
            few = (round(around_mm / cell_mm) + 2, round(600 / cell_mm) + 2)
            coarse = rng.standard_normal(few).astype(np.float32)
            self.light += texture / 2 * cv2.resize(coarse, (columns, rows))
        self.rows_mm = (np.arange(rows) + 0.5) * FINE_MM
        self.columns_mm = (np.arange(columns) + 0.5) * FINE_MM

    def gap(self, points_mm, width_mm, share=0.9):
        """A dark line of exactly this width; `share` of the light is missing in it."""
        bare = np.ones(self.light.shape, np.uint8)
        points = np.rint((np.array(points_mm) / FINE_MM - 0.5) * 16).astype(np.int32)
        cv2.polylines(bare, [points], False, 0, 1, cv2.LINE_8, 4)
        away = cv2.distanceTransform(bare, cv2.DIST_L2, 5) * FINE_MM
        self.light *= 1 - share * np.clip((width_mm / 2 - away) / FINE_MM + 0.5, 0, 1)
        return self

    def ring(self, at_mm, widths_mm):
        """A joint whose gap has this width, the same or one for each row."""
        right_mm = np.abs(self.columns_mm[None] - at_mm)
        half_mm = np.broadcast_to(widths_mm, self.rows_mm.shape)[:, None] / 2
        self.light *= 1 - 0.75 * np.clip((half_mm - right_mm) / FINE_MM + 0.5, 0, 1)
        return self

    def ellipse(self, middle_mm, radius_mm, light):
        """An area of another brightness."""
        x, y = self.columns_mm[None] - middle_mm[0], self.rows_mm[:, None] - middle_mm[1]
        self.light *= np.where(np.hypot(x, y) < radius_mm, np.float32(light), 1)
        return self

    def patch(self, mm_per_px=0.8, weight=None, girth_mm=None):
        size_wh = (round(600 / mm_per_px), round(self.around_mm / mm_per_px))
        soft = cv2.GaussianBlur(self.light, (0, 0), 0.7 * mm_per_px / FINE_MM)
        grey = 118 * cv2.resize(soft, size_wh, interpolation=cv2.INTER_AREA)
        image = np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
        seen = np.ones(grey.shape, np.float32) if weight is None else weight(size_wh)
        return WallPatch(image, seen, 0.0, 0.0, mm_per_px, mm_per_px, girth_mm)


def winding(start, end, sway_mm=4.0):
    """A line that winds as cracks do."""
    share = np.linspace(0, 1, 80)[:, None]
    ahead = np.subtract(end, start)
    normal = np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead)
    return start + share * ahead + sway_mm * np.sin(9 * share) * normal


LINES = {
    "along": winding((200, 120), (330, 125)),
    "across": winding((300, 40), (305, 190)),
    "oblique": winding((200, 60), (320, 170)),
}


@pytest.mark.parametrize(
    ("direction", "width_mm", "mm_per_px"),
    [("along", 1.0, 0.5), ("along", 3.0, 1.4), ("across", 1.0, 1.4), ("oblique", 3.0, 0.5)],
)
def test_a_crack_is_found_with_its_direction_and_size(direction, width_mm, mm_per_px):
    line = LINES[direction]
    (found,) = Classical().propose(Sheet().gap(line, width_mm).patch(mm_per_px))
    assert (found.kind, found.direction) == ("crack", direction)
    length_mm = np.hypot(*np.diff(line, axis=0).T).sum()
    assert found.length.mm == pytest.approx(length_mm, abs=7)  # two ends of some mm each
    assert abs(found.width.mm - width_mm) < 3 * found.width.sigma_mm
    assert found.width.sigma_mm < 0.3 * width_mm


@pytest.mark.parametrize("texture", [0.0, 0.12])
def test_a_sound_wall_gives_nothing(texture):
    assert Classical().propose(Sheet(texture=texture).patch()) == []


def test_a_hair_crack_gives_nothing():
    assert Classical().propose(Sheet().gap(LINES["along"], 0.3).patch()) == []


def test_the_ragged_border_of_what_was_seen_gives_nothing():
    def weight(size_wh):
        border = 30 + 8 * np.sin(np.arange(size_wh[0]) / 9)
        return (np.arange(size_wh[1])[:, None] > border).astype(np.float32)

    patch = Sheet().patch(weight=weight)
    patch.image[patch.weight == 0] = 44
    assert Classical().propose(patch) == []


def test_an_unseen_patch_gives_nothing():
    assert Classical().propose(Sheet().patch(weight=lambda wh: np.zeros(wh[::-1]))) == []


def test_a_joint_as_it_was_laid_gives_nothing():
    assert Classical().propose(Sheet().ring(300, 8.0).patch()) == []


def test_a_crack_that_meets_a_joint_is_found_beside_it():
    sheet = Sheet().ring(300, 8.0).gap(winding((295, 100), (450, 110)), 2.0)
    (found,) = Classical().propose(sheet.patch())
    assert found.kind == "crack"
    assert found.length.mm == pytest.approx(155, abs=20)


def test_a_wide_joint_is_open_by_its_gap():
    (found,) = Classical().propose(Sheet().ring(300, 24.0).patch())
    assert found.kind == "joint_open"
    assert found.width.mm == pytest.approx(24, abs=2)


def test_a_gap_that_differs_around_the_pipe_is_a_displaced_joint():
    around_mm = np.pi * PIPE_MM
    sheet = Sheet(around_mm)
    sheet.ring(300, 9 + 5 * np.cos(2 * np.pi * sheet.rows_mm / around_mm))
    (found,) = Classical().propose(sheet.patch(1.4, girth_mm=around_mm))
    assert found.kind == "joint_displaced"


@pytest.mark.parametrize(("light", "kind"), [(0.05, "hole"), (0.6, "stain")])
def test_a_dark_area_is_a_hole_or_a_stain(light, kind):
    (found,) = Classical().propose(Sheet().ellipse((300, 120), 40, light).patch())
    assert found.kind == kind
    assert np.hypot(*np.subtract(found.middle_mm, (300, 120))) < 10
    assert found.length.mm == pytest.approx(80, abs=16)
