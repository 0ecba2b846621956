"""Claims of queued inspections: one owner at a time, and one result."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from builders import clip_rig
from postgres import ON_BOTH

from app.errors import ClaimLost
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import Inspection
from app.storage.records.inspections import InspectionStore
from app.storage.records.runs import Outcome, RunStore

DONE = Outcome("done")
LONG_S, LAPSED_S = 3600.0, -1.0


pytestmark = ON_BOTH


@pytest.fixture
def database(new_url: Callable[[], str | None], tmp_path: Path) -> Iterator[Database]:
    opened = Database(stored_at(new_url(), tmp_path))
    yield opened
    opened.close()


@pytest.fixture
def store(database: Database) -> RunStore:
    return RunStore(database)


def add(database: Database, name: str, *, priority: int = 0, minutes: int = 0) -> str:
    """Queue an inspection; return its id."""
    at = datetime(2026, 11, 1, tzinfo=UTC) + timedelta(minutes=minutes)
    row = Inspection(
        id=name.ljust(32, "0"),
        name=name,
        status="queued",
        rig=clip_rig(),
        header={},
        source_kind="upload",
        source_filename="film.mp4",
        source_size=1,
        source_sha256=64 * "0",
        video_file="video.mp4",
        video={"frames": 40},
        frames_done=0,
        created_at=at,
        queued_at=at,
        priority=priority,
    )
    InspectionStore(database).add(row, "test")
    return row.id


def end(store: RunStore, claimed: Inspection | None, **given: Any) -> None:
    assert claimed is not None
    store.record_outcome(
        claimed.id, DONE, attempt=claimed.attempt, frames_done=40, fps=None, last=None, **given
    )


def name_of(claimed: Inspection | None) -> str | None:
    return None if claimed is None else claimed.name


def test_higher_priorities_go_first_and_then_those_that_have_waited_longest(
    database: Database, store: RunStore
) -> None:
    add(database, "b", minutes=2)
    add(database, "a", minutes=1)
    add(database, "urgent", priority=10, minutes=3)
    add(database, "some-day", priority=-10)
    claimed = [name_of(store.claim_next("server", LONG_S)) for _ in range(5)]
    assert claimed == ["urgent", "a", "b", "some-day", None]


def test_an_inspection_is_claimed_by_one_of_many(database: Database, store: RunStore) -> None:
    for n in range(12):
        add(database, f"film-{n:02d}")
    claimed: list[str] = []

    def claim(owner: str) -> None:
        while (row := store.claim_next(owner, LONG_S)) is not None:
            claimed.append(row.name)

    threads = [threading.Thread(target=claim, args=(f"server-{n}",)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(claimed) == sorted(f"film-{n:02d}" for n in range(12))


def test_a_lapsed_claim_is_taken_over_and_its_result_refused(
    database: Database, store: RunStore
) -> None:
    inspection_id = add(database, "film")
    lost = store.claim_next("lost", LAPSED_S)
    other = store.claim_next("other", LONG_S)
    assert lost is not None
    assert other is not None
    assert (other.id, other.attempt) == (inspection_id, lost.attempt + 1)
    assert store.claim_next("third", LONG_S) is None
    with pytest.raises(ClaimLost, match="Attempt 1"):
        end(store, lost)
    with pytest.raises(ClaimLost):
        store.require_claim(inspection_id, lost.attempt)
    end(store, other)
    with pytest.raises(ClaimLost):  # nor a second time
        end(store, other)
    kept = InspectionStore(database).get(inspection_id)
    assert (kept.status, kept.claimed_by, kept.claimed_until) == ("done", None, None)


def test_a_renewed_claim_holds_and_shows_the_progress(database: Database, store: RunStore) -> None:
    inspection_id = add(database, "film")
    store.claim_next("server", LAPSED_S)
    assert store.renew("server", LONG_S, {inspection_id: (17, 25.0)}) == {inspection_id}
    assert store.claim_next("other", LONG_S) is None
    row = InspectionStore(database).get(inspection_id)
    assert (row.frames_done, row.fps) == (17, 25.0)
    # What others have taken over, or a person has stopped, is not renewed.
    assert store.renew("other", LONG_S, {inspection_id: (18, None)}) == set()
    store.cancel_unless_ended(inspection_id)
    assert store.renew("server", LONG_S, {inspection_id: (19, None)}) == set()


def test_a_server_that_stops_gives_its_inspections_back(
    database: Database, store: RunStore
) -> None:
    mine, other = add(database, "mine"), add(database, "other", minutes=1)
    store.claim_next("me", LONG_S)
    store.claim_next("they", LONG_S)
    store.release("me")
    states = {row_id: InspectionStore(database).get(row_id).status for row_id in (mine, other)}
    assert states == {mine: "queued", other: "running"}


def test_a_start_takes_up_what_was_interrupted(database: Database, store: RunStore) -> None:
    add(database, "held")
    add(database, "lapsed", minutes=1)
    store.claim_next("they", LONG_S)
    store.claim_next("gone", LAPSED_S)
    assert store.queue_interrupted(lapsed_only=True) == 1  # others may use the database
    assert store.queue_interrupted(lapsed_only=False) == 1  # nobody else does
