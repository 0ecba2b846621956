import json
import sqlite3
import threading
import uuid
import weakref
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import httpx
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from builders import PATIENCE_S, TOKEN, TUS, clip_rig, make_clip, serving, wait_until
from postgres import ON_BOTH
from processes import Process
from sqlalchemy import text
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session
from surveys import Survey

from app.errors import DataFolderInUse
from app.inspections.films.films import Films
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import Base, EventRow, LoginSession
from app.storage.folder.files import DataFolder, write_durably


@pytest.fixture
def database(new_url: Callable[[], str | None], tmp_path: Path) -> Iterator[Database]:
    opened = Database(stored_at(new_url(), tmp_path))
    yield opened
    opened.close()


@ON_BOTH
def test_the_migrations_make_the_tables_that_the_code_uses(database: Database) -> None:
    with database.read() as session:
        context = MigrationContext.configure(session.connection())
        assert compare_metadata(context, Base.metadata) == []


def test_commits_are_synced_and_readers_cannot_write(database: Database) -> None:
    def pragma(session: Session) -> tuple[str, int, int]:
        names = ("journal_mode", "synchronous", "foreign_keys")
        return tuple(session.scalar(text(f"PRAGMA {name}")) for name in names)  # type: ignore[return-value]

    assert database.write(pragma) == ("wal", 2, 1)
    with database.read() as session, pytest.raises(OperationalError, match="readonly"):
        session.execute(text("DELETE FROM sessions"))


def add_login(session: Session, digest: str) -> None:
    now = datetime.now(UTC)
    row = LoginSession(digest=digest, token_digest=digest, created_at=now, seen_at=now)
    session.add(row)


@ON_BOTH
def test_a_write_that_fails_leaves_nothing_and_the_next_one_works(database: Database) -> None:
    def fail(session: Session) -> None:
        add_login(session, "a")
        session.flush()
        raise KeyError("x")

    with pytest.raises(KeyError):
        database.write(fail)
    database.write(lambda session: add_login(session, "b"))
    with database.read() as session:
        assert session.get(LoginSession, "a") is None
        assert session.get(LoginSession, "b") is not None


@ON_BOTH
def test_writes_from_many_threads_are_done_one_after_the_other(database: Database) -> None:
    writing = []

    def write(session: Session) -> None:
        writing.append(threading.current_thread().name)
        add_login(session, uuid.uuid4().hex)

    threads = [
        threading.Thread(target=lambda: [database.write(write) for _ in range(10)])
        for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert writing == ["database-writer"] * 80
    with database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM sessions")) == 80


@ON_BOTH
def test_what_a_write_held_is_free_once_it_is_done(database: Database) -> None:
    class Change:
        """Such as the rows of an import."""

        def __call__(self, session: Session) -> None:
            add_login(session, "a")

    change = Change()
    held = weakref.ref(change)
    database.write(change)
    del change
    wait_until(lambda: held() is None)


def test_instants_come_back_aware(database: Database) -> None:
    now = datetime.now(UTC)
    event = EventRow(inspection_id="i", action="a", who="w", at=now, before=None, after={"x": 1})
    database.write(lambda session: session.add(event))
    with database.read() as session:
        (kept,) = session.query(EventRow).all()
        assert (kept.at, kept.before, kept.after) == (now, None, {"x": 1})


def test_a_second_server_on_the_same_folder_is_refused(tmp_path: Path) -> None:
    folder = DataFolder(tmp_path, reserve_bytes=0)
    with pytest.raises(DataFolderInUse, match=str(tmp_path)):
        DataFolder(tmp_path, reserve_bytes=0)
    folder.close()
    DataFolder(tmp_path, reserve_bytes=0).close()


def test_the_servers_of_one_postgresql_database_share_the_folder(tmp_path: Path) -> None:
    several = [DataFolder(tmp_path, reserve_bytes=0, is_shared=True) for _ in "12"]
    with pytest.raises(DataFolderInUse):
        DataFolder(tmp_path, reserve_bytes=0)
    for folder in several:
        folder.close()


def test_a_file_is_replaced_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "file"
    write_durably(path, b"first")
    write_durably(path, b"second")
    assert path.read_bytes() == b"second"
    assert list(path.parent.iterdir()) == [path]


def test_what_was_acknowledged_survives_a_kill(
    survey: Survey, tmp_path: Path, is_long: bool
) -> None:
    data, inspection_id = survey.copied_to(tmp_path / "data"), survey.id
    acknowledged: dict[str, int] = {}
    with serving(data) as client:
        created = client.post("/api/uploads", headers=TUS | {"Upload-Length": "100000"})
        upload = created.headers["Location"]
    for _ in range(3 if is_long else 1):
        process = Process(data, tmp_path / "log")
        writer = threading.Thread(
            target=write_until_killed, args=(process.url, inspection_id, upload, acknowledged)
        )
        before = len(acknowledged)
        writer.start()
        wait_until(lambda before=before: len(acknowledged) > before + 5)
        process.end()
        writer.join()
    with serving(data) as client:
        kept = client.get(f"/api/inspections/{inspection_id}/observations").json()["observations"]
        frames = {tag["id"]: tag["frame"] for tag in kept}
        assert {name: frames.get(name) for name in acknowledged} == acknowledged
        pieces = int(client.head(upload, headers=TUS).headers["Upload-Offset"])
        assert pieces >= len(acknowledged)
    with sqlite3.connect(data / "chainage.db") as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)


def write_until_killed(
    url: str, inspection_id: str, upload: str, acknowledged: dict[str, int]
) -> None:
    """Tag, and after each tag send another byte of an upload."""
    headers = {"Authorization": f"Bearer {TOKEN}"}
    with httpx.Client(base_url=url, headers=headers, timeout=PATIENCE_S) as client:
        while True:
            name, frame = str(uuid.uuid4()), len(acknowledged) % 30
            path = f"/api/inspections/{inspection_id}/observations/{name}"
            try:
                answer = client.put(path, json={"frame": frame})
                assert answer.status_code == 200
                at = client.head(upload, headers=TUS).headers["Upload-Offset"]
                piece = TUS | {
                    "Upload-Offset": at,
                    "Content-Type": "application/offset+octet-stream",
                }
                assert client.patch(upload, content=b"x", headers=piece).status_code == 204
            except httpx.TransportError:
                return
            acknowledged[name] = frame


def test_an_operator_can_import_a_file_of_the_machine(tmp_path: Path) -> None:
    from vo_core import Rig

    video = make_clip(tmp_path / "sample.mp4", 12)
    with serving(tmp_path / "data") as client:
        films = client.server.app.state.services[Films]
        name = films.import_video(video, Rig.parse(clip_rig()), "Sample", {"asset_id": "S"})
        client.state_no_counter(name)
        inspection = client.wait(name)
        assert (inspection["name"], inspection["status"]) == ("Sample", "done")
    assert video.exists()
    rig = json.loads((tmp_path / "data" / "inspections" / name / "rig.json").read_text())
    assert Rig.parse(rig) == Rig.parse(clip_rig())
