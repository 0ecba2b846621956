"""The strip log and the unrolled wall: one axis, tags and places by distance, very long runs."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from dataclasses import replace
from typing import Any
from uuid import uuid4

import numpy as np
import pytest
from builders import half_size
from desks import box_of, click_at, delete_observations, expect_frame, expect_saved, observations
from numpy.typing import NDArray
from playwright.sync_api import Locator, Page, Route, expect
from playwright.sync_api import TimeoutError as TookTooLong
from steps import Server, log_in

from app.lab.simulation import SCENARIOS, simulate
from app.web.columns import MEDIA_TYPE, packed
from vo_core.rig import Rig

LENGTH_MM = 900.0
JOINT_MM = 750.0
"""From one joint to the next."""
RADIUS_MM = 150.0
ZERO_M = 0.002
"""Of the first frame: at full speed every frame lies 3 mm beside where centimetres are rounded."""
STEADY_FRAME = 33
"""From here the robot drives at full speed: frames lie at 0.257, 0.267 ... m."""
FRAME_MM = 10.0
"""From one frame to the next."""
LONG_FRAMES = 100_000
LONG_M = 100.0
LOST_FRAME = 43_210
"""The only lost one of the long run."""
TILE_M = 0.5

IS_DRAWN = """(count) => {
  const { marks, parts: { ground } } = document.querySelector('wall-strip');
  const size = [ground.clientWidth, ground.clientHeight];
  const drawn = [ground.width, ground.height];
  return marks.length === count
    && size.every((side, n) => drawn[n] === Math.round(side * devicePixelRatio));
}"""
"""Whether the wall is drawn at its present size, with so many marks."""


@pytest.fixture(scope="module")
def inspection(server: Server, tmp_path_factory: pytest.TempPathFactory) -> str:
    nominal = SCENARIOS["nominal"].shortened(LENGTH_MM)
    fields = half_size(nominal.rig)
    fields["pipe"]["segment_length_mm"] = JOINT_MM
    small = replace(nominal, rig=Rig.parse(fields))
    run = simulate(small, tmp_path_factory.mktemp("culvert"))
    tracked = server.track(run.video, run.rig)
    # One joint alone cannot be counted: from the zero the next ones are expected.
    zero = {"zero": {"frame": 0, "offset_m": ZERO_M}}
    server.ask("PUT", f"/api/inspections/{tracked}/corrections", zero)
    return tracked


def test_strips_are_drawn_clicked_moved_and_switched(
    page: Page, server: Server, inspection: str
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    _wait_for_wall(page)
    expect(page.locator(".stage__note")).to_be_hidden()
    for step in (
        both_strips_show_the_same_stretch,
        a_click_on_the_wall_tags_that_place,
        of_marks_that_overlap_the_nearest_one_is_clicked,
        a_mark_in_the_log_selects_its_defect,
        the_box_goes_to_what_is_typed_or_says_why_not,
        keys_move_zoom_and_tag,
        a_person_who_looks_elsewhere_is_left_there,
        the_wall_has_the_whole_circle_at_every_size,
        lanes_are_switched_and_remembered,
    ):
        _start_anew(page, server, inspection)
        step(page, server, inspection)


def both_strips_show_the_same_stretch(desk: Page, server: Server, inspection: str) -> None:
    wall, log = desk.locator(".wall__track"), desk.locator(".strip__track")
    _zoom_in(desk, wall, 0.5)

    desk.get_by_role("button", name="Seek").click()
    there_mm = _mm_at(desk, log, 0.6)
    click_at(log, 0.6)
    _expect_shown(desk, there_mm)
    click_at(log, 0.2)
    _expect_shown(desk, _mm_at(desk, log, 0.2))
    click_at(wall, 0.6)
    _expect_shown(desk, there_mm)


def a_click_on_the_wall_tags_that_place(desk: Page, server: Server, inspection: str) -> None:
    wall = desk.locator(".wall__track")
    desk.get_by_role("button", name="Tag", exact=True).click()
    _zoom_in(desk, wall, 0.4)
    wanted_mm, unit_mm = _mm_at(desk, wall, 0.55), _mm_per_px(desk)
    click_at(wall, 0.55, 0.65)
    expect(desk.locator(".defect")).to_have_count(1)
    expect(desk.locator(".save")).to_have_text("Saved")
    (item,) = observations(server, inspection)
    slack_mm = 1000 * item["distance_u95_m"] + unit_mm
    assert 1000 * item["distance_m"] == pytest.approx(wanted_mm, abs=slack_mm)
    # Below the middle of the strip is right of the invert: a little before 6 o'clock.
    assert item["pixel"][1] > 119.5

    # The mark lies where the click was: another click there selects it and tags nothing.
    desk.keyboard.press("Escape")
    expect(desk.locator(".defect [aria-current=true]")).to_have_count(0)
    click_at(wall, 0.55, 0.65)
    expect(desk.locator(".defect [aria-current=true]")).to_have_count(1)
    expect(desk.locator(".defect")).to_have_count(1)


def the_wall_has_the_whole_circle_at_every_size(
    desk: Page, server: Server, inspection: str
) -> None:
    hours = {12: 20, 9: 40, 6: 60, 1: 80}
    for hour, frame in hours.items():
        path = f"/api/inspections/{inspection}/observations/{uuid4()}"
        server.ask("PUT", path, {"frame": frame, "code": "BAC", "clock_from": hour})
    seen_mm = json.load(server.ask("GET", f"/api/inspections/{inspection}/unrolled"))["arc_to_mm"]
    selected = desk.locator(".defect [aria-current=true]")
    for width, height in ((1440, 900), (1024, 768), (390, 844)):
        desk.set_viewport_size({"width": width, "height": height})
        if width == 390:  # so small it is not only made, but opened
            desk.reload()
            _wait_for_wall(desk)
        wall = desk.locator(".wall__track")
        wall.scroll_into_view_if_needed()
        desk.wait_for_function(IS_DRAWN, arg=len(hours))
        for item in observations(server, inspection):
            hour, box = item["clock_from"], box_of(wall)
            across = _x_of(desk, wall, 1000 * item["distance_m"]) / box["width"]
            click_at(wall, across, _share_down(hour, seen_mm, box["height"]))
            expect(selected).to_contain_text(f"{hour} o’clock")
            desk.keyboard.press("Escape")
            expect(selected).to_have_count(0)
    desk.set_viewport_size({"width": 1440, "height": 900})


def of_marks_that_overlap_the_nearest_one_is_clicked(
    desk: Page, server: Server, inspection: str
) -> None:
    for frame, code in ((15, "BAC"), (16, "BAF")):
        path = f"/api/inspections/{inspection}/observations/{uuid4()}"
        server.ask("PUT", path, {"frame": frame, "code": code, "clock_from": 5})
    desk.wait_for_function("() => document.querySelector('wall-strip').marks.length === 2")
    places = desk.evaluate(
        """() => {
          const { marks, scale } = document.querySelector('wall-strip');
          const placeOf = ({ item, x, y }) => [item.code, [x * scale, y * scale]];
          return Object.fromEntries(marks.map(placeOf));
        }"""
    )
    assert math.dist(places["BAC"], places["BAF"]) < 10
    for code, (x, y) in places.items():
        desk.locator(".wall__track").click(position={"x": x, "y": y})
        expect(desk.locator(".defect [aria-current=true]")).to_contain_text(code)
        desk.keyboard.press("Escape")


def a_mark_in_the_log_selects_its_defect(desk: Page, server: Server, inspection: str) -> None:
    log = desk.locator(".strip__track")
    click_at(log, 0.5, 0.6)
    _expect_shown(desk, _mm_at(desk, log, 0.5))
    desk.keyboard.press("t")
    expect(desk.locator(".defect [aria-current=true]")).to_have_count(1)
    desk.keyboard.press("Escape")
    expect(desk.locator(".defect [aria-current=true]")).to_have_count(0)
    box = box_of(log)
    desk.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 18)
    expect(desk.locator(".defect [aria-current=true]")).to_have_count(1)


def the_box_goes_to_what_is_typed_or_says_why_not(
    desk: Page, server: Server, inspection: str
) -> None:
    distance, clock = desk.locator(".readout__distance"), desk.locator(".transport__clock")
    for typed, place, shown in [
        ("0.6", distance, "0.60"),
        ("2.2 ft", distance, "0.67"),
        ("0:02", clock, "0:02"),
        ("#33", clock, "frame 33"),
        ("j1", distance, "0.75"),
        ("0.8", distance, "0.80"),
    ]:
        desk.keyboard.press("g")
        desk.get_by_role("textbox", name="Distance, time, frame or joint").fill(typed)
        desk.keyboard.press("Enter")
        expect(desk.get_by_role("dialog")).to_have_count(0)
        expect(place).to_contain_text(shown)
    expect(desk.locator(".readout__more")).to_contain_text("Expected joint 1 + 0.05 m")

    desk.keyboard.press("g")
    box = desk.get_by_role("textbox", name="Distance, time, frame or joint")
    fault = desk.get_by_role("dialog").get_by_role("alert")
    for typed, sentence in [
        ("900 m", "The run goes from"),
        ("#99999", "The last frame is"),
        ("j77", "no joint 77"),
        ("9:59", "The film ends"),
        ("twelve", "Type a place such as"),
    ]:
        box.fill(typed)
        desk.keyboard.press("Enter")
        expect(fault).to_contain_text(sentence)
    desk.keyboard.press("Escape")


def lanes_are_switched_and_remembered(desk: Page, server: Server, inspection: str) -> None:
    log = desk.locator(".strip__track")
    before = box_of(log)["height"]
    desk.get_by_text("Lanes", exact=True).click()
    desk.get_by_label("Yaw", exact=True).check()
    desk.get_by_role("checkbox", name="Unrolled wall").uncheck()
    expect(desk.locator("wall-strip")).to_be_hidden()
    taller = box_of(log)["height"]
    assert taller > before
    desk.reload()
    expect(desk.locator(".strip__track")).to_be_visible()
    expect(desk.locator("wall-strip")).to_be_hidden()
    desk.wait_for_function(
        "tall => document.querySelector('.strip__track').clientHeight === tall", arg=taller
    )


def keys_move_zoom_and_tag(desk: Page, server: Server, inspection: str) -> None:
    log = desk.locator(".strip__track")
    desk.keyboard.press("g")
    desk.keyboard.type(f"#{STEADY_FRAME}")
    desk.keyboard.press("Enter")
    expect(log).to_have_attribute("aria-valuetext", "0.26 m")
    log.focus()
    desk.keyboard.press("PageUp")
    expect(log).to_have_attribute("aria-valuetext", "0.76 m")
    desk.keyboard.press("ArrowRight")
    expect(log).to_have_attribute("aria-valuetext", "0.77 m")
    whole = _axis(desk)
    desk.keyboard.press("+")
    near = _axis(desk)
    assert near["high"] - near["low"] == pytest.approx((whole["high"] - whole["low"]) / 2)
    desk.keyboard.press("0")
    assert _axis(desk) == whole

    wall = desk.locator(".wall__track")
    wall.focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowDown"):
        desk.keyboard.press(key)
    expect(desk.get_by_text("· 6 o’clock").first).to_be_attached()
    desk.keyboard.press("Enter")
    expect(desk.locator(".defect")).to_have_count(1)
    # The film stood still meanwhile.
    expect(log).to_have_attribute("aria-valuetext", "0.77 m")


def a_person_who_looks_elsewhere_is_left_there(desk: Page, server: Server, inspection: str) -> None:
    log = desk.locator(".strip__track")
    for _ in range(4):
        desk.keyboard.press("+")
    box = box_of(log)
    y = box["y"] + box["height"] / 2
    desk.mouse.move(box["x"] + 0.8 * box["width"], y)
    desk.mouse.down(button="right")
    desk.mouse.move(box["x"] + 0.1 * box["width"], y, steps=4)
    desk.mouse.up(button="right")
    there = _axis(desk)
    assert there["low"] > 0
    desk.keyboard.press("ArrowRight")
    expect(desk.locator(".transport__frame")).to_contain_text("frame 1")
    assert _axis(desk) == there
    # A jump to a place brings it into sight.
    desk.keyboard.press("g")
    desk.keyboard.type("0.02")
    desk.keyboard.press("Enter")
    expect(desk.get_by_role("dialog")).to_have_count(0)
    assert _axis(desk)["low"] == 0


def test_a_long_run_shows_its_only_lost_frame_and_its_tiles_stay_small_in_memory(
    page: Page, server: Server, inspection: str
) -> None:
    picture = server.ask("GET", _first_tile(server, inspection)).read()
    page.route("**/track?format=columns*", lambda route: _answer_columns(route, _long_track()))
    page.route("**/health?format=columns*", lambda route: _answer_columns(route, _long_health()))
    page.route("**/unrolled", lambda route: _answer(route, _long_wall()))
    page.route(
        "**/unrolled/*.jpg*", lambda route: route.fulfill(body=picture, content_type="image/jpeg")
    )
    log_in(page, server, f"/inspections/{inspection}")
    page.wait_for_function(
        "n => document.querySelector('strip-log')?.desk.track.length === n", arg=LONG_FRAMES
    )
    count = math.ceil(LONG_M / TILE_M)
    page.wait_for_function(
        "n => document.querySelector('wall-strip')?.pictures?.count === n", arg=count
    )
    page.evaluate(
        """async () => {
          document.querySelector('strip-log').desk.axis.showWhole();
          await new Promise(requestAnimationFrame);
          await new Promise(requestAnimationFrame);
        }"""
    )
    assert _is_drawn_as_lost(page, LOST_FRAME / LONG_FRAMES)
    assert not _is_drawn_as_lost(page, 0.6)
    decoded = page.evaluate("() => document.querySelector('wall-strip').pictures.pixels")
    assert decoded < 40 * 1000 * 600


# What the tests do again and again ---------------------------------------------------------------


def _start_anew(desk: Page, server: Server, inspection: str) -> None:
    """Without any tag, at the first frame, with the whole run in sight."""
    desk.keyboard.press("Escape")
    desk.locator(".transport__frame").click()  # keys belong to the film again
    expect_saved(desk)  # a tag on its way would be stored after the others are deleted
    delete_observations(server, inspection)
    expect(desk.locator(".defect")).to_have_count(0)
    desk.keyboard.press("Home")
    expect_frame(desk, 0)
    desk.keyboard.press("0")


def _answer(route: Route, body: Any) -> None:
    route.fulfill(body=json.dumps(body), content_type="application/json")


def _answer_columns(route: Route, columns: dict[str, NDArray[Any]]) -> None:
    total = len(next(iter(columns.values())))
    route.fulfill(body=packed(columns, run="long", total=total), content_type=MEDIA_TYPE)


def _long_track() -> dict[str, NDArray[Any]]:
    frames = np.arange(LONG_FRAMES)
    distances = 1000 * LONG_M * frames / LONG_FRAMES
    ones = np.ones(LONG_FRAMES, np.float32)
    return {
        "time_s": frames / 30,
        "x_mm": distances,
        "distance_mm": distances,
        "y_mm": 4 * np.sin(frames / 900).astype(np.float32),
        "yaw_deg": np.sin(frames / 500).astype(np.float32),
        **dict.fromkeys(("z_mm", "pitch_deg", "roll_deg", "looking_around"), 0 * ones),
        "sigma_distance_mm": ones,
        "quality": 0.9 * ones,
        "status": np.where(frames == LOST_FRAME, 2, 0).astype(np.uint8),
        "source": np.zeros(LONG_FRAMES, np.uint8),
    }


def _long_health() -> dict[str, NDArray[Any]]:
    blurred = np.where(np.arange(LONG_FRAMES) < 50, 1 << 3, 0).astype(np.uint8)
    halves = np.full(LONG_FRAMES, 0.5, np.float32)
    return {"overlap": halves, "fixed_pattern": halves, "complaints": blurred}


def _long_wall() -> dict[str, Any]:
    tiles = [
        {"index": i, "revision": 1, "from_m": i * TILE_M, "to_m": (i + 1) * TILE_M}
        for i in range(math.ceil(LONG_M / TILE_M))
    ]
    return {
        "tile_m": TILE_M, "mm_per_px": 0.5, "arc_from_mm": -470.0, "arc_to_mm": 470.0,
        "width_px": 1000, "height_px": 600, "tiles": tiles,
    }  # fmt: skip


def _first_tile(server: Server, inspection: str) -> str:
    path = f"/api/inspections/{inspection}/unrolled"
    tile = json.load(server.ask("GET", path))["tiles"][0]
    return f"{path}/{tile['index']}.jpg?v={tile['revision']}"


def _is_drawn_as_lost(page: Page, share: float) -> bool:
    """Whether the tracking lane is red at this share of the run."""
    red, green, blue = page.evaluate(
        """mm => {
          const log = document.querySelector('strip-log');
          const { top, height } = log.arrangement.rows.find(({ lane }) => lane.name === 'quality');
          const { low, high } = log.desk.axis.value;
          const canvas = log.querySelector('canvas');
          const unit = canvas.width / log.querySelector('.strip__track').clientWidth;
          const [left, right] = [92, log.querySelector('.strip__track').clientWidth - 22];
          const x = left + ((mm - low) / (high - low)) * (right - left);
          const around = [-1, 0, 1].map((dx) => [...canvas.getContext('2d').getImageData(
            Math.round(x * unit) + dx, Math.round((top + height - 4) * unit), 1, 1).data]);
          return around.toSorted((a, b) => (b[0] - b[1]) - (a[0] - a[1]))[0].slice(0, 3);
        }""",
        1000 * LONG_M * share,
    )
    return bool(red > green + 30 and red > blue + 30)


def _wait_for_wall(page: Page) -> None:
    """Until the wall is drawn and the film shows a frame of the whole track.

    Track, health and wall come by requests of their own; a click before the track does nothing.
    """
    page.wait_for_function(
        """() => {
          const wall = document.querySelector('wall-strip');
          const { track, health, playhead } = document.querySelector('inspection-page')?.desk ?? {};
          return wall?.rows && wall.pictures.count > 0 && playhead.value.row
            && health.complaints.length === track.length;
        }"""
    )


def _axis(page: Page) -> dict[str, float]:
    value: dict[str, float] = page.evaluate(
        "() => document.querySelector('inspection-page').desk.axis.value"
    )
    return value


def _zoom_in(page: Page, strip: Locator, across: float) -> None:
    """To less than half, by the wheel: turned on while nothing follows, as a person does."""
    before = _axis(page)
    _point_at(strip, across)
    for _ in range(20):
        page.mouse.wheel(0, -600)
        with suppress(TookTooLong):
            page.wait_for_function(
                """(span) => {
                  const { low, high } = document.querySelector('inspection-page').desk.axis.value;
                  return high - low < span / 2;
                }""",
                arg=before["high"] - before["low"],
                timeout=3000,
            )
            return
    raise AssertionError("The wheel does not zoom in.")


def _expect_shown(page: Page, mm: float) -> None:
    """Waits for a frame near that distance."""
    page.wait_for_function(
        """([mm, off]) => {
          const { row } = document.querySelector('inspection-page').desk.playhead.value;
          return row !== null && Math.abs(row.distance_mm - mm) <= off;
        }""",
        arg=[mm, FRAME_MM],
    )


def _point_at(place: Locator, across: float, down: float = 0.5) -> None:
    box = box_of(place)
    place.page.mouse.move(box["x"] + across * box["width"], box["y"] + down * box["height"])


def _mm_at(page: Page, place: Locator, across: float) -> float:
    """The distance at this share of a strip's width, by the axis that it is drawn with."""
    width = box_of(place)["width"]
    return float(
        page.evaluate(
            """async ([range, width, x]) => {
              const { Plot } = await import('/static/core/wall/axis.js');
              return new Plot(range, width).toMm(x);
            }""",
            [_axis(page), width, across * width],
        )
    )


def _share_down(hour: int, seen_mm: float, height: float) -> float:
    """Where an hour lies: from crown to crown, half a mark inside, with the invert in the middle.

    The camera saw no more than the invert, which has 60 % of the strip.
    """
    crown_mm = math.pi * RADIUS_MM
    arc_mm = (6 - hour) / 6 * crown_mm
    away_mm = abs(arc_mm)
    share = (
        0.3 * away_mm / seen_mm
        if away_mm <= seen_mm
        else 0.3 + 0.2 * (away_mm - seen_mm) / (crown_mm - seen_mm)
    )
    return 0.5 + math.copysign(share, arc_mm) * (height - 24) / height


def _x_of(page: Page, place: Locator, mm: float) -> float:
    """Where a distance lies from the left of a strip, px."""
    return float(
        page.evaluate(
            """async ([range, width, mm]) => {
              const { Plot } = await import('/static/core/wall/axis.js');
              return new Plot(range, width).toX(mm);
            }""",
            [_axis(page), box_of(place)["width"], mm],
        )
    )


def _mm_per_px(page: Page) -> float:
    box, axis = box_of(page.locator(".wall__track")), _axis(page)
    return (axis["high"] - axis["low"]) / (box["width"] - 104)
