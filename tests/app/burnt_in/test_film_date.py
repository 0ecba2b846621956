"""The date that a recorder has burnt into a film, and what is no date."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from app.burnt_in.box import Box
from app.burnt_in.film_date import date_in, shown_date
from app.burnt_in.text_model import Letter

pytestmark = pytest.mark.unit


def letters(text: str, sure: float = 0.99) -> tuple[Letter, ...]:
    return tuple(Letter(letter, sure, "", 0.0) for letter in text)


@pytest.mark.parametrize(
    ("text", "day"),
    [
        ("2019/05/17", date(2019, 5, 17)),
        ("2019-05-17 14:05:33", date(2019, 5, 17)),
        ("DATE: 17.05.2019", date(2019, 5, 17)),
        ("03.04.2019", date(2019, 4, 3)),
        ("17/05/2019", date(2019, 5, 17)),
        ("05/17/2019", date(2019, 5, 17)),
        ("05/05/2019", date(2019, 5, 5)),
    ],
)
def test_a_date_is_read(text: str, day: date) -> None:
    assert date_in(letters(text)) == day


@pytest.mark.parametrize(
    "text",
    [
        "03/04/2019",
        "2019/13/40",
        "0012.3 m",
        "MH 228 - 221",
        "14:05:33",
        "1970-01-01",
        "2019-05/17",
    ],
)
def test_what_is_uncertain_or_no_date_is_left_out(text: str) -> None:
    assert date_in(letters(text)) is None


def test_a_date_that_is_hard_to_read_is_left_out() -> None:
    assert date_in(letters("2019/05/17", sure=0.5)) is None


@pytest.mark.parametrize(
    ("texts", "day"),
    [
        (["2019/05/17", "2019/05/17", "2019/05/11"], date(2019, 5, 17)),
        (["2019/05/17", "", ""], None),
        (["2019/05/17", "2019/05/18", "2019/05/19"], None),
    ],
)
def test_two_pictures_must_show_the_same_date(texts: list[str], day: date | None) -> None:
    shown = iter(texts)
    picture = np.zeros((20, 100, 3), np.uint8)
    found = shown_date(
        [picture] * len(texts),
        [[Box(0, 0, 100, 20)]] * len(texts),
        lambda _: letters(next(shown)),
    )
    assert found == day
