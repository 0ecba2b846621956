"""Proposals on the wall are decided beside the film, by keys, and undone; who only looks cannot."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from desks import expect_frame, expect_read, expect_saved, observations
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey

from app.storage.database.database import FILE, Database
from app.storage.records.findings import FindingStore, new_finding
from app.storage.records.observations import ObservationStore
from app.survey.findings.records import CLASSICAL, Proposal, SearchState, SearchStatus, Size

FOUND = (("crack", 8, 0.9), ("deposit", 16, 0.6), ("crack", 24, 0.4), ("stain", 32, 0.8))
"""Kind, a frame that has it in its middle, score."""

SEARCH: tuple[SearchState, SearchState] = ("searching", "done")


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture
def inspection(server: Server, narrow: Survey) -> str:
    """Its wall was searched."""
    answer = server.ask("GET", f"/api/inspections/{narrow.id}/track?format=json")
    raw_mm = json.load(answer)["columns"]["distance_mm"]
    database = Database(server.data / FILE)
    found = [
        new_finding(narrow.id, _proposed(kind, raw_mm[frame], score), (CLASSICAL, "1"), None)
        for kind, frame, score in FOUND
    ]
    store = FindingStore(database, ObservationStore(database))
    begun, ended = (SearchStatus(state, CLASSICAL) for state in SEARCH)
    store.put_search(narrow.id, begun)
    assert store.settle(narrow.id, found, {}, before=begun, after=ended, replaces=CLASSICAL)
    database.close()
    return narrow.id


def _proposed(kind: str, axial_mm: float, score: float) -> Proposal:
    size = Size(4.0, 0.3)
    outline = ((axial_mm - 2, -1.0), (axial_mm, 0.0), (axial_mm + 2, -1.0))
    return Proposal(
        kind=kind, outline_mm=outline, length=size, width=None,
        direction="along" if kind == "crack" else None, score=score,
    )  # fmt: skip


def test_proposals_are_accepted_rejected_and_passed_over_by_keys(
    page: Page, server: Server, inspection: str
) -> None:
    shown_in = [finding["frame"] for finding in _read(server, inspection)["findings"]]
    log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    queue = page.locator("finding-queue")
    page.get_by_role("tab", name="Look here 4").click()
    counts, title = queue.locator(".queue__head .number"), queue.locator(".queue__title")
    expect(title).to_have_text("Crack, along the pipe")
    expect_frame(page, shown_in[0])
    expect_no_fault(page, within="finding-queue")

    page.keyboard.press("a")
    expect(counts).to_have_text("3 to look at \u00b7 1 accepted \u00b7 0 rejected")
    expect(title).to_have_text("Deposit")
    expect_frame(page, shown_in[1])
    page.keyboard.press("r")
    page.keyboard.press("n")
    expect(title).to_have_text("Stain")
    expect_saved(page)
    (made,) = observations(server, inspection)
    assert (made["code"], made["char1"], made["frame"]) == ("BAB", "B", shown_in[0])
    assert _counts(server, inspection) == {"offered": 2, "accepted": 1, "rejected": 1}

    # What was undone is looked at again.
    page.keyboard.press("u")
    expect(title).to_have_text("Deposit")
    page.keyboard.press("u")
    expect(counts).to_have_text("4 to look at \u00b7 0 accepted \u00b7 0 rejected")
    expect_saved(page)
    assert observations(server, inspection) == []

    # Without a line a decision waits; another code counts in place of the suggested one.
    page.context.set_offline(True)
    queue.get_by_label("Code", exact=True).fill("BBA")
    page.keyboard.press("Enter")
    queue.get_by_role("button", name="Accept").click()
    expect(page.locator(".save")).to_have_text("Waiting (1)")
    page.context.set_offline(False)
    expect_saved(page)
    (made,) = observations(server, inspection)
    assert (made["code"], made["quant1"]) == ("BBA", None)

    # A rejected one is offered again; elsewhere the keys are those of the desk.
    page.keyboard.press("r")
    queue.get_by_text("1 rejected", exact=True).click()
    queue.get_by_role("button", name="Offer again").click()
    expect(counts).to_have_text("3 to look at \u00b7 1 accepted \u00b7 0 rejected")
    page.get_by_role("tab", name="Checks").click()
    page.keyboard.press("r")
    expect_saved(page)
    assert _counts(server, inspection)["rejected"] == 0


def test_who_only_looks_decides_nothing(page: Page, server: Server, inspection: str) -> None:
    before = _counts(server, inspection)
    log_in(page, server, f"/inspections/{inspection}", server.make_token("visitor", "viewer"))
    expect_read(page)
    page.get_by_role("tab", name="Look here").click()
    queue = page.locator("finding-queue")
    expect(queue.get_by_text("You can look and export")).to_be_visible()
    expect(queue.get_by_role("button", name="Accept")).to_be_disabled()
    for key in ("a", "r"):
        page.keyboard.press(key)
    title = queue.locator(".queue__title")
    shown = title.inner_text()
    page.keyboard.press("n")
    expect(title).not_to_have_text(shown)
    assert _counts(server, inspection) == before


def _read(server: Server, inspection: str) -> dict[str, Any]:
    answer = server.ask("GET", f"/api/inspections/{inspection}/findings")
    found: dict[str, Any] = json.load(answer)
    return found


def _counts(server: Server, inspection: str) -> dict[str, int]:
    counts: dict[str, int] = _read(server, inspection)["counts"]
    return counts
