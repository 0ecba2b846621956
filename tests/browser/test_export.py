"""Reports leave the page: losses are shown before, and severity 5 is reported at once."""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pypdf
import pytest
from clip_surveys import ids_of
from looks import expect_no_fault
from playwright.sync_api import Page, Route, expect
from receivers import Receiver, receiving
from steps import Server, export, log_in, open_format
from surveys import Survey

from app.reports.bundle.verify import verify
from app.reports.formats import FORMATS

TAGS = [f"7d444840-9dc0-4d2a-8a6a-00000000000{n}" for n in range(5)]


@pytest.fixture(scope="module")
def receiver() -> Iterator[Receiver]:
    with receiving() as running:
        yield running


@pytest.fixture(scope="module")
def notifying(
    several: Survey, tmp_path_factory: pytest.TempPathFactory, receiver: Receiver
) -> Iterator[Server]:
    """A server with a client who is notified of severity 5."""
    settings = {"webhook_url": receiver.url, "webhook_secret": "a secret of sixteen or more"}
    with Server(several.copied_to(tmp_path_factory.mktemp("data")), **settings) as running:
        yield running


@pytest.fixture(scope="module")
def untouched(notifying: Server) -> Iterator[str]:
    """The ids of inspections that no test has taken."""
    return iter(ids_of(notifying))


@pytest.fixture(scope="module")
def inspection(notifying: Server, untouched: Iterator[str]) -> str:
    """With a crack and a tag without a code, for tests that change nothing of it."""
    return tagged(notifying, next(untouched))


@pytest.fixture
def own(notifying: Server, untouched: Iterator[str]) -> str:
    """The same, for one test."""
    return tagged(notifying, next(untouched))


def tagged(server: Server, inspection: str) -> str:
    tag(server, inspection, 0, frame=3, code="BAB", char1="B", char2="A", severity=3)
    tag(server, inspection, 1, frame=9)
    return inspection


def tag(server: Server, inspection: str, number: int, **fields: object) -> None:
    server.ask("PUT", f"/api/inspections/{inspection}/observations/{TAGS[number]}", fields)


def open_menu(page: Page) -> None:
    page.get_by_text("Export", exact=True).click()


def test_every_format_is_offered_and_one_is_saved_stopped_or_refused(
    page: Page, notifying: Server, several: Survey, inspection: str, tmp_path: Path
) -> None:
    log_in(page, notifying, f"/inspections/{inspection}")
    open_menu(page)
    offered = page.locator("[data-export]").evaluate_all("all => all.map(e => e.dataset.export)")
    assert FORMATS.keys() <= set(offered)
    assert len(offered) == len(set(offered))
    expect(page.locator("[data-export=emergency]")).to_be_hidden()  # nothing is severe
    expect_no_fault(page, within="desk-bar")
    page.keyboard.press("Escape")

    # By keys alone.
    menu = page.locator("[data-part=menu] summary").first
    menu.focus()
    page.keyboard.press("Enter")
    for key in (*["Tab"] * 5, "Enter", *["Tab"]):  # four in front, the fold, CSV
        page.keyboard.press(key)
    page.keyboard.press("Enter")
    by_keys = page.get_by_role("dialog", name="Export: CSV")
    expect(by_keys.get_by_role("button", name="Download")).to_be_focused()
    page.keyboard.press("Escape")
    expect(by_keys).to_have_count(0)
    expect(menu).to_be_focused()

    # Losses and checks are shown before, and forbid nothing.
    open_format(page, "EN 13508-2")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text(re.compile(r"This format cannot hold \d+ things"))
    expect(dialog).to_contain_text("Observation 2 has no code")
    expect(dialog).to_contain_text(re.compile(r"\d+ things to put right before a report is issued"))
    expect(dialog).to_contain_text("Asset is empty in the header.")
    expect_no_fault(page, within="dialog[open]")
    with page.expect_download() as download:
        dialog.get_by_role("button", name="Download the draft").click()
    assert download.value.suggested_filename == "clip-en13508.txt"
    assert Path(download.value.path()).read_bytes().startswith(b"#A1=")
    expect(dialog).to_have_count(0)
    expect(page.locator("toast-stack")).to_contain_text("clip-en13508.txt is saved")

    # A loss leads to its defect.
    open_format(page, "EN 13508-2")
    dialog.get_by_role("button", name="Go there").first.click()
    expect(dialog).to_have_count(0)
    expect(page.locator(".defect [aria-current=true]")).to_contain_text("No code")

    # A map without coordinates is refused in a sentence that leads on.
    open_format(page, "GeoJSON")
    expect(dialog.get_by_role("alert")).to_contain_text("latitude and longitude of both ends")
    expect_no_fault(page, within="dialog[open]")
    dialog.get_by_role("alert").get_by_role("button").click()
    expect(page.get_by_role("tabpanel", name="Header")).to_be_visible()

    # A report that takes long can be stopped.
    held: list[Route] = []
    # As a server that takes its time.
    page.route("**/exports/pdf?*", lambda route: held.append(route))
    open_format(page, "PDF")
    dialog.get_by_role("button", name="Download").click()
    expect(dialog.get_by_role("progressbar")).to_be_visible()
    expect(dialog).to_contain_text(re.compile(r"The report is being made… *[1-9]\d* s"))
    expect_no_fault(page, within="dialog[open]")
    dialog.get_by_role("button", name="Stop").click()
    expect(dialog.get_by_role("progressbar")).to_be_hidden()
    expect(dialog.get_by_role("button", name="Download")).to_be_focused()
    expect(dialog.get_by_role("alert")).to_be_empty()
    page.unroute("**/exports/pdf?*")
    with page.expect_download() as download:
        page.keyboard.press("Enter")
    assert Path(download.value.path()).read_bytes().startswith(b"%PDF-")
    assert len(held) == 1
    expect(dialog).to_have_count(0)

    # A refusal is shown, and the dialog stays.
    open_format(page, "CSV")
    page.route("**/exports/csv?*", lambda route: route.abort())
    dialog.get_by_role("button", name="Download").click()
    expect(dialog.get_by_role("alert")).to_contain_text("The server cannot be reached")
    page.unroute("**/exports/csv?*")
    with page.expect_download():
        dialog.get_by_role("button", name="Download").click()
    expect(dialog).to_have_count(0)

    film = several.folder / "video.mp4"
    a_delivery_has_its_film(page, film, tmp_path)
    one_document_is_about_all(page, notifying, inspection)


