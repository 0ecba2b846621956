"""The template of a project's reports is edited on its page, and the next report looks like it."""

from __future__ import annotations

import io
import json
from pathlib import Path

from looks import expect_no_fault
from PIL import Image
from playwright.sync_api import Page, expect
from pypdf import PdfReader
from steps import Server, log_in

API = "/api/report-templates"


def stored(server: Server, project: str) -> dict[str, object]:
    found = json.load(server.ask("GET", f"{API}/{project}"))
    assert found["project"] == project, "it has no template of its own"
    return dict(found["template"])


def test_a_template_is_edited_undone_saved_and_used(
    page: Page, server: Server, tmp_path: Path
) -> None:
    text = '#A1=ISO-8859-1\r\n#A2=en\r\n#A3=;\r\n#A4=.\r\n#A5="\r\n#A6=2010\r\n'
    text += "#B01=AAA;ABI\r\nCUL-0041;North\r\n#C=I;A;B\r\n0.00;BCD;XP\r\n3.20;BAB;B\r\n#Z\r\n"
    as_it_is = {"Content-Type": "application/octet-stream"}
    server.ask("POST", "/api/imports?filename=survey.txt", text.encode(), as_it_is)
    logo = tmp_path / "logo.png"
    Image.effect_noise((1200, 600), 90).save(logo)  # larger than the server takes
    log_in(page, server, "/assets/projects?project=North")
    page.get_by_role("main").get_by_role("link", name="Report template").click()
    expect(page.get_by_role("heading", name="Report template: North")).to_be_visible()
    expect(page.get_by_text("Nobody has made a template yet")).to_be_visible()

    # Texts: what is typed in one visit is one step.
    name, save = page.get_by_label("Name"), page.get_by_role("button", name="Save", exact=True)
    expect(save).to_be_disabled()
    name.press_sequentially("North Ltd")
    page.get_by_role("button", name="Undo").click()
    expect(name).to_have_value("")
    expect(save).to_be_disabled()
    page.get_by_role("button", name="Redo").click()
    expect(name).to_have_value("North Ltd")
    page.locator("input[type=file]").set_input_files(logo)
    expect(page.get_by_alt_text("The logo as it is printed")).to_be_visible()
    page.get_by_label("Colour of titles").fill("#ffee00")
    expect(page.get_by_text("This colour is too light")).to_be_visible()
    save.click()
    expect(page.get_by_text("titles in this colour cannot be read on white")).to_be_visible()
    page.get_by_label("Colour of titles").fill("#703000")

    # Sections: by the box, by keys, by a button, and back.
    sections = page.get_by_role("region", name="Sections").get_by_role("checkbox")
    sections.nth(1).uncheck()
    sections.nth(0).focus()
    page.keyboard.press("Alt+ArrowDown")
    expect(sections.nth(1)).to_be_focused()
    expect(sections.nth(1)).to_have_accessible_name("Summary")
    page.get_by_role("button", name="Move Pipe graphic up").click()
    expect(sections.nth(1)).to_have_accessible_name("Pipe graphic")

    # Recommendations: an unfinished one is not saved, a removed one comes back.
    blocks = page.get_by_role("region", name="Recommendations")
    blocks.get_by_role("button", name="Add a text").click()
    page.keyboard.type("bab")
    save.click()
    expect(page.get_by_text("Text 1 is not complete")).to_be_visible()
    blocks.get_by_label("Text, text 1").fill("Seal the crack.")
    blocks.get_by_label("Severity from, text 1").select_option("3")
    blocks.get_by_role("button", name="Remove text 1").click()
    expect(blocks.get_by_text("No texts yet.")).to_be_visible()
    page.locator("toast-stack").get_by_role("button", name="Undo").click()
    expect(blocks.get_by_label("Code, text 1")).to_have_value("BAB")
    expect_no_fault(page)
    save.click()
    expect(page.get_by_text("The template is saved")).to_be_visible()
    expect(page.get_by_text("This project has its own template.")).to_be_visible()
    kept = stored(server, "North")
    assert (kept["company_name"], kept["accent"]) == ("North Ltd", "#703000")
    assert kept["sections"] == [
        "graphic", "summary", "observations", "photos", "wall", "scene", "condition",
        "measurement", "checks",
    ]  # fmt: skip
    assert kept["recommendations"] == [
        {"text": "Seal the crack.", "code": "BAB", "char1": None, "severity_from": 3, "cost": None}
    ]

    # The report is made of it.
    with page.expect_download() as download:
        page.get_by_role("button", name="Make the PDF").click()
    pages = PdfReader(io.BytesIO(Path(download.value.path()).read_bytes())).pages
    assert "North Ltd" in pages[0].extract_text()

    # Somebody else saves meanwhile; nothing is lost.
    server.ask("PUT", f"{API}/North", kept | {"company_name": "Theirs"})
    page.get_by_label("Closing text").fill("Thank you.")
    save.click()
    expect(page.get_by_text("somebody else saved another version")).to_be_visible()
    page.get_by_role("button", name="Keep mine").click()
    expect(page.get_by_text("somebody else saved another version")).to_have_count(0)
    expect(save).to_be_disabled()
    assert (stored(server, "North")["company_name"], stored(server, "North")["closing"]) == (
        "North Ltd", "Thank you.",
    )  # fmt: skip

    # Back to the common one, and undone with what was typed.
    page.get_by_label("Introduction").fill("Not saved yet.")
    page.get_by_role("button", name="Use the common template").click()
    expect(name).to_have_value("")
    page.locator("toast-stack").get_by_role("button", name="Undo").last.click()
    expect(name).to_have_value("North Ltd")
    expect(page.get_by_label("Introduction")).to_have_value("Not saved yet.")
    assert stored(server, "North")["closing"] == "Thank you."

    # A question before what is typed is lost.
    name.fill("Other")
    asked = []
    page.on("dialog", lambda dialog: (asked.append(dialog.type), dialog.accept()))
    page.get_by_role("link", name="All other projects").click()
    expect(page.get_by_role("heading", name="All other projects")).to_be_visible()
    assert asked == ["beforeunload"]


def test_a_viewer_reads_it(page: Page, server: Server) -> None:
    server.ask("PUT", f"{API}/South", {"company_name": "South Ltd"})
    log_in(page, server, "/settings/template?project=South", server.make_token("Vera", "viewer"))
    expect(page.get_by_label("Name")).to_have_value("South Ltd")
    expect(page.get_by_label("Name")).to_be_disabled()
    expect(page.get_by_role("button", name="Save", exact=True)).to_be_hidden()
    expect(page.get_by_role("button", name="Add a text")).to_be_hidden()
