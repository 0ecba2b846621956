"""`chainage archive`: without a server and beside one, exit codes, and what it prints."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from builders import PATIENCE_S, TOKEN, clip_rig, make_clip, wait_until
from forks import Fork
from processes import process
from receivers import receiving

from app.cli.client import Api
from app.errors import ServerRefused
from app.storage.folder.address import Address, AddressFile
from app.storage.folder.files import DataFolder, Places

Command = Callable[..., Any]


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return make_clip(tmp_path_factory.mktemp("clip") / "clip.mp4", 12).read_bytes()


@pytest.fixture
def folder(tmp_path: Path, film: bytes) -> Path:
    """Two films, a rig, and rules that name another rig that is not there."""
    films = tmp_path / "films"
    for name in ("R/C-1_20260331.mp4", "other.mp4"):
        (films / name).parent.mkdir(parents=True, exist_ok=True)
        (films / name).write_bytes(film)
    (tmp_path / "rig.json").write_text(json.dumps(clip_rig()))
    rules = {
        "rigs": {"floor": "rig.json", "lost": "lost.json"},
        "rules": [
            {"name": "roads", "pattern": "{project}/{asset}_{date}.mp4", "rig": "floor"},
            {"name": "rest", "pattern": "**", "rig": "lost"},
        ],
    }
    (tmp_path / "rules.json").write_text(json.dumps(rules))
    return films


@pytest.fixture
def archive(chainage: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    monkeypatch.setenv("CHAINAGE_DISK_RESERVE_BYTES", "0")
    return lambda *words: chainage("archive", *words, "--data", tmp_path / "data")


def test_a_folder_is_added_run_and_listed_without_a_server(
    archive: Command, folder: Path, tmp_path: Path
) -> None:
    dry = archive("add", folder, "--rules", tmp_path / "rules.json", "--dry-run")
    assert dry.code == 0
    lines = dry.out.splitlines()
    assert lines[0].split() == ["film", "rule", "rig", "project", "asset", "problem"]
    assert lines[1].split()[1:3] == ["rest", "lost"]
    assert lines[1].endswith("There is no rig 'lost'.")
    assert lines[2].split()[1:] == ["roads", "floor", "R", "C-1"]
    assert "2 would be added" in lines[3]
    assert "lost.json cannot be read" in dry.err

    header = tmp_path / "header.csv"
    header.write_text("asset_id,client\nC-1,Roads\nC-9,Nobody\n")
    added = archive("add", folder, "--rules", tmp_path / "rules.json", "--header", header)
    assert (added.code, added.out) == (0, "2 films found: 2 added, 0 known already.\n")
    assert "Line 3 of the header table names 'c-9'" in added.err
    (folder / "bad.mp4").write_bytes(b"nothing" * 99)
    assert archive("add", folder / "bad.mp4", "--rig", tmp_path / "rig.json").code == 0

    ran = archive("run")
    assert ran.code == 1
    assert "Open http://127.0.0.1:" in ran.err
    assert "Films: 1 done, 1 refused, 1 unassigned." in ran.out
    assert "unreadable_video: The film is not a video" in ran.out

    listed = json.loads(archive("list", "--state", "done", "--json").out)
    assert [(film["asset"], film["frames_done"]) for film in listed["films"]] == [("C-1", 12)]
    again = archive("retry", "--rig", tmp_path / "rig.json")
    assert "1 films wait for another try" in again.out
    assert "1 films paused" in archive("pause").out
    status = json.loads(archive("status", "--json").out)
    assert status["progress"]["states"] == {"done": 1, "paused": 1, "unassigned": 1}
    assert status["failures"] == []


def test_lists_name_films_and_their_rigs(archive: Command, folder: Path, tmp_path: Path) -> None:
    films = tmp_path / "films.csv"
    with films.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["path", "name", "project", "rig", "client"])
        rows.writerow(["films/other.mp4", "One", "P", "rig.json", "Roads"])
        rows.writerow([folder / "R" / "C-1_20260331.mp4", "Two", "P", "lost.json", ""])
    added = archive("add", films)
    assert (added.code, "2 added" in added.out) == (0, True)
    assert "lost.json cannot be read" in added.err
    found = json.loads(archive("list", "--json").out)["films"]
    assert {(film["name"], film["rig_name"], film["state"]) for film in found} == {
        ("One", "rig.json", "ready"), ("Two", "lost.json", "unassigned"),
    }  # fmt: skip
    lines = tmp_path / "films.txt"
    lines.write_text("# the other way\nfilms/other.mp4\n\n")
    assert "1 known already" in archive("add", lines).out


def test_wrong_usage_and_failures_have_their_exit_codes(
    archive: Command, folder: Path, tmp_path: Path
) -> None:
    (tmp_path / "header.csv").write_text("file,yaer\nx,1\n")
    tried = (
        (["add", "{folder}", "--rig", "r.json", "--rules", "x.json"], 2, "--rules"),
        (["add"], 2, "FOLDER|LIST"),
        (["list", "--state", "odd"], 2, "--state"),
        (["retry", "x" * 32, "--project", "P"], 2, "filters"),
        (["add", "{folder}/nowhere"], 1, "nowhere cannot be read"),
        (["add", "{folder}", "--rig", "nowhere.json"], 1, "nowhere.json cannot be read"),
        (["add", "{folder}/R", "--header", "{folder}/../header.csv"], 1, "'yaer'"),
        (["rules", "{folder}/../rules.json"], 1, "no rig 'lost'"),
    )
    for words, code, said in tried:
        ended = archive(*(word.format(folder=folder) for word in words))
        assert ended.code == code, words
        assert said in " ".join(ended.err.split())
        assert "Traceback" not in ended.err


def test_beside_a_server_its_own_settings_hold(
    archive: Command, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = tmp_path / "data"
    monkeypatch.setenv("CHAINAGE_TOKEN", TOKEN)
    rig = ("--rig", tmp_path / "rig.json")
    with process(data, ARCHIVE_FOLDERS=str(folder / "R")) as client:
        refused = archive("add", folder, *rig)
        assert refused.code == 1
        assert "CHAINAGE_ARCHIVE_FOLDERS" in refused.err
        assert archive("add", folder / "R", *rig).code == 0
        ran = archive("run")
        assert ran.code == 0
        assert f"Open {client.base_url}" in ran.err
        assert client.get("/api/archive/progress").json()["states"] == {"done": 1}
        monkeypatch.setenv("CHAINAGE_TOKEN", "wrong")
        assert archive("status").code == 1


def test_a_run_that_is_interrupted_goes_on(archive: Command, folder: Path, tmp_path: Path) -> None:
    """It is stopped by SIGTERM, which means the same here: where a shell has started the tests in
    the background, their children ignore SIGINT.
    """
    data, log = tmp_path / "data", tmp_path / "log"
    assert archive("add", folder / "R", "--rig", tmp_path / "rig.json").code == 0
    # At this pace the film takes a second for each frame.
    paced = os.environ | {"CHAINAGE_PACE": "0.01"}
    running = Fork(["archive", "run", "--data", str(data)], paced, log)
    try:
        wait_until(lambda: list((data / "inspections").glob("*/video.mp4")))
        assert running.terminate(PATIENCE_S) == 1, log.read_text()
    finally:
        running.end()
    assert "the next run goes on" in log.read_text()
    assert "Traceback" not in log.read_text()
    again = archive("run")
    assert (again.code, again.out) == (0, "Films: 1 done.\n")


def test_what_follows_a_server_waits_while_it_or_its_database_is_away(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with receiving() as server, httpx.Client(base_url=f"http://127.0.0.1:{server.port}") as client:
        api, server.body = Api(False, "", client), b'{"detail": "The database is away."}'
        server.statuses = [503, 0, 502, 200]
        assert api.ask_patiently("GET", "/archive/progress")
        assert "The database is away. It is asked again." in capsys.readouterr().err
        server.statuses = [503, 403]
        with pytest.raises(ServerRefused, match="away"):
            api.ask("POST", "/archive/films")  # it may have been done
        with pytest.raises(ServerRefused):
            api.ask_patiently("GET", "/archive/progress")
        assert len(server.received) == 6


def test_what_follows_a_server_goes_on_with_the_standby_that_took_over(tmp_path: Path) -> None:
    file = AddressFile(Places(tmp_path))
    with receiving() as server, httpx.Client(base_url="http://127.0.0.1:1") as client:
        server.statuses, server.body = [200], b'{"films": 3}'
        file.keep(Address(f"http://127.0.0.1:{server.port}", None))
        assert Api(False, "", client, file).ask_patiently("GET", "/archive/progress")
        assert len(server.received) == 1


def test_the_address_of_a_killed_server_means_nothing(tmp_path: Path) -> None:
    file = AddressFile(Places(tmp_path))
    assert not file.is_in_use()
    folder = DataFolder(tmp_path, reserve_bytes=0)
    file.keep(Address("http://127.0.0.1:1", None))
    assert file.is_in_use()
    assert file.read() == Address("http://127.0.0.1:1", None)
    folder.close()  # what remains of a killed server is the file
    assert not file.is_in_use()
