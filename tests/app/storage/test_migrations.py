"""A data folder of every version before this one is taken over whole; a newer one is left alone."""

from __future__ import annotations

import hashlib
import json
import re
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import alembic.command
import alembic.config
import pytest
from alembic.script import ScriptDirectory
from builders import TOKEN, clip_rig, make_clip, serving
from postgres import ON_BOTH
from sqlalchemy import create_engine, inspect

import app.storage.database
from app.errors import UnusableDatabase
from app.storage.database.database import Database, stored_at, stored_of
from app.storage.database.dialect import Dialect
from app.storage.database.sqlite import Sqlite, revision_of
from app.storage.folder.files import Places

Command = Callable[..., Any]

INSPECTION, TAG, PACK = 32 * "a", "11111111-2222-4333-8444-555555555555", 32 * "c"
COOKIE = "a-cookie-of-a-browser"
FRAMES, STEP_MM = 40, 1.6
PHOTO = b"\xff\xd8 a photo"
NOW = "2026-10-01 08:00:00.000000"
PACK_TABLE = (
    "code,char1,char2,label,group,needs_clock,needs_q1,unit_q1,needs_q2,unit_q2,"
    "continuous_allowed,grade_s\nSCR,,,Scour at the outlet,S,no,opt,mm,no,,no,3\n"
)


def config() -> alembic.config.Config:
    made = alembic.config.Config()
    folder = Path(app.storage.database.__file__).parent / "migrations"
    made.set_main_option("script_location", str(folder))
    return made


NEWEST, *OLDER = [
    script.revision for script in ScriptDirectory.from_config(config()).walk_revisions()
]
"""Newest first."""


def sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


