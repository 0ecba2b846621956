"""Two runs of the same culvert side by side."""

from __future__ import annotations

import json
import re
import uuid
from collections.abc import Mapping
from datetime import date

import numpy as np
import pytest
from clips import numbered_clip, rig_for_clip
from looks import expect_no_fault
from numpy.typing import NDArray
from playwright.sync_api import Page, expect
from steps import Server, log_in

from app.survey.asset_history import Seen, Survey, changes_of, traces_of

FRAMES = 60

# The number that the blocks of a shown picture spell.
DRAWN = """(side) => {
  const canvas = document.querySelectorAll('.compare__stage canvas')[side];
  const { data } = canvas.getContext('2d').getImageData(0, 8, 256, 1);
  let drawn = 0;
  for (let bit = 0; bit < 16; bit += 1) if (data[4 * (16 * bit + 8)] > 128) drawn |= 1 << bit;
  return drawn;
}"""


@pytest.fixture(scope="module")
def runs(server: Server, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """The later one is of a file that browsers do not play, and has a crack that has grown."""
    folder = tmp_path_factory.mktemp("clips")
    rig = rig_for_clip(folder / "rig.json")
    clips = {"earlier.mp4": "libx264", "later.avi": "mpeg4"}
    a, b = (
        server.track(numbered_clip(folder / name, codec, frames=FRAMES), rig)
        for name, codec in clips.items()
    )
    _tag(server, a, {"frame": 20, "code": "BAB", "severity": 2})
    _tag(server, b, {"frame": 22, "code": "BAB", "severity": 4})
    _tag(server, a, {"frame": 40, "code": "BBA", "severity": 2})
    _tag(server, b, {"frame": 40, "code": "BBA", "severity": 2})
    _tag(server, b, {"frame": 44, "code": "BBF", "severity": 1})
    return a, b


def test_defects_are_matched_and_growth_is_shown(
    page: Page, server: Server, runs: tuple[str, str]
) -> None:
    a, b = runs
    log_in(page, server, f"/compare?a={a}&b={b}")
    rows = page.locator(".pair")
    expect(rows).to_have_count(3)
    expect(rows.nth(0)).to_contain_text("BAB")
    expect(rows.nth(0)).to_contain_text("severity 2 to 4")
    expect(rows.nth(1)).to_contain_text("Unchanged")
    expect(rows.nth(2)).to_contain_text("New")
    page.get_by_role("button", name="Grown 1").click()
    expect(rows).to_have_count(1)


def test_both_pictures_go_where_the_defect_was_tagged(
    page: Page, server: Server, runs: tuple[str, str]
) -> None:
    a, b = runs
    log_in(page, server, f"/compare?a={a}&b={b}")
    page.locator(".pair__main").first.click()
    _expect_frames(page, 20, 22)


def test_arrows_move_both_runs_along_the_culvert(
    page: Page, server: Server, runs: tuple[str, str]
) -> None:
    a, b = runs
    log_in(page, server, f"/compare?a={a}&b={b}")
    _expect_frames(page, 0, 0)
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    expect(page.locator(".compare__place")).to_have_text("0.04 m")
    _expect_frames(page, *(_frame_at(server, run, 40.0) for run in runs))


def test_a_run_from_the_other_end_is_turned_round(
    page: Page, server: Server, runs: tuple[str, str]
) -> None:
    a, b = runs
    log_in(page, server, f"/compare?a={a}&b={b}")
    page.get_by_label("B was driven from the other end").check()
    page.get_by_label("Length of the culvert").fill("0.1")
    page.keyboard.press("Enter")
    page.keyboard.press("Home")
    last = FRAMES - 1
    expect(page.locator(".compare__run").nth(1)).to_contain_text(f"frame {last}")


def test_runs_are_chosen_on_the_page(page: Page, server: Server, runs: tuple[str, str]) -> None:
    a, b = runs
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    log_in(page, server, f"/compare?a={a}")
    run_b, search = page.get_by_label("Run B"), page.get_by_label("Find inspections")
    expect(run_b.locator("option")).to_have_count(3)
    search.fill("nothing has this name")
    expect(run_b.locator("option")).to_have_count(2)  # the chosen run stays
    search.fill("later")
    expect(run_b.locator("option")).to_have_count(3)
    assert not [url for url in asked if url.endswith("/api/inspections")], "the whole list"
    run_b.select_option(b)
    page.wait_for_url(f"**/compare?a={a}&b={b}")
    expect(page.locator(".pair")).to_have_count(3)
    expect_no_fault(page)


@pytest.mark.parametrize("width", [360, 1440])
def test_the_page_is_not_wider_than_its_window(
    page: Page, server: Server, runs: tuple[str, str], width: int
) -> None:
    a, b = runs
    page.set_viewport_size({"width": width, "height": 800})
    log_in(page, server, f"/compare?a={a}&b={b}")
    expect(page.locator(".pair")).to_have_count(3)
    assert page.evaluate("document.documentElement.scrollWidth") <= width


ALIGNED = """async ({ isReversed, jointsA, jointsB, places }) => {
  const { align } = await import('/static/components/compare-page/alignment.js');
  const runs = { isReversed, jointsA, jointsB, lengthMm: 5000, byJoints: true };
  const { toA, toB, joints } = align(runs);
  return [joints.map(({ number }) => number), places.map(toA), places.map((mm) => toB(toA(mm)))];
}"""


def test_joints_take_the_stretching_out_of_a_run(page: Page, server: Server) -> None:
    log_in(page, server)
    joints_a = [{"number": n, "mm": 1000.0 * n} for n in (1, 2, 4)]
    joints_b = [{"number": n, "mm": 1020.0 * n} for n in (1, 2, 3, 4)]
    numbers, to_a, back = page.evaluate(
        ALIGNED,
        {
            "isReversed": False,
            "jointsA": joints_a,
            "jointsB": joints_b,
            "places": [1020.0, 1530.0, 4180.0],
        },
    )
    assert numbers == [1, 2, 4]
    assert to_a == pytest.approx([1000, 1500, 4100])
    assert back == pytest.approx([1020, 1530, 4180])


def test_joints_of_a_run_from_the_other_end_are_counted_from_this_one(
    page: Page, server: Server
) -> None:
    log_in(page, server)
    joints_a = [{"number": n, "mm": 1000.0 * n} for n in (1, 2, 3, 4)]
    joints_b = [{"number": n, "mm": 990.0 * n} for n in (1, 2, 3, 4)]
    numbers, to_a, back = page.evaluate(
        ALIGNED,
        {
            "isReversed": True,
            "jointsA": joints_a,
            "jointsB": joints_b,
            "places": [990.0, 2475.0],
        },
    )
    assert numbers == [1, 2, 3, 4]
    assert to_a == pytest.approx([4000, 2500])
    assert back == pytest.approx([990, 2475])


MATCHED = """async ([a, b]) => {
  const { match } = await import('/static/components/compare-page/matching.js');
  const asTheyAre = { toA: (mm) => mm, toB: (mm) => mm };
  const pairs = match(a, b, asTheyAre, false);
  return pairs.map(({ kind, a, b }) => [a?.id ?? null, b?.id ?? null, kind]);
}"""


def test_the_page_has_the_rules_of_the_history_of_an_asset(page: Page, server: Server) -> None:
    """Both decide alike about runs that were made up, each with an end and with its own gaps."""
    log_in(page, server)
    rng = np.random.default_rng(2)
    places = np.cumsum(rng.uniform(0.05, 0.9, 120))
    runs = [_made_up(rng, places, str(n)) for n in range(2)]
    surveys = [
        Survey(date(2020 + n, 1, 1), "with_flow", run, end_m)
        for n, (run, end_m) in enumerate(zip(runs, (50.0, 40.0), strict=True))
    ]
    expected = []
    for trace in traces_of(surveys):
        ids = dict(zip(trace.surveys, (seen.observation_id for seen in trace.seen), strict=True))
        change = changes_of(trace, surveys)[1]
        kind = "uncovered" if change in (None, "first") else change
        expected.append([ids.get(0), ids.get(1), kind])
    found = page.evaluate(
        MATCHED,
        [
            {"endMm": 1000 * survey.end_m, "observations": [_observed(one) for one in run]}
            for survey, run in zip(surveys, runs, strict=True)
            if survey.end_m is not None
        ],
    )
    assert sorted(found, key=str) == sorted(expected, key=str)
    assert {kind for _, _, kind in found} == {"new", "grown", "gone", "unchanged", "uncovered"}


def _made_up(rng: np.random.Generator, places: NDArray[np.float64], run: str) -> list[Seen]:
    return [
        Seen(
            run, f"{run}-{n}", str(rng.choice(["BAB", "BBA"])), float(place + rng.normal(0, 0.1)),
            u95_m=rng.choice([None, 0.05, 0.2]), clock=rng.choice([None, 1, 3, 6, 12]),
            severity=int(rng.integers(0, 5)), clock_to=rng.choice([None, 4, 12]),
            role=rng.choice([None, None, None, "A"]), quant1=rng.choice([None, 1.0, 2.0]),
        )
        for n, place in enumerate(places)
        if rng.uniform() < 0.8
    ]  # fmt: skip


def _observed(seen: Seen) -> dict[str, object]:
    return {
        "id": seen.observation_id, "code": seen.code, "distance_m": seen.distance_m,
        "distance_u95_m": seen.u95_m, "clock_from": seen.clock, "clock_to": seen.clock_to,
        "severity": seen.severity, "quant1": seen.quant1, "quant2": None,
        "continuous": seen.role and f"{seen.role}1",
    }  # fmt: skip


def _expect_frames(page: Page, a: int, b: int) -> None:
    """Stated, and drawn."""
    for side, frame in enumerate((a, b)):
        caption = page.locator(".compare__frame").nth(side)
        expect(caption).to_have_text(re.compile(rf"^frame {frame} "))
        assert page.evaluate(DRAWN, side) == frame


def _frame_at(server: Server, inspection: str, distance_mm: float) -> int:
    track = json.load(server.ask("GET", f"/api/inspections/{inspection}/track?format=json"))
    distances: list[float] = track["columns"]["distance_mm"]
    return min(range(len(distances)), key=lambda frame: abs(distances[frame] - distance_mm))


def _tag(server: Server, inspection: str, fields: Mapping[str, object]) -> None:
    path = f"/api/inspections/{inspection}/observations/{uuid.uuid4()}"
    json.load(server.ask("PUT", path, fields))
