"""The page, opened from the disk in Chromium, which shares nothing with its writer."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import pytest
from axe_playwright_python.sync_playwright import Axe
from builders import PATIENCE_S
from hypothesis import given
from lxml import html
from playwright.sync_api import expect
from random_reports import reports
from reports import (
    EVERY_FIELD,
    HEADER,
    OBSERVATIONS,
    advised,
    full_report,
    measured,
    report,
    said,
)

from app.errors import NoScene
from app.reports.html.web_page import write
from app.reports.report import Company, Extras
from app.reports.template import ReportTemplate
from app.survey.observations.checks import Issue
from app.survey.observations.records import Event
from app.viewer.still import scene_page

ISSUES = (Issue("block", "no_start", params={"needed": "BCD"}),)


@pytest.fixture(scope="module")
def context(browser):
    with browser.new_context(offline=True) as context:
        yield context


@pytest.fixture
def opened(context, tmp_path):
    """Write a report, open it from the disk; the page, and every address that it asked for."""
    pages = []

    def show(made):
        path = tmp_path / "report.html"
        path.write_bytes(write(made).content)
        page = context.new_page()
        pages.append(page)
        page.asked = []
        page.said = []
        page.on("request", lambda request: page.asked.append(request.url))
        page.on("console", lambda message: page.said.append(message.text))
        page.goto(path.as_uri())
        return page

    yield show
    for page in pages:
        page.close()


def cells_of(page):
    """The texts of each row of the observations."""
    rows = html.fromstring(page).xpath("//table[contains(@class, 'observations')]/tbody/tr")
    return [[" ".join(cell.text_content().split()) for cell in row] for row in rows]


def test_everybody_can_read_it_and_see_its_3d_view_from_the_file_alone(opened, tmp_path):
    template = ReportTemplate(grade="structural", costs=True)
    made = replace(
        report(tmp_path), language="ms", units="ft", issues=ISSUES, draw_scene=scene_page,
        template=template,
    )  # fmt: skip
    page = opened(advised(made, {9: {"recommendation": "Rebuild it.", "cost": 1.0}}))
    found = Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
    assert page.locator("html").get_attribute("lang") == "ms"
    expect(page.locator("table caption")).to_have_count(page.locator("table").count())
    assert page.evaluate("[...document.images].every(i => i.alt && i.naturalWidth === 640)")
    assert page.locator("img").count() == len(OBSERVATIONS)
    assert [url for url in page.asked if not url.startswith(("file:", "data:"))] == []
    expect(page.locator("iframe")).to_have_count(0)
    page.locator("#scene-open").click()
    canvas = page.frame_locator("iframe").locator("canvas").first
    canvas.wait_for(timeout=1000 * PATIENCE_S)
    canvas.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    assert page.locator("iframe").get_attribute("sandbox") == "allow-scripts"
    assert [url for url in page.asked if url.startswith(("http", "ws"))] == []
    assert not any("Refused to" in text for text in page.said)


def test_the_table_states_what_the_report_does():
    page = write(report()).content.decode()
    for n, (cells, fields) in enumerate(zip(cells_of(page), OBSERVATIONS, strict=True)):
        assert cells[0] == str(n + 1)
        assert cells[1].startswith(f"{fields['distance_m']:.2f} ± ")
        code = " ".join(fields[name] for name in ("code", "char1", "char2") if fields.get(name))
        assert cells[3] == (code or "no code")
        if fields.get("remark"):
            assert cells[4].endswith(fields["remark"])
        assert cells[8].startswith(str(fields.get("severity", "not rated")))
    shown = html.fromstring(page)
    assert shown.findtext(".//h1") == "CUL-0041"
    (alarm,) = shown.find_class("alarm")
    assert "Broken wall: fallen in, 12.40 m ± 0.06 m" in " ".join(alarm.text_content().split())


def test_what_was_measured_is_drawn_on_the_photo(opened, tmp_path):
    made = report(tmp_path, [{"distance_m": 1.0, "code": "BAB"}])
    page = opened(replace(made, entries=tuple(map(measured, made.entries))))
    expect(page.get_by_text("Width 23 ± 2 mm")).to_have_count(2)
    box, photo = (page.locator(f"figure {name}").bounding_box() for name in ("svg", "img"))
    assert (box["x"], box["y"]) == (photo["x"], photo["y"])
    expect(page.locator("figure polyline")).to_have_count(2 * 2)


def test_in_feet_and_malay_it_says_so():
    page = write(replace(report(), language="ms", units="ft")).content.decode()
    assert cells_of(page)[8][1].startswith("40.7 ± ")
    assert html.fromstring(page).get_element_by_id("observations").findtext("h2") == "Pemerhatian"


def test_whatever_came_in_is_text(opened):
    evil = "</script><script>window.hit=1</script><img src=x onerror='window.hit=1'>\"'&lt;"
    made = report(
        observations=[{"distance_m": 1.0, "remark": evil, "tagged_by": evil}],
        name=evil,
        header={"asset_id": evil, "operator": evil, "of_another": evil},
        events=(Event(inspection_id="0" * 32, action="changed", who=evil, at=report().made_at,
                      before={}, after={}, remark=evil),),
        issues=(Issue("warn", "no_start", params={"needed": evil}),),
        warning=evil,
        draw_scene=lambda made: f"<p>{made.name}</p>",
    )  # fmt: skip
    page = opened(made)
    page.get_by_role("button").click()
    expect(page.frame_locator("iframe").locator("p")).to_have_count(1)
    assert page.evaluate("window.hit") is None
    assert page.locator("img").count() == 0
    assert page.locator(".remark").inner_text() == evil
    assert page.locator("h1").inner_text() == evil


def test_without_a_3d_view_there_is_no_script():
    def refuse(_):
        raise NoScene("The viewer could not be started.")

    for made in (report(), replace(report(), draw_scene=refuse)):
        written = write(made)
        assert b"<script" not in written.content
        assert b"script-src" not in written.content
    assert said(written.losses) == ["The 3D view is missing: it could not be drawn."]


@pytest.mark.parametrize(
    "sections", [["observations"], ["photos", "wall", "graphic"], ["scene"], []]
)
def test_links_lead_only_to_sections_that_the_template_has(tmp_path, sections):
    template = ReportTemplate(sections=sections)
    page = html.fromstring(write(replace(report(tmp_path), template=template)).content)
    assert [one.get("id") for one in page.xpath("//main/section")] == sections
    ids = set(page.xpath("//@id"))
    assert {link[1:] for link in page.xpath("//@href") if link.startswith("#")} <= ids


def test_on_paper_there_are_no_buttons_and_on_a_phone_nothing_is_cut(opened):
    long = dict.fromkeys(("asset_id", "operator", "reviewer", "road", "client"), 400 * "W")
    made = replace(report(), header={**HEADER, **long}, company=Company(400 * "W"))
    page = opened(replace(made, draw_scene=lambda _: "<p>scene</p>"))
    for width in (1280, 360):
        page.set_viewport_size({"width": width, "height": 700})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.emulate_media(media="print")
    expect(page.get_by_role("button")).to_be_hidden()
    expect(page.locator("nav")).to_be_hidden()
    expect(page.locator(".observations")).to_be_visible()


EMPTY = ("meta", "img", "br", "input")


class Elements(HTMLParser):
    """Counts rows of the table of observations; elements must close in order."""

    def __init__(self):
        super().__init__()
        self.open, self.rows, self.in_table = [], 0, False

    def handle_starttag(self, tag, attrs):
        if tag == "table":
            self.in_table = dict(attrs).get("class") == "cards observations"
        self.rows += tag == "tr" and self.in_table and "tbody" in self.open
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@given(made=reports())
def test_any_report_is_a_page_whose_elements_close(made):
    parser = Elements()
    parser.feed(write(made).content.decode())
    assert parser.open == []
    assert parser.rows == len(made.entries)


@pytest.fixture(scope="module")
def walled(tmp_path_factory):
    """Return a report with 8 m of wall, of which a part was not seen, and lines in its header."""
    made = full_report(tmp_path_factory.mktemp("walled"))
    seen = {k: jpeg for k, jpeg in made.wall.items() if k < 16 and k not in (10, 11)}
    header = {**made.header, "client": "Jabatan Kerja Raya\nJalan Sultan\n50582 KL"}
    first, second, *others = made.entries
    shared = replace(second.photo, jpeg=first.photo.jpeg, sha256=first.photo.sha256)
    entries = (first, replace(second, photo=shared), *others)
    return replace(made, wall=seen, header=header, entries=entries,
                   extras=Extras(film_path="./my film.mp4"))  # fmt: skip


def test_a_phone_reads_it_without_scrolling_sideways(opened, walled):
    page = opened(walled)
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    expect(page.locator(".worst tbody tr")).to_have_count(6)
    assert page.evaluate("document.documentElement.scrollHeight") < 5 * 844
    expect(page.locator("#photos figure").first).to_be_hidden()
    page.locator(".worst").get_by_role("link", name="Photo 9").click()
    expect(page.locator("#photo-9 img")).to_be_in_viewport()
    page.get_by_label("Show: Pipe graphic").check()
    expect(page.locator("#graphic .desk")).to_be_hidden()
    labels = page.locator("#graphic .phone a")
    expect(labels).to_have_count(len(OBSERVATIONS))
    boxes = [label.bounding_box() for label in labels.all()]
    assert max(box["x"] + box["width"] for box in boxes) <= 390
    boxes.sort(key=lambda box: box["y"])
    assert all(box["y"] + box["height"] <= below["y"] for box, below in pairwise(boxes))
    for name in ("Header sheet", "Observations", "Unrolled wall", "Measurement"):
        page.get_by_label(f"Show: {name}").check()
    expect(page.locator("dd", has_text="50582 KL").first).to_have_text(
        re.compile("Jabatan Kerja Raya\nJalan Sultan\n50582 KL"), use_inner_text=True
    )
    found = Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
    page.get_by_label("400 %").check()
    assert page.locator(".wall-rows svg").first.bounding_box()["width"] == 4 * 960
    assert page.evaluate("document.documentElement.scrollWidth") == 390


def test_a_shared_picture_is_there_once_and_times_lead_into_the_film(walled):
    page = html.fromstring(write(walled).content.decode())
    figures = page.findall(".//figure")
    assert len(figures) == len(OBSERVATIONS) - 1
    links = [link.get("href") for link in figures[0].iter("a")]
    assert [link for link in links if link.startswith("#")] == ["#no-1", "#no-2"]
    assert links.count("./my%20film.mp4#t=0") == 1
    assert "./my%20film.mp4#t=41.333" in [link.get("href") for link in page.iter("a")]
    plain = html.fromstring(write(report()).content.decode())
    assert not [link for link in plain.iter("a") if "film" in link.get("href")]


def test_pictures_of_the_wall_are_reduced_where_they_are_too_many(walled, monkeypatch):
    whole = write(walled).content
    monkeypatch.setattr("app.reports.html.web_page.MOST_WALL_BYTES", 2**18)
    reduced = write(walled).content
    assert len(reduced) < len(whole) - 500_000
    assert b"of their resolution" in reduced
    assert b"of their resolution" not in whole


def test_cover_and_summary_say_that_the_survey_was_abandoned() -> None:
    page = write(report(header=EVERY_FIELD)).content.decode()
    sentence = "The survey was abandoned before the far end: robot stuck in silt"
    assert page.count(sentence) == 2
    assert "abandoned" not in write(report()).content.decode()
