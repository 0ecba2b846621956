"""The queue of videos and the child processes that track them.

The table of inspections is the queue: what is `queued` waits, what was `running` when the server
ended is queued again at the next start.  One thread a slot takes the oldest, starts a child and
drains its pipe, so that tracking never waits for the server.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import msgspec

from app.errors import NotRunning
from app.jobs.messages import Batch, Done, Failed, FromTracker, Limits, TrackRequest
from app.jobs.process import Child, describe_exit
from app.services.live import Live, Progress
from app.services.tracks import Tracks
from app.storage.files import DataFolder
from app.storage.inspections import InspectionStore, Outcome
from app.storage.tables import ENDED, Inspection
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 10.0
_PAUSE_AFTER_FAULT_S = 5.0


@dataclass
class _Run:
    """One inspection in a slot."""

    inspection: Inspection
    child: Child | None = None
    stop: str | None = None
    """Why it is to stop: "cancelled" by a person, or "shutdown"."""
    frames_done: int = 0
    first_batch: tuple[float, int] | None = None
    """When it came, and how many frames it held."""
    fps: float | None = None
    last: Estimate | None = None
    ended: threading.Event = field(default_factory=threading.Event)

    def progress(self) -> Progress:
        total = self.inspection.video.get("frames")
        eta_s = None
        if total and self.fps:
            eta_s = max(total - self.frames_done, 0) / self.fps
        return Progress(self.frames_done, total, self.fps, eta_s)


class Tracking:
    """Starts, follows and stops the tracking of inspections."""

    def __init__(
        self,
        inspections: InspectionStore,
        folder: DataFolder,
        tracks: Tracks,
        live: Live,
        *,
        slots: int,
        limits: Limits,
        stall_s: float,
        pace: float | None,
    ) -> None:
        self._inspections = inspections
        self._folder = folder
        self._tracks = tracks
        self._live = live
        self._limits = limits
        self._stall_s = stall_s
        self._pace = pace
        self._messages: msgspec.msgpack.Decoder[FromTracker] = msgspec.msgpack.Decoder(FromTracker)
        self._stopping = False
        self._changed = threading.Condition()
        """Guards `_runs` and `_stopping`; notified when there may be something to do."""
        self._runs: dict[str, _Run] = {}
        self._threads = [
            threading.Thread(target=self._work, name=f"tracking-{n}", daemon=True)
            for n in range(slots)
        ]

    def start(self) -> None:
        """Queue again what was running when the server ended, and begin."""
        interrupted = self._inspections.queue_interrupted()
        if interrupted:
            logger.info("%d interrupted inspections are tracked again.", interrupted)
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """End the children; their inspections go on at the next start."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
            for run in self._runs.values():
                _ask_to_stop(run, "shutdown")
        for thread in self._threads:
            thread.join(_STOP_TIMEOUT_S)

    def is_alive(self) -> bool:
        """Whether every slot can take work."""
        return all(thread.is_alive() for thread in self._threads)

    def wake(self) -> None:
        """Something was queued."""
        with self._changed:
            self._changed.notify_all()

    def progress(self, inspection_id: str) -> Progress | None:
        """How far a running inspection is."""
        with self._changed:
            run = self._runs.get(inspection_id)
            return run.progress() if run else None

    def last_estimate(self, inspection_id: str) -> Estimate | None:
        """The newest estimate of a running inspection."""
        with self._changed:
            run = self._runs.get(inspection_id)
            return run.last if run else None

    def cancel(self, inspection_id: str) -> None:
        """Stop an inspection; its track is kept as far as it is.

        Raises:
            NotRunning: It has ended already.
        """
        with self._changed:
            run = self._runs.get(inspection_id)
            if run is not None:
                _ask_to_stop(run, "cancelled")
        if run is not None:
            run.ended.wait(_STOP_TIMEOUT_S)
            return
        status = self._inspections.cancel_unless_ended(inspection_id)
        if status in ENDED and status != "cancelled":
            raise NotRunning(f"The inspection is {status}; there is nothing to stop.")
        self._live.publish(inspection_id, "cancelled", Progress(0, None, None, None))

    def retry(self, inspection_id: str) -> None:
        """Track an ended inspection again from its first frame.

        Raises:
            StillRunning: It is queued or running.
        """
        self._inspections.queue_again(inspection_id)
        self._live.publish(inspection_id, "queued", Progress(0, None, None, None))
        self.wake()

    def _work(self) -> None:
        while not self._stopping:
            try:
                run = self._next_run()
                if run is not None:
                    self._run_in_slot(run)
            except Exception:
                # Such as a database that takes no writes: the row still says `running`, so the
                # next start tracks it again; meanwhile the slot serves others.
                logger.exception("A tracking slot met a fault of the server.")
                with self._changed:
                    self._changed.wait_for(lambda: self._stopping, _PAUSE_AFTER_FAULT_S)

    def _run_in_slot(self, run: _Run) -> None:
        try:
            self._run(run)
        finally:
            with self._changed:
                del self._runs[run.inspection.id]
            run.ended.set()

    def _next_run(self) -> _Run | None:
        """Wait for the oldest queued inspection; None when the server stops."""
        with self._changed:
            while not self._stopping:
                inspection = self._inspections.claim_oldest_queued()
                if inspection is not None:
                    run = self._runs[inspection.id] = _Run(inspection)
                    return run
                self._changed.wait()
        return None

    def _run(self, run: _Run) -> None:
        inspection = run.inspection
        logger.info("Inspection %s (%s): tracking starts.", inspection.id, inspection.name)
        self._tracks.begin(inspection.id)
        self._live.publish(inspection.id, "running", run.progress())
        outcome = self._follow(run)
        if outcome is None:
            self._tracks.forget(inspection.id)
            return
        self._tracks.finish(inspection.id, track_metadata(inspection))
        self._inspections.record_outcome(
            inspection.id, outcome, frames_done=run.frames_done, fps=run.fps, last=run.last
        )
        logger.info(
            "Inspection %s (%s): %s after %d frames. %s",
            inspection.id, inspection.name, outcome.status, run.frames_done,
            outcome.error_detail or outcome.warning or "",
        )  # fmt: skip
        self._live.publish(inspection.id, outcome.status, run.progress())

    def _follow(self, run: _Run) -> Outcome | None:
        """Start a child and drain it until it ends; None if the next start is to go on."""
        child = Child("app.jobs.tracker")
        try:
            with self._changed:
                run.child = child
                if run.stop is not None:
                    child.terminate()
            outcome = self._drain(run, child)
        except TimeoutError:
            child.kill()
            outcome = Outcome(
                "failed",
                "tracking_stalled",
                f"Tracking made no progress for {self._stall_s:g} s and was stopped.",
            )
        except (EOFError, BrokenPipeError):
            how = describe_exit(child.end())
            outcome = Outcome(
                "failed", "tracking_process_died", f"The tracking process died: {how}."
            )
        except msgspec.MsgspecError:
            logger.exception("The tracking process of %s sent nonsense.", run.inspection.id)
            child.kill()
            outcome = Outcome(
                "failed", "tracking_failed", "The tracking process gave no sensible answer."
            )
        finally:
            child.end()
        with self._changed:
            if run.stop == "shutdown" and outcome.status != "done":
                return None
            if run.stop == "cancelled" and outcome.status != "done":
                return Outcome("cancelled")
        return outcome

    def _drain(self, run: _Run, child: Child) -> Outcome:
        inspection = run.inspection
        video = self._folder.inspection(inspection.id) / inspection.video_file
        child.send(TrackRequest(str(video), inspection.rig, self._limits, self._pace))
        while True:
            message = self._messages.decode(child.receive(self._stall_s))
            match message:
                case Batch():
                    self._take(run, message)
                case Done():
                    return Outcome("done", warning=message.problem)
                case Failed():
                    if message.trace:
                        logger.error("Tracking %s: %s", inspection.id, message.trace)
                    return Outcome("failed", message.code, message.detail)

    def _take(self, run: _Run, batch: Batch) -> None:
        estimates = tuple(Estimate(*msgspec.structs.astuple(row)) for row in batch.rows)
        self._tracks.append(run.inspection.id, estimates)
        now = time.monotonic()
        with self._changed:
            run.frames_done += len(estimates)
            if run.first_batch is None:
                run.first_batch = (now, run.frames_done)
            elif now > run.first_batch[0]:
                run.fps = (run.frames_done - run.first_batch[1]) / (now - run.first_batch[0])
            run.last = estimates[-1]
            progress = run.progress()
        self._live.publish(run.inspection.id, "running", progress, estimates, batch.jpeg)


def _ask_to_stop(run: _Run, why: str) -> None:
    run.stop = run.stop or why
    if run.child is not None:
        run.child.terminate()


def track_metadata(inspection: Inspection) -> Mapping[str, object]:
    """Comment lines of a track file: where it comes from."""
    return {
        "inspection": inspection.id,
        "name": inspection.name,
        "video": inspection.source_filename,
        "video_sha256": inspection.source_sha256,
    }
