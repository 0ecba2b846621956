"""What a machine leaves out that cannot follow its camera."""

from __future__ import annotations

from collections.abc import Sequence

from app.jobs.live.load import ORDER, Load


def after(shares: Sequence[float], load: Load | None = None) -> Load:
    """A load that has seen so many windows of four seconds, by their shares of skipped frames."""
    load = load or Load()
    captured, skipped, now_s = 0, 0, 0.0
    load.note(captured, skipped, now_s)
    now_s += 10.0
    load.note(captured, skipped, now_s)
    for share in shares:
        captured, skipped, now_s = captured + 100, skipped + round(100 * share), now_s + 4.0
        load.note(captured, skipped, now_s)
    return load


def test_the_view_goes_first_then_the_wall_then_pictures() -> None:
    for windows in range(5):
        assert after([0.4] * windows).shed == ORDER[:windows]
    assert ORDER == ("view", "wall", "pictures")
    assert after([0.4]).skipped_share == 0.4


def test_what_a_machine_can_bear_changes_nothing() -> None:
    assert after([0.0, 0.1, 0.19, 0.1]).shed == ()
    assert after([0.4, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]).shed == ("view",)


def test_it_comes_back_in_the_opposite_order_once_the_machine_has_kept_up_for_a_while() -> None:
    assert after([0.4, 0.4, *[0.0] * 4]).shed == ("view", "wall")
    assert after([0.4, 0.4, *[0.0] * 5]).shed == ("view",)
    assert after([0.4, 0.4, *[0.0] * 10]).shed == ()


def test_the_beginning_does_not_count() -> None:
    load = Load()
    for n in range(6):
        load.note(30 * n, 29 * n, float(n))
    assert load.shed == ()