def test_language_and_units_are_those_of_the_person(
    page: Page, notifying: Server, inspection: str
) -> None:
    usual = json.load(notifying.ask("GET", "/api/me"))["preferences"]
    notifying.ask("PUT", "/api/me/preferences", usual | {"language": "ms", "units": "ft"})
    log_in(page, notifying, f"/inspections/{inspection}")
    page.get_by_text("Eksport", exact=True).click()
    page.get_by_text("Format lain").click()
    page.get_by_role("button", name=re.compile("^CSV ")).click()
    dialog = page.get_by_role("dialog", name="Eksport: CSV")
    expect_no_fault(page, within="dialog[open]")
    with page.expect_request("**/exports/csv?*") as request, page.expect_download():
        dialog.get_by_role("button", name="Muat turun").click()
    assert request.value.url.endswith("/exports/csv?lang=ms&units=ft")
    notifying.ask("PUT", "/api/me/preferences", usual)


def test_a_severity_5_is_in_the_list_on_the_page_on_a_sheet_and_with_the_client(
    page: Page, notifying: Server, receiver: Receiver, own: str
) -> None:
    log_in(page, notifying, "/inspections")
    row = page.locator(".inspection", has=page.locator(f"a[href='/inspections/{own}']"))
    expect(row.locator(".chip")).to_have_count(1)
    tag(notifying, own, 3, frame=12, code="BAC", char1="C", severity=5)
    expect(row.locator(".chip")).to_have_text([re.compile("^Done ± "), "act now"])
    expect(page.locator("toast-stack")).to_contain_text("Act now: clip")
    expect_no_fault(page, within="toast-stack")
    page.locator("toast-stack").get_by_role("button", name="Open").click()
    page.wait_for_url(f"**/inspections/{own}")

    # On the page, too; and what is tagged now is in the table.
    expect(page.get_by_role("region", name="Act now")).to_be_visible()
    notifying.ask("DELETE", f"/api/inspections/{own}/observations/{TAGS[3]}")
    expect(page.get_by_role("region", name="Act now")).to_be_hidden()
    expect(page.locator(".defect")).to_have_count(2)
    expect(page.locator(".readout__distance")).to_contain_text("0.00")
    page.keyboard.press("1")
    expect(page.locator(".defect")).to_have_count(3)
    rows = list(csv.DictReader(io.StringIO(export(page, "CSV").decode("utf-8-sig"))))
    assert len(rows) == 3

    # The client is notified.
    receiver.statuses = [500] * 9
    banner = page.get_by_role("region", name="Act now")
    expect(banner).to_be_hidden()
    page.keyboard.press("Escape")
    page.locator(".defect__main").first.click()
    page.keyboard.press("Shift+Digit5")
    expect(banner).to_contain_text("BAB at 0.00 m")
    expect(banner).to_contain_text("Client not notified yet: It answered 500.")
    receiver.statuses = []
    expect_no_fault(page, within="emergency-banner")
    with page.expect_download() as download:
        banner.get_by_role("link", name="One-page sheet").click()
    assert download.value.suggested_filename == "clip-act-now.pdf"
    assert Path(download.value.path()).read_bytes().startswith(b"%PDF-")
    expect(banner).to_contain_text("Client notified, ")
    assert receiver.received[-1].message["observation"]["code"] == "BAB"
    page.get_by_role("tab", name="History").click()
    expect(page.locator("history-panel")).to_contain_text("The client was notified of BAB")
    expect_no_fault(page, within="history-panel")
    open_menu(page)
    expect(page.get_by_role("button", name=re.compile("^Act-now sheet"))).to_be_visible()
    page.keyboard.press("Escape")

    # Menu and dialog fit the window.
    for width in (360, 1280):
        page.set_viewport_size({"width": width, "height": 700})
        open_menu(page)
        _expect_inside(page, ".menu__list--exports")
        page.get_by_role("button", name=re.compile("^ISYBAU ")).click()
        expect(page.get_by_role("dialog")).to_contain_text("This format cannot hold")
        _expect_inside(page, "dialog")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.keyboard.press("Escape")


