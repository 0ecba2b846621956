"""The pipe cut open along its crown."""

import pytest

from app.reports.content.cut_pipe import clock_spans


@pytest.mark.parametrize(
    ("first", "last", "spans"),
    [
        (None, None, []),
        (6, None, [(0.5, 0.5)]),
        (3, None, [(0.75, 0.75)]),
        (9, None, [(0.25, 0.25)]),
        (3, 6, [(0.5, 0.75)]),
        (9, 12, [(0.0, 0.25)]),
        (12, 3, [(0.75, 1.0)]),
        (9, 3, [(0.0, 0.25), (0.75, 1.0)]),
        (12, 12, [(0.0, 1.0)]),
    ],
)
def test_a_clock_sector_lies_where_the_wall_is_cut_at_the_crown(first, last, spans):
    assert clock_spans(first, last) == spans
