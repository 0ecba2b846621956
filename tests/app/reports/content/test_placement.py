"""Labels beside the things they name."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.reports.content.placement import capacity, spread

PLACES = st.lists(st.floats(-50, 350), max_size=25).map(sorted)


@given(PLACES, st.floats(1, 12))
def test_labels_never_overlap_keep_their_order_and_stay_within(wanted, gap):
    places = spread(wanted, gap, 0, 300)

    assert len(places) == len(wanted)
    assert all(0 - 1e-6 <= place <= 300 + 1e-6 for place in places)
    assert all(b - a >= gap - 1e-6 for a, b in pairwise(places))


@given(PLACES, st.floats(1, 12))
def test_no_single_label_could_move_nearer_to_its_place(wanted, gap):
    places = [-1e9, *spread(wanted, gap, 0, 300), 1e9]

    for n, target in enumerate(wanted, 1):
        low, high = max(0, places[n - 1] + gap), min(300, places[n + 1] - gap)
        best = min(max(target, low), max(low, high))
        # Where labels touch each other, one can only come nearer if its neighbours go away.
        assert abs(places[n] - target) <= abs(best - target) + 1e-6


def test_labels_with_room_stay_where_they_are():
    assert spread([10, 50, 90], 5, 0, 100) == [10, 50, 90]


def test_crowded_labels_share_the_way_to_their_place():
    assert spread([50, 50, 50], 10, 0, 100) == [40, 50, 60]


def test_as_many_as_fit_fill_the_page_and_one_more_is_refused():
    most = capacity(10, 0, 100)

    assert spread([0] * most, 10, 0, 100) == [10 * n for n in range(11)]
    with pytest.raises(ValueError, match="do not fit"):
        spread([0] * (most + 1), 10, 0, 100)
