"""Which entries stand on which page of the pipe graphic, and where on the wall."""

from dataclasses import replace

import pypdfium2
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reportlab.lib.units import mm
from reports import LENGTH_M, report

from app.reports import pdf as document
from app.reports.content.placement import capacity
from app.reports.pdf.pipe_graphic import LABEL, laid_out
from app.reports.template import DEFAULT_TEMPLATE
from app.survey.adjustment.joints import FittedJoint

HEIGHT = 205 * mm
PLACES = st.lists(st.floats(-1, 300), max_size=120).map(sorted)


def with_entries_at(places_m):
    return report(observations=[{"distance_m": round(p, 3), "code": "BAB"} for p in places_m])


@given(PLACES)
def test_every_entry_has_a_label_on_one_page_that_shows_its_place(places_m):
    scale, sheets = laid_out(with_entries_at(places_m), HEIGHT)

    shown = [one.seq for sheet in sheets for one in sheet.entries]
    assert shown == list(range(1, len(places_m) + 1))
    for sheet in sheets:
        assert len(sheet.entries) <= capacity(LABEL, 0, HEIGHT - LABEL)
        assert (sheet.last_m - sheet.first_m) * 1000 / scale <= HEIGHT / mm + 1e-6
        assert all(
            sheet.first_m - 1e-6 <= one.distance_m <= sheet.last_m + 1e-6 for one in sheet.entries
        )


def test_a_short_pipe_with_few_entries_is_one_page_at_a_round_scale():
    scale, sheets = laid_out(with_entries_at([1, 2, 3]), HEIGHT)

    assert (scale, len(sheets)) == (125, 1)
    assert (sheets[0].first_m, sheets[0].last_m) == (0, LENGTH_M)


def test_dense_entries_make_the_scale_finer():
    few, _ = laid_out(with_entries_at([1, 2, 3]), HEIGHT)
    many, _ = laid_out(with_entries_at([n * 0.12 for n in range(200)]), HEIGHT)

    assert many < few


def test_a_hundred_labels_at_one_place_go_on_over_pages_of_it():
    _, sheets = laid_out(with_entries_at([5.0] * 100), HEIGHT)

    assert [(sheet.part, sheet.parts) for sheet in sheets if sheet.entries] == [
        (1, 3), (2, 3), (3, 3),
    ]  # fmt: skip


def test_an_entry_without_a_distance_is_on_no_page():
    made = report(observations=[{"distance_m": None, "code": "BAB"}])

    assert [sheet.entries for sheet in laid_out(made, HEIGHT)[1]] == [()]


@pytest.mark.parametrize("bits", [0.0, 1.3e-11, -1.3e-11])
def test_no_bar_of_a_node_covers_the_number_of_a_joint_at_the_very_end(bits):
    made = report(
        observations=[{"distance_m": 1.0, "code": "BAB"}], distance_m=12.0, header={},
        template=DEFAULT_TEMPLATE.model_copy(update={"sections": ["graphic"]}),
    )  # fmt: skip
    joint = FittedJoint(8, 1000 * (12.0 + bits), 2.0, None, 0, False)
    adjusted = replace(made.adjusted, sighted=(joint,))
    made = replace(made, corrected=replace(made.corrected, adjusted=adjusted))
    page = pypdfium2.PdfDocument(document.write(made).content)[1]
    bars = [box for one in page.get_objects() if 3 < height(box := one.get_bounds()) < 4.2
            and 80 < box[2] - box[0] < 100]  # fmt: skip
    text = page.get_textpage()
    at = text.search("J8").get_next()
    assert at is not None
    _, bottom, _, top = text.get_charbox(at[0])
    assert len(bars) == 2
    assert all(top <= bar[1] or bottom >= bar[3] for bar in bars)


def height(box):
    return box[3] - box[1]
