"""The drawing of the wall, by what its SVG says."""

import math
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from lxml import etree
from reports import ENGLISH, full_report

from app.reports.drawings.seen_wall import wall_of
from app.reports.drawings.unrolled_wall import MOST_PAGES, wall_scale, wall_strips
from vo_core.mosaic.layout import UNSEEN_GREY

SVG = "{http://www.w3.org/2000/svg}"


def strips_of(report):
    return list(wall_strips(report, ENGLISH, wall_of(report)))


def place_of_text(strip, said):
    """Return (x, y) of a text, mm."""
    text = next(t for t in strip.iter(f"{SVG}text") if t.text == said)
    return float(text.get("x")), float(text.get("y"))


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    return full_report(tmp_path_factory.mktemp("wall"))


@pytest.fixture(scope="module")
def strips(full):
    return [etree.fromstring(strip.svg.encode()) for strip in strips_of(full)]


def test_pictures_distances_joints_and_hours_lie_to_scale(full, strips):
    first = strips[0]
    start, _ = place_of_text(first, "0.2 m")
    assert place_of_text(first, "1.4 m")[0] - start == pytest.approx(1200 / 10, abs=0.1)
    assert place_of_text(strips[1], "J1")[0] == pytest.approx(7.0, abs=0.5)
    seven, six = (place_of_text(first, hour)[1] for hour in ("7", "6"))
    assert six - seven == pytest.approx(math.pi * 900 / 12 / 10, abs=0.1)
    pictures = [one for strip in strips for one in strip.iter(f"{SVG}image")]
    assert len(pictures) == len(full.wall)
    arc_mm = full.layout.arc_to_mm - full.layout.arc_from_mm
    for picture in pictures:
        across, high = float(picture.get("width")), float(picture.get("height"))
        assert across / high == pytest.approx(500 / arc_mm, rel=0.01)
    bar = [rect for rect in first.iter(f"{SVG}rect") if rect.get("height") == "1.20"]
    assert [float(rect.get("width")) for rect in bar] == [50, 25]
    assert place_of_text(first, "0.5 m")


def test_only_what_was_seen_is_drawn_and_gaps_are_named(full, tmp_path):
    height, width = full.layout.height_px, full.layout.width_px
    unseen = tmp_path / "unseen.jpg"
    cv2.imwrite(str(unseen), np.full((height, width, 3), UNSEEN_GREY, np.uint8))
    tiles = {k: jpeg for k, jpeg in full.wall.items() if k < 6 and k != 2}
    drawn = strips_of(replace(full, wall=tiles | {-10: unseen, -1: unseen, 7: unseen}))
    spans = [re.search(r"from (\S+) m to (\S+) m", strip.alt).groups() for strip in drawn]
    assert spans[0][0] == "0.00"
    assert float(spans[-1][1]) == pytest.approx(3.0, abs=0.02)
    first = etree.fromstring(drawn[0].svg.encode())
    gap = place_of_text(first, "not seen")[0] - place_of_text(first, "1.2 m")[0]
    assert gap == pytest.approx((1250 - 1200) / 10, abs=1)


def test_a_long_culvert_has_a_coarser_scale_and_few_pages(full):
    long = replace(full, wall={k: full.wall[k % len(full.wall)] for k in range(600)})
    scale = wall_scale(long, wall_of(long))
    assert scale == 50
    assert sum(strip.height_mm for strip in strips_of(long)) < 250 * MOST_PAGES


def test_every_strip_names_its_observations_which_lead_to_their_rows(full, strips):
    drawn = strips_of(full)
    alts = " ".join(strip.alt for strip in drawn)
    named = ", ".join(re.findall(r"Observations by number: ([\d, ]+)\.", alts)).split(", ")
    assert [int(n) for n in named] == [e.number for e in full.entries if e.number < 12]
    assert drawn[0].alt.startswith("Unrolled wall from 0.00 m to 1.50 m at scale 1 : 10.")
    links = [link.get("href") for strip in strips for link in strip.iter(f"{SVG}a")]
    assert links == [f"#no-{n}" for n in named]


def test_thousands_of_observations_at_one_place_fit_on_a_page(full):
    crowd = tuple(replace(full.entries[0], number=n, distance_m=1.0) for n in range(2100))
    crowded = replace(full, entries=crowd)
    assert wall_scale(crowded, wall_of(crowded)) == 10
    assert strips_of(crowded)[0].height_mm < 218


def test_without_a_readable_tile_there_is_no_wall(full, tmp_path):
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(b"\xff\xd8 no picture")
    assert wall_of(replace(full, wall={0: broken, 1: tmp_path / "gone.jpg"})) is None
