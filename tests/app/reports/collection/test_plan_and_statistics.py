"""What a document over many inspections says of all of them, without the document."""

import math
from dataclasses import replace

import pytest
from reports import report

from app.reports.collection.collected import collected
from app.reports.collection.plan import plan_of
from app.reports.collection.statistics import by_code, grouped, total

CRACK = {"code": "BAB", "char1": "B", "distance_m": 2.0, "severity": 3}
ROOTS = {"code": "BBA", "char1": "A", "distance_m": 5.0, "severity": 5}
START = {"code": "BCD", "char1": "Z", "distance_m": 0.0}


def one(number, *observations, **header):
    made = report(observations=(START, *observations))
    return collected(number, replace(made, header={**made.header, **header}))


def at(number, lat, lon):
    return one(number, start_lat=lat, start_lon=lon, end_lat=lat, end_lon=lon)


def test_counts_are_of_defects_and_a_stretch_counts_once():
    stretch = [
        CRACK | {"cont_id": 1, "cont_role": role, "distance_m": place, "severity": severity}
        for role, place, severity in (("start", 2.0, 2), ("change", 3.0, 4), ("finish", 4.5, 2))
    ]
    found = one(1, *stretch, ROOTS, ROOTS | {"severity": None})
    assert (found.defects, found.urgent, found.worst) == (3, 1, 5)
    assert {code: (c.count, c.worst, c.stretches_m) for code, c in found.codes.items()} == {
        "BAB": (1, 4, pytest.approx(2.5)),
        "BBA": (2, 5, 0),
    }


def test_inspections_are_summed_by_what_they_have_in_common():
    some = [
        one(1, CRACK, material="concrete", road="B 11", year=1960, date="2025-03-01"),
        one(2, ROOTS, CRACK, material="steel", road="B 11", year=None, date="2026-03-01"),
        replace(one(3, ROOTS, material="", road="A 1"), length_m=None),
    ]
    roads = {group.name: group for group in grouped(some, "road")}
    assert [*roads] == ["A 1", "B 11"]
    assert (roads["B 11"].inspections, roads["B 11"].defects, roads["B 11"].worst) == (2, 3, 5)
    assert roads["B 11"].per_100_m == pytest.approx(3 / (2 * 24.6) * 100)
    assert roads["A 1"].per_100_m is None
    assert [group.name for group in grouped(some, "material")] == ["concrete", "steel", ""]
    assert [group.name for group in grouped(some, "built")][-1] == ""
    assert [(c.code, c.defects, c.inspections) for c in by_code(some)] == [
        ("BAB", 2, 2), ("BBA", 2, 2),
    ]  # fmt: skip
    assert total(some).grades == (("overall.2", 1), ("overall.4", 2))


def test_spellings_that_differ_in_capitals_and_blanks_are_one():
    some = [one(n, material=name) for n, name in enumerate(["Concrete", "concrete ", "concrete"])]
    assert [(group.name, group.inspections) for group in grouped(some, "material")] == [
        ("concrete", 3),
    ]  # fmt: skip


def test_the_plan_is_true_to_its_scale_and_north_is_up():
    placed = [at(1, 51.0, 9.0), at(2, 51.01, 9.0), at(3, 51.0, 9.02)]
    plan = plan_of([*placed, one(4, start_lat=None, end_lat=None)], 150, 150)
    assert [one.number for one in plan.unplaced] == [4]
    first, north, east = (run.middle for run in plan.runs)
    degree_mm = 6.371e9 * math.pi / 180
    assert north[0] == pytest.approx(first[0])
    assert (north[1] - first[1]) * plan.scale == pytest.approx(0.01 * degree_mm)
    wide = 0.02 * degree_mm * math.cos(math.radians(51.005))
    assert (east[0] - first[0]) * plan.scale == pytest.approx(wide)
    assert all(0 <= value <= 150 for run in plan.runs for value in run.middle)
    assert plan.bar_mm == pytest.approx(plan.bar_m * 1000 / plan.scale)
    assert 20 <= plan.bar_mm <= 50


def test_culverts_that_lie_together_share_a_label():
    lats = (51.0, 51.00001, 51.00002, 51.5)
    plan = plan_of([at(n, lat, 9.0) for n, lat in enumerate(lats, 1)], 100, 100)
    assert sorted(label.text for label in plan.labels) == ["1–3", "4"]


def test_one_culvert_and_places_at_the_pole_have_a_plan():
    assert plan_of([one(1)], 100, 100).scale >= 100
    assert math.isfinite(plan_of([at(1, 90, 0), at(2, 89.9, 170)], 100, 100).scale)
    assert plan_of([one(1, start_lat=None, end_lat=None)], 100, 100).runs == ()
