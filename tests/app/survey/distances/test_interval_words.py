"""How the interval of a distance is written, wherever it stands."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.reports.content.translator import FOOT_M
from app.survey.distances.interval import U95, half_width_m, half_width_text


@pytest.mark.parametrize(
    ("sigma_mm", "shown"), [(0.0, "0.01"), (0.4, "0.01"), (5.2, "0.02"), (121.0, "0.24")]
)
def test_an_interval_is_rounded_up_and_never_zero(sigma_mm: float, shown: str) -> None:
    assert half_width_text(half_width_m(sigma_mm)) == shown


@given(sigma_mm=st.floats(0, 1e6), is_feet=st.booleans())
def test_no_interval_is_shown_narrower_than_it_is_or_wider_than_one_digit(
    sigma_mm: float, is_feet: bool
) -> None:
    unit_m, decimals = (FOOT_M, 1) if is_feet else (1.0, 2)
    text = half_width_text(half_width_m(sigma_mm), unit_m=unit_m, digits=decimals)
    true = U95 * sigma_mm / 1000 / unit_m
    assert true * (1 - 1e-9) - 1e-9 <= float(text) < true + 0.001 / unit_m + 10**-decimals + 1e-6


def test_what_is_whole_is_not_rounded_up() -> None:
    assert half_width_m(230 / U95) == 0.23
    assert half_width_text(0.23) == "0.23"
