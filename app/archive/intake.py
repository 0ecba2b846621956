"""The intake: makes inspections of the films that wait, one after the other, a few ahead of the
tracking.

The database decides: an inspection has the id of its film, and the transaction that adds it ends
the waiting of the film. Whatever a killed server leaves behind before that is made again, and
nothing is made twice.
"""

from __future__ import annotations

import logging
import re
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from app.archive.copying import copy_film
from app.archive.folders import modified_at
from app.archive.paths import line_of, path_of, text_of
from app.errors import (
    FilmChanged,
    NoLongerWanted,
    StillRunning,
    described,
)
from app.inspections.films.films import Films
from app.inspections.inspections import Inspections
from app.inspections.packs import Packs
from app.logs import about
from app.storage.archive.changes import header_of
from app.storage.archive.intake import IntakeStore
from app.storage.archive.selection import FilmRow
from app.storage.database.tables import ENDED, ArchiveFilm, Inspection
from app.storage.storage import Storage
from app.tracking.films.engines import Engine
from app.tracking.films.queue import Tracking
from app.tracking.live import Event, Update
from app.tracking.worker import HINDRANCES, Worker
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

AHEAD = 2
"""Inspections that wait for a tracking slot beyond one for each."""
_LOOK_EVERY_S = 2.0
"""How often the database is asked what has changed, also while a film is copied."""
_STOP_S = 10.0
_COPY = re.compile(r"[0-9a-f]{32}\.import")
_FAULT = {
    "error_code": "internal_error",
    "error_detail": "A fault of the program over this film; the server's log says which.",
}


class _Stopped(Exception):
    """The server stops."""


_LEFT_ALONE = (NoLongerWanted, StillRunning)
"""What others have done with a film meanwhile."""


@dataclass(frozen=True)
class IntakeState:
    """What the intake of this server is doing."""

    film_id: str | None = None
    """The film that is being copied."""
    name: str | None = None
    bytes_done: int = 0
    bytes_total: int = 0
    hindrance: str | None = None
    """A sentence that says why no film is taken in."""


class Intake(Worker):
    """Takes films in, in its own thread; a copy that is not complete is given up when it stops."""

    def __init__(
        self,
        storage: Storage,
        inspections: Inspections,
        films: Films,
        tracking: Tracking,
        packs: Packs,
        engine: Engine,
    ) -> None:
        super().__init__("archive-intake", stop_timeout_s=_STOP_S)
        self._store = IntakeStore(storage.database)
        self._inspections = inspections
        self._films = films
        self._tracking = tracking
        self._packs = packs
        self._folder = storage.folder
        self._engine = engine
        self._state = IntakeState()
        """`_changed` guards it."""

    def start(self) -> None:
        """Remove the copies that a killed server left, and start."""
        for path in self._folder.inspections.iterdir():
            if _COPY.fullmatch(path.name):
                path.unlink()
        super().start()

    def on_event(self, event: Event) -> None:
        """Look for the next film when an inspection begins or ends to be tracked."""
        if isinstance(event, Update) and (event.state in ENDED or not event.progress.frames_done):
            self.wake()

    def state(self) -> IntakeState:
        """Return what the intake is doing."""
        with self._changed:
            return self._state

    def _step(self) -> float:
        try:
            has_taken = self._take_next()
        except HINDRANCES as error:
            self._set(IntakeState(hindrance=str(error)))
            raise
        except Exception:
            hindrance = "A fault of the server interrupts the intake; it is in the log."
            self._set(IntakeState(hindrance=hindrance))
            raise
        self._set(IntakeState())
        return 0.0 if has_taken else _LOOK_EVERY_S

    def _set(self, state: IntakeState) -> None:
        with self._changed:
            self._state = state

    def _take_next(self) -> bool:
        """Take the next film in; return whether there was one."""
        slots = self._engine.slots()
        if not slots or self._store.ahead() >= slots + AHEAD:
            return False
        row = self._store.next_waiting()
        if row is None:
            return False
        with about(row.film.id):
            try:
                self._take_or_refuse(row)
            except _LEFT_ALONE as error:
                logger.info("Film %s of the archive: %s", row.film.id, error)
            except _Stopped:
                logger.info("Film %s of the archive waits for the next start.", row.film.id)
        return True

    def _take_or_refuse(self, row: FilmRow) -> None:
        """Take a film in; whatever is wrong, but not with the server, costs this film alone."""
        try:
            self._take(row)
        except (*_LEFT_ALONE, *HINDRANCES, _Stopped):
            raise
        except ChainageError as error:
            self._refuse(row.film, error)
        except Exception:
            logger.exception("A fault over film %s of the archive; it is refused.", row.film.id)
            self._store.refuse(row.film.id, _FAULT)

    def _take(self, row: FilmRow) -> None:
        film, inspection = row.film, row.inspection
        if inspection is None:
            self._create(film)
        else:
            if inspection.status in ENDED:
                self._track_again(film, inspection)
            self._store.note_taken(film.id)

    def _create(self, film: ArchiveFilm) -> None:
        header = film.header | header_of(
            {name: getattr(film, name) for name in ("project", "asset") if getattr(film, name)}
        )
        self._packs.require(header)
        self._folder.require_room(film.size)
        copy = self._folder.inspections / f"{film.id}.import"
        source = path_of(film.path)
        try:
            copy_film(source, copy, film.size, film.modified_at, partial(self._copied, film, [0.0]))
            self._films.create_from_copy(
                film.id,
                copy,
                line_of(text_of(source.name)),
                film.rig or {},
                self._add,
                name=film.name,
                header=header,
                who=film.wanted_by or film.added_by,
                priority=film.priority,
            )
        finally:
            copy.unlink(missing_ok=True)

    def _add(self, inspection: Inspection, who: str) -> None:
        self._store.take(inspection.id, inspection, who)

    def _track_again(self, film: ArchiveFilm, inspection: Inspection) -> None:
        if film.rig is not None and film.rig != inspection.rig:
            self._inspections.track_with(film.id, film.rig, film.wanted_by or film.added_by)
        else:
            self._tracking.retry(film.id)

    def _copied(self, film: ArchiveFilm, looked_s: list[float], done: int) -> None:
        """Note the progress of a copy; raise if it is to end."""
        with self._changed:
            self._state = IntakeState(film.id, film.name, done, film.size)
            if self._stopping:
                raise _Stopped
        if time.monotonic() - looked_s[0] >= _LOOK_EVERY_S:
            self._store.require_wanted(film.id)
            self._folder.require_room(film.size - done)
            looked_s[0] = time.monotonic()

    def _refuse(self, film: ArchiveFilm, error: ChainageError) -> None:
        told = described(error)
        values: dict[str, Any] = {"error_code": told["code"], "error_detail": told["detail"]}
        if isinstance(error, FilmChanged):
            with suppress(OSError):
                status = path_of(film.path).stat()
                values |= {"size": status.st_size, "modified_at": modified_at(status)}
        logger.info("Film %s of the archive is refused: %s", film.id, told["detail"])
        self._store.refuse(film.id, values)
