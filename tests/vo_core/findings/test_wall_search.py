"""What lies on several patches is one finding, in whichever order the wall grows."""

import cv2
import numpy as np
import pytest

from vo_core.findings.finding import Finding
from vo_core.findings.measuring import length_of
from vo_core.findings.patches import blocks_of, patch_of, tiles_of
from vo_core.findings.search import Search, propose
from vo_core.mosaic.layout import Layout
from vo_core.mosaic.mosaic import Tile

pytestmark = pytest.mark.unit

GIRTH_MM = 600.0
RING = Layout(500.0, 2.0, -GIRTH_MM / 2, GIRTH_MM / 2, width_px=250, height_px=300)


class DarkAreas:
    """Proposes the outline of each dark area."""

    def propose(self, patch):
        dark = (patch.image[..., 0] < 100).astype(np.uint8) * (patch.weight > 0)
        contours, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        outlines = [patch.to_mm(contour[:, 0].astype(float)) for contour in contours]
        return [Finding("stain", outline, None, None, None, 0.5) for outline in outlines]


def wall(*rectangles_mm):
    """Patches of 12 tiles from -1 m with dark rectangles (axial from, to, arc from, to)."""
    picture = np.full((300, 12 * 250, 3), 128, np.uint8)
    for x0, x1, y0, y1 in rectangles_mm:
        rows = np.arange(round((y0 + 300) / 2), round((y1 + 300) / 2)) % 300
        picture[rows, round((x0 + 1000) / 2) : round((x1 + 1000) / 2)] = 40
    tiles = {
        k: Tile(k, picture[:, (k + 2) * 250 :][:, :250], np.ones((300, 250), np.float32))
        for k in range(-2, 10)
    }
    return [patch_of(RING, k, tiles.get, girth_mm=GIRTH_MM) for k in blocks_of(tiles)]


def boxes(found):
    return [
        np.rint([*finding.axial_range_mm, *finding.outline_mm[:, 1][[0, 0]]])[:2].tolist()
        for finding in sorted(found, key=lambda one: one.axial_range_mm)
    ]


def test_an_area_in_the_overlap_of_two_patches_is_one_finding():
    assert boxes(propose(DarkAreas(), wall((900, 1100, 0, 50)))) == [[901, 1099]]


def test_an_area_over_four_blocks_is_one_finding_as_long_as_it_is():
    (found,) = propose(DarkAreas(), wall((-300, 3300, 0, 50), (-1, -1, 0, 0)))
    assert found.axial_range_mm == pytest.approx((-300, 3300), abs=3)
    assert np.ptp(found.outline_mm[:, 1]) == pytest.approx(50, abs=5)


def test_an_area_across_the_seam_of_the_ring_is_one_finding_around_its_middle():
    (found,) = propose(DarkAreas(), wall((400, 600, 260, 340)))
    assert abs(found.middle_mm[1]) == pytest.approx(300, abs=2)
    assert np.ptp(found.outline_mm[:, 1]) == pytest.approx(78)


@pytest.mark.parametrize("order", [1, -1])
def test_a_growing_wall_tells_each_finding_once_when_it_is_complete(order):
    areas = [(x, x + 150, -100, -50) for x in range(-900, 4900, 230)]
    search, patches = Search(DarkAreas()), wall(*areas)
    told = [boxes(search.add(patch)) for patch in patches[::order]]
    assert all(told[1:])
    every = [box for part in told for box in part] + boxes(search.finish())
    assert sorted(every) == boxes(propose(DarkAreas(), patches))
    assert len(every) == len(areas)


class OneCrack:
    """Proposes the part of a line that a patch shows, seen a little differently by each."""

    def __init__(self, line_mm):
        self.line_mm = line_mm

    def propose(self, patch):
        to_mm = patch.axial_from_mm + patch.image.shape[1] * patch.mm_per_px
        axial_mm = self.line_mm[:, 0]
        line_mm = self.line_mm[(axial_mm > patch.axial_from_mm) & (axial_mm < to_mm)]
        if len(line_mm) < 2:
            return []
        line_mm = line_mm + [0.0, 1.0 if patch.axial_from_mm > 0 else -1.0]
        return [Finding("crack", line_mm, length_of(line_mm), None, None, 0.5)]


@pytest.mark.parametrize("end_mm", [(1020.0, 200.0), (1700.0, -150.0)])
def test_a_crack_that_winds_about_the_border_of_two_patches_is_as_long_as_it_is(end_mm):
    share = np.linspace(0.0, 1.0, 400)[:, None]
    line_mm = (1 - share) * [980.0, -200.0] + share * end_mm
    line_mm += np.sin(40 * share) * [15.0, 0.0]
    (found,) = propose(OneCrack(line_mm), wall((-1, -1, 0, 0)))
    assert found.length.mm == pytest.approx(length_of(line_mm).mm, abs=5)
    assert length_of(found.outline_mm).mm == pytest.approx(found.length.mm)


def test_two_areas_beside_each_other_stay_two():
    assert len(propose(DarkAreas(), wall((900, 1100, 0, 40), (900, 1100, 60, 100)))) == 2


def test_a_patch_reads_its_block_and_its_neighbours():
    assert list(tiles_of(-1)) == [-3, -2, -1, 0]
