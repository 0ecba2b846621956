"""The inbox: a folder whose new films are added to the archive by the stored rules, and tracked.

A film is complete when its size and time have not changed for a while and no process of this
machine, as far as this one may look, has it open for writing. One that no rule fits is unassigned,
and waits for a rig.

Each look takes the next portion of the files, so that its work does not grow with their number.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path

from app.archive.additions import assigned_to, columns
from app.archive.archive import stored_rules
from app.archive.assignment import Assignment
from app.archive.folders import Found, files_below, is_film, looked_at
from app.archive.intake import Intake
from app.archive.paths import path_of
from app.storage.archive.changes import ArchiveChanges
from app.storage.archive.films import ArchiveFilms
from app.storage.archive.rules import RuleStore
from app.storage.database.database import Database
from app.tracking.worker import Worker

logger = logging.getLogger(__name__)

WHO = "inbox"
_LOOK_EVERY_S = 2.0
_AT_ONCE = 1000
"""Files of one look."""
_STOP_S = 10.0


@dataclass(frozen=True)
class _Seen:
    """A file that is not in the archive yet."""

    size: int
    modified_at: datetime
    since_s: float
    """When it was seen in this state first, by `time.monotonic`."""


class Inbox(Worker):
    """Looks at the folder now and then, in its own thread."""

    def __init__(
        self, database: Database, intake: Intake, folder: Path, *, settle_s: float
    ) -> None:
        super().__init__("archive-inbox", stop_timeout_s=_STOP_S)
        self._archive = ArchiveFilms(database)
        self._changes = ArchiveChanges(database)
        self._rules = RuleStore(database)
        self._intake = intake
        self._folder = folder
        self._settle_s = settle_s
        self._files: Iterator[Path] = iter(())
        """The rest of this pass over the folder."""
        self._seen: dict[Path, _Seen] = {}
        """Files of this pass that are not in the archive; `_seen_before` has those of the last."""
        self._seen_before: dict[Path, _Seen] = {}
        self._reported = set[Path]()
        """Files of which the log says why they are not added."""

    def _step(self) -> float:
        """Look at the next portion of the files."""
        self._look()
        return min(_LOOK_EVERY_S, self._settle_s)

    def _look(self) -> None:
        portion = list(islice(self._files, _AT_ONCE))
        if not portion:  # the end of a pass
            self._seen_before, self._seen = self._seen, {}
            self._reported &= self._seen_before.keys()
            self._files = files_below(self._folder.resolve())
            return
        found = [self._looked_at(path) for path in portion if is_film(path.name)]
        known = self._archive.known(film.path for film in found)
        settled = [film for film in found if film.path not in known and self._has_settled(film)]
        if settled:
            written = being_written()
            if complete := [film for film in settled if self._is_complete(film, written)]:
                self._add(complete)

    def _looked_at(self, path: Path) -> Found:
        root = self._folder.resolve()
        return looked_at(path, root, [root])

    def _has_settled(self, film: Found) -> bool:
        """Note a film that is not in the archive yet; return whether it changes no more."""
        path = path_of(film.path)
        now_s = time.monotonic()
        seen = self._seen_before.get(path)
        if seen is None or (seen.size, seen.modified_at) != (film.size, film.modified_at):
            seen = _Seen(film.size, film.modified_at, now_s)
        self._seen[path] = seen
        if now_s - seen.since_s < self._settle_s:
            return False
        if film.problem is not None and path not in self._reported:
            logger.warning("In the inbox, %r: %s", film.relative, film.problem)
            self._reported.add(path)
        return film.problem is None

    def _is_complete(self, film: Found, written: set[Path]) -> bool:
        """Whether nobody writes a settled film, nor has written its end since it was looked at."""
        path = path_of(film.path)
        return path not in written and self._looked_at(path) == film

    def _add(self, films: list[Found]) -> None:
        assigned = assigned_to(films, Assignment(stored_rules(self._rules)), self._archive)
        now = datetime.now(UTC)
        rows = [
            row | {"state": "waiting", "wanted_at": now, "wanted_by": WHO}
            for row in columns(assigned, WHO)
        ]
        added = self._changes.add(rows)
        without = sum(row["rig"] is None for row in rows if row["id"] in added)
        logger.info("The inbox added %d films, %d of them without a rig.", len(added), without)
        self._intake.wake()


def being_written() -> set[Path]:
    """Return the files that a process has open for writing, as far as this one may look."""
    found = set[Path]()
    for process in Path("/proc").iterdir():
        if process.name.isdecimal():
            with suppress(PermissionError, FileNotFoundError, ProcessLookupError):
                for handle in (process / "fd").iterdir():
                    with suppress(FileNotFoundError):  # it was closed meanwhile
                        if _is_for_writing(process, handle.name):
                            found.add(handle.readlink())
    return found


def _is_for_writing(process: Path, handle: str) -> bool:
    text = (process / "fdinfo" / handle).read_text()
    flags = next(int(line.split()[1], 8) for line in text.splitlines() if line[:6] == "flags:")
    return flags & os.O_ACCMODE != os.O_RDONLY
