"""The modules below the page: numbers for people, the wall under a pixel, live messages."""

from __future__ import annotations

import json
from collections.abc import Iterator
from math import degrees, radians, sin
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from clip_surveys import FRAMES
from clips import SIZE
from playwright.sync_api import APIResponse, Page, Route
from steps import Server, log_in
from surveys import Survey
from tracks import straight_track

from app.lab.simulation import SCENARIOS
from app.survey.adjustment.adjust import adjust
from app.survey.measure import Measure
from app.survey.measuring import figure_of
from app.survey.place import Course, wall_grid
from app.survey.register import completed, fields_of, registered
from app.survey.stated import Stated
from app.web.columns import packed
from app.web.schemas.observations import WallGridOut
from vo_core import Pose
from vo_core.geometry.stance import AS_STATED, Stance
from vo_core.geometry.wall import wall_point

TOLERANCE_MM = 2.0
"""The table is interpolated for a read-out in whole centimetres."""


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture
def site(page: Page, server: Server) -> Page:
    """A document of the server in which nothing runs but the modules that a test imports.

    The whole page has modules of its own, which would store other preferences at the same time.
    """
    log_in(page, server, "/healthz")
    return page


IN_METRES = {
    "chainage(3.4244)": "3.42 m",
    "chainage(3.4249)": "3.43 m",  # 3.425 is published
    "chainage(0.705)": "0.71 m",
    "chainage(3.815)": "3.82 m",
    "chainage(3.8149)": "3.82 m",
    "chainage(1.005)": "1.01 m",
    "chainage(-0.005)": "−0.01 m",
    "chainage(-0.0004)": "0.00 m",
    "chainage(-1.5)": "−1.50 m",
    "chainage(null)": "– m",
    "plusMinus(0.0004)": "± 0.01 m",
    "plusMinus(0.0101)": "± 0.02 m",
    "plusMinus(0.02)": "± 0.02 m",
    "plusMinus(null)": "",
    "speed(4.25)": "4.3 m/min",
    "parseDistance('12.40')": 12.4,
    "parseDistance(' 12,40 m ')": 12.4,
    "parseDistance('−0.5')": -0.5,
    "parseDistance('.5')": 0.5,
    "parseDistance('10 ft')": 3.048,
    "parseDistance('')": None,
    "parseDistance('12.4.1')": None,
    "parseDistance('12 km')": None,
    "parseDistance('1e3')": None,
    "timecode(63.456)": "1:03.46",
    "timecode(3723, 0)": "1:02:03",
    "timecode(59.999)": "1:00.00",
    "bytes(0)": "0 B",
    "bytes(12345678)": "12.3 MB",
    "clockHour(0.2)": "12 o’clock",
    "clockHour(5.6)": "6 o’clock",
    "duration(3900)": "1 h 5 min",
}
IN_FEET = {
    "chainage(3.048)": "10.0 ft",
    "chainage(-0.01)": "0.0 ft",
    "chainage(0.381)": "1.3 ft",
    "chainage(null)": "– ft",
    "plusMinus(0.0004)": "± 0.1 ft",
    "plusMinus(0.3048)": "± 1.0 ft",
    "plusMinus(0.3049)": "± 1.1 ft",
    "speed(9.144)": "30.0 ft/min",
    "parseDistance('10')": 3.048,
    "parseDistance('40,7 FT')": pytest.approx(12.40536),
    "parseDistance('3 m')": 3,
}


def _written(site: Page, wanted: dict[str, object]) -> dict[str, object]:
    calls = ", ".join(f"units.{call}" for call in wanted)
    found = site.evaluate(
        f"async () => {{ const units = await import('/static/core/units.js'); return [{calls}]; }}"
    )
    return dict(zip(wanted, found, strict=True))


def test_numbers_read_as_people_write_them(site: Page) -> None:
    assert _written(site, IN_METRES) == IN_METRES


