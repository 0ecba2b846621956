"""The numbers in the 3D view of a report, as Chromium draws them from the file alone."""

import random
from dataclasses import replace
from itertools import combinations

import cv2
import numpy as np
import pytest
import viser
from playwright.sync_api import expect
from reports import entry, report

from app.reports.html.web_page import write
from app.viewer.geometry import Section
from app.viewer.pin_numbers import _Screen, apart
from app.viewer.still import scene_page
from app.viewer.views import view_of

MANY = 28
WINDOW_PX = (1000, 700)
"""So that the 3D view is as low as a label's place assumes."""


def crowded():
    """Return a report whose defects stand close together in the part that the page begins with."""
    rng = random.Random(4)  # noqa: S311
    entries = [
        entry(n, distance_m=round(rng.uniform(0.3, 9.0), 1), code="BAB", clock_from=n % 12 or 12,
              severity=n % 6)
        for n in range(1, MANY + 1)
    ]  # fmt: skip
    return replace(report(), entries=tuple(entries), draw_scene=scene_page)


@pytest.fixture
def picture_of(browser, tmp_path):
    """Show the 3D view of a report; its picture, BGR."""
    context = browser.new_context(
        offline=True, viewport={"width": WINDOW_PX[0], "height": WINDOW_PX[1]}
    )
    page = context.new_page()

    def show(made):
        (tmp_path / "report.html").write_bytes(write(made).content)
        page.goto((tmp_path / "report.html").as_uri())
        page.get_by_role("button", name="Show the 3D view").click()
        frame = page.locator("iframe")
        expect(page.frame_locator("iframe").locator("canvas").first).to_be_visible()
        before = np.zeros((1, 1, 3), np.uint8)
        for _ in range(40):
            page.wait_for_timeout(700)
            taken = cv2.imdecode(np.frombuffer(frame.screenshot(), np.uint8), cv2.IMREAD_COLOR)
            is_drawn = (taken.max(axis=2) > 150).sum() > 2000
            if is_drawn and before.shape == taken.shape and (before == taken).all():
                return taken
            before = taken
        pytest.fail("The 3D view does not come to rest.")

    yield show
    context.close()


def boxes_in(changed):
    """Return (left, top, width, height) of connected changes that are as large as a label."""
    closed = cv2.morphologyEx(changed.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    opened = cv2.morphologyEx(closed, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    _, _, found, _ = cv2.connectedComponentsWithStats(opened)
    return [tuple(map(int, one[:4])) for one in found[1:] if one[4] > 60]


@pytest.mark.long
def test_numbers_of_many_defects_do_not_overlap_as_chromium_draws_them(picture_of, monkeypatch):
    add = viser.SceneApi.add_label

    def add_hidden(self, name, *args, **options):
        label = add(self, name, *args, **options)
        label.visible = not name.startswith("/pins/numbers")
        return label

    made = crowded()
    with monkeypatch.context() as patched:
        patched.setattr(viser.SceneApi, "add_label", add_hidden)
        without = picture_of(made)
    changed = abs(picture_of(made).astype(int) - without.astype(int)).max(axis=2) > 3
    boxes = boxes_in(changed)
    # Labels that touched each other would be one larger box.
    assert len(boxes) == MANY
    assert max(width for _, _, width, _ in boxes) <= 30
    assert max(height for *_, height in boxes) <= 24


def test_numbers_of_many_defects_do_not_overlap():
    section = Section(radius_m=0.15, half_width_m=0.15)
    view = view_of("overview", section, (0.0, 9.0), 0.0, 1.2)
    rng = random.Random(4)  # noqa: S311
    heads = [np.array([rng.uniform(0.3, 9.0), 0.0, 0.0]) for _ in range(MANY)]
    places = apart(range(10, 10 + MANY), heads, -0.4, view)
    found = [place for place in places if place is not None]
    assert len(found) == MANY
    boxes = [_Screen(view).box(place, 24.0) for place in found]
    assert not any(one.meets(other) for one, other in combinations(boxes, 2))


def test_a_label_without_room_is_left_out():
    section = Section(radius_m=0.15, half_width_m=0.15)
    view = view_of("overview", section, (0.0, 6.0), 0.0, 1.2)
    places = apart(range(100, 200), [np.array([3.0, 0.0, 0.0])] * 100, -0.4, view)
    assert places[0].tolist() == [3.0, 0.0, -0.4]
    assert 20 <= sum(place is not None for place in places) < 100
