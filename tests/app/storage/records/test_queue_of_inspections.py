"""The queue of inspections: their order, one attempt at a time, and one result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from builders import clip_rig
from postgres import ON_BOTH

from app.errors import ClaimLost
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import Inspection
from app.storage.records.inspections import InspectionStore
from app.storage.records.observations import ObservationStore
from app.storage.records.runs import Outcome, RunStore
from app.survey.observations.records import CHAINAGE, SMOOTHED
from app.survey.observations.tag import StatedTag

DONE = Outcome("done")


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


def end(store: RunStore, claimed: Inspection) -> None:
    store.record_outcome(
        claimed.id, DONE, attempt=claimed.attempt, frames_done=40, fps=None, last=None
    )


def observe(database: Database, inspection_id: str, frame: int) -> None:
    tag = StatedTag.kept({"frame": frame, "code": "BAB"})
    ObservationStore(database).put(inspection_id, f"{frame:036}", tag, "test")


def name_of(claimed: Inspection | None) -> str | None:
    return None if claimed is None else claimed.name


def test_higher_priorities_go_first_and_then_those_that_have_waited_longest(
    database: Database, store: RunStore
) -> None:
    add(database, "b", minutes=2)
    add(database, "a", minutes=1)
    add(database, "urgent", priority=10, minutes=3)
    add(database, "some-day", priority=-10)
    claimed: list[Inspection] = []
    while (row := store.claim_next([each.id for each in claimed])) is not None:
        claimed.append(row)
    assert [row.name for row in claimed] == ["urgent", "a", "b", "some-day"]


def test_what_runs_without_a_run_is_taken_again_and_its_earlier_result_refused(
    database: Database, store: RunStore
) -> None:
    inspection_id = add(database, "film")
    add(database, "next", priority=10)
    urgent = store.claim_next([])
    assert urgent is not None
    lost = store.claim_next([urgent.id])
    again = store.claim_next([urgent.id])
    assert lost is not None
    assert again is not None
    assert (again.id, again.attempt) == (inspection_id, lost.attempt + 1)
    assert store.claim_next([urgent.id, again.id]) is None
    with pytest.raises(ClaimLost, match="Attempt 1"):
        end(store, lost)
    with pytest.raises(ClaimLost):
        store.require_claim(inspection_id, lost.attempt)
    end(store, again)
    with pytest.raises(ClaimLost):  # nor a second time
        end(store, again)
    assert InspectionStore(database).get(inspection_id).status == "done"


def test_what_is_queued_again_before_its_run_has_ended_waits_for_that(
    database: Database, store: RunStore
) -> None:
    inspection_id = add(database, "film")
    assert store.claim_next([inspection_id]) is None
    assert name_of(store.claim_next([])) == "film"


def test_a_start_queues_again_what_was_interrupted(database: Database, store: RunStore) -> None:
    for name in ("one", "two", "waits"):
        add(database, name)
    one = store.claim_next([])
    assert one is not None
    store.claim_next([one.id])
    assert store.queue_interrupted() == 2
    assert InspectionStore(database).counts() == {"queued": 3}


@pytest.mark.parametrize(("moved_mm", "noted_mm"), [(-12.44, 12.4), (0.4, None)])
def test_the_history_says_by_how_much_smoothing_moved_observations_of_the_run_at_most(
    database: Database, store: RunStore, moved_mm: float, noted_mm: float | None
) -> None:
    inspection_id = add(database, "film")
    claimed = store.claim_next([])
    assert claimed is not None
    for frame in (3, 7):
        observe(database, inspection_id, frame)
    moves_mm = np.full(9, 50.0)
    moves_mm[[3, 7]] = 0.1, moved_mm
    store.record_outcome(inspection_id, DONE, frames_done=9, fps=None, last=None, moved_mm=moves_mm)
    events = InspectionStore(database).events(inspection_id)
    noted = [(event.who, event.after) for event in events if event.action == SMOOTHED]
    assert noted == ([] if noted_mm is None else [(CHAINAGE, {"measured_moved_mm": noted_mm})])
    # Tracked again, they end where they were.
    store.queue_again(inspection_id)
    store.record_outcome(inspection_id, DONE, frames_done=9, fps=None, last=None, moved_mm=moves_mm)
    again = InspectionStore(database).events(inspection_id)
    assert len([event for event in again if event.action == SMOOTHED]) == len(noted)