def test_distances_are_shown_and_typed_in_feet_where_that_is_chosen(site: Page) -> None:
    site.evaluate(
        """async () => {
          const { preferences } = await import('/static/core/preferences.js');
          preferences.keep({ units: 'ft' });
        }"""
    )
    site.reload()
    assert _written(site, IN_FEET) == IN_FEET


def test_words_count_and_are_put_together(site: Page) -> None:
    said = site.evaluate(
        """async () => {
          const { errorText, t, wordFor } = await import('/static/core/words.js');
          const result = (run) => { try { return run(); } catch (error) { return error.message; } };
          return [
            t('progress.frames', { n: 1 }), t('progress.frames', { n: 7 }),
            result(() => t('progress.nothing')), result(() => t('progress.speed')),
            wordFor('status', 'done'), wordFor('status', 'other'),
            errorText({ code: 'busy', message: 'as the server says' }),
            errorText({ code: 'invalid_rig', message: 'as the server says' }),
            errorText({ code: 'a_new_one', detail: 'as the server says' }),
          ];
        }"""
    )
    assert said == [
        "1 frame",
        "7 frames",
        "No words for progress.nothing.",
        "progress.speed needs {fps}.",
        "Done",
        None,
        "The server has too much to do. Try again in a moment.",
        "as the server says",
        "as the server says",
    ]


def test_text_is_escaped_wherever_it_comes_from(site: Page) -> None:
    evil = "<img src=x onerror=alert(1)>\"'&"
    shown = site.evaluate(
        """async (evil) => {
          const { html, render } = await import('/static/core/html.js');
          const element = document.createElement('div');
          const nested = [html`<b>${evil}</b>`, null, false];
          render(element, html`<p title="${evil}">${evil}${nested}</p>`);
          const [p] = element.children;
          return [p.title, p.textContent, element.querySelectorAll('img').length];
        }""",
        evil,
    )
    assert shown == [evil, evil + evil, 0]


def test_broken_or_foreign_memories_of_a_browser_count_as_none(site: Page) -> None:
    found = site.evaluate(
        """async () => {
          const { recall, recallMembers, remember } = await import('/static/core/remembered.js');
          const read = (text, otherwise) => {
            localStorage.setItem('x', text);
            return recall('x', otherwise);
          };
          const recalled = [
            read('{broken', {}), read('[1]', {}), read('null', {}), read('{"a": 1}', []),
            read('"text"', null), read('{"a": 1}', null),
          ];
          remember('x', { lanes: 'all', click: 'seek', other: 1, pack: 7 });
          const members = recallMembers('x', { lanes: ['wall'], click: 'tag', pack: null });
          remember('x', null);
          const forgotten = localStorage.getItem('x');
          const isKept = [remember('x', 'old'), remember('x', 'y'.repeat(6e6))];
          return [recalled, members, forgotten, isKept, recall('x', '')];
        }"""
    )
    usual = {"lanes": ["wall"], "click": "seek", "pack": 7}
    assert found == [[{}, {}, {}, [], None, {"a": 1}], usual, None, [True, False], "old"]


def test_the_archive_file_of_an_inspection_is_no_unfinished_film(site: Page) -> None:
    films = site.evaluate(
        """async () => {
          const { remember } = await import('/static/core/remembered.js');
          const { unfinishedFilms } = await import('/static/core/upload.js');
          const url = '/api/uploads/1';
          remember('chainage.upload:1', { url, name: 'north/run.mp4' });
          remember('chainage.upload:2', { url, name: 'CUL-1.chainage.ZIP' });
          return unfinishedFilms().map(({ key, name }) => (remember(key, null), name));
        }"""
    )
    assert films == ["north/run.mp4"]


def test_a_live_message_is_split_into_header_and_picture(site: Page) -> None:
    parsed = site.evaluate(
        """async () => {
          const { parseMessage } = await import('/static/core/live.js');
          const header = new TextEncoder().encode('{"seq":7,"state":"läuft"}');
          const message = (jpeg) => {
            const bytes = new Uint8Array(4 + header.length + jpeg.length);
            new DataView(bytes.buffer).setUint32(0, header.length);
            bytes.set(header, 4);
            bytes.set(jpeg, 4 + header.length);
            return bytes.buffer;
          };
          const full = parseMessage(message([255, 216, 1]));
          return [full.header, [...full.jpeg], parseMessage(message([])).jpeg];
        }"""
    )
    assert parsed == [{"seq": 7, "state": "läuft"}, [255, 216, 1], None]


