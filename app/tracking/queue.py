"""The queue of videos and the child processes that track them.

The table of inspections is the queue. An inspection that was `running` when the server ended is
queued again at the next start and continues from its last checkpoint. One thread for each slot
takes the oldest, starts a child and drains its pipe, so that tracking never waits for the server.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping
from functools import partial

import msgspec

from app.errors import DiskFull, NothingRecorded, NotRunning
from app.jobs.messages import (
    Batch,
    Checkpoint,
    Done,
    Failed,
    FromTracker,
    Limits,
    Passing,
    TrackRequest,
)
from app.jobs.process import Child, describe_exit
from app.logs import about
from app.storage.files import DataFolder
from app.storage.inspections import InspectionStore
from app.storage.runs import Outcome, RunStore
from app.storage.tables import ENDED, Inspection
from app.tracking.journal import Journal, Resumption
from app.tracking.live import Live, Progress
from app.tracking.runs import Run, Runs
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled
from app.tracking.videos import NO_FILM

logger = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 10.0
_PAUSE_AFTER_FAULT_S = 5.0
_MOST_DEATHS = 3
"""Tracking processes that may die in a row without a newer checkpoint; then the video is at
fault."""


class _Died(Exception):
    """The tracking process ended without a result; `code` is that of the API."""

    def __init__(self, code: str, detail: str) -> None:
        super().__init__(detail)
        self.code = code


class Tracking:
    """Starts, follows and stops the tracking of inspections."""

    def __init__(
        self,
        inspections: InspectionStore,
        store: RunStore,
        folder: DataFolder,
        tracks: Tracks,
        unrolled: Unrolled,
        runs: Runs,
        live: Live,
        *,
        slots: int,
        limits: Limits,
        stall_s: float,
        pace: float | None,
    ) -> None:
        self._inspections = inspections
        self._store = store
        self._folder = folder
        self._tracks = tracks
        self._unrolled = unrolled
        self._runs = runs
        self._live = live
        self._limits = limits
        self._stall_s = stall_s
        self._pace = pace
        self._messages: msgspec.msgpack.Decoder[FromTracker] = msgspec.msgpack.Decoder(FromTracker)
        self._stopping = False
        self._changed = runs.changed
        self._threads = [
            threading.Thread(target=self._work, name=f"tracking-{n}", daemon=True)
            for n in range(slots)
        ]

    def start(self) -> None:
        """Queue again what was running when the server ended, and start."""
        interrupted = self._store.queue_interrupted()
        if interrupted:
            logger.info("%d interrupted inspections continue.", interrupted)
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """End the children; their inspections continue at the next start."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._runs.ask_all_to_stop("shutdown")
        for thread in self._threads:
            thread.join(_STOP_TIMEOUT_S)

    def is_alive(self) -> bool:
        """Return whether every slot can take work."""
        return all(thread.is_alive() for thread in self._threads)

    def wake(self) -> None:
        """Wake the slots: an inspection was queued."""
        with self._changed:
            self._changed.notify_all()

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
        self._live.publish(inspection_id, "cancelled", Progress(0, None, None, None))

    def retry(self, inspection_id: str) -> None:
        """Track an ended inspection again from its first frame.

        Raises:
            StillRunning: The inspection is queued or running.
            NothingRecorded: There is no video to track.
        """
        self.require_film(self._inspections.get(inspection_id))
        self._store.queue_again(inspection_id)
        self.queued(inspection_id)

    def require_film(self, row: Inspection) -> None:
        """Raise NothingRecorded if an ended inspection has no film, so that it cannot be tracked
        again.
        """
        video = self._folder.inspection(row.id) / row.video_file
        if not row.has_film:
            raise NothingRecorded(NO_FILM)
        if row.status in ENDED and not video.exists():
            raise NothingRecorded("Nothing was recorded; start a new live inspection.")
        if row.status in ENDED:
            self._journal(row).drop()

    def queued(self, inspection_id: str) -> None:
        """Publish that an inspection was queued to be tracked from its first frame."""
        self._live.publish(inspection_id, "queued", Progress(0, None, None, None))
        self.wake()

    def _work(self) -> None:
        while not self._stopping:
            try:
                run = self._next_run()
                if run is not None:
                    self._run_in_slot(run)
            except DiskFull as full:
                logger.warning("A tracking slot waits: %s", full)
                self._pause()
            except Exception:
                # For example the database accepts no writes: the row still says `running`, so the
                # next start tracks it again; meanwhile the slot serves others.
                logger.exception("A fault of the server interrupted a tracking slot.")
                self._pause()

    def _pause(self) -> None:
        with self._changed:
            self._changed.wait_for(lambda: self._stopping, _PAUSE_AFTER_FAULT_S)

    def _run_in_slot(self, run: Run) -> None:
        try:
            with about(run.inspection.id):
                self._run(run)
        finally:
            self._runs.remove(run)

    def _next_run(self) -> Run | None:
        """Wait for the oldest queued inspection; None when the server stops."""
        with self._changed:
            while not self._stopping:
                inspection = self._store.claim_oldest_queued()
                if inspection is not None:
                    run = Run(inspection)
                    self._runs.add(run)
                    return run
                self._changed.wait()
        return None

    def _run(self, run: Run) -> None:
        inspection = run.inspection
        logger.info("Inspection %s (%s): tracking starts.", inspection.id, inspection.name)
        journal = self._journal(inspection)
        outcome = self._followed(run, journal)
        if outcome is None or not self._runs.keep_end(run, partial(self._keep, run, outcome)):
            self._tracks.forget(inspection.id)
            return
        journal.drop()
        logger.info(
            "Inspection %s (%s): %s after %d frames. %s",
            inspection.id, inspection.name, outcome.status, run.frames_done,
            outcome.error_detail or outcome.warning or "",
        )  # fmt: skip
        self._live.publish(inspection.id, outcome.status, run.progress())

    def _keep(self, run: Run, outcome: Outcome) -> None:
        self._tracks.finish(run.inspection.id, track_metadata(run.inspection))
        self._store.record_outcome(
            run.inspection.id, outcome, frames_done=run.frames_done, fps=run.fps, last=run.last
        )

    def _journal(self, inspection: Inspection) -> Journal:
        return Journal(self._folder, self._unrolled, inspection)

    def _followed(self, run: Run, journal: Journal) -> Outcome | None:
        """Follow one child after another until one has a result; None if the next start
        continues.
        """
        deaths = frames = 0
        while True:
            resumption = journal.read()
            if resumption is None:
                journal.drop()
                self._runs.begin(run)
            else:
                logger.info(
                    "Inspection %s: from frame %d on.", run.inspection.id, resumption.frames
                )
                self._runs.resume(run, resumption.found)
                if resumption.frames > frames:
                    deaths, frames = 0, resumption.frames
            try:
                return self._follow(run, journal, resumption)
            except _Died as death:
                deaths += 1
                logger.warning("Tracking %s: %s", run.inspection.id, death)
                if deaths == _MOST_DEATHS:
                    detail = f"{death} It was tried {deaths} times."
                    return Outcome("failed", death.code, detail)

    def _follow(self, run: Run, journal: Journal, resumption: Resumption | None) -> Outcome | None:
        """Start a child and drain it until it ends; None if the next start continues.

        Raises:
            _Died: The child ended or hung without a result and was not asked to stop.
        """
        child = Child("app.jobs.tracker")
        try:
            self._runs.give_child(run, child)
            outcome = self._drain(run, child, journal, resumption)
        except TimeoutError as error:
            child.kill()
            raise _Died(
                "tracking_stalled",
                f"Tracking made no progress for {self._stall_s:g} s and was stopped.",
            ) from error
        except (EOFError, BrokenPipeError) as error:
            how = describe_exit(child.end())
            if run.stop is None:
                raise _Died(
                    "tracking_process_died", f"The tracking process died: {how}."
                ) from error
            outcome = Outcome("cancelled")
        except msgspec.MsgspecError:
            logger.exception(
                "The tracking process of %s sent an invalid message.", run.inspection.id
            )
            child.kill()
            outcome = Outcome(
                "failed", "tracking_failed", "The tracking process gave an invalid answer."
            )
        finally:
            child.end()
        with self._changed:
            if run.stop == "shutdown" and outcome.status != "done":
                return None
            if run.stop == "cancelled" and outcome.status != "done":
                return Outcome("cancelled")
        return outcome

    def _drain(
        self, run: Run, child: Child, journal: Journal, resumption: Resumption | None
    ) -> Outcome:
        inspection = run.inspection
        child.send(self._request(inspection, resumption))
        while True:
            message = self._messages.decode(child.receive(self._stall_s))
            match message:
                case Batch():
                    self._runs.take(run, message)
                    journal.note(message)
                case Checkpoint():
                    journal.keep(message)
                case Passing():
                    logger.debug(
                        "Tracking %s: decoding frame %d again.", inspection.id, message.frames
                    )
                case Done():
                    return Outcome("done", warning=message.problem)
                case Failed():
                    if message.trace:
                        logger.error("Tracking %s: %s", inspection.id, message.trace)
                    return Outcome("failed", message.code, message.detail)

    def _request(self, inspection: Inspection, resumption: Resumption | None) -> TrackRequest:
        video = str(self._folder.inspection(inspection.id) / inspection.video_file)
        marks = self._tracks.marks(inspection.id)
        if resumption is None:
            return TrackRequest(video, inspection.rig, self._limits, self._pace, marks=marks)
        limits = self._limits
        if limits.cpu_s is not None:  # of the whole run, over all its processes
            rest_s = max(limits.cpu_s - round(resumption.cpu_s), 1)
            limits = msgspec.structs.replace(limits, cpu_s=rest_s)
        return TrackRequest(
            video, inspection.rig, limits, self._pace, str(resumption.checkpoint), marks
        )


def track_metadata(inspection: Inspection) -> Mapping[str, object]:
    """Return the comment lines of a track file, which state its origin."""
    return {
        "inspection": inspection.id,
        "name": inspection.name,
        "video": inspection.source_filename,
        "video_sha256": inspection.source_sha256,
    }
