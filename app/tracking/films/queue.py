"""The queue of films, and the threads that have them tracked by an engine.

The table of inspections is the queue and the truth. A thread takes the next inspection under the
number of a new attempt; what was running when the server ended, or a slot failed, is taken again.
A result is accepted from the newest attempt only, so that no run adds a second one.
"""

from __future__ import annotations

import logging
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial

from app.errors import (
    AppError,
    Busy,
    ClaimLost,
    DiskFull,
    EngineUnavailable,
    InspectionLocked,
    InspectionNotFound,
    NothingRecorded,
    NotRunning,
    StillRunning,
    StoreUnavailable,
    WorkerLost,
    code_of,
)
from app.logs import about
from app.storage.blobs import keys
from app.storage.database.tables import ENDED, Inspection
from app.storage.records.inspections import InspectionStore
from app.storage.records.runs import Outcome, RunStore
from app.storage.storage import Storage
from app.tracking.films.chunked import ChunkedTracking, Pieces
from app.tracking.films.engines import Engine, EngineState
from app.tracking.films.run_files import RunFiles
from app.tracking.films.runs import Run, Runs, TrackedFilm
from app.tracking.films.work import Manifest
from app.tracking.live import Event, Live, Update
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.videos import NO_FILM
from app.tracking.tracks import Tracks
from app.watched import Watched

logger = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 10.0
_PAUSE_AFTER_FAULT_S = 5.0
_MOST_LOSSES = 5
"""Workers of a cluster that may be lost in a row without progress; then the film is at fault."""
_MOST_FAULTS = 3
_PASSING = (Busy, ClaimLost, DiskFull, EngineUnavailable, StoreUnavailable)
"""Errors that are not the film's."""
_LOOK_AGAIN_S = 5.0
"""Nobody reports that a cluster has another worker."""


