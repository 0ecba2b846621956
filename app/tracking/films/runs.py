"""The inspections that are being tracked now, from files and from cameras."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from app.errors import Busy, DiskFull, StoreUnavailable
from app.jobs.live.messages import CameraStatus
from app.jobs.process import Child
from app.jobs.track.batches import Batch
from app.jobs.track.messages import FrameRange
from app.storage.database.tables import Inspection
from app.storage.records.runs import Outcome
from app.survey.distances.track_rows import estimate_at
from app.tracking.live import Live, Progress, Update
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

_PAUSE_S = 2.0
_WAITS_FOR_ROOM = (
    "The server's disk is full. The results are held in memory until there is room for them."
)


class TrackedFilm(msgspec.Struct, frozen=True):
    """An inspection as far as its tracking is concerned; see the columns of the same name."""

    id: str
    name: str
    rig: dict[str, Any]
    video: dict[str, Any]
    source_filename: str
    source_sha256: str

    @classmethod
    def from_row(cls, row: Inspection) -> TrackedFilm:
        """Take what is needed of a row."""
        return msgspec.convert(row, cls, from_attributes=True)


def track_metadata(film: TrackedFilm | Inspection) -> Mapping[str, object]:
    """Return the comment lines of a track file, which state its origin."""
    return {
        "inspection": film.id,
        "name": film.name,
        "video": film.source_filename,
        "video_sha256": film.source_sha256,
    }


@dataclass
class Run:
    """One inspection that is being tracked."""

    inspection: TrackedFilm
    film: str = ""
    """Key of the film in the blob store; empty for a camera."""
    child: Child | None = None
    stop: str | None = None
    """Reason to stop: "cancelled" or "finished" by a person, or "shutdown"."""
    frames_done: int = 0
    first_batch: tuple[float, int] | None = None
    """Arrival time and number of frames of the first batch."""
    fps: float | None = None
    last: Estimate | None = None
    camera: CameraStatus | None = None
    """None for a file."""
    ended: threading.Event = field(default_factory=threading.Event)
    patience_s: float = 10.0
    """Time allowed for its end."""
    hindrance: str | None = None
    """A sentence that says why it cannot go on, or why its end cannot be stored yet."""
    attempt: int | None = None
    """Number of the claim under which a file is tracked."""
    frames: FrameRange | None = None
    """Of a chunk of a film: its frames."""
    moved_mm: NDArray[np.float64] | None = None
    """At its end: by how much smoothing has moved each frame."""

    def progress(self) -> Progress:
        """Return the progress."""
        total = self.inspection.video.get("frames")
        eta_s = None
        if total and self.fps:
            eta_s = max(total - self.frames_done, 0) / self.fps
        return Progress(self.frames_done, total, self.fps, eta_s)

    def end_child(self, child: Child) -> None:
        """Make the child stop."""
        child.terminate()

    def ask_to_stop(self, why: str) -> None:
        """Stop as soon as possible; the first reason counts."""
        self.stop = self.stop or why
        if self.child is not None:
            self.end_child(self.child)


class Runs:
    """The runs by inspection, and the results of their children."""

    def __init__(self, tracks: Tracks, unrolled: Unrolled, live: Live) -> None:
        self.tracks = tracks
        self.unrolled = unrolled
        self._live = live
        self.changed = threading.Condition()
        """Guards the runs; notified when there may be something to do."""
        self._runs: dict[str, Run] = {}

    def add(self, run: Run) -> None:
        """Add a run that is about to begin."""
        with self.changed:
            self._runs[run.inspection.id] = run

    def all(self) -> list[Run]:
        """Return all runs."""
        with self.changed:
            return list(self._runs.values())

    def running(self, inspection_id: str) -> Run | None:
        """Return the run of an inspection; None unless it is running."""
        with self.changed:
            return self._runs.get(inspection_id)

    def begin(self, run: Run) -> None:
        """Start a run at its first frame and drop the results of an earlier run."""
        self.unrolled.begin(run.inspection.id)
        self._set_back(run, ())

    def resume(self, run: Run, found: Iterable[Batch]) -> None:
        """Resume a run at its checkpoint with the results up to it.

        The frames after the checkpoint are tracked again. The wall stays: painting it again gives
        the same tiles.
        """
        self._set_back(run, found)

    def go_on(self, run: Run) -> None:
        """Continue an ended run after its last frame; its track stays."""
        self.tracks.go_on(run.inspection.id)
        track = self.tracks.get(run.inspection.id)
        with self.changed:
            run.frames_done = len(track)
            run.last = estimate_at(track, len(track) - 1)
        self._publish(run)

    def _set_back(self, run: Run, found: Iterable[Batch]) -> None:
        self.tracks.begin(run.inspection.id)
        frames_done, last = 0, None
        for batch in found:
            self.tracks.append(run.inspection.id, batch)
            frames_done += len(batch.estimates)
            last = batch.estimates[-1] if batch.estimates else last
        with self.changed:
            run.frames_done, run.last = frames_done, last
            run.first_batch = run.fps = None
        self._publish(run)

    def remove(self, run: Run) -> None:
        """Remove a run that has ended."""
        with self.changed:
            del self._runs[run.inspection.id]
            self.changed.notify_all()
        self.unrolled.end(run.inspection.id)
        run.ended.set()

    def deleted(self, inspection_id: str) -> None:
        """Let a run that is still ending write nothing more."""
        with self.changed:
            if inspection_id in self._runs:
                self.unrolled.refuse(inspection_id)

    def give_child(self, run: Run, child: Child) -> None:
        """Assign a child to a run; it is stopped at once if the run is to stop."""
        with self.changed:
            run.child = child
            if run.stop is not None:
                run.end_child(child)

    def ask_to_stop(self, inspection_id: str, why: str) -> Run | None:
        """Ask a run to stop; return it, or None if there is none."""
        with self.changed:
            run = self._runs.get(inspection_id)
            if run is not None:
                run.ask_to_stop(why)
                self.changed.notify_all()
            return run

    def report(self, run: Run, frames_done: int, fps: float | None) -> None:
        """Publish the progress of a run whose results are elsewhere until its end."""
        with self.changed:
            run.frames_done, run.fps = frames_done, fps
        self._publish(run)

    def ask_all_to_stop(self, why: str) -> None:
        """Ask all runs to stop."""
        with self.changed:
            for run in self._runs.values():
                run.ask_to_stop(why)
            self.changed.notify_all()

    def publish_end(self, run: Run, outcome: Outcome) -> None:
        """Publish how a run has ended."""
        logger.info(
            "Inspection %s (%s): %s after %d frames. %s",
            run.inspection.id, run.inspection.name, outcome.status, run.frames_done,
            outcome.error_detail or outcome.warning or "",
        )  # fmt: skip
        self._publish(run, outcome.status)
        if run.moved_mm is not None:
            self._live.corrected(run.inspection.id)

    def _publish(self, run: Run, state: str = "running") -> None:
        self._live.publish(Update(run.inspection.id, state, run.progress(), camera=run.camera))

    def keep_end(self, run: Run, keep: Callable[[], None]) -> bool:
        """Call `keep` repeatedly while the disk is full or the object store is away; return False
        if the server stops before.

        The results stay in memory until then, so that nothing is lost.
        """
        run.moved_mm = self.tracks.moved_mm(run.inspection.id)
        while True:
            try:
                self.unrolled.catch_up(run.inspection.id)
                keep()
            except (Busy, DiskFull, StoreUnavailable) as hindrance:
                logger.warning("The end of inspection %s waits: %s", run.inspection.id, hindrance)
                with self.changed:
                    is_full = isinstance(hindrance, DiskFull)
                    run.hindrance = _WAITS_FOR_ROOM if is_full else str(hindrance)
                    if self.changed.wait_for(lambda: run.stop == "shutdown", _PAUSE_S):
                        return False
            else:
                return True

    def wait_hindered(self, run: Run, why: str, pause_s: float) -> bool:
        """Wait before another try; return False as soon as the run is asked to stop."""
        with self.changed:
            run.hindrance = why
            is_stopped = self.changed.wait_for(lambda: run.stop is not None, pause_s)
            run.hindrance = None
        return not is_stopped

    def take(self, run: Run, batch: Batch) -> None:
        """Store the results of a child and notify the listeners."""
        self.tracks.append(run.inspection.id, batch)
        self.unrolled.take(run.inspection.id, batch.tiles)
        if batch.smoothed and run.last and batch.smoothed[-1].frame == run.last.frame:
            run.last = batch.smoothed[-1]
        if not batch.estimates:  # the wall held back until the end, or smoothed rows
            return
        now = time.monotonic()
        with self.changed:
            run.frames_done += len(batch.estimates)
            if run.first_batch is None:
                run.first_batch = (now, run.frames_done)
            elif now > run.first_batch[0]:
                run.fps = (run.frames_done - run.first_batch[1]) / (now - run.first_batch[0])
            run.last = batch.estimates[-1]
        self._live.publish(
            Update(
                run.inspection.id,
                "running",
                run.progress(),
                tuple(batch.estimates),
                batch.jpeg,
                batch.captured_s,
                run.camera,
                batch.health[-1][1] if batch.health else None,
            )
        )
