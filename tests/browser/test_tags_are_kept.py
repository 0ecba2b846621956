"""Tagging, editing and undoing; nothing is lost when the server is away."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from desks import (
    another_tab,
    ask,
    delete_observations,
    expect_frame,
    expect_saved,
    observations,
)
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey


@pytest.fixture(scope="module")
def server(wide: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(wide.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(wide: Survey) -> str:
    return wide.id


@pytest.fixture
def desk(page: Page, server: Server, inspection: str) -> Page:
    """The page of an inspection without any tag."""
    delete_observations(server, inspection)
    log_in(page, server, f"/inspections/{inspection}")
    expect_frame(page, 0)
    return page


def test_what_is_tagged_and_typed_survives_the_server_a_reload_and_a_closed_tab(
    desk: Page, server: Server, inspection: str
) -> None:
    tags_made_without_a_server_are_saved_when_it_is_back(desk, server)
    # Saving is held back by the browser while the page is reloaded.
    desk.route("**/observations/*", lambda route: route.abort())
    desk.keyboard.press("5")
    expect(desk.locator(".save")).to_have_text("Waiting (1)")
    desk.reload()
    expect(desk.locator(".defect__what b").first).to_have_text(re.compile("B"))
    expect(desk.locator(".save")).to_have_text("Waiting (1)")
    desk.unroute("**/observations/*")
    expect_saved(desk)
    assert {item["code"] for item in observations(server, inspection)} == {"BAB", "BAC", "BBA"}
    delete_observations(server, inspection)
    expect(desk.locator(".defect")).to_have_count(0)
    what_is_typed_survives_a_reload_and_a_closed_tab(desk, server, inspection)


def tags_made_without_a_server_are_saved_when_it_is_back(desk: Page, server: Server) -> None:
    server.kill()
    desk.keyboard.press("1")
    desk.keyboard.press("2")
    expect(desk.locator(".save")).to_have_text("Waiting (2)")
    server.start()
    expect_saved(desk)


def what_is_typed_survives_a_reload_and_a_closed_tab(
    desk: Page, server: Server, inspection: str
) -> None:
    save, remark = desk.locator(".save"), desk.get_by_label("Remark")
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    expect_saved(desk)
    desk.route("**/observations/*", lambda route: route.abort())
    ask(desk, "remark")
    remark.press_sequentially("root")
    ask(desk, "quant1")
    desk.get_by_label("Quantity", exact=True).press_sequentially("0,4")
    expect(save).to_have_text(re.compile(r"Waiting \([12]\)"))  # 2: one was just being sent
    desk.reload()
    expect(desk.locator(".defect__more")).to_contain_text("root")
    desk.locator(".defect__main").click()
    desk.keyboard.press("e")
    expect(desk.locator(".question[data-key=quant1]")).to_contain_text("0.4 mm")
    ask(desk, "remark")
    remark.press("End")
    remark.press_sequentially("s at the joint")
    other = another_tab(desk)
    desk.close()
    other.goto(f"{server.url}/inspections/{inspection}")
    expect(other.locator(".defect__more")).to_contain_text("roots at the joint")
    expect_saved(other)
    [item] = observations(server, inspection)
    assert (item["remark"], item["quant1"]) == ("roots at the joint", 0.4)

    # All letters of a visit of the field are one step, which the button names.
    other.locator(".defect__main").click()
    other.keyboard.press("e")
    ask(other, "remark")
    other.get_by_label("Remark").fill("")
    other.get_by_label("Remark").press_sequentially("dry")
    other.get_by_role("button", name="Done").click()
    undo = other.locator("[data-part=undo]")
    expect(undo).to_have_attribute(
        "title", "Undo: remark roots at the joint → dry of BAB at 0.00 m (U)"
    )
    undo.click()
    expect(other.locator(".defect__more")).to_contain_text("roots at the joint")
    expect(undo).to_be_disabled()
