"""An old survey is imported on the list page, looked at, compared and exported, without a film."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from desks import DRAWN_AND_STATED, expect_frame, expect_read
from playwright.sync_api import Page, Route, expect
from reports import report
from steps import Server, log_in, open_format
from surveys import Survey

from app.reports.formats import FORMATS


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The archive file of an inspection with its film."""
    return tmp_path_factory.mktemp("archive") / "CUL-1.chainage.zip"


@pytest.fixture(scope="module")
def server(
    narrow: Survey, archive: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Server]:
    """Without the inspection that it has put into the archive file."""
    path = f"/api/inspections/{narrow.id}"
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        archive.write_bytes(running.ask("GET", f"{path}/exports/archive?film=true").read())
        running.ask("DELETE", path)
        yield running


@pytest.fixture
def old_survey(server: Server, tmp_path: Path) -> Iterator[Path]:
    path = tmp_path / "old survey.txt"
    odd = b"not a number;;BAC;A;;;;;;;;;\r\n"
    path.write_bytes(FORMATS["en13508"].write(report()).content.replace(b"#Z\r\n", odd + b"#Z\r\n"))
    yield path
    for left in json.load(server.ask("GET", "/api/inspections"))["inspections"]:
        server.ask("DELETE", f"/api/inspections/{left['id']}")


def test_an_old_survey_is_imported_works_without_a_film_and_is_compared(
    page: Page, server: Server, old_survey: Path, tmp_path: Path
) -> None:
    log_in(page, server, "/inspections")
    chosen = page.locator("inspection-list input[type=file]")
    wrong = tmp_path / "notes.txt"
    wrong.write_text("shopping list", "utf-8")
    chosen.set_input_files(wrong)
    expect(page.get_by_text("The file has none of the known formats")).to_be_visible()

    chosen.set_input_files(old_survey)
    page.get_by_role("dialog").get_by_role("button", name="Close").last.click()
    expect(page.locator(".inspection")).to_have_count(1)
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import a survey").click()
    chooser.value.set_files(old_survey)
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("1 inspection was made")
    expect(dialog).to_contain_text("12 observations")
    expect(dialog).to_contain_text("Line 22: No distance can be read from 'not a number'")
    dialog.get_by_role("link", name="CUL-0041 2026-09-14").click()

    stage = page.locator("video-panel")
    expect(stage).to_contain_text("imported without its film")
    expect_read(page)  # a click before the track moves nothing
    crack = page.locator("defect-list").get_by_text("BAB").first
    crack.click()
    expect(page.locator("distance-readout")).to_contain_text("3.20")
    expect(page.locator("distance-readout")).to_contain_text("± –")
    page.keyboard.press("ArrowRight")
    expect(page.locator("distance-readout")).to_contain_text("4.80")
    with page.expect_response(lambda answer: answer.request.method == "PUT") as kept:
        page.keyboard.press("t")
    tag = kept.value.json()
    assert (tag["distance_m"], tag["pixel"], tag["distance_u95_m"]) == (4.8, None, None)

    found = json.load(server.ask("GET", "/api/inspections"))["inspections"]
    page.goto(f"{server.url}/compare?a={found[0]['id']}&b={found[1]['id']}")
    expect(page.locator("compare-page")).to_contain_text("0.00 m")


def test_an_inspection_comes_whole_from_another_server(
    page: Page, server: Server, archive: Path
) -> None:
    """Its archive file is sent in pieces; stopped, it leaves nothing, and sent again it is all."""
    log_in(page, server, "/inspections")
    chooser = page.locator("inspection-list input[type=file]")
    page.route("**/api/uploads/*", hold_pieces)
    with page.expect_request(lambda request: request.method == "PATCH"):
        chooser.set_input_files(archive)
    dialog = page.get_by_role("dialog", name="Import CUL-1.chainage.zip")
    expect(dialog.get_by_role("status")).to_contain_text("0 % of")
    with page.expect_response(lambda answer: answer.request.method == "DELETE") as deleted:
        dialog.get_by_role("button", name="Cancel").click()
    assert deleted.value.status == 204
    page.unroute_all(behavior="ignoreErrors")

    # What the server stores at last goes on without its dialog.
    held: list[Route] = []
    page.route("**/api/imports/archive?*", lambda route: held.append(route))
    with page.expect_request("**/api/imports/archive?*"):
        chooser.set_input_files(archive)
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    held[0].continue_()
    done = page.get_by_role("dialog", name="Imported from CUL-1.chainage.zip")
    expect(done).to_contain_text("1 inspection was made.")
    expect(done).not_to_contain_text("There is no film.")
    done.get_by_role("link").click()
    page.wait_for_url("**/inspections/*")
    back = page.url.rsplit("/", 1)[1]
    expect_frame(page, 0)
    page.wait_for_function(f"JSON.stringify(({DRAWN_AND_STATED})()) === '[0,0]'")

    offer = open_format(page, "Archive file")
    offer.get_by_role("checkbox", name="The film as well (").check()
    with page.expect_download() as download:
        offer.get_by_role("button", name="Download").click()
    assert download.value.suggested_filename.endswith(".chainage.zip")
    server.ask("DELETE", f"/api/inspections/{back}")


def hold_pieces(route: Route) -> None:
    """Let everything pass but the content of an upload."""
    if route.request.method != "PATCH":
        route.continue_()
