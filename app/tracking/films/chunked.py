"""Tracks one long film in chunks at the same time, on slots that have nothing else to do.

Where results could not be joined, or a chunk fails, the film is tracked as a whole, so that its
track is never worse than that of one run.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future

from app.errors import MediaFailed, MediaTimeout
from app.jobs.track.chunks import mended, plan
from app.jobs.track.messages import FrameRange
from app.tracking.films.engines import Engine
from app.tracking.films.run_files import RunFiles
from app.tracking.films.runs import Run, Runs
from app.tracking.films.work import Manifest, Report

logger = logging.getLogger(__name__)

Persistent = Callable[[Run, Callable[[], Manifest | None]], Manifest | None]
"""Calls until there is a result; None if the run was asked to shut down."""


class Piece:
    """Work that any slot may do."""

    def __init__(self, work: Callable[[], Manifest | None]) -> None:
        self._work = work
        self._result: Future[Manifest | None] = Future()

    def do(self) -> None:
        """Do the work; a failure is that of the thread that waits for the result."""
        try:
            self._result.set_result(self._work())
        except BaseException as error:
            self._result.set_exception(error)

    def result(self) -> Manifest | None:
        """Wait until a slot has done the work, which ends when its run is stopped or hangs."""
        return self._result.result()


class Pieces:
    """Pieces that wait for a slot."""

    def __init__(self, changed: threading.Condition) -> None:
        """Use a condition that wakes the slots."""
        self._changed = changed
        self._waiting: deque[Piece] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def offer(self, pieces: Sequence[Piece]) -> None:
        """Let slots take these."""
        with self._changed:
            self._waiting.extend(pieces)
            self._changed.notify_all()

    def take(self, wanted: Piece | None = None) -> Piece | None:
        """Return a piece that nobody else has taken: this one or any; None if there is none."""
        with self._changed:
            if wanted is None:
                return self._waiting.popleft() if self._waiting else None
            if wanted not in self._waiting:
                return None
            self._waiting.remove(wanted)
            return wanted


class ChunkedTracking:
    """Tracks films in chunks by an engine."""

    def __init__(
        self, engine: Engine, runs: Runs, files: RunFiles, pieces: Pieces, persistent: Persistent
    ) -> None:
        self._engine = engine
        self._runs = runs
        self._files = files
        self._pieces = pieces
        self._persistent = persistent

    def ranges(self, run: Run, slots: int) -> list[FrameRange]:
        """Return the chunks of a film, or a single range if it is tracked as a whole.

        Args:
            run: The run of the film.
            slots: Number of slots for it. A run that was interrupted keeps its chunks.
        """
        frames = run.inspection.video.get("frames")
        whole = plan(None, 1)
        if len(plan(frames, 2)) == 1:
            return whole
        kept = self._files.plan(run)
        if kept is not None:
            return kept
        return whole if self._files.spec(run).marks else plan(frames, slots)

    def track(self, run: Run, ranges: Sequence[FrameRange]) -> Manifest | None:
        """Track a film in these chunks and join them; None if the run was asked to shut down."""
        logger.info("Inspection %s: in %d chunks.", run.inspection.id, len(ranges))
        self._runs.begin(run)
        while True:
            self._files.keep_plan(run, ranges)
            chunks = self._tracked(run, ranges)
            if chunks is None or run.stop == "shutdown":
                return None
            usable = _up_to_first_broken(chunks)
            if not usable or any(chunk.outcome.status == "failed" for chunk in chunks):
                return self._whole(run, "A chunk failed.")
            try:
                joined = self._joined(run, usable)
            except (MediaFailed, MediaTimeout) as error:
                return self._whole(run, str(error))
            if joined is None or joined.seam is None:
                return joined
            logger.info("Inspection %s: %s", run.inspection.id, joined.outcome.error_detail)
            if run.stop is not None:
                return self._joined(run, usable[: joined.seam + 1])
            ranges = mended(ranges, joined.seam, joined.lacks)

    def _whole(self, run: Run, why: str) -> Manifest | None:
        logger.warning("Inspection %s: tracked as a whole. %s", run.inspection.id, why)
        self._files.drop_plan(run)
        return self._persistent(run, lambda: self._engine.track(run))

    def _tracked(self, run: Run, ranges: Sequence[FrameRange]) -> list[Manifest] | None:
        progress = _Progress(self._runs, run, len(ranges))
        pieces = [
            Piece(lambda n=number, own=frames: self._chunk(run, own, progress.reporter(n)))  # type: ignore[misc]
            for number, frames in enumerate(ranges)
        ]
        self._pieces.offer(pieces)
        for piece in pieces:
            if self._pieces.take(piece) is not None:
                piece.do()
        found = [piece.result() for piece in pieces]
        return None if None in found else [each for each in found if each is not None]

    def _chunk(
        self, run: Run, frames: FrameRange, report: Callable[[Report], None]
    ) -> Manifest | None:
        spec = self._files.spec_of_chunk(run, frames)
        return self._persistent(
            run,
            lambda: self._engine.run(spec, lambda: run.stop is not None, report),
        )

    def _joined(self, run: Run, chunks: Sequence[Manifest]) -> Manifest | None:
        spec = self._files.spec_of_join(run, chunks)
        return self._persistent(
            run, lambda: self._engine.run(spec, lambda: False, lambda report: None)
        )


class _Progress:
    """Adds up the progress of the chunks of a run."""

    def __init__(self, runs: Runs, run: Run, count: int) -> None:
        self._runs = runs
        self._run = run
        self._lock = threading.Lock()
        self._chunks = [Report(0, None)] * count

    def reporter(self, number: int) -> Callable[[Report], None]:
        """Return what takes the reports of a chunk."""

        def report(news: Report) -> None:
            with self._lock:
                self._chunks[number] = news
                done = sum(each.frames_done for each in self._chunks)
                fps = sum(each.fps or 0.0 for each in self._chunks)
            total = self._run.inspection.video.get("frames") or done
            # Frames that two chunks share are counted once, as far as can be known.
            self._runs.report(self._run, min(done, total), fps or None)

        return report


def _up_to_first_broken(chunks: Sequence[Manifest]) -> list[Manifest]:
    """Return the chunks that one run would have tracked before it was stopped."""
    usable: list[Manifest] = []
    for chunk in chunks:
        if chunk.frames_done:
            usable.append(chunk)
        if not chunk.is_whole:
            break
    return usable
