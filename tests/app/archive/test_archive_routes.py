"""The archive through its routes: films are added by rules, tracked, stopped and repaired."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from builders import Client, assert_error, clip_rig, make_clip, serving, wait_until
from processes import process
from surveys import Survey

from app.storage.database.database import FILE

API = "/api/archive"
ROADS = {"name": "roads", "pattern": "{project}/{asset}_{date}.mp4", "rig": "floor"}
RULES: dict[str, Any] = {
    "rigs": {"floor": clip_rig(), "wide": clip_rig(width=300)},
    "rules": [ROADS],
}
FRAMES = 12
ONE, OTHER = "C-1_20260331.mp4", "other.MP4"
Serve = Callable[..., AbstractContextManager[Client]]


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return make_clip(tmp_path_factory.mktemp("clip") / "clip.mp4", FRAMES).read_bytes()


@pytest.fixture
def folder(tmp_path: Path, film: bytes) -> Path:
    """One film of a road, one elsewhere, and what is no film."""
    road = tmp_path / "films" / "Road 5"
    road.mkdir(parents=True)
    (road / ONE).write_bytes(film)
    (tmp_path / "films" / OTHER).write_bytes(film)
    (tmp_path / "films" / "notes.txt").write_text("x")
    return tmp_path / "films"


@pytest.fixture
def serve(tmp_path: Path, folder: Path) -> Serve:
    def start(**settings: Any) -> AbstractContextManager[Client]:
        return serving(tmp_path / "data", archive_folders=(folder,), **settings)

    return start


def ask(client: Client, action: str, method: str = "POST", **body: Any) -> Any:
    answer = client.request(method, f"{API}/{action}", json=body)
    assert answer.status_code == 200, answer.text
    return answer.json()


def get(client: Client, what: str, **query: Any) -> Any:
    answer = client.get(f"{API}/{what}", params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()


def states(client: Client) -> dict[str, int]:
    return dict(get(client, "progress")["states"])


def films(client: Client) -> dict[str, dict[str, Any]]:
    """The films by their file names."""
    return {Path(each["path"]).name: each for each in get(client, "films")["films"]}


def rows(data: Path, inspection_id: str) -> list[str]:
    """The rows of a finished track."""
    lines = (data / "inspections" / inspection_id / "track.csv").read_text().splitlines()
    return [line for line in lines if not line.startswith("#")]


def review(client: Client, inspection_id: str, *states: str) -> None:
    for state in states:
        path = f"/api/inspections/{inspection_id}/review"
        client.post(path, json={"state": state}).raise_for_status()


def add_all(client: Client, folder: Path, **rules: Any) -> None:
    assert client.put(f"{API}/rules", json=RULES | rules).status_code == 200
    ask(client, "films", paths=[str(folder)])


def test_films_are_added_by_rules_and_tracked(serve: Serve, folder: Path) -> None:
    with serve() as client:
        assert client.put(f"{API}/rules", json=RULES).status_code == 200
        registered = {"project": "Road 6", "header": {"material": "clay"}}
        assert client.put("/api/register/assets/C-1", json=registered).status_code == 200
        seen = ask(client, "films/preview", paths=[str(folder)])
        assert states(client) == {}
        assert ask(client, "films", paths=[str(folder)]) == seen
        assert (seen["found"], seen["new"], seen["known"]) == (2, 2, 0)
        assert [(each["rule"], each["problem"]) for each in seen["films"]] == [
            (None, "The file is not a film by its suffix."),
            (None, "No rule fits this film, so it has no rig."),
            ("roads", None),
        ]
        assert states(client) == {"ready": 1, "unassigned": 1}
        assert ask(client, "start", where={"project": "Road 5"}) == {"changed": 1}
        wait_until(lambda: states(client) == {"done": 1, "unassigned": 1})
        found = films(client)[ONE]
        assert (found["state"], found["frames_done"]) == ("done", FRAMES)
        assert found["inspection_id"] == found["id"]
        assert found["distance_m"] > 0
        assert client.inspection(found["id"])["header"] == {
            "asset_id": "C-1", "project": "Road 5", "date": "2026-03-31", "material": "clay",
        }  # fmt: skip
        progress = get(client, "progress")
        assert (progress["films_done"], progress["frames_done"]) == (1, FRAMES)
        again = ask(client, "films", paths=[str(folder)])
        assert (again["new"], again["known"]) == (0, 2)
        assert get(client, "films", outdated=True)["total"] == 0
        with closing(sqlite3.connect(client.data / FILE)) as database, database:
            database.execute("UPDATE inspections SET tracked_with = '0.0.9+0123456789ab'")
        (old,) = get(client, "films", outdated=True)["films"]
        assert (old["name"], old["outdated"]) == (found["name"], True)
        assert ask(client, "retry", where={}) == {"changed": 0}, "nobody meant it"
        assert ask(client, "retry", where={"outdated": True}) == {"changed": 1}
        wait_until(lambda: states(client) == {"done": 1, "unassigned": 1})
        assert get(client, "films", outdated=True)["total"] == 0


def test_one_repair_for_all_films_that_failed_for_the_same_reason(
    serve: Serve, folder: Path, tmp_path: Path
) -> None:
    away = tmp_path / "away.mp4"
    bad = folder / "Road 5" / "C-3_20260402.mp4"
    bad.write_bytes(b"nothing" * 99)
    with serve() as client:
        add_all(client, folder, rules=[ROADS | {"rig": "wide"}])
        ask(client, "start", where={})
        wait_until(lambda: states(client) == {"refused": 2, "unassigned": 1})
        groups = {each["code"]: each for each in get(client, "failures")["groups"]}
        assert {code: each["repair"] for code, each in groups.items()} == {
            "rig_video_mismatch": "rig", "unreadable_video": "film",
        }  # fmt: skip
        where = {"reason": groups["rig_video_mismatch"]["reason"]}
        assert get(client, "films", **where)["films"] == [films(client)[ONE]]
        change = {"rig": clip_rig(), "rig_name": "measured", "header": {"client": "Roads"}}
        assert ask(client, "films", "PATCH", where=where, set=change) == {"changed": 1}
        assert ask(client, "retry", where=where) == {"changed": 1}
        wait_until(lambda: states(client) == {"done": 1, "refused": 1, "unassigned": 1})
        done = films(client)[ONE]
        assert done["rig_name"] == "measured"
        assert client.inspection(done["id"])["header"]["client"] == "Roads"
        shutil.copy(folder / OTHER, bad)
        ask(client, "films", "PATCH", where={"state": "refused"}, set={"rig": clip_rig()})
        ask(client, "retry", where={"state": "refused"})  # the first try notices the change
        wait_until(lambda: films(client)[bad.name]["state"] == "refused")
        assert films(client)[bad.name]["error"]["code"] == "film_changed"
        bad.rename(away)
        bad.symlink_to(away)  # out of the folder
        for _ in range(2):
            ask(client, "retry", where={"state": "refused"})
            wait_until(lambda: films(client)[bad.name]["state"] == "refused")
            assert films(client)[bad.name]["error"]["code"] == "film_missing"
            bad.unlink(missing_ok=True)
        away.rename(bad)
        ask(client, "retry", where={"state": "refused"})  # it is taken as it is now
        wait_until(lambda: films(client)[bad.name]["inspection_id"])


def test_films_are_paused_resumed_cancelled_tried_again_and_deleted(
    serve: Serve, folder: Path, film: bytes, tmp_path: Path
) -> None:
    (folder / "Road 5" / "C-2_20260401.mp4").write_bytes(film)
    (tmp_path / "desk.mp4").write_bytes(film)
    with serve(pace=0.01) as client:
        add_all(client, folder)
        one, two = (films(client)[name]["id"] for name in (ONE, "C-2_20260401.mp4"))
        ask(client, "start", where={"state": "ready"})
        wait_until(lambda: states(client) == {"running": 1, "queued": 1, "unassigned": 1})
        desk = client.inspect(tmp_path / "desk.mp4")
        assert ask(client, "pause", ids=[one]) == {"changed": 1}
        client.wait(desk, "running")  # before the film of the archive that was there first
        assert client.inspection(two)["status"] == "queued"
        assert ask(client, "pause", where={}) == {"changed": 1}
        assert states(client) == {"paused": 2, "unassigned": 1}
        client.post(f"/api/inspections/{desk}/cancel")
        assert ask(client, "resume", ids=[one]) == {"changed": 1}
        wait_until(lambda: states(client) == {"running": 1, "paused": 1, "unassigned": 1})
        assert ask(client, "cancel", where={}) == {"changed": 2}
        assert states(client) == {"cancelled": 2, "unassigned": 1}
        review(client, one, "submitted", "in_review", "approved")
        assert ask(client, "retry", where={"state": "cancelled"}) == {"changed": 2}
        # The locked one, which is the first, costs itself alone.
        wait_until(lambda: states(client) == {"refused": 1, "running": 1, "unassigned": 1})
        assert films(client)[ONE]["error"]["code"] == "inspection_locked"
        assert "reopen" in get(client, "failures")["groups"][0]["reason"]
        ask(client, "cancel", ids=[two])
        reopened = {"state": "reopened", "reason": "The track breaks off."}
        client.post(f"/api/inspections/{one}/review", json=reopened).raise_for_status()
        client.post(f"/api/inspections/{one}/retry").raise_for_status()  # on its page
        ask(client, "cancel", ids=[one])
        assert states(client) == {"cancelled": 2, "unassigned": 1}, "no longer refused"
        ask(client, "films", "PATCH", ids=[one], set={"rig": clip_rig(fx=240.0)})
        assert ask(client, "retry", ids=[one]) == {"changed": 1}
        wait_until(lambda: states(client) == {"running": 1, "cancelled": 1, "unassigned": 1})
        assert client.inspection(one)["rig"]["camera"]["fx"] == 240.0
        assert ask(client, "films", "DELETE", ids=[one]) == {"changed": 1}
        assert client.inspection(one)["status"] == "running"
        assert client.delete(f"/api/inspections/{two}").status_code == 204
        assert states(client) == {"ready": 1, "unassigned": 1}  # its inspection is gone


def test_a_paused_film_continues_where_it_was(
    serve: Serve, folder: Path, clip: Path, survey: Survey, caplog: pytest.LogCaptureFixture
) -> None:
    shutil.copy(clip, folder / "Road 5" / ONE)
    with serve(pace=0.25) as client:
        add_all(client, folder)
        one = films(client)[ONE]["id"]
        ask(client, "start", where={})
        wait_until((client.data / "inspections" / one / "checkpoint").exists)
        assert ask(client, "pause", where={}) == {"changed": 1}
        assert client.inspection(one)["status"] == "cancelled"
    with serve() as client, caplog.at_level("INFO", "app.tracking.films.film_run"):
        ask(client, "resume", where={})
        client.wait(one, "done")
        assert rows(client.data, one) == rows(survey.data, survey.id)
    (message,) = [record.getMessage() for record in caplog.records if "on." in record.msg]
    assert not message.endswith("from frame 0 on.")


def test_a_full_disk_a_killed_server_and_a_fault_over_another_film_stop_no_film(
    serve: Serve, folder: Path, tmp_path: Path, film: bytes
) -> None:
    (folder / "Road 5" / "C-0_20260331.mp4").write_bytes(film)
    with serve(disk_reserve_bytes=2**49) as client:
        add_all(client, folder)
        ask(client, "start", where={})
        hindrance = wait_until(lambda: get(client, "progress")["intake"]["hindrance"])
        assert "not enough room" in hindrance
        assert states(client) == {"waiting": 2, "unassigned": 1}
        one = films(client)[ONE]["id"]
    with closing(sqlite3.connect(tmp_path / "data" / "chainage.db")) as database, database:
        database.execute("update archive_films set header = '[]' where path like '%C-0_%'")
    inspections = tmp_path / "data" / "inspections"
    (inspections / one).mkdir()
    (inspections / one / "video.mp4").write_bytes(film[:99])  # the row was not written
    (inspections / f"{one}.import").write_bytes(film[:99])
    with serve() as client:
        wait_until(lambda: states(client) == {"refused": 1, "done": 1, "unassigned": 1})
        (refused,) = get(client, "failures")["groups"]
        assert (refused["code"], refused["repair"]) == ("internal_error", "retry")
        assert client.get(f"/api/inspections/{one}/video").content == film
        assert not list(inspections.glob("*.import"))


def test_a_server_that_is_killed_takes_each_film_in_once(
    folder: Path, tmp_path: Path, film: bytes
) -> None:
    (folder / "Road 5" / "C-2_20260402.mp4").write_bytes(film)
    data = tmp_path / "data"
    with process(data, ARCHIVE_FOLDERS=str(folder)) as client:
        add_all(client, folder)
        ask(client, "start", where={})
        wait_until(lambda: states(client).get("waiting", 0) < 2)
    # It was killed in the middle of whatever it was doing.
    with process(data) as client:
        wait_until(lambda: states(client) == {"done": 2, "unassigned": 1})
        listed = client.get("/api/inspections").json()["inspections"]
        taken = {each["id"] for each in films(client).values() if each["inspection_id"]}
        assert (len(listed), {each["id"] for each in listed}) == (2, taken)
        assert {path.name for path in (data / "inspections").iterdir()} == taken


def test_what_the_inbox_gets_is_tracked_once_it_is_complete(tmp_path: Path, film: bytes) -> None:
    inbox = tmp_path / "inbox"
    (inbox / "R").mkdir(parents=True)
    (inbox / OTHER).write_bytes(film)
    odd = os.fsencode(inbox / "R") + b"/\xff\n'\"$(x)_20260331.mp4"
    Path(os.fsdecode(odd)).write_bytes(film)
    (inbox / "R" / "out_20260401.mp4").symlink_to(Path(__file__))
    with serving(tmp_path / "data", inbox=inbox, inbox_settle_s=0.3) as client:
        assert client.put(f"{API}/rules", json=RULES).status_code == 200
        with (inbox / "R" / ONE).open("wb") as recorder:
            recorder.write(film[:1000])
            recorder.flush()
            wait_until(lambda: states(client) == {"unassigned": 1, "done": 1})
            assert ONE not in films(client)  # it is open for writing
            recorder.write(film[1000:])
        wait_until(lambda: states(client) == {"unassigned": 1, "done": 2})
        found = films(client)
        assert found[ONE]["size"] == len(film)
        assert {each["asset"] for each in found.values()} == {
            None, "C-1", "\N{REPLACEMENT CHARACTER} '\"$(x)",
        }  # fmt: skip
        rules = RULES | {"rules": [ROADS, {"name": "rest", "pattern": "*", "rig": "floor"}]}
        assert client.put(f"{API}/rules", json=rules).status_code == 200
        wait_until(lambda: "unassigned" not in states(client))


def test_rules_have_versions_and_reach_films_without_a_rig_and_nonsense_is_refused(
    serve: Serve, folder: Path, tmp_path: Path
) -> None:
    with serve(max_jobs=0) as idle:
        assert_rules_reach_films(idle, folder)
        assert_refused(idle, folder, tmp_path)


def assert_rules_reach_films(idle: Client, folder: Path) -> None:
    tag = idle.get(f"{API}/rules").headers["ETag"]
    put = idle.put(f"{API}/rules", json=RULES, headers={"If-Match": tag})
    assert put.status_code == 200
    assert put.headers["ETag"] != tag
    empty = idle.put(f"{API}/rules", json={}, headers={"If-Match": tag})
    assert empty.status_code == 412
    assert empty.json()["current"] == put.json() == get(idle, "rules")
    ask(idle, "films", paths=[str(folder)])
    assert states(idle) == {"ready": 1, "unassigned": 1}
    rest = {"name": "rest", "pattern": "**", "rig": "floor", "project": "Rest"}
    assert idle.put(f"{API}/rules", json=RULES | {"rules": [ROADS, rest]}).status_code == 200
    assert states(idle) == {"ready": 2}
    assert films(idle)[OTHER]["project"] == "Rest"
    for rules, code in (
        (RULES | {"rigs": {}}, "invalid_rig"),
        ({"rules": [{"name": "x", "pattern": "{"}]}, "invalid_request"),
    ):
        detail = assert_error(idle.put(f"{API}/rules", json=rules), 422, code)
        assert "rules.0" in detail


def assert_refused(idle: Client, folder: Path, tmp_path: Path) -> None:
    """What cannot be done is refused with the reason."""
    for path in (str(tmp_path), f"{folder}/../data", "/"):
        answer = idle.post(f"{API}/films", json={"paths": [path]})
        assert "CHAINAGE_ARCHIVE_FOLDERS" in assert_error(answer, 422, "folder_not_allowed")
    answer = idle.post(f"{API}/films", json={"paths": [f"{folder}/nowhere"]})
    assert_error(answer, 422, "no_such_film")
    table = {"paths": [str(folder)], "header_csv": "file,yaer\nx,1\n"}
    answer = idle.post(f"{API}/films/preview", json=table)
    assert "'yaer'" in assert_error(answer, 422, "invalid_table")
    answers: list[httpx.Response] = [
        idle.post(f"{API}/start", json={}),
        idle.post(f"{API}/start", json={"ids": [], "where": {}}),
        idle.post(f"{API}/start", json={"ids": ["x"]}),
        idle.post(f"{API}/start", json={"where": {}, "priority": 10}),
        idle.post(f"{API}/films", json={"paths": ["relative"]}),
        idle.post(f"{API}/films", json={"paths": []}),
        idle.request("PATCH", f"{API}/films", json={"where": {}}),
        idle.get(f"{API}/films", params={"sort": "colour"}),
        idle.get(f"{API}/films", params={"limit": 501}),
    ]
    for answer in answers:
        assert_error(answer, 422, "invalid_request")