ROWS_0001: dict[str, dict[str, Any]] = {
    "tokens": {"digest": sha256(TOKEN), "name": "server", "role": "admin", "created_at": NOW},
    "sessions": {
        "digest": sha256(COOKIE),
        "token_digest": sha256(TOKEN),
        "created_at": "{now}",
        "seen_at": "{now}",
    },
    "inspections": {
        "id": INSPECTION,
        "name": "An old run",
        "status": "done",
        "rig": json.dumps(clip_rig()),
        "header": json.dumps({"asset_id": "CUL-0041"}),
        "source_kind": "upload",
        "source_filename": "old.mp4",
        "source_size": 1,
        "source_sha256": 64 * "0",
        "video_file": "video.mp4",
        "video": json.dumps(
            {
                "width": 256,
                "height": 160,
                "duration_s": 1.6,
                "frames": FRAMES,
                "codec": "h264",
                "playable": True,
                "media_type": "video/mp4",
            }
        ),
        "frames_done": FRAMES,
        "fps": 80.0,
        "distance_mm": (FRAMES - 1) * STEP_MM,
        "sigma_distance_mm": 0.5,
        "created_at": NOW,
        "queued_at": NOW,
        "finished_at": NOW,
    },
    "observations": {
        "inspection_id": INSPECTION,
        "id": TAG,
        "seq": 1,
        "frame": 10,
        "fields": json.dumps({"frame": 10, "code": "BAB", "remark": "kept"}),
        "photo_frame": 10,
        "photo_sha256": hashlib.sha256(PHOTO).hexdigest(),
        "created_at": NOW,
        "created_by": "server",
    },
    "events": {
        "inspection_id": INSPECTION,
        "observation_id": TAG,
        "action": "created",
        "who": "server",
        "at": NOW,
        "after": json.dumps({"frame": 10, "code": "BAB"}),
    },
    "heartbeat": {"id": 1, "at": NOW},
}
ROWS_0002 = ROWS_0001 | {
    "inspections": ROWS_0001["inspections"]
    | {
        "corrections": json.dumps({"zero": {"frame": 0, "offset_m": 1.0}}),
        "revision": 3,
    },
    "events": ROWS_0001["events"] | {"remark": "why"},
    "preferences": {"who": "server", "chosen": json.dumps({"language": "ms", "pack": PACK})},
    "code_packs": {
        "id": PACK,
        "name": "Road agency",
        "table": PACK_TABLE,
        "created_at": NOW,
        "created_by": "server",
    },
}
ROWS_0003 = {table: row for table, row in ROWS_0002.items() if table != "tokens"}
ROWS_0004 = ROWS_0003 | {
    "alerts": {
        "id": "22222222-2222-4333-8444-555555555555",
        "inspection_id": INSPECTION,
        "observation_id": TAG,
        "state": "told",
        "tries": 1,
        "created_at": NOW,
        "next_at": NOW,
        "told_at": NOW,
    },
}
ROWS_0007 = ROWS_0004 | {
    "archive_films": {
        "id": INSPECTION,
        "path": "/films/old.mp4",
        "relative": "old.mp4",
        "path_sha256": sha256("/films/old.mp4"),
        "size": 1,
        "modified_at": NOW,
        "name": "An old run",
        "rig": json.dumps(clip_rig()),
        "header": json.dumps({}),
        "priority": 0,
        "state": "idle",
        "added_at": NOW,
        "added_by": "server",
    },
    "archive_rules": {
        "id": 1,
        "content": json.dumps({"rigs": {}, "rules": []}),
        "changed_at": NOW,
        "changed_by": "server",
    },
}
ROWS_0008 = ROWS_0007 | {
    "indexed_inspections": {
        "inspection_id": INSPECTION,
        "index_version": 1,
        "revision": 3,
        "name": "An old run",
        "surveyed_on": "2026-10-01",
        "folded": "an old run",
        "defects": 1,
    },
    "indexed_defects": {
        "inspection_id": INSPECTION,
        "observation_id": TAG,
        "revision": 3,
        "inspection": "An old run",
        "surveyed_on": "2026-10-01",
        "seq": 1,
        "frame": 10,
        "code": "BAB",
        "clock_hours": 0,
        "created_at": NOW,
        "folded": "bab",
    },
}
ROWS_0009 = ROWS_0008 | {
    "rigs": {
        "id": TAG,
        "name": "Crawler",
        "rig": json.dumps(clip_rig()),
        "changed_at": NOW,
        "changed_by": "server",
    },
}
ROWS_0010 = ROWS_0009 | {
    "attachments": {
        "inspection_id": INSPECTION,
        "id": INSPECTION,
        "observation_id": TAG,
        "kind": "photo",
        "rank": 1,
        "frame": 12,
        "created_at": NOW,
        "created_by": "server",
    },
}
ROWS_0011 = ROWS_0010 | {
    "remarks": {
        "inspection_id": INSPECTION,
        "id": TAG,
        "observation_id": TAG,
        "kind": "question",
        "text": "Is it a root?",
        "version": "1",
        "made_at": NOW,
        "made_by": "server",
    },
    "token_uses": {"token_digest": sha256(TOKEN), "seen_at": NOW},
}
ROWS_0012 = ROWS_0011 | {
    "assets": {
        "asset_id": "CUL-0041",
        "spelling": "cul0041",
        "project": "A7",
        "header": "{}",
        "line": "[]",
        "folded": "cul-0041 a7",
        "changed_at": NOW,
        "changed_by": "server",
    },
    "inspection_labels": {"inspection_id": INSPECTION, "label": "winter"},
}
ROWS_0013 = ROWS_0012 | {
    "report_templates": {
        "project": "A7",
        "content": "{}",
        "changed_at": NOW,
        "changed_by": "server",
    },
}
ROWS = {
    "0001": ROWS_0001,
    "0002": ROWS_0002,
    "0003": ROWS_0003,
    "0004": ROWS_0004,
    "0005": ROWS_0004,
    "0006": ROWS_0004,
    "0007": ROWS_0007,
    "0008": ROWS_0008,
    "0009": ROWS_0009,
    "0010": ROWS_0010,
    "0011": ROWS_0011,
    "0012": ROWS_0012,
    "0013": ROWS_0013,
}
"""What a database of each version may hold: a row of every table."""


def of_version(data: Path, revision: str, url: str | None = None) -> Dialect:
    """A data folder as that version left it, and its database, which may be at a URL."""
    data.mkdir()
    path = data / "chainage.db"
    engine = create_engine(f"sqlite:///{path}")
    with engine.connect() as connection:
        settings = config()
        settings.attributes["connection"] = connection
        alembic.command.upgrade(settings, revision)
        connection.commit()
    engine.dispose()
    with sqlite3.connect(path) as database:
        (now,) = database.execute("SELECT strftime('%Y-%m-%d %H:%M:%f000', 'now')").fetchone()
        for table, row in ROWS[revision].items():
            names, marks = ", ".join(f'"{name}"' for name in row), ", ".join("?" * len(row))
            values = [value.replace("{now}", now) if isinstance(value, str) else value
                      for value in row.values()]  # fmt: skip
            database.execute(f"INSERT INTO {table} ({names}) VALUES ({marks})", values)  # noqa: S608
        tables = database.execute(
            "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite_%'"
        )
        assert {name for (name,) in tables} - {"alembic_version"} == ROWS[revision].keys()
    place = data / "inspections" / INSPECTION
    (place / "photos").mkdir(parents=True)
    make_clip(place / "video.mp4", FRAMES)
    (place / "rig.json").write_text(json.dumps(clip_rig()))
    (place / "track.csv").write_text(track())
    (place / "photos" / f"{TAG}-10.jpg").write_bytes(PHOTO)
    stored = stored_at(url, data)
    if url is not None:
        stored.take_over(path)
    return stored


