"""Findings of two walls in register: what is new, grown, gone, and what nobody can say."""

from datetime import UTC, datetime

import pytest

from app.inspections.compared.differences import Difference, Searched, differences_of
from app.survey.findings.records import Finding, Size
from vo_core.alignment.wall_map import Node, WallMap
from vo_core.mosaic.layout import Layout

pytestmark = pytest.mark.unit

GIRTH_MM = 900.0
RING = Layout(500.0, 1.0, -450.0, 450.0, 500, 900)
STRIP = Layout(500.0, 1.0, -130.0, 130.0, 500, 260)
SHIFTED = WallMap(
    "same", [[Node(0.0, 1000.0, 50.0, 0.5), Node(5000.0, 6000.0, 50.0, 0.5)]], [], 150.0, GIRTH_MM
)
TURNED = WallMap(
    "opposite", [[Node(0.0, 6000.0, 0.0, 0.5), Node(5000.0, 1000.0, 0.0, 0.5)]], [], 150.0, GIRTH_MM
)


def crack(name, axial_mm, arc_mm, width_mm=1.0, state="offered"):
    return Finding(
        kind="crack",
        outline_mm=((axial_mm, arc_mm), (axial_mm + 100, arc_mm), (axial_mm + 200, arc_mm)),
        length=Size(200.0, 10.0),
        width=Size(width_mm, 0.3),
        direction="along",
        score=0.9,
        inspection_id="one",
        id=name,
        detector="classical",
        version="1",
        frame=None,
        pixel=None,
        found_at=datetime.now(UTC),
        state=state,
    )


def found(later, earlier, wall_map=SHIFTED, layouts=(RING, RING)):
    return differences_of(Searched(later, layouts[0]), Searched(earlier, layouts[1]), wall_map)


def test_the_same_crack_is_no_difference_and_a_wider_one_has_grown():
    assert found([crack("b", 2000, 0)], [crack("a", 3000, 50)]) == []
    assert found([crack("b", 2000, 0, 2.0)], [crack("a", 3000, 50)]) == [
        Difference("grown", "b", "a")
    ]
    assert found([crack("b", 2000, 0, 1.5)], [crack("a", 3000, 50)]) == []  # within the intervals


def test_a_crack_that_one_wall_shows_is_new_or_gone():
    assert found([crack("b", 2000, 0)], [crack("a", 2000, 0)]) == [
        Difference("new", "b", None),
        Difference("gone", None, "a"),
    ]


def test_across_the_seam_and_from_the_other_end_it_is_the_same():
    assert found([crack("b", 2000, -440)], [crack("a", 3000, -390)]) == []
    assert found([crack("b", 2000, 430)], [crack("a", 3000, -420)]) == []
    assert found([crack("b", 2000, 100)], [crack("a", 3800, -100)], TURNED) == []


def test_what_one_camera_did_not_see_is_neither_new_nor_gone():
    layouts = (RING, STRIP)
    assert found([crack("b", 2000, 300)], [], layouts=layouts) == []
    assert found([crack("b", 2000, 0)], [], layouts=layouts) == [Difference("new", "b", None)]
    assert found([crack("b", 9000, 0)], [crack("a", 100, 0)]) == []  # no map there


def test_what_a_person_rejected_is_no_difference_and_stays_known():
    assert found([crack("b", 2000, 0, state="rejected")], []) == []
    assert found([crack("b", 2000, 0)], [crack("a", 3000, 50, state="rejected")]) == []
