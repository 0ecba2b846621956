"""The archive: a folder is added by rules, tracked and opened; a group of failures is repaired."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from clips import numbered_clip, rig_for_clip
from desks import expect_frame
from looks import expect_no_fault
from playwright.sync_api import Locator, Page, Route, expect
from steps import Server, log_in

FRAMES = 8


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("films")


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return numbered_clip(tmp_path_factory.mktemp("clip") / "clip.mp4", "libx264", frames=FRAMES)


@pytest.fixture(scope="module")
def rig_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rig_for_clip(tmp_path_factory.mktemp("rig") / "crawler.json")


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory, films: Path) -> Iterator[Server]:
    data = tmp_path_factory.mktemp("data")
    with Server(data, archive_folders=str(films)) as running:
        yield running


@pytest.fixture
def archive(server: Server) -> Iterator[Server]:
    """It is empty before each test."""
    server.ask("PUT", "/api/archive/rules", {"rigs": {}, "rules": []})
    yield server
    server.ask("DELETE", "/api/archive/films", {"where": {}})


def folder_of(films: Path, clip: Path, name: str, *files: str) -> Path:
    folder = films / name
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(clip, folder / file)
    return folder


def add(server: Server, folder: Path, rigs: dict[str, Any], rig: str) -> None:
    """Add a folder by one rule, without the page."""
    rules = {"rigs": rigs, "rules": [{"name": "all", "pattern": "**/{asset}.mp4", "rig": rig}]}
    server.ask("PUT", "/api/archive/rules", rules)
    server.ask("POST", "/api/archive/films", {"paths": [str(folder)]})


def row_of(page: Page, name: str) -> Locator:
    return page.get_by_role("row").filter(has_text=name)


def add_rig(page: Page, rig_file: Path) -> None:
    """The first one, named Crawler, from its file."""
    page.get_by_role("button", name="Add a rig").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Name", exact=True).fill("Crawler")
    dialog.locator("rig-form input[type=file]").set_input_files(rig_file)
    expect(dialog.get_by_label("Picture width")).not_to_have_value("")
    dialog.get_by_role("button", name="Take this rig").click()
    expect(page.locator(".rig-card")).to_contain_text("Crawler")


def test_a_folder_is_added_by_a_rule_after_a_dry_run_and_its_film_tracked_and_opened(
    page: Page, archive: Server, films: Path, clip: Path, rig_file: Path
) -> None:
    folder = folder_of(films, clip, "whole", "North/CUL-1_a.mp4", "South/odd name.mp4")
    log_in(page, archive, "/films")
    expect(page.get_by_role("heading", name="No films yet")).to_be_visible()
    page.get_by_role("link", name="Rules and rigs").first.click()
    add_rig(page, rig_file)
    page.get_by_role("button", name="Add a rule").click()
    pattern = page.get_by_label("Path within the added folder")
    pattern.fill("{project}/{wrong_*.mp4")
    page.get_by_role("button", name="Save").click()
    expect(page.locator(".rule .fault").filter(has_text="brace")).to_be_visible()
    expect(pattern).to_be_focused()
    pattern.fill("{project}/{asset}_*.mp4")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("The rules are saved.")).to_be_visible()

    page.goto(f"{archive.url}/films/add")
    folders = page.get_by_role("group", name="Folder of films")
    folders.get_by_role("button", name="whole").click()
    expect(folders).to_contain_text(str(folder))
    expect(folders).to_contain_text("0 films here")
    page.get_by_role("button", name="Show what each film would get").click()
    expect(page.get_by_text("2 films: 2 new, 0 taken in already.")).to_be_visible()
    row = row_of(page, "CUL-1_a.mp4")
    for text in ("Rule 1", "Crawler", "North", "CUL-1"):
        expect(row.get_by_role("cell", name=text, exact=True)).to_be_visible()
    expect(row_of(page, "odd name")).to_contain_text("No rule fits")
    assert json.load(archive.ask("GET", "/api/archive/films"))["total"] == 0
    page.get_by_role("button", name="Add 2 films").click()

    expect(row_of(page, "odd name")).to_contain_text("No rig")
    page.get_by_role("button", name="Start the one that is ready").click()
    expect(row_of(page, "CUL-1_a")).to_contain_text("Done")
    row_of(page, "CUL-1_a").get_by_role("link").click()
    expect_frame(page, r"\d+")
    assert re.search(r"/inspections/[0-9a-f]{32}", page.url)


def test_rules_are_not_edited_before_they_are_read_nor_stored_over_those_of_somebody_else(
    page: Page, archive: Server, rig_file: Path
) -> None:
    # A server that starts is asked again.
    log_in(page, archive, "/healthz")
    away = {"code": "unavailable", "detail": "It starts."}
    for path, asked in (
        ("settings/template", "**/api/report-templates/"),
        ("films/rules", "**/api/archive/rules"),
    ):
        page.route(asked, lambda route: route.fulfill(status=503, json=away), times=1)
        page.goto(f"{archive.url}/{path}")
        expect(page.get_by_role("alert").first).to_have_text("It starts. Trying again…")
        expect(page.locator(".rules, fieldset.template")).to_be_visible()
        expect(page.get_by_role("alert").first).to_be_empty()

    page.get_by_role("button", name="Add a rule").click()
    theirs = {"rigs": {}, "rules": [{"name": "theirs", "pattern": "**"}]}
    archive.ask("PUT", "/api/archive/rules", theirs)
    page.get_by_role("button", name="Save").click()
    page.get_by_role("button", name="Take theirs").click()
    expect(page.get_by_label("Name", exact=True)).to_have_value("theirs")
    expect_no_fault(page, ("light",))

    # On a slow network nothing can be edited that the stored rules would replace.
    late: list[Route] = []
    page.route("**/api/archive/rules", lambda route: late.append(route))
    page.route("**/api/presets", lambda _: None)  # its answer never comes
    page.reload()
    expect(page.get_by_role("heading", name="Rules and rigs")).to_be_visible()
    expect(page.get_by_role("button", name="Add a rig")).to_be_hidden()
    for name in ("Discard changes", "Save", "Try on a folder"):
        expect(page.get_by_role("button", name=name)).to_be_disabled()
    late.pop().continue_()
    add_rig(page, rig_file)
    expect(page.get_by_role("button", name="Save")).to_be_enabled()


def test_a_group_of_failures_is_repaired_by_one_other_rig(
    page: Page, archive: Server, films: Path, clip: Path, rig_file: Path
) -> None:
    right = json.loads(rig_file.read_text())
    wrong = right | {"camera": right["camera"] | {"width": 640, "fx": 1200.0}}
    folder = folder_of(films, clip, "group", "A.mp4", "B.mp4")
    add(archive, folder, {"Wrong": wrong, "Right": right}, "Wrong")
    archive.ask("POST", "/api/archive/start", {"where": {}})
    log_in(page, archive, "/films/failures")
    group = page.locator(".failure")
    expect(group).to_contain_text("2 films")
    expect_no_fault(page, ("light",))
    group.get_by_role("button", name="Another rig, then retry").click()
    page.get_by_role("dialog").get_by_label("Rig").first.select_option("Right")
    expect_no_fault(page, ("dark",))
    page.get_by_role("button", name="Set it and retry").click()
    expect(page.get_by_text("No film has failed.")).to_be_visible()
    page.goto(f"{archive.url}/films")
    for name in ("A.mp4", "B.mp4"):
        expect(row_of(page, name)).to_contain_text("Done")
        expect(row_of(page, name)).to_contain_text("Right")


def test_what_was_done_to_selected_films_is_undone(
    page: Page, archive: Server, films: Path, clip: Path, rig_file: Path
) -> None:
    folder = folder_of(films, clip, "undone", "A.mp4", "B.mp4")
    add(archive, folder, {"Rig": json.loads(rig_file.read_text())}, "Rig")
    log_in(page, archive, "/films")
    page.get_by_role("checkbox", name="Select B", exact=True).check()
    page.get_by_role("button", name="Change…").click()
    page.get_by_role("dialog").get_by_label("Priority").fill("7")
    page.get_by_role("dialog").get_by_role("button", name="Change").click()
    expect(row_of(page, "B.mp4").locator(".table__priority")).to_have_text("7")
    page.get_by_role("button", name="Undo").click()
    expect(row_of(page, "B.mp4").locator(".table__priority")).to_have_text("0")
    page.get_by_role("checkbox", name="Select B", exact=True).check()
    page.get_by_role("button", name="Take off the list").click()
    question = page.get_by_role("dialog", name="Take 1 film off the list?")
    expect(question.get_by_role("button", name="Cancel")).to_be_focused()
    question.get_by_role("button", name="Take off the list").click()
    expect(row_of(page, "B.mp4")).to_have_count(0)
    expect(row_of(page, "A.mp4")).to_have_count(1)