def track() -> str:
    head = "frame,time_s,x_mm,y_mm,yaw_deg,distance_mm,sigma_distance_mm,quality,status\n"
    return head + "".join(
        f"{n},{n / 25},{n * STEP_MM},0.0,0.0,{n * STEP_MM},0.5,0.9,ok\n" for n in range(FRAMES)
    )


@pytest.mark.parametrize(
    ("database_kind", "revision"),
    # From the first one all migrations, from the last every table; PostgreSQL has the same.
    [
        ("sqlite", "0001"),
        ("sqlite", OLDER[0]),
        ("postgresql", "0001"),
        pytest.param("postgresql", OLDER[0], marks=pytest.mark.long),
        *(pytest.param("sqlite", each, marks=pytest.mark.long) for each in OLDER[1:-1]),
    ],
    indirect=["database_kind"],
    scope="module",
)
def test_everything_of_an_older_version_is_there(
    tmp_path: Path, new_url: Callable[[], str | None], revision: str
) -> None:
    url = new_url()
    stored = of_version(tmp_path / "data", revision, url)
    before = dump(stored, tmp_path)
    offset_m = 1.0 if revision >= "0002" else 0.0
    with serving(tmp_path / "data", database=url) as client:
        path = f"/api/inspections/{INSPECTION}"
        inspection = client.inspection(INSPECTION)
        assert (inspection["name"], inspection["status"]) == ("An old run", "done")
        assert inspection["header"]["asset_id"] == "CUL-0041"
        assert inspection["distance_m"] == pytest.approx(offset_m + 39 * STEP_MM / 1000, abs=1e-3)
        assert (inspection["tracked_with"], inspection["outdated"]) == (None, True)
        (tag,) = client.get(f"{path}/observations").json()["observations"]
        assert (tag["id"], tag["code"], tag["remark"]) == (TAG, "BAB", "kept")
        assert tag["distance_m"] == pytest.approx(offset_m + 10 * STEP_MM / 1000, abs=1e-3)
        assert client.get(f"{path}/observations/{TAG}/photo").content == PHOTO
        stated = client.get(f"{path}/corrections").json()["stated"]
        if revision < "0005":  # what was reported keeps its distances
            assert stated["joints"]["use"] is False
        (event,) = client.get(f"{path}/events").json()["events"]
        assert (event["action"], event["who"]) == ("created", "server")
        assert client.get(f"{path}/exports/csv").text.count("BAB") == 1
        assert client.get(f"{path}/video").status_code == 200
        if revision >= "0002":
            assert client.get("/api/me").json()["preferences"]["language"] == "ms"
            assert [pack["name"] for pack in client.get("/api/packs").json()["packs"]] == [
                "Road agency"
            ]
        with client.anonymous() as browser:
            browser.cookies[browser.cookie_name] = COOKIE
            assert browser.get(path).status_code == 200
        assert client.tag(INSPECTION).status_code == 200
    copy = tmp_path / "data" / f"chainage.db.before-{NEWEST}"
    assert (revision_of(copy), stored.revision()) == (revision, NEWEST)
    assert dump(Sqlite(copy), tmp_path) == before


@ON_BOTH
def test_a_migration_that_fails_leaves_the_database_as_it_was(
    tmp_path: Path, new_url: Callable[[], str | None]
) -> None:
    stored = of_version(tmp_path / "data", "0001", new_url())
    execute(stored, "CREATE TABLE code_packs (x INTEGER)")  # 0002 makes one, after other changes
    before = tables_of(stored)
    with pytest.raises(Exception, match=r"code_packs.* already exists"):
        Database(stored)
    assert stored.revision() == "0001"
    assert tables_of(stored) == before


