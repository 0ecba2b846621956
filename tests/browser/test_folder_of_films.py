"""A folder of films with one header and one rig: each becomes an inspection, or says why not."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from clips import numbered_clip, rig_for_clip
from looks import expect_no_fault
from playwright.sync_api import Locator, Page, Response, Route, expect
from steps import Server, limit_upload, log_in


@pytest.fixture(scope="module")
def clips(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two films that are not the same."""
    folder = tmp_path_factory.mktemp("clips")
    five, six = (
        numbered_clip(folder / f"{frames}.mp4", "libx264", frames=frames) for frames in (5, 6)
    )
    return five, six


@pytest.fixture
def folder(tmp_path: Path, clips: tuple[Path, Path]) -> Path:
    """Three films, one of them damaged, and three files of other kinds."""
    folder = tmp_path / "job 12"
    (folder / "camera").mkdir(parents=True)
    shutil.copy(clips[1], folder / "run 10.mp4")
    shutil.copy(clips[0], folder / "camera" / "run 9.mp4")
    (folder / "run 2.avi").write_bytes(b"Once upon a time there was a culvert.")
    for other in ("notes.txt", "camera/map.png", "camera/._run 9.mp4"):
        (folder / other).write_text("not a film")
    return folder


@pytest.fixture
def form(page: Page, server: Server, tmp_path: Path) -> Page:
    log_in(page, server, "/new")
    page.locator("rig-form input[type=file]").set_input_files(rig_for_clip(tmp_path / "rig.json"))
    return page


def row(page: Page, name: str) -> Locator:
    return page.locator(".drop__film", has_text=name)


def inspections(server: Server) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.load(server.ask("GET", "/api/inspections"))["inspections"]
    return found


def is_made(got: Response) -> bool:
    return got.request.method == "POST" and got.url.endswith("/api/inspections") and got.ok


def choose(page: Page, folder: Path) -> None:
    page.locator("input[webkitdirectory]").set_input_files(folder)


def drop(page: Page, *paths: Path) -> None:
    """Drop files and folders, as from a file manager."""
    box = page.locator(".drop").bounding_box()
    assert box
    session = page.context.new_cdp_session(page)
    data = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        at = {"x": box["x"] + box["width"] / 2, "y": box["y"] + 20}
        session.send("Input.dispatchDragEvent", {"type": kind, "data": data, **at})


def test_each_film_of_a_folder_becomes_an_inspection_and_a_bad_one_says_why(
    form: Page, server: Server, folder: Path
) -> None:
    before = {one["id"] for one in inspections(server)}
    form.get_by_role("textbox", name="Operator", exact=True).fill("A. Rahman")
    choose(form, folder)
    expect(form.locator(".drop__others")).to_have_text("3 files are no films and were left out.")
    names = form.locator(".drop__name b")
    expect(names).to_have_text(["job 12/camera/run 9.mp4", "job 12/run 2.avi", "job 12/run 10.mp4"])
    expect(form.locator(".drop__total")).to_contain_text("3 of 3 uploaded · 100 %")
    expect(form.get_by_label("Name", exact=True)).to_be_hidden()
    expect_no_fault(form)

    form.get_by_role("button", name="Start tracking").click()
    expect(form.locator(".new__foot .fault")).to_contain_text("1 film has failed")
    expect(form.locator(".new__foot .fault")).to_contain_text("Inspections made: 2.")
    expect(row(form, "run 2.avi").locator(".drop__state--failed")).to_contain_text("run 2.avi")
    expect(form.locator(".drop__total")).to_contain_text("1 has failed")
    made = [one for one in inspections(server) if one["id"] not in before]
    assert sorted(one["name"] for one in made) == ["run 10", "run 9"]
    assert {one["header"]["operator"] for one in made} == {"A. Rahman"}
    assert made[0]["rig"] == made[1]["rig"]

    # The bad film goes, and nothing is left to start.
    row(form, "run 2.avi").get_by_role("button", name="Remove").click()
    expect(row(form, "run 2.avi")).to_have_count(0)
    form.get_by_role("button", name="Start tracking").click()
    expect(form.get_by_text("Choose the video first.")).to_be_visible()
    row(form, "run 9.mp4").get_by_role("link", name="Open the inspection").click()
    form.wait_for_url("**/inspections/*")


