"""A delivery leaves the desk with its film, and one document over all leaves the list."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pypdf
import pytest
from clips import numbered_clip, rig_for_clip
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in

from app.reports.bundle.verify import verify

TAG = "7d444840-9dc0-4d2a-8a6a-000000000001"


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return numbered_clip(tmp_path_factory.mktemp("film") / "clip.mp4", "libx264", frames=20)


@pytest.fixture(scope="module")
def inspection(server: Server, film: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    made = server.track(film, rig_for_clip(tmp_path_factory.mktemp("rig") / "rig.json"))
    tag = {"frame": 3, "code": "BAB", "char1": "B", "char2": "A", "severity": 3}
    server.ask("PUT", f"/api/inspections/{made}/observations/{TAG}", tag)
    return made


def test_a_delivery_with_its_film_then_one_document(
    page: Page, server: Server, inspection: str, film: Path, tmp_path: Path
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    page.get_by_text("Export", exact=True).click()
    page.get_by_role("button", name=re.compile("^Delivery ")).click()
    dialog = page.get_by_role("dialog", name="Export: Delivery")
    dialog.get_by_label("Exchange format").select_option("RIBX")
    dialog.get_by_label("Language of report and page").select_option("Bahasa Malaysia")
    dialog.get_by_label("The film as well").check()
    expect_no_fault(page, ("dark",))
    with page.expect_download() as download:
        dialog.get_by_role("button", name="Download").click()
    expect(dialog).to_have_count(0)
    assert download.value.suggested_filename == "clip-delivery.zip"
    path = tmp_path / "delivery.zip"
    download.value.save_as(path)
    assert verify(path, video=film).is_right
    with zipfile.ZipFile(path) as archive:
        assert archive.read("clip.mp4") == film.read_bytes()
        cited = set(re.findall(r"clip[\w.-]*\.(?:jpg|mp4)", archive.read("clip.ribx").decode()))
        assert cited == {"clip.mp4", "clip-001.jpg"}
        assert cited <= set(archive.namelist())
        assert b'lang="ms"' in archive.read("clip-report.html")[:200]

    page.goto(f"{server.url}/")
    page.get_by_label("Select this page").check()
    page.get_by_role("button", name="Export…").click()
    dialog = page.get_by_role("dialog", name="Export 1 inspection")
    for label in ("PDF", "XLSX"):
        dialog.get_by_label(label, exact=True).uncheck()
    expect(dialog.get_by_role("button", name="Make the archive")).to_be_disabled()
    dialog.get_by_label("One document").check()
    expect_no_fault(page, ("dark",))
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