def execute(stored: Dialect, statement: str) -> None:
    engine = stored.writer()
    with engine.begin() as connection:
        connection.exec_driver_sql(statement)
    engine.dispose()


def tables_of(stored: Dialect) -> dict[str, list[str]]:
    """Every column of every table."""
    engine = stored.reader()
    columns = {
        table: [str(column["name"]) for column in inspect(engine).get_columns(table)]
        for table in inspect(engine).get_table_names()
    }
    engine.dispose()
    return columns


def dump(stored: Dialect, folder: Path) -> list[str]:
    """All tables and rows, in the form of SQLite."""
    copy = folder / "dumped.db"
    stored.copy_to(copy)
    with sqlite3.connect(copy) as database:
        return sorted(database.iterdump())


@ON_BOTH
def test_a_database_of_a_newer_version_is_refused_in_a_sentence(
    tmp_path: Path,
    new_url: Callable[[], str | None],
    chainage: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    url = new_url()
    stored = stored_at(url, tmp_path)
    Database(stored).close()
    execute(stored, "UPDATE alembic_version SET version_num = '9999'")
    before = tables_of(stored)
    if url is not None:
        monkeypatch.setenv("CHAINAGE_DATABASE", url)
    with pytest.raises(UnusableDatabase):
        Database(stored)
    for command in (["serve", "--port", "0"], ["backup", tmp_path / "backup.zip"]):
        refused = chainage(*command, "--data", tmp_path)
        assert refused.code == 1
        assert "newer version of Chainage" in refused.err
        assert "Traceback" not in refused.err
    assert tables_of(stored) == before


def test_what_is_no_database_is_refused_in_a_sentence(tmp_path: Path, chainage: Command) -> None:
    (tmp_path / "chainage.db").write_bytes(b"something else" * 1000)
    refused = chainage("serve", "--port", "0", "--data", tmp_path)
    assert refused.code == 1
    assert "cannot be read" in refused.err
    assert "Traceback" not in refused.err


@ON_BOTH
def test_no_new_database_is_made_beside_inspections(
    tmp_path: Path, new_url: Callable[[], str | None]
) -> None:
    places = Places(tmp_path)
    (places.inspections / INSPECTION).mkdir(parents=True)
    with pytest.raises(UnusableDatabase, match=r"missing or empty, but .* holds inspections"):
        stored_of(new_url(), places)


def make_another(file: Path) -> None:
    with closing(sqlite3.connect(file)) as database, database:
        database.execute("CREATE TABLE customers (id)")


@pytest.mark.parametrize(
    ("leave", "said"),
    [(Path.exists, "holds inspections"), (Path.touch, "holds inspections"),
     (make_another, "of another program")],
    ids=["missing", "zero bytes", "another"],
)  # fmt: skip
def test_a_lost_database_is_refused_in_a_sentence(
    tmp_path: Path, chainage: Command, leave: Callable[[Path], object], said: str
) -> None:
    file = tmp_path / "chainage.db"
    (Places(tmp_path).inspections / INSPECTION).mkdir(parents=True)
    leave(file)
    before = file.read_bytes() if file.exists() else None
    refused = chainage("serve", "--port", "0", "--data", tmp_path)
    assert refused.code == 1
    assert said in " ".join(refused.err.split())
    assert "Traceback" not in refused.err
    assert (file.read_bytes() if file.exists() else None) == before


def test_damaged_pages_are_named_in_a_sentence_by_every_command(
    tmp_path: Path, chainage: Command
) -> None:
    path = tmp_path / "chainage.db"
    Database(path).close()
    with path.open("r+b") as file:
        size = file.seek(0, 2)
        file.seek(3 * 4096)
        file.write(b"\xa5" * (size - 3 * 4096))
    export = ["export", "any", "--format", "csv", "--out", tmp_path / "out.csv", "--data", tmp_path]
    for command in (
        ["serve", "--port", "0", "--data", tmp_path],
        ["backup", tmp_path / "backup.zip", "--data", tmp_path],
        export,
    ):
        refused = chainage(*command)
        printed = " ".join(refused.err.split())
        assert refused.code in (1, 2), printed
        assert "Traceback" not in printed
        assert "damaged" in printed
        assert "chainage restore" in printed
        assert "chainage.db" in re.sub(r"[\s│]", "", refused.err)  # a box may break the path