def test_the_wall_under_the_cursor_is_the_one_that_the_server_states(
    site: Page, server: Server, narrow: Survey
) -> None:
    path = f"/api/inspections/{narrow.id}"
    width, height = SIZE
    for frame in (0, FRAMES - 1):
        for u, v in ((1, 1), (width / 2, height / 2), (width - 2, 20), (37.5, height - 2)):
            exact = json.load(server.ask("GET", f"{path}/wall?u={u}&v={v}&frame={frame}"))
            shown = site.evaluate(
                """async ([path, frame, u, v]) => {
                  const { WallGrid } = await import('/static/core/wall.js');
                  const read = async (name) => (await fetch(path + name)).json();
                  const wall = new WallGrid(await read('/wallgrid'));
                  const { columns } = await read(`/track?format=json&since=${frame}`);
                  const pose = Object.fromEntries(
                    Object.entries(columns).map(([name, [first]]) => [name, first]));
                  const point = wall.at(u, v, pose);
                  return [point, wall.pixel(point, pose)];
                }""",
                [path, frame, u, v],
            )
            point, pixel = shown
            assert point["distance_m"] * 1000 == pytest.approx(
                exact["distance_m"] * 1000, abs=TOLERANCE_MM
            )
            assert point["clock_h"] == pytest.approx(exact["clock"], abs=0.1)
            assert pixel == pytest.approx([u, v], abs=1.0)


def _row(pose: Pose) -> dict[str, float]:
    """The columns of a track that hold a pose."""
    return {
        "x_mm": pose.x_mm,
        "y_mm": pose.y_mm,
        "z_mm": pose.z_mm,
        "yaw_deg": degrees(pose.yaw_rad),
        "pitch_deg": degrees(pose.pitch_rad),
        "roll_deg": degrees(pose.roll_rad),
    }


LOOKING = [Pose(900.0), Pose(900.0, 9.0, radians(50), -6.0, radians(-20), radians(3))]


@pytest.mark.parametrize("pose", LOOKING, ids=["ahead", "aside"])
def test_a_camera_that_looks_aside_has_the_wall_under_the_cursor(site: Page, pose: Pose) -> None:
    rig, stance = SCENARIOS["forward_crooked"].rig, Stance(12.0, 1.5, 16.0, -3.0, 0.5)
    pixels = [(3.0, 4.0), (600.0, 100.0), (320.0, 470.0), (200.5, 333.3)]
    shown = site.evaluate(
        """async ([grid, pixels, pose]) => {
          const { WallGrid } = await import('/static/core/wall.js');
          const wall = new WallGrid(grid);
          return pixels.map(([u, v]) => {
            const point = wall.at(u, v, pose);
            const { distance_m: m, right_mm: right, clock_h: clock } = point;
            return [1000 * m, right, clock, ...wall.pixel(point, pose)];
          });
        }""",
        [
            WallGridOut.of(wall_grid(rig, stance)).model_dump(),
            pixels,
            _row(pose),
        ],
    )
    there = Pose.of(pose.vector + stance.pose.vector)
    for pixel, seen in zip(pixels, shown, strict=True):
        exact = wall_point(rig, pixel, there)
        assert exact is not None
        # Interpolated in cells of 20 px, a farther wall less exactly.
        near = 0.01 * (exact.distance_mm - pose.x_mm) + 0.3
        assert seen[0] == pytest.approx(exact.distance_mm, abs=near)
        assert seen[2] == pytest.approx(exact.clock_h, abs=0.02)
        assert seen[1] == pytest.approx(150.0 * sin(radians(30 * (6 - seen[2]))), abs=0.1)
        assert seen[3:] == pytest.approx(pixel, abs=1.0)


