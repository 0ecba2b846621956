"""The 3D view of a report shows each observation as the live view does."""

from dataclasses import replace

import pytest
from reports import report

import app.viewer.still as still
from app.viewer.pins import Pin


@pytest.fixture
def drawn(monkeypatch):
    """Draw a report; the pins in its scene."""
    shown: list[tuple[Pin, ...]] = []

    def keep(_rig, _track, _estimate, pins, *_others):
        shown.append(tuple(pins))
        return ""

    monkeypatch.setattr(still, "still_page", keep)

    def draw(made):
        still.scene_page(made)
        return shown[-1]

    return draw


def test_a_pin_stands_where_the_pixel_shows_it_not_at_the_full_hour(drawn):
    made = report()
    (first, *_) = [entry for entry in made.entries if entry.tag.clock_from is None]
    (pin,) = drawn(replace(made, entries=(replace(first, clock_from=3, clock_h=3.4),)))
    assert pin.clock == 3.4


def test_a_pin_stands_where_a_person_stated_it(drawn):
    made = report()
    (first, *_) = [entry for entry in made.entries if entry.tag.clock_from is not None]
    (pin,) = drawn(replace(made, entries=(replace(first, clock_h=3.4),)))
    assert pin.clock == first.tag.clock_from
