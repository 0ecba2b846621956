"""Live inspections: each has its own thread and camera process, and ends as a video file.

The camera process writes the recording, which survives a crash of the process or of the server:
when a process dies, another continues the same file, and a recording that a server left open is
finalised at its next start and tracked as a file.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from app.errors import DiskFull, MediaFailed, MediaTimeout, StoreUnavailable
from app.jobs.live.finaliser import FinaliseRequest
from app.jobs.live.messages import CameraState, CameraStatus, LiveRequest, shown
from app.jobs.live.reopener import ReopenRequest
from app.jobs.messages import Limits, Problem
from app.jobs.process import Child, ChildFault, Refused, ask_about_media
from app.jobs.track.batches import Batch
from app.jobs.track.parts import Between, Mark
from app.logs import about
from app.settings import MIB
from app.storage.blobs import keys
from app.storage.database.tables import Inspection
from app.storage.folder.files import sha256_of, sync_folder
from app.storage.records.inspections import InspectionStore
from app.storage.records.runs import Outcome, RunStore
from app.storage.storage import Storage
from app.tracker import tracker
from app.tracking.cameras import LiveSource
from app.tracking.films.queue import Tracking
from app.tracking.films.runs import Run, Runs, TrackedFilm, track_metadata
from app.tracking.live import Live, Update
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.videos import video_columns
from app.tracking.tracks import Tracks
from vo_core.errors import UnreadableVideo
from vo_core.video_info import VideoInfo

logger = logging.getLogger(__name__)

_SILENCE_S = 20.0
"""Silence after which a camera process counts as hung; it reports twice a second."""
_FINALISING_S = 1800.0
_STOP_TIMEOUT_S = 15.0
_PAUSE_AFTER_FAULT_S = 5.0
_MOST_DEATHS, _DEATHS_WITHIN_S = 5, 60.0
_HOPELESS = (
    "camera_unreachable", "rig_video_mismatch", "unreadable_video", "invalid_rig",
    "no_wall_in_view",
)  # fmt: skip
_ROOM_TO_REMUX = 1.05
"""Free space needed for the MP4, relative to the recording."""
AFTER_A_CRASH = "The server ended during the recording; everything recorded until then is kept."
_UNTRACKED = (
    "The camera process ended before it had tracked everything; the recording is tracked again."
)


_NO_PICTURE = "The camera delivered no picture before the end."


@dataclass
class LiveRun(Run):
    """A run with a camera."""

    source: LiveSource | None = None
    zero_s: float | None = None
    """Time 0 of the recording, by `time.monotonic`."""
    between: Between | None = None
    """The robot's movement since the earlier run that this one continues."""
    first_frame: int = 0
    dropped_before: int = 0
    reconnects_before: int = 0
    """Reconnections of earlier processes of this run."""
    patience_s: float = 60.0
    """Time allowed for finalising; an hour of film takes some seconds."""

    def end_child(self, child: Child) -> None:
        """Ask the child to end, as it must still track what was captured and close the file."""
        try:
            child.send(None)
        except OSError:  # it has died; its thread will notice
            logger.debug("A camera process had ended before it was asked to.")