def test_the_page_measures_what_the_server_does(site: Page) -> None:
    rig = SCENARIOS["forward"].rig
    row = straight_track(np.array([900.0]))
    course = Course(adjust(row, rig, Stated(), []), row)
    clicks = [(180.0, 400.0), (420.0, 420.0), (400.0, 330.0), (250.0, 100.0)]
    counts = {"length": 4, "width": 2, "area": 4, "gap": 2, "step": 2, "depth": 2}
    shown = site.evaluate(
        """async ([grid, clicks, counts, pose]) => {
          const { WallGrid } = await import('/static/core/wall.js');
          const { measured } = await import('/static/core/measure.js');
          const wall = new WallGrid(grid);
          const sights = clicks.map(([u, v]) => wall.sight(u, v, pose));
          return Object.entries(counts).map(([kind, count]) => {
            const { value, percent } = measured(kind, sights.slice(0, count), wall.radius);
            return [value, percent];
          });
        }""",
        [WallGridOut.of(wall_grid(rig, AS_STATED)).model_dump(), clicks, counts, _row(Pose(900.0))],
    )
    for (kind, count), (value, percent) in zip(counts.items(), shown, strict=True):
        points = [{"frame": 0, "pixel": list(click)} for click in clicks[:count]]
        figure = figure_of(course, Measure.model_validate({"kind": kind, "points": points}))
        assert figure is not None
        assert value == pytest.approx(figure.value, rel=0.01, abs=0.5), kind
        assert percent == (figure.percent and pytest.approx(figure.percent, rel=0.01))


def test_a_size_becomes_the_quantity_of_a_code_in_its_unit(site: Page) -> None:
    stated = site.evaluate(
        """async () => {
          const { quantityOf } = await import('/static/core/measure.js');
          const depth = { value: 41.2, percent: 13.7 };
          const other = { value: -18.04, percent: null };
          return [
            quantityOf('depth', depth, '%', 150), quantityOf('depth', depth, 'mm', 150),
            quantityOf('step', other, '%', 150), quantityOf('gap', other, 'mm', null),
            quantityOf('width', { value: 2.34, percent: null }, 'mm', 150),
            quantityOf('area', other, 'mm', 150), quantityOf('length', other, 'deg', 150),
            quantityOf('step', other, '%', null),
          ];
        }"""
    )
    assert stated == [14, 41, 6, 18, 2.3, None, None, None]


@pytest.mark.parametrize("pose", LOOKING, ids=["ahead", "aside"])
def test_the_outline_of_the_view_crosses_the_unrolled_wall_nowhere(site: Page, pose: Pose) -> None:
    """Ahead it goes round the pipe once, and is cut at the crown; aside it is one loop."""
    rig = SCENARIOS["forward"].rig
    lines = site.evaluate(
        """async ([grid, pose]) => {
          const { WallGrid } = await import('/static/core/wall.js');
          const { arcAt, cutAtCrown } = await import('/static/components/wall-strip/rows.js');
          const { radius_mm: radius } = grid;
          const points = new WallGrid(grid).outline(pose).map((point) => ({
            mm: Math.min(1000 * point.distance_m, pose.x_mm + 600),
            arc: arcAt(point.clock_h, radius),
          }));
          return cutAtCrown(points, radius).map((line) => line.map(({ mm, arc }) => [mm, arc]));
        }""",
        [
            WallGridOut.of(wall_grid(rig, AS_STATED)).model_dump(),
            _row(pose),
        ],
    )
    assert len(lines) == (2 if pose.yaw_rad == 0 else 1)
    for line in lines:
        along, around = np.abs(np.diff(line, axis=0)).T
        assert around.max() < 100.0
        assert along.max() < 250.0
        assert min(mm for mm, _ in line) > pose.x_mm - 30


class SlowLine:
    """Holds the answers with a whole track until they are let through, in any order."""

    def __init__(self, site: Page) -> None:
        self._site = site
        self._held: list[tuple[Route, APIResponse]] = []
        site.route("**/track?format=columns&since=0", self._hold)

    def _hold(self, route: Route) -> None:
        self._held.append((route, route.fetch()))

    def expect_held(self, count: int) -> None:
        """The server has answered so many requests."""
        while len(self._held) < count:
            self._site.wait_for_timeout(10)

    def let_through(self, number: int) -> None:
        route, answer = self._held[number]
        route.fulfill(response=answer)


