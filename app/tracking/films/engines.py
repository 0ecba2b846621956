"""Engines that track films: the child processes of this machine, or a cluster (`dask_engine`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from app.burnt_in.readings import ReadFilm
from app.jobs.messages import Limits
from app.storage.storage import Storage
from app.tracker import tracker
from app.tracking.films.film_run import FilmTracker
from app.tracking.films.runs import Run, Runs
from app.tracking.films.work import IsStopped, Manifest, OnReport, Spec, run
from app.tracking.pictures.counter_reading import CounterOrder, OnProgress, read_counter
from app.tracking.pictures.film_files import FilmFiles


@dataclass(frozen=True)
class EngineState:
    """What an engine can do now."""

    kind: str
    """local or dask."""
    workers: int
    """Films that it tracks at once."""
    dashboard_url: str | None = None
    """Page of the engine itself."""
    problem: str | None = None
    """A sentence that says why it tracks nothing."""


class Engine(Protocol):
    """Tracks films, each in the thread that asks for it."""

    most_slots: int
    """Films that it may ever track at once."""

    def slots(self) -> int:
        """Return the films that it can track at once now."""

    def state(self) -> EngineState:
        """Return its state for people."""

    def track(self, run: Run) -> Manifest | None:
        """Track the film of a run; None if the run was asked to shut down.

        Raises:
            WorkerLost: A worker was lost; another try continues from its checkpoint.
            EngineUnavailable: There is nobody who could track it now.
        """

    def run(self, spec: Spec, is_stopped: IsStopped, report: OnReport) -> Manifest:
        """Run a spec, see `work.run`; raises the errors of `track`."""

    def read_counter(
        self, order: CounterOrder, is_stopped: IsStopped, report: OnProgress
    ) -> ReadFilm:
        """Read a burnt-in counter, see `read_counter`; raises the errors of `track` too."""

    def close(self) -> None:
        """Let go of everything."""


class Pool:
    """Tracks in child processes of this machine; the results grow in the data folder."""

    def __init__(
        self,
        storage: Storage,
        runs: Runs,
        *,
        slots: int,
        limits: Limits,
        stall_s: float,
        pace: float | None,
    ) -> None:
        self.most_slots = slots
        self._folder = storage.folder
        self._blobs = storage.blobs
        self._films = FilmFiles(storage.blobs, storage.folder)
        self._limits = limits
        self._tracker = FilmTracker(storage.folder, runs, stall_s=stall_s, pace=pace)

    def slots(self) -> int:
        """Return the number of child processes that may track at once."""
        return self.most_slots

    def state(self) -> EngineState:
        """Return its state for people."""
        return EngineState("local", self.most_slots)

    def track(self, run: Run) -> Manifest | None:
        """Track the film of a run, whose results grow where everybody sees them."""
        self._folder.inspection(run.inspection.id).mkdir(exist_ok=True)  # for the journal
        with self._films.film_at(run.film).local() as video:
            outcome = self._tracker.track(run, video, self._limits)
        if outcome is None:
            return None
        return Manifest(outcome, run.frames_done, run.fps, run.last, tracker())

    def run(self, spec: Spec, is_stopped: IsStopped, report: OnReport) -> Manifest:
        """Run a spec in this thread; a child process does the work."""
        return run(spec, self._blobs, is_stopped=is_stopped, report=report)

    def read_counter(
        self, order: CounterOrder, is_stopped: IsStopped, report: OnProgress
    ) -> ReadFilm:
        """Read a counter in this thread; a child process does the work."""
        return read_counter(order, self._blobs, is_stopped=is_stopped, report=report)

    def close(self) -> None:
        """Nothing is open."""