class Tracking:
    """Claims, follows and stops the tracking of inspections."""

    def __init__(
        self,
        storage: Storage,
        tracks: Tracks,
        runs: Runs,
        live: Live,
        run_files: RunFiles,
        engine: Engine,
    ) -> None:
        self._inspections = InspectionStore(storage.database)
        self._store = RunStore(storage.database)
        self._films = FilmFiles(storage.blobs, storage.folder)
        self._tracks = tracks
        self._runs = runs
        self._live = live
        self._run_files = run_files
        self._engine = engine
        self._stopping = False
        self._is_held = False
        self._claiming = threading.Lock()
        """Held until what was claimed has a run."""
        self._changed = runs.changed
        self._wakes = 0
        self._busy = 0
        """Slots that have something to do."""
        self._faults: Counter[str] = Counter()
        """Faults of the program by inspection."""
        self._pieces = Pieces(self._changed)
        self._chunked = ChunkedTracking(engine, runs, run_files, self._pieces, self._persistent)
        work: dict[str, Callable[[], None]] = {
            f"tracking-{slot}": partial(self._work, slot) for slot in range(engine.most_slots)
        }
        self.threads = [
            Watched(name, each, stop_timeout_s=_STOP_TIMEOUT_S) for name, each in work.items()
        ]

    def start(self) -> None:
        """Queue again what was running when the server ended, and start."""
        with suppress(DiskFull):  # the slots take them nevertheless
            if interrupted := self._store.queue_interrupted():
                logger.info("%d interrupted inspections continue.", interrupted)
        for thread in self.threads:
            thread.start()

    def stop(self) -> None:
        """End the runs; their inspections continue at the next start."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._runs.ask_all_to_stop("shutdown")
        for thread in self.threads:
            thread.stop()
        try:
            self._store.queue_interrupted()
        except (Busy, DiskFull) as hindrance:
            logger.warning("What was running is queued again at the next start: %s", hindrance)
        finally:
            self._engine.close()

    def engine_state(self) -> EngineState:
        """Return what tracks the films, and how many at once."""
        return self._engine.state()

    def waiting(self) -> int:
        """Return the number of films in the queue."""
        return self._inspections.counts().get("queued", 0)

    def hold(self) -> None:
        """Begin no inspection until `release`."""
        self._is_held = True

    def release(self) -> None:
        """Begin what was queued meanwhile."""
        self._is_held = False
        self.wake()

    def wake(self) -> None:
        """Wake the slots: an inspection was queued."""
        with self._changed:
            self._wakes += 1
            self._changed.notify_all()

    def on_event(self, event: Event) -> None:
        """Handle an event: an inspection was queued."""
        if isinstance(event, Update) and event.state == "queued":
            self.wake()

    def cancel(self, inspection_id: str) -> None:
        """Stop an inspection and keep its track so far.

        Raises:
            NotRunning: The inspection has already ended.
        """
        run = self._runs.ask_to_stop(inspection_id, "cancelled")
        if run is not None:
            run.ended.wait(run.patience_s)
            return
        status = self._store.cancel_unless_ended(inspection_id)
        if status in ENDED and status != "cancelled":
            raise NotRunning(f"The inspection is {status}; there is nothing to stop.")
        self._live.publish(Update(inspection_id, "cancelled"))

    def retry(self, inspection_id: str) -> None:
        """Track an ended inspection again; one that was cancelled continues at its checkpoint.

        Raises:
            StillRunning: The inspection is queued or running.
            NothingRecorded: There is no video to track.
        """
        self.require_film(self._inspections.get(inspection_id))
        self._store.queue_again(inspection_id)
        self.queued(inspection_id)

    def track_again(self, inspection_ids: Iterable[str]) -> int:
        """Track ended inspections again; return the number of those that can be: what is approved,
        running, deleted or without a film is left alone.
        """
        queued = 0
        for inspection_id in inspection_ids:
            try:
                self.retry(inspection_id)
            except (InspectionLocked, InspectionNotFound, NothingRecorded, StillRunning) as left:
                logger.info("Inspection %s is not tracked again: %s", inspection_id, left)
            else:
                queued += 1
        return queued

    def require_film(self, row: Inspection) -> None:
        """Raise NothingRecorded if an ended inspection has no film, so that it cannot be tracked
        again.
        """
        if not row.has_film:
            raise NothingRecorded(NO_FILM)
        if row.status in ENDED and not self._films.film_of(row).exists():
            raise NothingRecorded("Nothing was recorded; start a new live inspection.")

    def queued(self, inspection_id: str) -> None:
        """Publish that an inspection was queued to be tracked."""
        self._live.publish(Update(inspection_id, "queued"))
        self.wake()

    def _work(self, slot: int) -> None:
        while not self._stopping:
            try:
                run = self._next_run(slot)
                if run is not None:
                    with self._occupied():
                        self._run_in_slot(run)
                elif (piece := self._pieces.take()) is not None:
                    with self._occupied():
                        piece.do()
            except ClaimLost as lost:
                logger.warning("%s", lost)
            except _PASSING as hindrance:
                logger.warning("A tracking slot waits: %s", hindrance)
                self._pause()
            except Exception:
                # The row still says `running` without a run, so that it is tracked again.
                logger.exception("A fault of the server interrupted a tracking slot.")
                self._pause()

    def _pause(self) -> None:
        with self._changed:
            self._changed.wait_for(lambda: self._stopping, _PAUSE_AFTER_FAULT_S)

    @contextmanager
    def _occupied(self) -> Iterator[None]:
        with self._changed:
            self._busy += 1
        try:
            yield
        finally:
            with self._changed:
                self._busy -= 1

    def _run_in_slot(self, run: Run) -> None:
        try:
            with about(run.inspection.id):
                self._run(run)
        except _PASSING:
            raise
        except Exception as fault:
            self._give_up_after_faults(run, fault)
            raise
        finally:
            self._runs.remove(run)

    def _give_up_after_faults(self, run: Run, fault: Exception) -> None:
        """Let an inspection fail whose film is missing, or over which the program fails often."""
        self._faults[run.inspection.id] += 1
        if isinstance(fault, AppError):
            outcome = Outcome("failed", code_of(type(fault)), str(fault))
        elif self._faults[run.inspection.id] == _MOST_FAULTS:
            detail = f"The program failed {_MOST_FAULTS} times; the server's log says how."
            outcome = Outcome("failed", "tracking_failed", detail)
        else:
            return
        self._record(run, Manifest(outcome, run.frames_done))
        self._runs.publish_end(run, outcome)

    def _next_run(self, slot: int) -> Run | None:
        """Wait for the next inspection that may be claimed.

        Returns:
            Its run; None when the server stops, or when there is a piece of another run to do.
        """
        while not self._stopping:
            with self._changed:
                wakes = self._wakes
                has_piece = bool(self._pieces)
            if slot < self._engine.slots() and not self._is_held:
                if has_piece:
                    return None
                run = self._claimed_run()
                if run is not None:
                    return run
            with self._changed:
                if not (self._stopping or self._pieces or self._wakes != wakes):
                    self._changed.wait(_LOOK_AGAIN_S)
        return None

    def _claimed_run(self) -> Run | None:
        with self._claiming:
            inspection = self._store.claim_next([run.inspection.id for run in self._runs.all()])
            if inspection is None:
                return None
            run = Run(
                TrackedFilm.from_row(inspection),
                keys.film(inspection.id, inspection.video_file),
                attempt=inspection.attempt,
            )
            self._runs.add(run)
            return run

    def _run(self, run: Run) -> None:
        inspection = run.inspection
        logger.info("Inspection %s (%s): tracking starts.", inspection.id, inspection.name)
        try:
            manifest = self._tracked(run)
        except EngineUnavailable:
            logger.info("Inspection %s waits in the queue.", inspection.id)
            self._tracks.forget(inspection.id)
            self._store.give_back(inspection.id)
            self.queued(inspection.id)
            raise  # this slot would claim it again at once: the engine knows its workers of 5 s ago
        try:
            if manifest is None or not self._runs.keep_end(run, partial(self._keep, run, manifest)):
                self._tracks.forget(inspection.id)
                return
        except ClaimLost:
            self._tracks.forget(inspection.id)
            raise
        outcome = manifest.outcome
        try:
            if outcome.status != "cancelled":  # then another run continues from its checkpoint
                self._run_files.drop(inspection.id)
        except StoreUnavailable as away:  # it goes with the inspection, or with its next run
            logger.warning("What is left of the runs of %s stays: %s", inspection.id, away)
        self._runs.publish_end(run, outcome)

    def _tracked(self, run: Run) -> Manifest | None:
        """Have a film tracked; None if another run continues.

        A long film gets the slots that have nothing else to do.
        """
        with self._changed:
            idle = max(self._engine.slots() - self._busy, 0)
        ranges = self._chunked.ranges(run, 1 + idle)
        if len(ranges) == 1:
            return self._persistent(run, lambda: self._engine.track(run), keeps_slot=False)
        return self._chunked.track(run, ranges)

    def _persistent(
        self, run: Run, work: Callable[[], Manifest | None], *, keeps_slot: bool = True
    ) -> Manifest | None:
        """Try again whenever a worker is lost; None if another run continues.

        Raises:
            EngineUnavailable: There is nobody to do it, and it may not keep its slot meanwhile.
        """
        losses = frames = 0
        while True:
            try:
                return work()
            except WorkerLost as loss:
                losses = 1 if run.frames_done > frames else losses + 1
                frames = max(frames, run.frames_done)
                logger.warning("Tracking %s: %s", run.inspection.id, loss)
                if losses == _MOST_LOSSES:
                    detail = f"{loss} It was tried {losses} times."
                    return Manifest(Outcome("failed", "worker_lost", detail), run.frames_done)
            except (EngineUnavailable, StoreUnavailable) as gone:
                if isinstance(gone, EngineUnavailable) and not keeps_slot:
                    raise
                logger.warning("Tracking %s waits: %s", run.inspection.id, gone)
                if not self._runs.wait_hindered(run, str(gone), _PAUSE_AFTER_FAULT_S):
                    return None if run.stop == "shutdown" else Manifest(Outcome("cancelled"), 0)

    def _keep(self, run: Run, manifest: Manifest) -> None:
        if self._store.has_outcome(run.inspection.id, run.attempt, manifest.outcome):
            return  # the database stored it, but could not say so
        self._store.require_claim(run.inspection.id, run.attempt)
        self._run_files.settle(run, manifest)
        self._record(run, manifest)

    def _record(self, run: Run, manifest: Manifest) -> None:
        self._store.record_outcome(
            run.inspection.id,
            manifest.outcome,
            attempt=run.attempt,
            frames_done=manifest.frames_done,
            fps=manifest.fps,
            last=manifest.last,
            tracked_with=manifest.tracked_with,
            moved_mm=run.moved_mm,
        )