def _expect_inside(page: Page, selector: str) -> None:
    box = page.locator(selector).bounding_box()
    window = page.viewport_size
    assert box is not None
    assert window is not None
    assert box["x"] >= 0
    assert box["y"] >= 0
    assert box["x"] + box["width"] <= window["width"]
    assert box["y"] + box["height"] <= window["height"]


def a_delivery_has_its_film(page: Page, film: Path, tmp_path: Path) -> None:
    open_format(page, "Delivery")
    dialog = page.get_by_role("dialog", name="Export: Delivery")
    dialog.get_by_label("Exchange format").select_option("RIBX")
    dialog.get_by_label("Language of report and page").select_option("Bahasa Malaysia")
    dialog.get_by_label("The film as well").check()
    expect_no_fault(page, ("dark",), within="dialog[open]")
    held: list[Route] = []
    page.route("**/api/bulk-exports", lambda route: held.append(route))
    with page.expect_request("**/api/bulk-exports"):
        dialog.get_by_role("button", name="Download").click()
    page.keyboard.press("Escape")
    stop = page.get_by_role("dialog", name="Stop making the delivery?")
    stop.get_by_role("button", name="Cancel").click()
    with page.expect_download() as download:
        held[0].continue_()
    page.unroute("**/api/bulk-exports")
    expect(dialog).to_have_count(0)
    assert download.value.suggested_filename == "clip-delivery.zip"
    path = tmp_path / "delivery.zip"
    download.value.save_as(path)
    assert verify(path, video=film).is_right
    with zipfile.ZipFile(path) as archive:
        assert archive.read("clip.mp4") == film.read_bytes()
        cited = set(re.findall(r"clip[\w.-]*\.(?:jpg|mp4)", archive.read("clip.ribx").decode()))
        assert cited >= {"clip.mp4", "clip-001.jpg"}
        assert cited <= set(archive.namelist())
        assert b'lang="ms"' in archive.read("clip-report.html")[:200]


def one_document_is_about_all(page: Page, notifying: Server, inspection: str) -> None:
    page.goto(f"{notifying.url}/inspections")
    row = page.locator(".inspection", has=page.locator(f"a[href='/inspections/{inspection}']"))
    row.get_by_role("checkbox").check()
    page.get_by_role("button", name="Export…").click()
    dialog = page.get_by_role("dialog", name="Export 1 inspection")
    for label in ("PDF", "XLSX"):
        dialog.get_by_label(label, exact=True).uncheck()
    expect(dialog.get_by_role("button", name="Make the archive")).to_be_disabled()
    dialog.get_by_label("One document").check()
    expect_no_fault(page, ("dark",), within="dialog[open]")
    dialog.get_by_role("button", name="Make the archive").click()
    with page.expect_download() as download:
        dialog.get_by_role("link", name="Download").click()
    assert download.value.suggested_filename == "chainage-report.pdf"
    titles = [
        one.title
        for one in pypdf.PdfReader(download.value.path()).outline
        if not isinstance(one, list)
    ]
    assert titles[-1] == "1 · clip"