@pytest.fixture
def tracked(site: Page, server: Server, narrow: Survey) -> str:
    """The address of an inspection in the API, whose track is `track` in the page."""
    path = f"/api/inspections/{narrow.id}"
    server.ask("PUT", f"{path}/corrections", {"zero": None})
    site.evaluate(
        """async (id) => {
          const { Track } = await import('/static/core/track.js');
          globalThis.track = new Track(id);
          globalThis.asked = [];
          await track.extend();
        }""",
        narrow.id,
    )
    return path


def ask_for_all_rows(site: Page, server: Server, path: str, line: SlowLine, zero_m: float) -> None:
    """Correct the zero and read the track again."""
    zero = {"zero": {"frame": 0, "offset_m": zero_m}}
    server.ask("PUT", f"{path}/corrections", zero)
    count = site.evaluate("() => asked.push(track.reload())")
    line.expect_held(count)


FIRST_MM = "async () => { await Promise.race(asked); return track.row(0).distance_mm; }"


@pytest.mark.parametrize(("order", "shown_mm"), [((1, 0), (2000, 2000)), ((0, 1), (1000, 2000))])
def test_of_two_corrections_the_older_one_is_shown_only_until_the_newer_one_comes(
    site: Page, server: Server, tracked: str, order: tuple[int, int], shown_mm: tuple[int, int]
) -> None:
    line = SlowLine(site)
    ask_for_all_rows(site, server, tracked, line, 1)
    ask_for_all_rows(site, server, tracked, line, 2)
    line.let_through(order[0])
    assert site.evaluate(FIRST_MM) == pytest.approx(shown_mm[0])
    line.let_through(order[1])
    site.evaluate("() => Promise.all(asked)")
    assert site.evaluate(FIRST_MM) == pytest.approx(shown_mm[1])


def test_a_track_that_was_cleared_does_not_come_back(
    site: Page, server: Server, tracked: str
) -> None:
    line = SlowLine(site)
    ask_for_all_rows(site, server, tracked, line, 1)
    site.evaluate("() => track.clear()")
    line.let_through(0)
    assert site.evaluate("async () => { await asked[0]; return track.length; }") == 0


def test_rows_that_came_after_the_request_for_all_are_read_again(
    site: Page, server: Server, tracked: str
) -> None:
    """The server answers with the five rows that there were when it was asked."""
    every = site.evaluate("() => track.length")
    answer = server.ask("GET", f"{tracked}/track?format=columns").read()
    head = json.loads(answer.partition(b"\n")[0])
    rows = {name: np.zeros(5, kind) for name, kind in head["columns"]}
    early = packed(rows, run=head["run"], total=5)
    site.route("**/track?format=columns&since=0", lambda route: route.fulfill(body=early))
    site.evaluate("() => track.reload()")
    assert site.evaluate("() => track.length") == every


PAGED = """async () => {
  const { PagedList } = await import('/static/core/paged-list.js');
  const { signal } = new AbortController();
  window.list = new PagedList('/api/things', { filters: ['search'], limit: 50, signal });
}"""


def test_a_long_list_shows_the_answer_to_its_newest_question(site: Page) -> None:
    held: list[Route] = []

    def answer(route: Route) -> None:
        if "offset=0" in route.request.url:
            held.append(route)
            return
        held[0].fulfill(json={"total": 100, "page": "first"})
        route.fulfill(json={"total": 100, "page": "second"})

    site.route("**/api/things*", answer)
    site.evaluate(PAGED)
    with site.expect_request("**/api/things*"):
        site.evaluate("() => void (window.first = list.again())")
    assert site.evaluate("async () => (await list.turnTo(50), list.value.page)") == "second"
    assert site.evaluate("() => window.first") is False  # overtaken, and no fault


