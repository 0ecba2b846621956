"""Templates of reports through their routes, and in the reports of an inspection."""

from __future__ import annotations

import base64
import io
import struct
import zlib
from pathlib import Path
from typing import Any
from urllib.parse import quote

from builders import Client, assert_error
from lxml import html
from PIL import Image

from app.storage.database.backup import back_up, restore
from app.storage.database.database import Database
from app.storage.records.report_templates import ReportTemplateStore

API = "/api/report-templates"


def path_of(project: str) -> str:
    return f"{API}/{quote(project, safe='')}"


def picture(size: tuple[int, int] = (40, 20), kind: str = "PNG") -> str:
    out = io.BytesIO()
    Image.new("RGB", size, (200, 30, 30)).save(out, kind)
    return base64.b64encode(out.getvalue()).decode()


def claiming(side_px: int) -> str:
    """A picture whose header claims to be larger than it is."""
    content = bytearray(base64.b64decode(picture()))
    content[16:24] = struct.pack(">II", side_px, side_px)
    content[29:33] = struct.pack(">I", zlib.crc32(content[12:29]))
    return base64.b64encode(content).decode()


def listed(client: Client) -> list[str]:
    return [one["project"] for one in client.get(API).json()["templates"]]


def test_a_template_is_kept_replaced_and_taken_away(server: Client) -> None:
    first = server.get(path_of("North/1 ü")).json()
    assert (first["project"], first["template"]["company_name"]) == (None, "")
    assert server.put(path_of(""), json={"company_name": "Everybody"}).status_code == 200
    made = server.put(path_of("North/1 ü"), json={"company_name": "North", "logo": picture()})
    assert made.json() == server.get(path_of("North/1 ü")).json()
    assert made.json()["changed_by"] == "server"
    assert listed(server) == ["", "North/1 ü"]
    version = {"If-Match": made.headers["ETag"]}
    theirs = server.put(path_of("North/1 ü"), json={"company_name": "B"}, headers=version)
    assert theirs.status_code == 200
    for late in (
        server.put(path_of("North/1 ü"), json={"company_name": "C"}, headers=version),
        server.delete(path_of("North/1 ü"), headers=version),
    ):
        assert (late.status_code, late.json()["code"]) == (412, "changed_meanwhile")
        assert late.json()["current"]["company_name"] == "B"
    assert server.delete(path_of("North/1 ü")).status_code == 204
    assert server.delete(path_of("North/1 ü")).status_code == 204, "there is nothing left"
    found = server.get(path_of("North/1 ü")).json()
    assert (found["project"], found["template"]["company_name"]) == ("", "Everybody")


def test_of_two_first_templates_of_a_project_none_is_lost(shared: Client) -> None:
    shared.put(path_of(""), json={"company_name": "Everybody"})
    common = {"If-Match": shared.get(path_of("New")).headers["ETag"]}
    first = shared.put(path_of("New"), json={"company_name": "A"}, headers=common)
    assert first.status_code == 200
    second = shared.put(path_of("New"), json={"company_name": "B"}, headers=common)
    assert (second.status_code, second.json()["current"]["company_name"]) == (412, "A")
    shared.delete(path_of("New"))
    gone = {"If-Match": first.headers["ETag"]}
    late = shared.put(path_of("New"), json={"company_name": "C"}, headers=gone)
    assert (late.status_code, late.json()["current"]) == (412, None)


WRONG: tuple[tuple[dict[str, Any], str], ...] = (
    ({"sections": ["summary", "summary"]}, "names a section twice"),
    ({"sections": ["nonsense"]}, "sections"),
    ({"accent": "#ffee00"}, "too light"),
    ({"accent": "red"}, "accent"),
    ({"logo": "not base64!"}, "is not base64"),
    ({"logo": base64.b64encode(b"GIF89a").decode()}, "no PNG or JPEG"),
    ({"logo": picture()[:60]}, "no PNG or JPEG"),
    ({"logo": picture((4001, 1))}, "4001 x 1 pixels"),
    ({"logo": picture(kind="GIF")}, "no PNG or JPEG"),
    ({"logo": claiming(60_000)}, "60000 x 60000 pixels"),
    ({"recommendations": [{"text": ""}]}, "recommendations"),
    ({"introduction": "\x00"}, "introduction"),
    ({"unknown": 1}, "unknown"),
)
"""Fields, and a part of what is said of them."""


def test_what_no_report_can_show_is_refused(shared: Client) -> None:
    for wrong, said in WRONG:
        assert said in assert_error(shared.put(path_of("x"), json=wrong), 422, "invalid_request")
    assert "x" not in listed(shared)


def test_the_reports_of_an_inspection_use_the_template_of_its_project(
    shared: Client, own: str
) -> None:
    for project in ("", "North"):  # other tests of this server have them
        shared.delete(path_of(project))
    path = f"/api/inspections/{own}"
    header = shared.get(path).json()["header"]
    shared.patch(path, json={"header": header | {"project": "North"}})
    of_it = f"{path}/report-template"
    assert shared.get(of_it).json()["project"] is None
    plain = exported(shared, path)
    assert "Summary" in plain
    shared.put(path_of(""), json={"company_name": "Everybody Ltd"})
    assert shared.get(of_it).json()["project"] == ""
    assert "Everybody Ltd" in exported(shared, path)
    chosen = {
        "company_name": "North Ltd", "company_address": "1 High Street\nNorthtown",
        "logo": picture(), "introduction": "As ordered.", "closing": "We thank you.",
        "accent": "#703000", "sections": ["condition", "summary"],
    }  # fmt: skip
    shared.put(path_of("North"), json=chosen)
    page = html.fromstring(exported(shared, path).encode())
    assert [one.get("id") for one in page.xpath("//main/section")] == ["condition", "summary"]
    assert len(page.xpath("//nav//a")) == 2
    (company,) = page.xpath("//*[@class='company']")
    assert company.text_content().split() == ["North", "Ltd", "1", "High", "Street", "Northtown"]
    (logo,) = company.xpath("img")
    assert Image.open(io.BytesIO(base64.b64decode(logo.get("src").split(",")[1]))).size == (40, 20)
    assert "--accent: #703000" in page.xpath("string(//style)")
    assert page.xpath("//header//text()[contains(., 'As ordered.')]")
    assert page.xpath("//footer//text()[contains(., 'We thank you.')]")
    shared.delete(path_of("North"))
    assert "Everybody Ltd" in exported(shared, path)
    assert_error(shared.get(f"/api/inspections/{'0' * 32}/report-template"), 404,
                 "inspection_not_found")  # fmt: skip


def exported(client: Client, inspection: str) -> str:
    answer = client.get(f"{inspection}/exports/html")
    assert answer.status_code == 200, answer.text
    return str(answer.text)


def test_templates_are_backed_up_and_restored(shared: Client, tmp_path: Path) -> None:
    shared.put(path_of("North"), json={"company_name": "North Ltd"})
    back_up(shared.data, tmp_path / "backup.zip", lambda *_: None)
    restore(tmp_path / "backup.zip", tmp_path / "again", lambda *_: None)
    database = Database(tmp_path / "again" / "chainage.db")
    found = ReportTemplateStore(database).best(["North"])
    database.close()
    assert found
    assert (found.project, found.content["company_name"]) == ("North", "North Ltd")
