"""Which entries stand on which sheet of the pipe graphic, and where on the wall."""

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree
from reports import ENGLISH, LENGTH_M, OBSERVATIONS, report

from app.reports.drawings.pipe_graphic import PAGE_MM, laid_out, pipe_sheets, whole_pipe
from app.reports.drawings.svg import NARROW, WASH, WIDTH
from app.survey.adjustment.joints import FittedJoint

PLACES = st.lists(st.floats(-1, 300), max_size=120).map(sorted)
SVG = "{http://www.w3.org/2000/svg}"


def with_entries_at(places_m):
    return report(observations=[{"distance_m": round(p, 3), "code": "BAB"} for p in places_m])


def read(drawing):
    return etree.fromstring(drawing.svg.encode())


def texts_of(node):
    return ["".join(text.itertext()) for text in node.iter(f"{SVG}text")]


@given(PLACES)
def test_every_entry_has_a_label_on_one_sheet_that_shows_its_place(places_m):
    scale, sheets = laid_out(with_entries_at(places_m), ENGLISH)
    shown = [label.entry.number for sheet in sheets for label in sheet.labels]
    assert shown == list(range(1, len(places_m) + 1))
    for sheet in sheets:
        first_m, last_m = sheet.span_m
        assert sum(label.height for label in sheet.labels) <= PAGE_MM
        assert (last_m - first_m) * 1000 / scale <= PAGE_MM + 1e-6
        assert all(
            first_m - 1e-6 <= label.entry.distance_m <= last_m + 1e-6 for label in sheet.labels
        )


def test_a_short_pipe_with_few_entries_is_one_sheet_at_a_round_scale():
    scale, (sheet,) = laid_out(with_entries_at([1, 2, 3]), ENGLISH)
    assert (scale, sheet.span_m) == (125, (0, LENGTH_M))


def test_dense_entries_make_the_scale_finer_or_go_on_over_sheets_of_one_place():
    few, _ = laid_out(with_entries_at([1, 2, 3]), ENGLISH)
    many, _ = laid_out(with_entries_at([n * 0.12 for n in range(200)]), ENGLISH)
    assert many < few
    _, sheets = laid_out(with_entries_at([5.0] * 100), ENGLISH)
    parts = [(sheet.part, sheet.parts) for sheet in sheets if sheet.labels]
    assert parts == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize("width_mm", [WIDTH, NARROW])
def test_marks_lie_to_scale_and_labels_in_full_lead_to_their_rows(width_mm):
    made = report()
    drawn = read(whole_pipe(made, ENGLISH, width_mm))
    labels = drawn.findall(f"{SVG}a")
    assert [label.get("href") for label in labels] == [f"#no-{n}" for n in range(1, 13)]
    for label, entry in zip(labels, made.entries, strict=True):
        said = " ".join(texts_of(label)).replace(" ", "")
        assert ENGLISH.label(entry).replace(" ", "") in said
        assert ENGLISH.short_place(entry).replace(" ", "") in said
    tops = [float(label.find(f"{SVG}rect").get("y")) for label in labels]
    assert min(below - above for above, below in pairwise(tops)) > 3.2
    wall = next(drawn.iter(f"{SVG}rect"))
    top, high = float(wall.get("y")), float(wall.get("height"))
    single = [f for f in OBSERVATIONS if f.get("clock_from") and not f.get("clock_to")]
    places = sorted(float(circle.get("cy")) for circle in drawn.iter(f"{SVG}circle"))
    for y, fields in zip(places, single, strict=True):
        assert (y - top) / high == pytest.approx(fields["distance_m"] / 24.6, abs=0.001)


def test_an_entry_without_a_distance_has_no_label_and_one_without_a_severity_no_colour():
    made = report(
        observations=[
            {"distance_m": 3.0, "code": "BAB", "clock_from": 3},
            {"distance_m": None, "code": "BAB"},
        ]
    )
    (sheet,) = map(read, pipe_sheets(made, ENGLISH))
    assert {mark.get("fill") for mark in sheet.iter(f"{SVG}circle")} == {WASH}
    assert len(sheet.findall(f"{SVG}a")) == 1


@pytest.mark.parametrize("bits", [0.0, 1.3e-11, -1.3e-11])
def test_no_bar_of_a_node_covers_the_number_of_a_joint_at_the_very_end(bits):
    made = report(observations=[{"distance_m": 1.0, "code": "BAB"}], distance_m=12.0, header={})
    joint = FittedJoint(8, 1000 * (12.0 + bits), 2.0, None, 0, False)
    adjusted = replace(made.adjusted, sighted=(joint,))
    made = replace(made, corrected=replace(made.corrected, adjusted=adjusted))
    (sheet,) = map(read, pipe_sheets(made, ENGLISH))
    accent = made.template.accent
    bars = [float(bar.get("y")) for bar in sheet.iter(f"{SVG}rect") if bar.get("fill") == accent]
    (name,) = (float(t.get("y")) for t in sheet.iter(f"{SVG}text") if t.text == "J8")
    assert len(bars) == 2
    assert all(name <= bar or name - 1.5 >= bar + 1.3 for bar in bars)
