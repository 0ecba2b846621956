"""Reads the burnt-in counters of films, one after the other, while or after they are tracked.

What is to be read stands in the files beside the tracks, so that nothing is lost when the server
ends. Even of the lowest priority, the child slows the trackers of a busy machine by a third, so
what nobody has asked for is read while no film waits to be tracked.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from pathlib import Path

import msgspec

from app.burnt_in.readings import BurntIn, CounterReadings, ReadFilm
from app.errors import (
    BlobNotFound,
    Busy,
    EngineUnavailable,
    MediaFailed,
    NothingRecorded,
    NotRunning,
    StoreUnavailable,
    WorkerLost,
)
from app.jobs.messages import Limits, Progress
from app.jobs.process import Child, ask_about_media
from app.jobs.requests.counter import CounterRequest
from app.storage.blobs.blobs import StoredBlob
from app.storage.database.tables import ENDED
from app.storage.records.inspections import InspectionStore, require_unlocked
from app.survey.observations.review import APPROVED
from app.tracking.films.work import IsStopped
from app.tracking.live import Event, Live, Update
from app.tracking.pictures.counter_files import SEARCHED, CounterFiles, KeptCounter
from app.tracking.pictures.counter_reading import CHILD, CounterOrder, OnProgress
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.videos import NO_FILM
from app.tracking.worker import InspectionWorker
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 10.0
_SEARCH_S = 60.0
"""Time that a person waits for a search, which takes some 5 s."""


class CounterQueue(InspectionWorker):
    """A thread that has one counter read at a time."""

    def __init__(
        self,
        inspections: InspectionStore,
        films: FilmFiles,
        files: CounterFiles,
        live: Live,
        *,
        limits: Limits,
        read: Callable[[CounterOrder, IsStopped, OnProgress], ReadFilm],
        has_others: Callable[[], bool],
    ) -> None:
        """Prepare the thread.

        Args:
            inspections, films, files: What is read.
            live: Told when a counter was read.
            limits: Of each child.
            read: Reads a counter, see `read_counter`; on a worker if there are some.
            has_others: Whether films wait to be tracked.
        """
        super().__init__("counters", stop_timeout_s=_STOP_TIMEOUT_S)
        self._inspections = inspections
        self._films = films
        self._files = files
        self._live = live
        self._limits = limits
        self._read = read
        self._has_others = has_others
        self._inherits = True
        """Whether to look for films that the server left waiting when it ended."""
        self._reading: str | None = None
        """`_changed` guards this and the next fields."""
        self._progress: Progress | None = None
        self._is_stopped = threading.Event()
        """Whether what is being read is no longer wanted."""

    def stop(self) -> None:
        """End the child; its film is read again at the next start."""
        with self._changed:
            self._stopping = True
            self._is_stopped.set()
        super().stop()

    def on_event(self, event: Event) -> None:
        """Handle an event: an uploaded film is next, or one whose tracking has ended."""
        if isinstance(event, Update) and event.state in ("queued", *ENDED):
            self.announce(event.inspection_id)

    def progress(self, inspection_id: str) -> Progress | None:
        """Return how far the counter of an inspection is read; None if it is not being read."""
        with self._changed:
            return self._progress if self._reading == inspection_id else None

    def state(self, inspection_id: str, stated: KeptCounter) -> None:
        """Store what a person states, and read the film again unless only the unit or the
        uncertainty of its readings is another one.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            NothingRecorded: There is no film.
            PixelOutsidePicture: The box is not in the picture.
        """
        row = self._inspections.get(inspection_id)
        require_unlocked(row)
        if not row.has_film:
            raise NothingRecorded(NO_FILM)
        stated.require_picture_size(row.video["width"], row.video["height"])
        with self._changed:
            kept = self._files.get(inspection_id)
            if kept is not None and kept.differs_in_meaning(stated):
                stated = msgspec.structs.replace(kept, unit=stated.unit, percent=stated.percent)
            self._files.put(inspection_id, stated)
            if self._reading == inspection_id:
                self._is_stopped.set()
        self._live.counter_read(inspection_id)
        self.announce(inspection_id, is_asked=True)

    def cancel(self, inspection_id: str) -> None:
        """Give up reading a counter.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            NotRunning: It is neither waiting nor being read.
        """
        require_unlocked(self._inspections.get(inspection_id))
        with self._changed:
            kept = self._files.get(inspection_id)
            if kept is None or kept.state != "waiting":
                raise NotRunning("The counter is not being read; there is nothing to stop.")
            self._files.put(inspection_id, msgspec.structs.replace(kept, state="cancelled"))
            if self._reading == inspection_id:
                self._is_stopped.set()

    def search(self, film: Path) -> BurntIn:
        """Find the counter of a film while somebody waits.

        Raises:
            UnreadableVideo: The file has no picture.
            MediaTimeout, MediaFailed: The process took too long, or died.
        """
        request = CounterRequest(str(film), self._limits, is_search=True)
        with Child(CHILD) as child:
            return ask_about_media(
                child, request, BurntIn, work="Searching the counter", stall_s=_SEARCH_S
            )

    def _step(self) -> float | None:
        if self._inherits:
            self._find_waiting()
            self._inherits = False
        return super()._step()

    def _may_take(self, *, is_asked: bool) -> bool:
        try:
            return is_asked or not self._has_others()
        except Exception:
            logger.exception("Whether films wait to be tracked is not known.")
            return False

    def _find_waiting(self) -> None:
        """Find what was waiting when the server ended."""
        for inspection_id in self._inspections.ended():
            try:
                if self._files.is_waiting(inspection_id):
                    self.announce(inspection_id)
            except StoreUnavailable:
                raise
            except Exception:
                logger.exception("The state of the counter of %s cannot be read.", inspection_id)

    def _look_at(self, inspection_id: str) -> None:
        """Read the counter of a film that no longer grows, unless it is read already."""
        row = self._inspections.get(inspection_id)
        is_whole = row.status in ENDED or row.source_kind == "upload"
        if not is_whole or not row.has_film or row.review_state == APPROVED:
            return
        film = self._films.film_of(row)
        try:
            size = film.about().size
        except BlobNotFound:
            return
        with self._changed:
            kept = self._files.get(inspection_id) or SEARCHED
            if kept.state == "read" and kept.film_bytes != size:  # the recording was continued
                kept = msgspec.structs.replace(kept, state="waiting")
            if kept.state != "waiting" or self._stopping:
                return
            self._files.put(inspection_id, kept)
            self._reading, self._progress = inspection_id, Progress(0, None)
            self._is_stopped.clear()
        try:
            self._read_film(inspection_id, film, kept)
        finally:
            with self._changed:
                self._reading = self._progress = None

    def _read_film(self, inspection_id: str, film: StoredBlob, kept: KeptCounter) -> None:
        """Have a counter read, and store the result unless something else is wanted meanwhile."""

        def note(progress: Progress) -> None:
            with self._changed:
                self._progress = progress

        csv = ""
        order = CounterOrder(film.key, kept.within, self._limits)
        try:
            read = self._read(order, self._is_stopped.is_set, note)
            csv, done = read.csv, _read_of(kept, read, film.about().size)
        except (EngineUnavailable, WorkerLost) as gone:
            raise Busy(str(gone)) from gone
        except (ChainageError, FileNotFoundError) as failure:
            done = msgspec.structs.replace(kept, state="failed", detail=str(failure))
        with self._changed:
            if self._stopping or not film.exists() or self._files.get(inspection_id) != kept:
                return
            if done.state == "read":
                self._files.put_readings(inspection_id, done, csv)
            else:
                self._files.put(inspection_id, done)
        self._live.counter_read(inspection_id)
        logger.info(
            "Inspection %s: the counter is %s. %s", inspection_id, done.state, done.detail or ""
        )


def _read_of(kept: KeptCounter, read: ReadFilm, film_bytes: int) -> KeptCounter:
    """Return what is known after reading; raise MediaFailed if the table is none."""
    try:
        CounterReadings.from_csv(read.csv, read.found.place)
    except ValueError as error:
        raise MediaFailed("The process that reads counters gave an invalid answer.") from error
    return msgspec.structs.replace(
        kept,
        state="read",
        place=read.found.place,
        film_date=read.found.film_date,
        film_bytes=film_bytes,
        detail=read.problem,
    )
