"""The inspections that are being tracked now, from files and from cameras."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from app.errors import Busy, DiskFull, StoreUnavailable
from app.jobs.process import Child
from app.jobs.track.batches import Batch
from app.jobs.track.messages import FrameRange
from app.survey.track_rows import estimate_at
from app.tracking.live import CameraStatus, Live, Progress
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

_PAUSE_S = 2.0
_WAITS_FOR_ROOM = (
    "The server's disk is full. The results are held in memory until there is room for them."
)


class TrackedFilm(Protocol):
    """An inspection as far as its tracking is concerned; see the columns of the same name."""

    @property
    def id(self) -> str:
        """Id of the inspection."""

    @property
    def name(self) -> str:
        """Name of the inspection."""

    @property
    def rig(self) -> Mapping[str, Any]:
        """Camera, mount and pipe."""

    @property
    def video(self) -> Mapping[str, Any]:
        """Result of the probe."""

    @property
    def source_filename(self) -> str:
        """Name of the film given by the user."""

    @property
    def source_sha256(self) -> str:
        """Digest of the film."""


def track_metadata(film: TrackedFilm) -> Mapping[str, object]:
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
        self._tracks = tracks
        self._unrolled = unrolled
        self._live = live
        self.changed = threading.Condition()
        """Guards the runs; notified when there may be something to do."""
        self._runs: dict[str, Run] = {}

    def add(self, run: Run) -> None:
        """Add a run that is about to begin."""
        with self.changed:
            self._runs[run.inspection.id] = run

    def ids(self) -> list[str]:
        """Return the inspections that have a run."""
        with self.changed:
            return list(self._runs)

    def begin(self, run: Run) -> None:
        """Start a run at its first frame and drop the results of an earlier run."""
        self._unrolled.begin(run.inspection.id)
        self._set_back(run, ())

    def resume(self, run: Run, found: Iterable[Batch]) -> None:
        """Resume a run at its checkpoint with the results up to it.

        The frames after the checkpoint are tracked again. The wall stays: painting it again gives
        the same tiles.
        """
        self._set_back(run, found)

    def go_on(self, run: Run) -> None:
        """Continue an ended run after its last frame; its track stays."""
        self._tracks.go_on(run.inspection.id)
        track = self._tracks.get(run.inspection.id)
        with self.changed:
            run.frames_done = len(track)
            run.last = estimate_at(track, len(track) - 1)
            progress = run.progress()
        self._live.publish(run.inspection.id, "running", progress, camera=run.camera)

    def _set_back(self, run: Run, found: Iterable[Batch]) -> None:
        self._tracks.begin(run.inspection.id)
        frames_done, last = 0, None
        for batch in found:
            self._tracks.append(run.inspection.id, batch)
            frames_done += len(batch.estimates)
            last = batch.estimates[-1] if batch.estimates else last
        with self.changed:
            run.frames_done, run.last = frames_done, last
            run.first_batch = run.fps = None
            progress = run.progress()
        self._live.publish(run.inspection.id, "running", progress, camera=run.camera)

    def remove(self, run: Run) -> None:
        """Remove a run that has ended."""
        with self.changed:
            del self._runs[run.inspection.id]
            self.changed.notify_all()
        self._unrolled.end(run.inspection.id)
        run.ended.set()

    def deleted(self, inspection_id: str) -> None:
        """Let a run that is still ending write nothing more."""
        with self.changed:
            if inspection_id in self._runs:
                self._unrolled.refuse(inspection_id)

    def progress(self, inspection_id: str) -> Progress | None:
        """Return the progress of a running inspection."""
        with self.changed:
            run = self._runs.get(inspection_id)
            return run.progress() if run else None

    def last_estimate(self, inspection_id: str) -> Estimate | None:
        """Return the newest estimate of a running inspection."""
        with self.changed:
            run = self._runs.get(inspection_id)
            return run.last if run else None

    def camera(self, inspection_id: str) -> CameraStatus | None:
        """Return the state of a live inspection's camera; None unless it is running."""
        with self.changed:
            run = self._runs.get(inspection_id)
            return run.camera if run else None

    def speeds_fps(self) -> list[float]:
        """Return the frames per second of each run whose speed is known."""
        with self.changed:
            return [run.fps for run in self._runs.values() if run.fps is not None]

    def cameras(self) -> int:
        """Return the number of cameras being recorded."""
        with self.changed:
            return sum(run.camera is not None for run in self._runs.values())

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

    def stop_of(self, run: Run) -> str | None:
        """Return why a run was asked to stop; None if it was not."""
        with self.changed:
            return run.stop

    def report(self, run: Run, frames_done: int, fps: float | None) -> None:
        """Publish the progress of a run whose results are elsewhere until its end."""
        with self.changed:
            run.frames_done, run.fps = frames_done, fps
            progress = run.progress()
        self._live.publish(run.inspection.id, "running", progress)

    def ask_all_to_stop(self, why: str) -> None:
        """Ask all runs to stop."""
        with self.changed:
            for run in self._runs.values():
                run.ask_to_stop(why)
            self.changed.notify_all()

    def hindrance(self, inspection_id: str) -> str | None:
        """Return why a running inspection cannot go on, or its end cannot be stored yet; None if
        nothing prevents it.
        """
        with self.changed:
            run = self._runs.get(inspection_id)
            return run.hindrance if run else None

    def keep_end(self, run: Run, keep: Callable[[], None]) -> bool:
        """Call `keep` repeatedly while the disk is full or the object store is away; return False
        if the server stops before.

        The results stay in memory until then, so that nothing is lost.
        """
        while True:
            try:
                self._unrolled.catch_up(run.inspection.id)
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
        self._tracks.append(run.inspection.id, batch)
        self._unrolled.take(run.inspection.id, batch.tiles)
        if not batch.estimates:  # frames that a camera's run held back until its end
            return
        now = time.monotonic()
        with self.changed:
            run.frames_done += len(batch.estimates)
            if run.first_batch is None:
                run.first_batch = (now, run.frames_done)
            elif now > run.first_batch[0]:
                run.fps = (run.frames_done - run.first_batch[1]) / (now - run.first_batch[0])
            run.last = batch.estimates[-1]
            progress = run.progress()
        self._live.publish(
            run.inspection.id,
            "running",
            progress,
            tuple(batch.estimates),
            batch.jpeg,
            captured_s=batch.captured_s,
            camera=run.camera,
            health=batch.health[-1][1] if batch.health else None,
        )