class Recorder:
    """Starts, follows and ends live inspections."""

    def __init__(
        self,
        storage: Storage,
        tracks: Tracks,
        runs: Runs,
        live: Live,
        tracking: Tracking,
        *,
        memory_bytes: int,
    ) -> None:
        self._inspections = InspectionStore(storage.database)
        self._store = RunStore(storage.database)
        self._folder = storage.folder
        self._blobs = storage.blobs
        self._films = FilmFiles(storage.blobs, storage.folder)
        self._tracks = tracks
        self._runs = runs
        self._live = live
        self._tracking = tracking
        self._memory_bytes = memory_bytes
        self._reserve_bytes = storage.folder.reserve_bytes
        self.restarts = 0
        """Number of camera processes that died."""
        self._lock = threading.Lock()
        self._threads: set[threading.Thread] = set()
        self._stopping = threading.Event()

    def start(self) -> None:
        """Recover the recordings that were open when their server ended; on a full disk later."""
        try:
            self._adopt()
        except DiskFull as full:
            logger.warning("Recordings that were open are recovered later: %s", full)
            self._in_thread(self._adopt_later, _PAUSE_AFTER_FAULT_S, None)

    def _adopt(self) -> None:
        known = [run.inspection.id for run in self._runs.all()]
        for inspection in self._store.open_recordings():
            if inspection.id not in known:
                self._in_thread(self._recover, inspection, inspection.id)

    def _adopt_later(self, pause_s: float) -> None:
        if not self._stopping.wait(pause_s):
            self.start()

    def stop(self) -> None:
        """End the recordings; they are finalised and tracked at the next start."""
        self._stopping.set()
        self._runs.ask_all_to_stop("shutdown")
        with self._lock:
            threads = list(self._threads)
        deadline = time.monotonic() + _STOP_TIMEOUT_S
        for thread in threads:
            thread.join(max(deadline - time.monotonic(), 0.0))

    def begin(
        self, inspection: Inspection, source: LiveSource, between: Between | None = None
    ) -> None:
        """Start recording and tracking; `between` continues an earlier run."""
        camera = CameraStatus(False, 0, 0, 0.0, None, free_bytes=self._room_for_more())
        run = LiveRun(
            TrackedFilm.from_row(inspection), source=source, camera=camera, between=between
        )
        self._runs.add(run)
        self._in_thread(self._run, run, inspection.id)

    def finish(self, inspection_id: str) -> None:
        """Let a recording end; what was captured is tracked, and its film made, meanwhile."""
        recording = self._runs.running(inspection_id)
        if recording is None or recording.camera is None:
            return
        if self._runs.ask_to_stop(inspection_id, "finished") is not None:
            recording.camera = msgspec.structs.replace(recording.camera, is_ending=True)

    def reopen(self, video: Path, recording: Path) -> None:
        """Make a finished film a recording again; the film stays.

        Raises:
            DiskFull: There is no room for both files.
            MediaFailed: The film cannot be converted.
        """
        size = video.stat().st_size
        self._folder.require_room(round(_ROOM_TO_REMUX * size))
        limits = Limits(self._memory_bytes, file_bytes=self._folder.disk_bytes())
        try:
            with Child("app.jobs.live.reopener") as child:
                ask_about_media(
                    child,
                    ReopenRequest(str(video), str(recording), limits),
                    type(None),
                    work="Going on with the recording",
                    stall_s=_FINALISING_S,
                )
        except (MediaFailed, MediaTimeout, UnreadableVideo) as failure:
            recording.unlink(missing_ok=True)
            logger.warning("%s cannot be continued: %s", video, failure)
            raise MediaFailed(f"The film cannot be continued. {failure}") from failure
        sync_folder(recording.parent)

    def _in_thread(self, work: Any, subject: Any, inspection_id: str | None) -> None:
        def guarded() -> None:
            try:
                with about(inspection_id):
                    work(subject)
            except Exception:
                # For example the database accepts no writes: the row still says `running`, so that
                # the next start recovers it.
                logger.exception("A fault of the server interrupted a live inspection.")
            finally:
                with self._lock:
                    self._threads.discard(thread)

        thread = threading.Thread(target=guarded, name="recorder", daemon=True)
        with self._lock:
            self._threads.add(thread)
        thread.start()

    def _run(self, run: LiveRun) -> None:
        inspection = run.inspection
        try:
            logger.info("Inspection %s (%s): recording starts.", inspection.id, inspection.name)
            if run.between is None:
                self._runs.begin(run)
            else:
                self._runs.go_on(run)
                run.first_frame = run.frames_done
            outcome = self._captured(run)
            if run.stop == "shutdown" or not self._runs.keep_end(
                run, partial(self._end, run, outcome)
            ):
                self._tracks.forget(inspection.id)
        finally:
            self._runs.remove(run)

    def _captured(self, run: LiveRun) -> Outcome:
        """Follow one camera process after another until the recording ends."""
        deaths: deque[float] = deque(maxlen=_MOST_DEATHS)
        while True:
            child = Child("app.jobs.live.camera")
            try:
                return self._drained(run, child)
            except ChildFault as fault:
                if isinstance(fault, Refused):
                    if fault.code in _HOPELESS:
                        return Outcome("failed", fault.code, str(fault))
                    fault.log(f"Recording {run.inspection.id}")
                logger.warning("The camera process of %s died: %s", run.inspection.id, fault)
                with self._lock:
                    self.restarts += 1
                outcome = self._after_death(run, deaths, str(fault))
                if outcome is not None:
                    return outcome
            finally:
                child.end()

    def _after_death(self, run: LiveRun, deaths: deque[float], how: str) -> Outcome | None:
        """Decide after a death: None to continue with another process."""
        if run.stop is not None:
            return Outcome("queued", warning=_UNTRACKED)
        now = time.monotonic()
        is_hopeless = len(deaths) == _MOST_DEATHS and now - deaths[0] < _DEATHS_WITHIN_S
        deaths.append(now)
        assert run.source is not None  # noqa: S101  (given by begin)
        if is_hopeless or run.source.camera.kind == "file":
            return Outcome(
                "failed",
                "tracking_process_died",
                f"The camera process died: {how}. What it recorded is kept; try again to track it.",
            )
        if run.camera is not None:
            run.dropped_before = run.camera.dropped
            run.reconnects_before = run.camera.reconnects
        return None

    def _drained(self, run: LiveRun, child: Child) -> Outcome:

        def take(part: Batch | CameraState) -> None:
            if isinstance(part, Batch):
                self._runs.take(run, part)
            else:
                self._note(run, part)

        problem = child.ask(
            self._request(run),
            Problem,
            stall_s=_SILENCE_S,
            part=Batch | CameraState,
            on_sent=lambda: self._runs.give_child(run, child),
            on_part=take,
        )
        return Outcome("done", warning=problem.sentence)

    def _request(self, run: LiveRun) -> LiveRequest:
        assert run.source is not None  # noqa: S101  (given by begin)
        # The limit is the whole disk: space may be freed during the recording.
        limits = Limits(self._memory_bytes, file_bytes=self._folder.disk_bytes())
        return LiveRequest(
            run.source.camera,
            dict(run.inspection.rig),
            str(self._folder.recording(run.inspection.id)),
            str(self._folder.marks(run.inspection.id)),
            limits,
            self._reserve_bytes,
            asdict(run.last) if run.last else None,
            run.zero_s,
            self._left_out(run),
            run.between if run.frames_done == run.first_frame else None,
        )

    def _left_out(self, run: LiveRun) -> list[Mark]:
        """Return frames that have a row but are not recorded; later ones were lost with their
        process.
        """
        last = run.last.frame if run.last else -1
        marks = self._tracks.marks(run.inspection.id)
        return [mark for mark in marks if mark.kind == "left_out" and mark.frame <= last]

    def _room_for_more(self) -> int:
        return max(self._folder.free_bytes(), 0)

    def _note(self, run: LiveRun, state: CameraState) -> None:
        """Store the state of the camera, and notify the listeners if it was lost or came back."""
        before = run.camera
        run.zero_s = state.zero_s
        run.camera = msgspec.structs.replace(
            state.status,
            reconnects=run.reconnects_before + state.status.reconnects,
            dropped=run.dropped_before + state.status.dropped,
            free_bytes=self._room_for_more(),
            is_ending=run.stop is not None,
        )
        self._tracks.leave_out(run.inspection.id, state.left_out)
        if before is None or shown(before) != shown(run.camera):
            last = (run.last,) if run.last else ()
            self._live.publish(
                Update(run.inspection.id, "running", run.progress(), last, camera=run.camera)
            )

    def _end(self, run: LiveRun, outcome: Outcome) -> None:
        inspection = run.inspection
        marks = self._tracks.keep_marks(inspection.id)
        if any(mark.kind == "left_out" for mark in marks) and outcome.warning is None:
            outcome = replace(outcome, warning=_partly_recorded(marks))
        if run.stop == "cancelled" and outcome.status == "done":
            outcome = Outcome("cancelled", warning=outcome.warning)
        if outcome.status == "done" and run.frames_done == run.first_frame:
            outcome = replace(outcome, warning=outcome.warning or _NO_PICTURE)
        if outcome.status == "done" and not run.frames_done:
            outcome = Outcome("failed", "nothing_recorded", _NO_PICTURE)
        old = self._finalised(inspection)
        if outcome.status == "queued":
            self._queue(inspection, _UNTRACKED)
        else:
            row = self._inspections.get(inspection.id)
            self._tracks.finish(inspection.id, track_metadata(row))
            self._store.record_outcome(
                inspection.id,
                outcome,
                frames_done=run.frames_done,
                fps=run.fps,
                last=run.last,
                # Of a track that was continued the first part may be an older program's.
                tracked_with=row.tracked_with if run.first_frame else tracker(),
                moved_mm=run.moved_mm,
            )
            self._runs.publish_end(run, outcome)
        if old is not None:
            old.unlink(missing_ok=True)

    def _recover(self, inspection: Inspection) -> None:
        """Finalise a recording that a server left open, and queue it, once the store answers."""
        logger.info("Inspection %s (%s): recording recovered.", inspection.id, inspection.name)
        # From `record_video` on its row is that of an interrupted film, which a slot would track
        # beside the one that tracks it after `_queue`.
        run = Run(TrackedFilm.from_row(inspection))
        self._runs.add(run)
        try:
            while not self._stopping.is_set():
                try:
                    self._queue_recovered(inspection)
                except StoreUnavailable as away:
                    logger.warning("The recording of %s waits: %s", inspection.id, away)
                    self._stopping.wait(_PAUSE_AFTER_FAULT_S)
                else:
                    return
        finally:
            self._runs.remove(run)

    def _queue_recovered(self, inspection: Inspection) -> None:
        old = self._finalised(inspection)
        if not self._films.film_at(keys.film(inspection.id, keys.RECORDING)).exists():
            detail = "The server ended before anything was recorded."
            outcome = Outcome("failed", "nothing_recorded", detail)
            self._store.record_outcome(inspection.id, outcome, frames_done=0, fps=None, last=None)
        else:
            self._queue(inspection, AFTER_A_CRASH)
        if old is not None:
            old.unlink(missing_ok=True)

    def _queue(self, inspection: TrackedFilm | Inspection, warning: str) -> None:
        self._tracks.forget(inspection.id)
        self._store.queue_recording(inspection.id, warning)
        self._live.publish(Update(inspection.id, "queued"))
        self._tracking.wake()

    def _finalised(self, inspection: TrackedFilm | Inspection) -> Path | None:
        """Make the recording the inspection's film; return a file to delete once nobody reads it.

        A recording that cannot be finalised is the film as it is.
        """
        recording = self._folder.recording(inspection.id)
        if not recording.exists():
            return None
        mp4 = recording.with_name("recording.mp4")
        try:
            info = self._remuxed(recording, mp4)
        except (MediaFailed, MediaTimeout, UnreadableVideo) as failure:
            logger.warning("Recording of %s: %s", inspection.id, failure)
            self._blobs.adopt(keys.film(inspection.id, keys.RECORDING), recording)
            return None
        video = mp4 if mp4.exists() else recording
        columns = video_columns(info)
        columns["playable"] = columns["playable"] and video == mp4
        left_out = [m for m in self._tracks.marks(inspection.id) if m.kind == "left_out"]
        columns["frames"] += len(left_out)  # dropped frames have numbers too
        name = "video.mp4" if video == mp4 else keys.RECORDING
        is_spare = self._blobs.adopt(keys.film(inspection.id, name), video)
        self._store.record_video(
            inspection.id, name, columns, video.stat().st_size, sha256_of(video)
        )
        mp4.unlink(missing_ok=True)
        return recording if is_spare else None

    def _remuxed(self, recording: Path, mp4: Path) -> VideoInfo:
        size = recording.stat().st_size
        has_room = self._folder.free_bytes() > _ROOM_TO_REMUX * size
        limits = Limits(self._memory_bytes, file_bytes=round(_ROOM_TO_REMUX * size) + MIB)
        with Child("app.jobs.live.finaliser") as child:
            return ask_about_media(
                child,
                FinaliseRequest(str(recording), str(mp4) if has_room else None, limits),
                VideoInfo,
                work="Finalising the recording",
                stall_s=_FINALISING_S,
            )


def _partly_recorded(marks: Sequence[Mark]) -> str:
    left_out = sum(mark.kind == "left_out" for mark in marks)
    return f"The disk was full for a while: {left_out} frames were tracked but not recorded."
