"""How wide an interval may be before a distance is of no use."""

import pytest

from app.survey.distances.intended_use import IntendedUse


@pytest.mark.parametrize(
    ("length_m", "u95_m", "is_met"),
    [
        (2.83, 0.3, True),
        (2.83, 4.89, False),
        (60.0, 1.2, True),
        (-60.0, 1.2, True),
        (60.0, 1.3, False),
        (12.0, None, None),
        (None, None, None),
    ],
)
def test_the_greater_of_a_length_and_a_share_counts(
    length_m: float | None, u95_m: float | None, is_met: bool | None
) -> None:
    assert IntendedUse().is_met(length_m, u95_m) is is_met