def test_a_dropped_folder_is_searched_to_the_bottom_and_films_of_one_name_are_told_apart(
    form: Page, server: Server, tmp_path: Path, clips: tuple[Path, Path]
) -> None:
    (tmp_path / "papers").mkdir()
    for name in ("plan.pdf", "notes.txt"):
        (tmp_path / "papers" / name).write_text("not a film")
    choose(form, tmp_path / "papers")
    expect(form.locator(".drop__others")).to_have_text("There is no film among these 2 files.")
    expect(form.get_by_role("button", name="Choose a folder")).to_be_visible()
    form.get_by_role("button", name="Start tracking").click()
    expect(form.get_by_text("Choose the video first.")).to_be_visible()
    expect(form.get_by_role("button", name="Choose films")).to_be_focused()

    both = tmp_path / "both"
    for camera, clip in zip(("left", "right"), clips, strict=True):
        (both / camera).mkdir(parents=True)
        shutil.copy(clip, both / camera / "0001.mp4")
        (both / camera / "notes.txt").write_text("not a film")
    drop(form, both)
    expect(form.locator(".drop__name b")).to_have_text(
        ["both/left/0001.mp4", "both/right/0001.mp4"]
    )
    expect(form.locator(".drop__others")).to_have_text("2 files are no films and were left out.")
    expect(form.locator(".drop__state")).to_have_text(["Uploaded", "Uploaded"])
    form.get_by_role("button", name="Start tracking").click()
    form.wait_for_url("**/inspections")
    expect(form.locator(".inspection", has_text="both/right/0001")).to_have_count(1)
    names = {one["name"] for one in inspections(server)}
    assert {"both/left/0001", "both/right/0001"} <= names


def test_a_film_that_stops_is_named_the_next_one_follows_and_all_are_removed_at_once(
    form: Page, folder: Path
) -> None:
    """The server refuses the first film for good; by keyboard it is taken out of the list."""
    begun: list[str] = []

    def refuse_first(route: Route) -> None:
        begun.append(route.request.url)
        if len(begun) > 1:
            route.fallback()
            return
        route.fulfill(status=413, json={"code": "upload_too_large", "detail": "Too large."})

    form.route("**/api/uploads", refuse_first)
    choose(form, folder)
    expect(row(form, "run 10.mp4").locator(".drop__state")).to_have_text("Uploaded")
    expect(row(form, "run 9.mp4").locator(".drop__state--failed")).not_to_be_empty()
    row(form, "run 9.mp4").get_by_role("button", name="Remove job 12/camera/run 9.mp4").focus()
    form.keyboard.press("Enter")
    expect(row(form, "run 9.mp4")).to_have_count(0)
    expect(form.get_by_role("button", name="Add films")).to_be_focused()

    deleted: list[str] = []
    form.on("request", lambda sent: deleted.append(sent.url) if sent.method == "DELETE" else None)
    expect(form.locator(".drop__total")).to_contain_text("2 of 2 uploaded")
    form.get_by_role("button", name="Remove all").click()
    expect(form.get_by_role("button", name="Choose films")).to_be_focused()
    form.reload()
    expect(form.locator("rig-form")).to_be_visible()
    expect(form.locator(".drop__unfinished")).to_have_count(0)
    assert len(deleted) == 2


def test_a_film_that_waits_for_room_does_not_keep_the_others_from_their_inspections(
    form: Page, folder: Path
) -> None:
    """A token may have a hundred uploads that are no inspections; here it may have one."""
    (folder / "run 2.avi").unlink()
    begun: list[str] = []
    made: list[str] = []

    def refuse_second(route: Route) -> None:
        begun.append(route.request.url)
        if made or len(begun) == 1:
            route.fallback()
            return
        detail = "Discard some, or wait."
        route.fulfill(status=429, json={"code": "too_many_uploads", "detail": detail})

    form.route("**/api/uploads", refuse_second)
    form.on("response", lambda got: made.append(got.url) if is_made(got) else None)
    choose(form, folder)
    expect(row(form, "run 10.mp4").locator(".drop__state")).to_contain_text("Trying again")
    form.get_by_role("button", name="Start tracking").click()
    form.wait_for_url("**/inspections")
    assert len(made) == 2


def test_a_film_on_a_disk_that_goes_is_named_and_the_next_one_follows(
    form: Page, folder: Path
) -> None:
    first = folder / "camera" / "run 9.mp4"
    with first.open("ab") as file:
        file.write(bytes(8_000_000))
    limit_upload(form, 400_000)
    choose(form, folder)
    expect(row(form, "run 9.mp4").locator(".drop__state")).to_contain_text(re.compile(r"[1-9] %"))
    first.unlink()
    expect(row(form, "run 9.mp4").locator(".drop__state--failed")).to_contain_text(
        "The file can no longer be read here."
    )
    expect(row(form, "run 10.mp4").locator(".drop__state")).to_have_text("Uploaded")
