"""The archive in both kinds of databases: states, lists, claims, and films that come twice."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from builders import clip_rig
from postgres import ON_BOTH

from app.errors import InspectionLocked, NoLongerWanted
from app.storage.archive.changes import ArchiveChanges
from app.storage.archive.films import ArchiveFilms
from app.storage.archive.intake import IntakeStore
from app.storage.archive.selection import Selection
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import Inspection

NOW = datetime(2026, 11, 1, tzinfo=UTC)
ALL = Selection()

pytestmark = ON_BOTH


@dataclass(frozen=True)
class Store:
    """The archive of one database."""

    films: ArchiveFilms
    changes: ArchiveChanges
    intake: IntakeStore


@pytest.fixture
def store(new_url: Callable[[], str | None], tmp_path: Path) -> Iterator[Store]:
    database = Database(stored_at(new_url(), tmp_path))
    yield Store(ArchiveFilms(database), ArchiveChanges(database), IntakeStore(database))
    database.close()


def film(name: str, **fields: Any) -> dict[str, Any]:
    return {
        "id": name.ljust(32, "0"),
        "path": f"/films/{name}.mp4",
        "relative": f"{name}.mp4",
        "size": 100,
        "modified_at": NOW,
        "name": name,
        "project": "P",
        "asset": None,
        "rule": None,
        "rig": clip_rig(),
        "rig_name": "floor",
        "header": {},
        "priority": 0,
        "error_code": None,
        "error_detail": None,
        "added_at": NOW,
        "added_by": "test",
    } | fields


def inspection(name: str, **fields: Any) -> Inspection:
    given = {
        "id": name.ljust(32, "0"),
        "name": name,
        "status": "queued",
        "rig": clip_rig(),
        "header": {"client": "Roads"},
        "source_kind": "upload",
        "source_filename": "film.mp4",
        "source_size": 1,
        "source_sha256": 64 * "0",
        "video_file": "video.mp4",
        "video": {"frames": 40},
        "frames_done": 0,
        "created_at": NOW,
        "queued_at": NOW,
    }
    return Inspection(**given | fields)


def take(store: Store, name: str, **fields: Any) -> None:
    """Start a film and make an inspection of it."""
    only = Selection((name.ljust(32, "0"),))
    assert store.changes.set_state(only, ("ready",), "waiting", "me") == 1
    claimed = store.intake.next_waiting()
    assert claimed is not None
    store.intake.take(claimed.film.id, inspection(name, **fields), "test")


def states(store: Store) -> dict[str, str]:
    _, rows = store.films.listed(ALL, "name", descending=False, offset=0, limit=100)
    return {row.film.name: row.state for row in rows}


def test_a_film_has_the_state_of_its_inspection_once_there_is_one(store: Store) -> None:
    store.changes.add([film("a"), film("b"), film("c"), film("d"), film("e", rig=None)])
    for name, status in (("a", "done"), ("b", "failed"), ("c", "running")):
        take(store, name, status=status, frames_done=10)
    expected = {"a": "done", "b": "failed", "c": "running", "d": "ready", "e": "unassigned"}
    assert states(store) == expected
    assert store.changes.set_state(ALL, ("failed", "ready"), "waiting", "me") == 2
    assert states(store) == expected | {"b": "waiting", "d": "waiting"}
    assert store.changes.set_state(ALL, ("waiting", "running"), "idle", "me") == 3
    assert states(store) == expected
    tallies = store.films.tallies(ALL)
    assert (tallies["done"].frames_done, tallies["done"].frames_total) == (10, 40)
    assert {state: tally.films for state, tally in tallies.items()} == {
        "done": 1, "failed": 1, "running": 1, "ready": 1, "unassigned": 1,
    }  # fmt: skip


def test_a_path_is_added_once(store: Store) -> None:
    assert len(store.changes.add([film("a"), film("b")])) == 2
    again = [film("c", path="/films/a.mp4"), film("d")]
    assert store.changes.add(again) == {"d".ljust(32, "0")}
    assert store.films.known(["/films/a.mp4", "/films/x.mp4"]) == {"/films/a.mp4"}


def test_films_are_found_by_text_state_project_and_asset(store: Store) -> None:
    store.changes.add([film("Abc", asset="C-1"), film("x_y", project="Q"), film("x%y", rig=None)])

    def found(**fields: Any) -> list[str]:
        total, rows = store.films.listed(
            replace(ALL, **fields), "name", descending=True, offset=0, limit=10
        )
        assert total == len(rows)
        return [row.film.name for row in rows]

    assert found() == ["x_y", "x%y", "Abc"]
    assert found(search="aBC") == found(search="c-1") == ["Abc"]
    assert (found(search="_"), found(search="x%y")) == (["x_y"], ["x%y"])
    assert found(states=("unassigned",)) == ["x%y"]
    assert (found(project="Q"), found(asset="C-1")) == (["x_y"], ["Abc"])
    assert found(ids=()) == []
    total, rows = store.films.listed(ALL, None, descending=False, offset=2, limit=1)
    assert (total, [row.film.name for row in rows]) == (3, ["x_y"])


def test_the_next_film_is_that_of_the_highest_priority(store: Store) -> None:
    store.changes.add([film("a"), film("b", priority=5), film("c", rig=None, state="waiting")])
    store.changes.set_state(ALL, ("ready",), "waiting", "me")
    assert taken_next(store) == "b"
    assert taken_next(store) == "a"
    assert store.intake.next_waiting() is None


def taken_next(store: Store) -> str:
    row = store.intake.next_waiting()
    assert row is not None
    store.intake.take(row.film.id, inspection(row.film.name), "test")
    return row.film.name


def test_what_is_cancelled_meanwhile_becomes_no_inspection(store: Store) -> None:
    store.changes.add([film("a")])
    store.changes.set_state(ALL, ("ready",), "waiting", "me")
    waiting = store.intake.next_waiting()
    assert waiting is not None
    store.intake.require_wanted(waiting.film.id)
    store.changes.set_state(ALL, ("waiting",), "idle", "me")
    with pytest.raises(NoLongerWanted):
        store.intake.require_wanted(waiting.film.id)
    with pytest.raises(NoLongerWanted):
        store.intake.take(waiting.film.id, inspection("a"), "test")
    assert states(store) == {"a": "ready"}


def test_a_change_reaches_the_inspections(store: Store) -> None:
    store.changes.add([film("a"), film("b")])
    take(store, "a")
    ids = store.films.ids(ALL)
    changed = store.changes.change(
        ids, "me", {"project": "Q", "priority": 4}, {"client": None, "year": 2001}
    )
    assert changed == 2
    _, rows = store.films.listed(ALL, "name", descending=False, offset=0, limit=2)
    assert [(row.film.project, row.film.priority) for row in rows] == [("Q", 4), ("Q", 4)]
    store.changes.set_state(ALL, ("ready",), "waiting", "me")
    waiting = store.intake.next_waiting()
    assert waiting is not None
    assert waiting.film.header == {"year": 2001}
    store.intake.refuse(waiting.film.id, {})
    store.changes.set_state(ALL, ("queued",), "waiting", "me")
    again = store.intake.next_waiting()
    assert again is not None
    assert again.inspection is not None
    assert again.inspection.header == {"project": "Q", "year": 2001}
    assert again.inspection.priority == 4


def test_unassigned_films_get_what_new_rules_say(store: Store) -> None:
    store.changes.add([film("a", rig=None), film("b", rig=None), film("c")])

    def given(path: str, relative: str) -> dict[str, Any] | None:
        return {"rig": clip_rig(), "rig_name": path} if relative == "a.mp4" else None

    assert store.changes.assign(given) == 1
    assert states(store) == {"a": "ready", "b": "unassigned", "c": "ready"}


def test_one_approved_inspection_keeps_all_films_as_they_were(store: Store) -> None:
    store.changes.add([film(f"{number:04d}") for number in range(1001)])
    for name, state in (("0000", "draft"), ("1000", "approved")):  # in two portions
        take(store, name, status="done", review_state=state, reviewed_by="Ana")
    ids = [f"{number:04d}".ljust(32, "0") for number in range(1001)]
    with pytest.raises(InspectionLocked, match="1000"):
        store.changes.change(ids, "me", {"project": "Q"}, {})
    _, rows = store.films.listed(ALL, "name", descending=False, offset=0, limit=len(ids))
    assert {row.film.project for row in rows} == {"P"}
    assert store.changes.change(ids, "me", {"priority": 3}, {}) == len(ids)
