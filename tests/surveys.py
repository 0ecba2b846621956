"""Surveys that are tracked once for all processes of a test run, and copied for who reads or tags.

To track a film takes a server and another process; a copy of the data folder takes neither.
"""

from __future__ import annotations

import os
import shutil
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

import pytest
from builders import Client, serving
from locks import alone

from app.storage.database.database import FILE, Database, stored_at
from app.storage.database.tables import Inspection
from app.storage.records.inspections import InspectionStore


class HasData(Protocol):
    """A running server."""

    @property
    def data(self) -> Path: ...


@dataclass(frozen=True)
class Survey:
    """A tracked inspection in the data folder of a server that has stopped."""

    data: Path
    id: str

    @property
    def folder(self) -> Path:
        """Where its files are."""
        return self.data / "inspections" / self.id

    def copied_to(self, data: Path) -> Path:
        """A data folder of somebody's own."""
        return shutil.copytree(self.data, data, dirs_exist_ok=True)


def another(survey: Survey, client: HasData, **changes: Any) -> str:
    """Put a copy of the tracked inspection into a running server of it; return its id.

    Args:
        changes: Other values of columns than those of the survey.
    """
    database = Database(client.data / FILE)
    store = InspectionStore(database)
    tracked = store.get(survey.id)
    values = {column.key: getattr(tracked, column.key) for column in Inspection.__mapper__.columns}
    values |= {"id": uuid.uuid4().hex, "created_at": datetime.now(UTC)}
    del values["project"]  # it follows the header
    made = Inspection(**values | changes)
    shutil.copytree(survey.folder, client.data / "inspections" / made.id)
    store.add(made, "server")
    database.close()
    return made.id


@contextmanager
def served(survey: Survey, data: Path, database_url: str | None) -> Iterator[Client]:
    """Run a server over a copy of the survey, with its rows at the URL if there is one."""
    survey.copied_to(data)
    if database_url is not None:
        stored_at(database_url, data).take_over(data / "chainage.db")
    with serving(data, database=database_url) as client:
        yield client


def tracked_once(
    temporary: pytest.TempPathFactory, name: str, track: Callable[[Path], str]
) -> Survey:
    """The survey that `track` makes in the data folder that it is given, answering its id."""

    def make(folder: Path) -> None:
        (folder / "id").write_text(track(folder / "data"))

    folder = made_once(temporary, name, make)
    return Survey(folder / "data", (folder / "id").read_text())


def made_once(temporary: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """A folder that `make` has filled, once for all processes of a test run.

    A film that is written twice is not the same bytes: x264 reads memory that nobody has written.
    """
    own = temporary.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "made" / name
    folder.mkdir(parents=True, exist_ok=True)
    is_made = folder / "is_made"
    with alone(folder / "lock"):
        if not is_made.exists():
            make(folder)
            is_made.touch()
    return folder