def test_a_long_list_that_has_become_shorter_shows_its_last_page(site: Page) -> None:
    offsets: list[int] = []

    def answer(route: Route) -> None:
        offset = int(parse_qs(urlsplit(route.request.url).query)["offset"][0])
        offsets.append(offset)
        route.fulfill(json={"total": 60, "offset": offset})

    site.route("**/api/things*", answer)
    site.evaluate(PAGED)
    assert site.evaluate("async () => (await list.turnTo(200), list.value.offset)") == 50
    assert offsets == [200, 50]
    assert site.evaluate("() => location.search") == "?page=2"


def test_of_all_selected_rows_one_is_left_out_and_a_deleted_one_is_not_counted(site: Page) -> None:
    sizes = site.evaluate(
        """async () => {
          const { Selection } = await import('/static/core/selection.js');
          const page = ['a', 'b', 'c'].map((id) => ({ id }));
          const selection = new Selection();
          const sizes = [];
          selection.addEventListener('change', () => sizes.push(selection.size));
          selection.markAll('', 120);
          selection.forget(['c'], 119);
          selection.markOne(page, 'b', { isSelected: false, isRange: false });
          selection.forget(['a'], 118);
          return [sizes.at(0), sizes.at(1), selection.meant.ids];
        }"""
    )
    assert sizes == [120, 119, ["c"]]


def test_an_archive_names_what_is_undone_and_what_is_not(site: Page) -> None:
    undone = site.evaluate(
        """async () => {
          const { undoOf } = await import('/static/core/archive.js');
          const films = (...states) => states.map((state, i) => ({ id: String(i), state }));
          return [
            undoOf('start', films('ready', 'done')),
            undoOf('pause', films('waiting', 'running')),
            undoOf('cancel', films('waiting')),
            undoOf('cancel', films('waiting', 'running')),
            undoOf('retry', films('refused')),
            undoOf('start', films('done')),
          ].map((undo) => undo !== null);
        }"""
    )
    assert undone == [True, True, True, False, False, False]


def test_a_fault_of_the_rules_is_found_at_its_field(site: Page) -> None:
    sentence = (
        "rules.1.pattern: the brace { has no partner (found '{a; b'); rules.2: two of a name; "
        "rigs.Crawler: camera.fx: must be above 0"
    )
    found = site.evaluate(
        "async (text) => (await import('/static/core/rules.js')).faultsIn(text)", sentence
    )
    assert [fault["place"] for fault in found] == [
        ["rules", "1", "pattern"],
        ["rules", "2"],
        ["rigs", "Crawler"],
    ]
    assert found[0]["text"] == "the brace { has no partner (found '{a; b')"


LACKING = """async ([fields, headers]) => {
  const { lacking } = await import('/static/core/register.js');
  return headers.map((header) => lacking(fields, header));
}"""


def test_the_page_fills_a_header_from_the_register_as_the_server_does(site: Page) -> None:
    barrel = {"shape": "egg", "height_mm": 900, "width_mm": 600, "known_length_m": 12.5, "year": 2}
    asset = registered("A", "North", barrel, ((101.5, 3.25), (101.6, 3.5)))
    headers: list[dict[str, str | int | float | bool | None]] = [
        {}, barrel | {"year": ""}, {"shape": "arch"}, {"height_mm": 900}, {"width_mm": 1},
        {"project": "South"}, {"job_ref": "7"}, {"start_lat": 3.25, "end_lon": 1},
        {"known_length_source": "tape", "remarks": "x"},
    ]  # fmt: skip
    filled = site.evaluate(LACKING, [fields_of(asset), headers])
    assert [header | added for header, added in zip(headers, filled, strict=True)] == [
        completed(header, asset) for header in headers
    ]


