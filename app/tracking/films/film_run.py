"""Follows the tracking of one film: one child process after another, until one has a result.

The same code runs in the server, in its own data folder, and on a worker of a cluster, in a scratch
folder (`work`), so that both give the same files to the byte.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import msgspec

from app.jobs.messages import Limits, Problem
from app.jobs.process import Child, Died, Refused, Stalled
from app.jobs.track.batches import Batch
from app.jobs.track.messages import Checkpoint, Passing, TrackRequest, Untracked
from app.storage.folder.files import Places
from app.storage.records.runs import Outcome
from app.tracking.films.journal import Journal, Resumption
from app.tracking.films.runs import Run, Runs

logger = logging.getLogger(__name__)

_MOST_DEATHS = 3
"""Tracking processes that may die in a row without a newer checkpoint; then the video is at
fault."""


class FilmTracker:
    """Tracks films; what it finds is in the tracks and walls of its runs, and in journals."""

    def __init__(
        self,
        folder: Places,
        runs: Runs,
        *,
        stall_s: float,
        pace: float | None = None,
        on_batch: Callable[[Batch], None] = lambda batch: None,
        on_checkpoint: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare the tracking.

        Args:
            folder: Where journal and checkpoint are kept.
            runs: Receive the results.
            stall_s: Seconds without progress after which a child is ended.
            pace: Most seconds of video tracked per second.
            on_batch: Called with all results, pictures included.
            on_checkpoint: Called whenever the results up to a checkpoint are on the disk.
        """
        self._folder = folder
        self._runs = runs
        self._stall_s = stall_s
        self._pace = pace
        self._on_batch = on_batch
        self._on_checkpoint = on_checkpoint

    def track(self, run: Run, video: Path, limits: Limits) -> Outcome | None:
        """Track a film, from its last checkpoint on if there is one.

        Args:
            run: Was added to the runs.
            video: The film.
            limits: For the run as a whole, over all its processes.
        Returns:
            How it ended; None if the run was asked to shut down and another will continue it.
        """
        first = 0 if run.frames is None else run.frames.first
        journal = Journal(self._folder, self._runs.unrolled, run.inspection, first)
        outcome = self._tracked(run, video, limits, journal)
        if outcome is not None and outcome.status == "failed" and run.frames is None:
            self._take_untracked(run, video, limits)
        if run.frames is not None:
            journal.finish()  # chunks are joined by everything that it has
        return outcome

    def _tracked(self, run: Run, video: Path, limits: Limits, journal: Journal) -> Outcome | None:
        """Start one child after another until one has a result."""
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
            request = self._request(run, video, limits, resumption)
            try:
                return self._follow(run, journal, request)
            except (Stalled, Died) as fault:
                deaths += 1
                code, detail = self._described(fault)
                logger.warning("Tracking %s: %s", run.inspection.id, detail)
                if deaths == _MOST_DEATHS:
                    return Outcome("failed", code, f"{detail} It was tried {deaths} times.")

    def _take_untracked(self, run: Run, video: Path, limits: Limits) -> None:
        """Give the frames that could not be tracked their rows, so that people can tag them."""
        rest = Untracked(run.frames_done, asdict(run.last) if run.last else None)
        request = TrackRequest(str(video), dict(run.inspection.rig), limits, untracked=rest)
        child = Child("app.jobs.track.tracker")
        try:
            self._runs.give_child(run, child)
            child.ask(
                request,
                Problem,
                stall_s=self._stall_s,
                part=Batch,
                on_part=lambda batch: self._runs.take(run, batch),
            )
        except (Died, Stalled, Refused) as fault:
            logger.warning("Inspection %s has no rows of its rest: %s", run.inspection.id, fault)
        finally:
            child.end()

    def _described(self, fault: Stalled | Died) -> tuple[str, str]:
        """Return code and sentence."""
        if isinstance(fault, Died):
            return "tracking_process_died", f"The tracking process died: {fault}."
        detail = f"Tracking made no progress for {self._stall_s:g} s and was stopped."
        return "tracking_stalled", detail

    def _follow(self, run: Run, journal: Journal, request: TrackRequest) -> Outcome | None:
        """Start a child and take its results until it ends; None if another run continues.

        Raises:
            Stalled, Died: The child has no result and was not asked to stop.
        """

        def take(part: Batch | Checkpoint | Passing) -> None:
            if isinstance(part, Batch):
                self._runs.take(run, part)
                self._on_batch(part)
                journal.note(part)
            elif isinstance(part, Checkpoint) and journal.keep(part):
                self._on_checkpoint()

        child = Child("app.jobs.track.tracker")
        try:
            self._runs.give_child(run, child)
            problem = child.ask(
                request,
                Problem,
                stall_s=self._stall_s,
                part=Batch | Checkpoint | Passing,
                on_part=take,
            )
            outcome = Outcome("done", warning=problem.sentence)
        except Died:
            if run.stop is None:
                raise
            outcome = Outcome("cancelled")
        except Refused as refusal:
            refusal.log(f"Tracking {run.inspection.id}")
            outcome = Outcome("failed", refusal.code, str(refusal))
        finally:
            child.end()
        stop = run.stop
        if outcome.status == "done" or stop is None:
            return outcome
        return None if stop == "shutdown" else Outcome("cancelled")

    def _request(
        self, run: Run, video: Path, limits: Limits, resumption: Resumption | None
    ) -> TrackRequest:
        inspection = run.inspection
        marks = self._runs.tracks.marks(inspection.id)
        rig = dict(inspection.rig)
        if resumption is None:
            return TrackRequest(str(video), rig, limits, self._pace, marks=marks, frames=run.frames)
        if limits.cpu_s is not None:
            rest_s = max(limits.cpu_s - round(resumption.cpu_s), 1)
            limits = msgspec.structs.replace(limits, cpu_s=rest_s)
        return TrackRequest(
            str(video),
            rig,
            limits,
            self._pace,
            str(resumption.checkpoint),
            str(resumption.journal),
            marks,
            run.frames,
        )
