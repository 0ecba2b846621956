"""What was stated, uploaded and logged in outlives the server."""

from __future__ import annotations

import contextlib
import sqlite3
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

from builders import TOKEN, TUS, assert_error, frame_number, serving
from doors import log_in
from reports import DEFECTS, report
from surveys import Survey

from app.access.access import Access
from app.reports.formats import FORMATS
from app.storage.database.backup import back_up, restore

DATABASE = "chainage.db"


def test_an_inspection_its_corrections_and_an_import_are_found_again_also_in_a_backup(
    survey: Survey, tmp_path: Path
) -> None:
    data, back = survey.copied_to(tmp_path / "data"), tmp_path / "back"
    path = f"/api/inspections/{survey.id}"
    with serving(data) as client:
        content = FORMATS["en13508"].write(report()).content
        made = client.post("/api/imports", params={"filename": "old.txt"}, content=content)
        imported = f"/api/inspections/{made.json()['inspections'][0]['id']}"
        client.tag(survey.id, code="BAB", pixel=[20, 30])
        gone = client.tag(survey.id).json()["id"]
        client.delete(f"{path}/observations/{gone}")
        zero = {"zero": {"frame": 20, "offset_m": 0.35}}
        client.put(f"{path}/corrections", json=zero).raise_for_status()
        preferences = client.get("/api/me").json()["preferences"] | {"language": "ms"}
        client.put("/api/me/preferences", json=preferences)
        shown = ["/api/me", *(of + part for of in (path, imported) for part in (
            "", "/track", "/observations", "/corrections"))]  # fmt: skip
        before = {each: client.get(each).text for each in shown}
        assert back_up(data, tmp_path / "all.zip", lambda done, total: None).missing == ()
    restore(tmp_path / "all.zip", back, lambda done, total: None)
    for folder in (data, back):
        with serving(folder) as client:
            assert {each: client.get(each).text for each in shown} == before
            assert client.inspection(imported.rpartition("/")[2])["defects"] == DEFECTS
            assert frame_number(client.get(f"{path}/frames/5.jpg").content) == 5
            assert client.post(f"{path}/observations/{gone}/restore").status_code == 200
            assert client.get("/readyz").status_code == 200


def test_sessions_outlive_the_server_until_they_are_old_or_its_token_is_another_one(
    tmp_path: Path,
) -> None:
    with serving(tmp_path) as client:
        old, idle, kept = (log_in(client).cookies[client.cookie_name] for _ in range(3))
    now = datetime.now(UTC).replace(tzinfo=None)
    ages = {"created_at": (31, 8, 29), "seen_at": (0, 8, 6)}
    with contextlib.closing(sqlite3.connect(tmp_path / DATABASE)) as database, database:
        rows = [row for (row,) in database.execute("SELECT digest FROM sessions ORDER BY rowid")]
        for column, days in ages.items():
            for row, age in zip(rows, days, strict=True):
                change = f"UPDATE sessions SET {column} = ? WHERE digest = ?"  # noqa: S608
                database.execute(change, (str(now - timedelta(days=age)), row))

    def answers(*, token: str) -> list[int]:
        with serving(tmp_path, token=token) as client:
            stranger = client.anonymous()
            found = [
                stranger.get("/api/me", headers=headers).status_code
                for headers in (
                    {"Authorization": f"Bearer {TOKEN}"},
                    *({"Cookie": f"{client.cookie_name}={cookie}"} for cookie in (kept, old, idle)),
                )
            ]
            if token == TOKEN:
                log_in(client)
                with contextlib.closing(sqlite3.connect(tmp_path / DATABASE)) as database:
                    assert database.execute("SELECT count(*) FROM sessions").fetchone() == (2,)
            return found

    assert answers(token=TOKEN) == [200, 200, 401, 401]
    assert answers(token=TOKEN[::-1]) == [401] * 4


def test_the_server_makes_a_token_once_and_keeps_it_to_itself(tmp_path: Path) -> None:
    tokens = []
    (tmp_path / DATABASE).touch(mode=0o644)
    tmp_path.chmod(0o755)
    for _ in range(2):
        with serving(tmp_path, token=None) as client:
            tokens.append(client.server.app.state.services[Access].server_token)
            bearer = {"Authorization": f"Bearer {tokens[-1]}"}
            assert client.get("/api/session", headers=bearer).status_code == 200
    assert tokens[0] == tokens[1]
    assert len(tokens[0]) >= 43
    modes = {
        name: stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("", "token", DATABASE)
    }
    assert modes == {"": 0o700, "token": 0o600, DATABASE: 0o600}
    assert tokens[0].encode() not in (tmp_path / DATABASE).read_bytes()


def test_an_upload_goes_on_after_restarts_of_which_one_had_no_room(tmp_path: Path) -> None:
    content = bytes(range(256)) * 100
    with serving(tmp_path) as client:
        begun = client.post("/api/uploads", headers={**TUS, "Upload-Length": str(len(content))})
        place = begun.headers["Location"]
        client.patch_upload(place, 0, content[:1000])
    with serving(tmp_path, disk_reserve_bytes=2**50) as client:
        answer = client.post("/api/uploads", headers={**TUS, "Upload-Length": "10"})
        assert_error(answer, 507, "disk_full")
        assert_error(client.patch_upload(place, 1000, content[1000:]), 507, "disk_full")
        assert client.head(place, headers=TUS).headers["Upload-Offset"] == "1000"
    with serving(tmp_path) as client:
        assert client.patch_upload(place, 1000, content[1000:]).status_code == 204
    (stored,) = (tmp_path / "uploads").glob("*.bin")
    assert stored.read_bytes() == content
