"""The drawing of the wall, measured on the page by PDFium, which shares nothing with its writer."""

import math
import re
from dataclasses import replace

import cv2
import numpy as np
import pypdfium2 as pdfium
import pytest
from reports import full_report

from app.reports.content.translator import Translator
from app.reports.content.wall import place_of, wall_of
from app.reports.pdf.flow import Figure
from app.reports.pdf.pages import made
from app.reports.pdf.unrolled_wall import unrolled_wall
from vo_core.mosaic.mosaic import UNSEEN_GREY

MM = 72 / 25.4
PATH = 2
"""PDFium's number of path objects."""


class Sheets:
    """The pages, as PDFium reads them."""

    def __init__(self, report):
        t = Translator.of(report)
        self.pages = list(pdfium.PdfDocument(made(report, t, "Wall", unrolled_wall(report, t))))
        self.text = "\n".join(page.get_textpage().get_text_range() for page in self.pages)

    def boxes(self, text, page=0):
        """Return (left, bottom, right, top) of a text wherever it is on a page, points."""
        read = self.pages[page].get_textpage()
        search = read.search(text, match_case=True, match_whole_word=True)
        found = []
        while (hit := search.get_next()) is not None:
            at, count = hit
            chars = [read.get_charbox(at + n) for n in range(count)]
            lefts, bottoms, rights, tops = zip(*chars, strict=True)
            found.append((min(lefts), min(bottoms), max(rights), max(tops)))
        return found

    def middle(self, text, page=0):
        left, bottom, right, top = self.boxes(text, page)[0]
        return (left + right) / 2, (bottom + top) / 2

    def picture(self, page=0, scale=3):
        """Return BGR and the pixels in a point."""
        return self.pages[page].render(scale=scale).to_numpy()[..., :3], scale


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    return full_report(tmp_path_factory.mktemp("wall"))


@pytest.fixture(scope="module")
def sheets(full):
    return Sheets(full)


def test_the_scale_bar_is_as_long_as_it_says_at_the_printed_scale(sheets):
    assert "at scale 1 : 10 along and around" in sheets.text
    left, bottom, _, top = sheets.boxes("0.5 m")[0]
    picture, scale = sheets.picture()
    row = picture[picture.shape[0] - round((bottom + top) / 2 * scale)]
    dark = row.max(axis=1) < 90
    half_px = np.flatnonzero(dark[: round(left * scale)])
    # The left half of the bar is filled, the right half has only an outline.
    runs = np.split(half_px, np.flatnonzero(np.diff(half_px) > 1) + 1)
    longest = max(runs, key=len)
    assert len(longest) / scale == pytest.approx(500 / 10 / 2 * MM, abs=0.8)


def test_distances_joints_and_hours_lie_to_scale(sheets):
    first, last = (sheets.middle(f"{metre} m")[0] for metre in ("0.2", "1.4"))
    assert last - first == pytest.approx(1200 / 10 * MM, abs=0.3)
    joint_x, _ = sheets.middle("J1")
    assert joint_x - first == pytest.approx((1500 - 200) / 10 * MM, abs=1)
    (seven_y,), (six_y,) = ([box[1] for box in sheets.boxes(hour)][:1] for hour in ("7", "6"))
    assert seven_y - six_y == pytest.approx(math.pi * 900 / 12 / 10 * MM, abs=0.3)


def test_the_joint_is_a_line_across_the_strip(sheets):
    joint_x, joint_y = sheets.middle("J1")
    picture, scale = sheets.picture()
    low = picture.shape[0] - round((joint_y + 12 * MM) * scale)
    column = picture[low - 60 : low, round(joint_x * scale) - 2 : round(joint_x * scale) + 3]
    assert (column.max(axis=2).min(axis=1) < 60).mean() > 0.9


def test_only_what_was_seen_is_drawn_and_gaps_are_named(full, tmp_path):
    height, width = full.layout.height_px, full.layout.width_px
    unseen = tmp_path / "unseen.jpg"
    cv2.imwrite(str(unseen), np.full((height, width, 3), UNSEEN_GREY, np.uint8))
    tiles = {k: jpeg for k, jpeg in full.wall.items() if k < 6 and k != 2}
    drawn = Sheets(replace(full, wall=tiles | {-10: unseen, -1: unseen, 7: unseen}))
    spans = re.findall(r"(-?\d+\.\d\d) m to (-?\d+\.\d\d) m", drawn.text)
    assert spans[0][0] == "0.00"
    assert float(spans[-1][1]) == pytest.approx(3.0, abs=0.02)
    # The letters in the drawing are smaller than those of the notes.
    left, _, right, _ = min(drawn.boxes("not seen"), key=lambda box: box[2] - box[0])
    metre_x, _ = drawn.middle("1.2 m")
    assert (left + right) / 2 - metre_x == pytest.approx((1250 - 1200) / 10 * MM, abs=1)
    assert "Hatched: not seen" in drawn.text


def test_a_long_culvert_has_a_coarser_scale_and_few_pages(full):
    tiles = {k: full.wall[k % len(full.wall)] for k in range(600)}
    drawn = Sheets(replace(full, wall=tiles))
    assert len(drawn.pages) <= 9
    (scale,) = set(re.findall(r" m 1 : (\d+) \d", drawn.text))
    assert scale == "50"
    assert "A finer scale would take more than 8 pages" in drawn.text


def test_every_strip_has_a_sentence_that_names_its_observations(full):
    parts = unrolled_wall(full, Translator.of(full))
    alts = [part.alt for part in parts if isinstance(part, Figure)]
    named = ", ".join(re.findall(r"Observations by number: ([\d, ]+)\.", " ".join(alts)))
    assert [int(n) for n in named.split(", ")] == [e.seq for e in full.entries if e.seq < 12]
    assert alts[0].startswith("Unrolled wall from 0.00 m to 1.63 m at scale 1 : 10. Joints: 1.")


@pytest.mark.parametrize(
    ("first", "last", "hours"),
    [(3, None, [(3, 3)]), (9, None, [(-3, -3)]), (3, 9, [(-3, 3)]), (9, 11, [(-5, -3)]),
     (10, 2, [(-6, -4), (4, 6)]), (12, 12, [(-6, 6)]), (12, 3, [(3, 6)])],
)  # fmt: skip
def test_a_sector_lies_on_the_wall_cut_at_the_crown(full, first, last, hours):
    entry = full.entries[2]
    placed = replace(entry, clock_from=first, tag=entry.tag.model_copy(update={"clock_to": last}))
    place = place_of(full, placed)
    hour_mm = math.pi * 900 / 12
    found = np.array(sorted(place.around_mm)) / hour_mm
    assert found == pytest.approx(np.array(hours, float))


def test_thousands_of_observations_at_one_place_fit_on_a_page(full):
    crowd = tuple(replace(full.entries[0], seq=n, distance_m=1.0) for n in range(2100))
    assert "at scale 1 : 10 along" in Sheets(replace(full, entries=crowd)).text


def test_without_a_readable_tile_there_is_no_wall(full, tmp_path):
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(b"\xff\xd8 no picture")
    assert wall_of(replace(full, wall={0: broken, 1: tmp_path / "gone.jpg"})) is None