TWO_DESKS = """async () => {
  const { DeskWindows, followDesk } = await import('/static/core/desk-windows.js');
  const { Store } = await import('/static/core/store.js');
  const deskOf = () => Object.assign(new EventTarget(), {
    inspection: { id: 'one' },
    playhead: new Store({ frame: 0 }),
    selection: new Store(null),
    picking: new Store(null),
    observations: Object.assign(new Store([]), {
      find(id) { return this.value.find((item) => item === id) ?? null; },
    }),
    select(id) { this.selection.set(id); },
  });
  window.desk = () => {
    const lifetime = new AbortController();
    const desk = deskOf();
    return { desk, windows: new DeskWindows(desk, lifetime.signal), leave: () => lifetime.abort() };
  };
  window.here = desk();
  let address;
  window.open = (url) => { address = url; return window; };
  here.windows.toggle('wall');
  const id = sessionStorage.getItem('chainage.desk');
  sessionStorage.clear(); // as in another tab
  window.other = desk();
  history.replaceState(null, '', address);
  window.wall = deskOf();
  followDesk(wall, 'wall', new AbortController().signal);
  sessionStorage.setItem('chainage.desk', id);
}"""


def test_a_window_belongs_to_the_desk_that_opened_it(site: Page) -> None:
    site.evaluate(TWO_DESKS)
    site.wait_for_function("() => here.windows.has('wall')")
    site.evaluate("() => { here.leave(); window.again = desk(); }")  # as a reload does
    site.wait_for_function("() => again.windows.has('wall')")
    assert site.evaluate("other.windows.value") == []

    # Escape in the window ends what the desk wanted a click for.
    site.evaluate("again.desk.picking.set(() => {})")
    site.wait_for_function("() => wall.picking.value")
    site.evaluate("() => { wall.selection.set('tag'); wall.picking.set(null); }")
    site.wait_for_function("() => !again.desk.picking.value")

    # Whoever has gone on at the desk is not brought back to what the window has tagged meanwhile.
    site.evaluate("""() => {
      again.desk.observations.set(['another']);
      again.desk.selection.set('another');
      again.desk.observations.set(['another', 'tag']);
    }""")
    assert site.evaluate("again.desk.selection.value") == "another"

    # This page was opened by no script, so that none may close it.
    site.route("**/inspections/one", lambda route: route.fulfill(body="the desk"))
    with site.expect_navigation(url="**/inspections/one"):
        site.evaluate("() => { setTimeout(() => again.windows.toggle('wall')); }")


def test_remarks_of_two_tabs_are_kept_for_the_person_who_typed_them(site: Page) -> None:
    def as_person(name: str, script: str) -> object:
        site.reload()
        return site.evaluate(
            f"""async (name) => {{
              document.documentElement.dataset.person = name;
              const {{ RemarkDrafts }} = await import('/static/core/remark-drafts.js');
              const [here, there] = [new RemarkDrafts('one'), new RemarkDrafts('one')];
              {script}
            }}""",
            name,
        )

    as_person("Ann", "here.put('a', 'Is it wet?'); there.put('b', 'Roots'); here.put('a', 'Wet?');")
    assert as_person("Ben", "return here.value;") == {}
    assert as_person("Ann", "return here.value;") == {"a": "Wet?", "b": "Roots"}
    sent = "here.put('a', ''); there.put('b', ''); return Object.keys(localStorage).join();"
    assert "remarks" not in str(as_person("Ann", sent))


def test_what_a_busy_server_could_not_answer_is_read_again_after_a_pause(site: Page) -> None:
    pauses = site.evaluate(
        """async () => {
          const { ApiError } = await import('/static/core/api.js');
          const { followChanges } = await import('/static/core/changes-elsewhere.js');
          const [live, pauses, refusals] = [new EventTarget(), [], [503, 404]];
          const wait = window.setTimeout;
          window.setTimeout = (run, ms) => { pauses.push(ms); return wait(run, 0); };
          const read = async () => {
            const status = refusals.shift();
            if (status) throw new ApiError(status, 'busy', '');
          };
          const shown = new Promise((resolve) => {
            const { signal } = new AbortController();
            followChanges(live, read, ({ status }) => resolve(status), signal);
          });
          live.state = 'OPEN';
          live.dispatchEvent(new Event('changed'));
          return [await shown, pauses];
        }"""
    )
    assert pauses == [404, [300, 3000]]
