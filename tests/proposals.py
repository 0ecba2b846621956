"""Findings as a search would leave them, without its process."""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from typing import Any

from surveys import HasData

from app.storage.database.database import FILE, Database
from app.storage.records.findings import FindingStore
from app.storage.records.observations import ObservationStore
from app.survey.findings.records import Finding, Point, SearchStatus, Size

WAITING = SearchStatus("waiting", "classical")


def finding(inspection_id: str, axial_mm: float = 40.0, **changes: Any) -> Finding:
    """A crack of 40 mm along the floor, which frame 10 of the clip shows."""
    values: dict[str, Any] = {
        "kind": "crack",
        "outline_mm": ((axial_mm, -10.0), (axial_mm + 20, -10.0), (axial_mm + 40, -10.0)),
        "length": Size(40.0, 2.0),
        "width": Size(2.0, 0.5),
        "direction": "along",
        "score": 0.7,
        "detector": "classical",
        "version": "1",
        "frame": 10,
        "pixel": (100.0, 70.0),
        "found_at": datetime.now(UTC),
    }
    return Finding(inspection_id=inspection_id, id=str(uuid.uuid4()), **values | changes)


@contextmanager
def findings_of(client: HasData) -> Iterator[FindingStore]:
    """What a search of a running server would write through."""
    with closing(Database(client.data / FILE)) as database:
        yield FindingStore(database, ObservationStore(database))


def settle(
    client: HasData, inspection_id: str, *found: Finding, places: Mapping[str, Point] | None = None
) -> None:
    """Keep the result of a search of the whole wall."""
    with findings_of(client) as store:
        store.put_search(inspection_id, WAITING)
        done = SearchStatus("done", "classical")
        assert store.settle(
            inspection_id, found, places or {}, before=WAITING, after=done, replaces="classical"
        )
