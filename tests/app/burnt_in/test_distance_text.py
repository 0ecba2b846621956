"""Which numbers of a line of text are distances, and what they are."""

import pytest

from app.burnt_in.distance_text import read_distance
from app.burnt_in.text_model import Letter

pytestmark = pytest.mark.unit


def letters(text, *, sure=0.99):
    return [Letter(letter, sure, "", 0.0) for letter in text]


@pytest.mark.parametrize(
    ("text", "value", "decimals", "unit"),
    [
        ("0012.3 m", 12.3, 1, "m"),
        ("+12.34m", 12.34, 2, "m"),
        ("DIST: 49.5 FT", 49.5, 1, "ft"),
        ("-0.5 m", -0.5, 1, "m"),
        ("12,3 m", 12.3, 1, "m"),
        ("0007.0", 7.0, 1, ""),
        ("0012. 3", 12.3, 1, ""),
        ("2019/05/17 14:05:33 8.4m", 8.4, 1, "m"),
        ("DN 300 17.2 ft", 17.2, 1, "ft"),
        ("228", 228.0, 0, ""),
    ],
)
def test_a_distance_is_read_with_its_decimals_and_unit(text, value, decimals, unit):
    (found,) = read_distance(letters(text))
    assert (found.value, found.decimals, found.unit) == (value, decimals, unit)


@pytest.mark.parametrize(
    "text",
    [
        "14:05:33",
        "2019/05/17",
        "17.05.2019",
        "14:05:33.25",
        "21.4 C",
        "0.31 bar",
        "3.5%",
        "DN 0.30 m",
        "MH",
        "",
    ],
)
def test_a_clock_a_date_and_other_quantities_are_no_distance(text):
    assert not [found for found in read_distance(letters(text)) if found.decimals]


def test_a_distance_is_as_certain_as_its_least_certain_character():
    line = letters("D 12.3 m")
    line[3] = Letter("2", 0.7, "7", 0.25)
    line[7] = Letter("m", 0.1, "n", 0.1)  # the unit is no part of the number
    first, second = read_distance(line)
    assert (first.value, first.sure) == (12.3, 0.7)
    assert (second.value, second.sure) == (17.3, 0.25)


def test_a_word_such_as_dist_announces_a_distance():
    assert read_distance(letters("DIST: 49.5"))[0].is_named
    assert not read_distance(letters("MH 49.5"))[0].is_named
