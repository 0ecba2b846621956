"""Text is compared without case and accents, clock positions as sets of hours."""

import pytest

from app.survey.folding import folded, storable, words_of
from app.survey.places.clock_hours import ALL_ROUND, hour_bits


def hours(bits):
    return {hour for hour in range(1, 13) if bits >> (hour - 1) & 1}


@pytest.mark.parametrize(
    ("text", "bare"),
    [
        ("Über die Straße", "uber die strasse"),
        ("  Résidus\n de  béton ", "residus de beton"),
        ("ΔΙΆΒΡΩΣΗ", "διαβρωση"),
        ("ﬁssure №3", "fissure no3"),
        ("half \ud800 and \x00", "half \ufffd and \ufffd"),
    ],
)
def test_text_is_folded(text, bare):
    assert folded(text) == bare


def test_texts_that_are_missing_are_left_out():
    assert folded("A", None, "", "b") == "a b"


def test_a_query_is_words_and_at_most_ten():
    assert words_of("  Root   JOINT ") == ["root", "joint"]
    assert len(words_of(" ".join(map(str, range(1000))))) == 10


def test_what_a_database_cannot_hold_is_replaced_and_nothing_else():
    assert storable("50 %_\\ 😀 \x00\udfff") == "50 %_\\ 😀 \ufffd\ufffd"


@pytest.mark.parametrize(
    ("first", "last", "covered"),
    [
        (3, None, {3}),
        (12, None, {12}),
        (11, 1, {11, 12, 1}),
        (9, 2, {9, 10, 11, 12, 1, 2}),
        (6, 6, {6}),
        (12, 12, set(range(1, 13))),
        (1, 12, set(range(1, 13))),
        (None, None, set()),
        (None, 3, set()),
    ],
)
def test_a_sector_covers_its_hours_clockwise(first, last, covered):
    assert hours(hour_bits(first, last)) == covered


def test_all_round_is_every_hour():
    assert hours(ALL_ROUND) == set(range(1, 13))
