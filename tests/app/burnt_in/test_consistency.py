"""Which readings follow from each other: misread digits are refused, resets are kept."""

import pytest

from app.burnt_in.consistency import Candidate, Stretch, consistent

pytestmark = pytest.mark.unit
TICK = 0.1


def stretches(*readings, step_s=0.3):
    """A stretch for each reading: a value, or several with their probabilities."""
    found = []
    for n, reading in enumerate(readings):
        candidates = reading if isinstance(reading, dict) else {reading: 0.95}
        found.append(
            Stretch(
                first=3 * n,
                last=3 * n + 2,
                first_s=n * step_s,
                last_s=n * step_s + 0.2,
                candidates=tuple(Candidate(*item) for item in candidates.items()),
                readings=3,
            )
        )
    return found


def kept(*readings, **options):
    found = consistent(stretches(*readings, **options), TICK)
    return [None if candidate is None else candidate.value for candidate in found]


def test_a_counter_that_ticks_is_kept():
    drive = [12.0, 12.1, 12.2, 12.3, 12.2, 12.1]
    assert kept(*drive) == drive


def test_a_misread_digit_is_refused():
    assert kept(12.0, 12.1, 82.2, 12.3, 12.4) == [12.0, 12.1, None, 12.3, 12.4]


def test_misread_digits_do_not_widen_what_is_usual():
    readings = [12.0, 12.1, 912.2, 12.3, 12.4, 812.5, 12.6, 12.7, 412.8, 12.9, 13.0]
    assert kept(*readings) == [value if value < 100 else None for value in readings]


def test_the_readings_after_a_reset_are_kept():
    run = [12.0, 12.1, 12.2, 0.0, 0.1, 0.2, 0.3]
    assert kept(*run) == run


def test_of_two_possible_digits_the_one_that_follows_is_chosen():
    assert kept(12.0, 12.1, {17.2: 0.5, 12.2: 0.4}, 12.3, 12.4)[2] == 12.2


def test_a_refuted_alternative_makes_the_other_more_certain():
    found = consistent(stretches(12.0, 12.1, {17.2: 0.5, 12.2: 0.4}, 12.3, 12.4), TICK)
    assert found[2].sure > 0.75


def test_nothing_is_put_where_nothing_fits():
    assert kept(12.0, 12.1, {55.5: 0.6, 66.6: 0.3}, 12.3, 12.4)[2] is None


def test_a_counter_that_runs_on_unseen_is_kept():
    found = stretches(12.0, 12.1, 12.2, 12.3)
    found += [
        Stretch(300 + 3 * n, 302 + 3 * n, 30 + 0.3 * n, 30.2 + 0.3 * n, (Candidate(v, 0.95),), 3)
        for n, v in enumerate((22.0, 22.1, 22.2))
    ]
    assert all(consistent(found, TICK))


def test_a_film_without_readings_has_none():
    assert consistent([], TICK) == []
