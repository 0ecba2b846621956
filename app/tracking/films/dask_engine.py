"""Tracks films on a cluster of Dask distributed (`pip install 'chainage[cluster]'`).

The scheduler only carries specs, manifests and progress; films and results go through the blob
store. Whoever can reach a scheduler can run code on its workers, so it is reached by TLS with
certificates of both sides, or on this machine only.
"""

from __future__ import annotations

import logging
import tempfile
import threading
import time
from concurrent.futures import CancelledError
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from app.errors import EngineUnavailable, WorkerLost
from app.storage.blobs.blobs import Blobs
from app.storage.blobs.stores import blobs_at
from app.tracking.films.engines import EngineState
from app.tracking.films.run_files import RunFiles
from app.tracking.films.runs import Run, Runs
from app.tracking.films.work import IsStopped, Manifest, OnReport, Report, Spec, run, sweep

if TYPE_CHECKING:
    from distributed import Client, Future

logger = logging.getLogger(__name__)

_MOST_SLOTS = 64
_CONNECT_S = 10.0
_POLL_S = 0.5
_STATE_S = 5.0
"""How long the number of workers is remembered."""
_NO_WORKER = "The cluster has no worker."
_STOPPING_S = 20.0
"""Time that a worker may take to end a run that was stopped."""


class Cluster(msgspec.Struct, frozen=True):
    """A scheduler, and the files of the certificates for it."""

    address: str
    """tls://host:port, or tcp:// on this machine."""
    ca: Path | None = None
    cert: Path | None = None
    key: Path | None = None


class Store(msgspec.Struct, frozen=True):
    """Where workers find films and leave results; credentials are in their own environment."""

    url: str | None
    """Of an object store; see `blobs_at`."""
    folder: str
    """The data folder, which workers must have under the same path if there is no URL."""

    def opened(self) -> Blobs:
        """Open the store in a worker."""
        if self.url is None:
            return blobs_at(None, Path(self.folder))
        return blobs_at(self.url, Path(tempfile.gettempdir()) / "chainage")


class DaskEngine:
    """Has films tracked by the workers of a cluster."""

    most_slots = _MOST_SLOTS

    def __init__(self, cluster: Cluster, store: Store, files: RunFiles, runs: Runs) -> None:
        """Prepare the engine; it connects when it is first used.

        Args:
            cluster: The scheduler.
            store: Where its workers find films and leave results.
            files, runs: Of the server.
        """
        self._cluster = cluster
        self._store = store
        self._files = files
        self._runs = runs
        self._lock = threading.Lock()
        self._connected: Client | None = None
        self._tasks: list[_Task] = []
        """What is submitted, in this order."""
        self._known = EngineState("dask", 0)
        self._known_s = -_STATE_S

    def slots(self) -> int:
        """Return the number of threads of all workers, which is looked up if it is not known."""
        with self._lock:
            if time.monotonic() - self._known_s >= _STATE_S:
                self._known = self._looked_up()
                self._known_s = time.monotonic()
            return min(self._known.workers, self.most_slots)

    def state(self) -> EngineState:
        """Return at once what was last known; every slot looks it up again and again."""
        return self._known

    def _looked_up(self) -> EngineState:
        try:
            client = self._client()
            info = client.scheduler_info(n_workers=-1)
        except (EngineUnavailable, OSError, TimeoutError) as gone:
            return EngineState("dask", 0, problem=str(gone))
        workers = sum(worker["nthreads"] for worker in info["workers"].values())
        problem = None if workers else _NO_WORKER
        return EngineState("dask", workers, client.dashboard_link, problem)

    def _client(self) -> Client:
        """Return the connection, made anew if it is lost; the caller holds the lock."""
        if self._connected is not None and self._connected.status == "running":
            return self._connected
        from distributed import Client
        from distributed.security import Security

        self._disconnect()
        cluster = self._cluster
        security = None
        if cluster.address.startswith("tls:"):
            security = Security(
                tls_ca_file=str(cluster.ca),
                tls_client_cert=str(cluster.cert),
                tls_client_key=str(cluster.key),
                require_encryption=True,
            )
        try:
            self._connected = Client(
                cluster.address,
                security=security,
                timeout=_CONNECT_S,
                set_as_default=False,
                name="chainage",
            )
        except (OSError, TimeoutError) as error:
            raise EngineUnavailable(
                f"The scheduler at {cluster.address} does not answer. It is tried again."
            ) from error
        return self._connected

    def _disconnect(self) -> None:
        if self._connected is not None:
            self._connected.close(timeout=_CONNECT_S)
            self._connected = None

    def track(self, run: Run) -> Manifest | None:
        """Track the film of a run; its results come at its end.

        Raises:
            EngineUnavailable: No worker is free for it, though one was when it was claimed.
        """
        self._runs.begin(run)
        manifest = self._run(
            self._files.spec(run),
            lambda: run.stop is not None,
            lambda news: self._runs.report(run, news.frames_done, news.fps),
            may_wait=False,
        )
        if run.stop == "shutdown" and not manifest.is_whole:
            return None
        self._runs.report(run, manifest.frames_done, manifest.fps)
        return manifest

    def run(self, spec: Spec, is_stopped: IsStopped, report: OnReport) -> Manifest:
        """Submit a spec and follow it.

        Raises:
            WorkerLost: Its worker was lost.
            EngineUnavailable: The scheduler is gone, or has no worker.
        """
        return self._run(spec, is_stopped, report, may_wait=True)

    def _run(
        self, spec: Spec, is_stopped: IsStopped, report: OnReport, *, may_wait: bool
    ) -> Manifest:
        with self._lock:
            client = self._client()
            task = _Task(client, spec, self._store)
            self._tasks.append(task)
        stopped_s: float | None = None
        try:
            while not task.is_done(_POLL_S):
                if (news := task.news) is not None:
                    report(news)
                self._require_worker(task, may_wait=may_wait)
                if client.status != "running":
                    raise EngineUnavailable(
                        f"The connection to the scheduler at {self._cluster.address} was lost. It "
                        "is tried again."
                    )
                if stopped_s is None and is_stopped():
                    task.stop()
                    stopped_s = time.monotonic()
                if stopped_s is not None and time.monotonic() - stopped_s > _STOPPING_S:
                    raise WorkerLost("The worker did not stop when it was asked to.")
            return task.result()
        finally:
            with self._lock:
                self._tasks.remove(task)
            task.forget()

    def _require_worker(self, task: _Task, *, may_wait: bool) -> None:
        """Raise EngineUnavailable if there is no worker, or none for a task that may not wait."""
        slots = self.slots()
        if not slots:
            raise EngineUnavailable(_NO_WORKER)
        with self._lock:
            first = sorted(self._tasks, key=lambda each: each.news is None)[:slots]
        if not may_wait and task.news is None and task not in first:
            raise EngineUnavailable("All workers of the cluster are busy.")

    def close(self) -> None:
        """Disconnect."""
        with self._lock:
            self._disconnect()


class _Task:
    """One run of one spec on the cluster."""

    def __init__(self, client: Client, spec: Spec, store: Store) -> None:
        from distributed import Event

        self._client = client
        self.news: Report | None = None
        """The newest progress; None until a worker has begun."""
        # A key of its own: the scheduler would answer a known one with the result it remembers.
        self._topic = f"chainage-{spec.id}-{time.time_ns()}"
        self._stop = Event(self._topic, client=client)
        client.subscribe_topic(self._topic, self._hear)
        self._future: Future[Any] = client.submit(
            run_on_worker,
            msgspec.json.encode(spec),
            msgspec.json.encode(store),
            self._topic,
            key=self._topic,
            pure=False,
        )
        self._ended = threading.Event()
        self._future.add_done_callback(lambda _: self._ended.set())

    def _hear(self, event: tuple[float, Any]) -> None:
        frames_done, fps = event[1]
        self.news = Report(frames_done, fps)

    def is_done(self, timeout_s: float) -> bool:
        """Wait a while for the end."""
        return self._ended.wait(timeout_s)

    def stop(self) -> None:
        """Ask the worker to end the run where it is."""
        self._stop.set()

    def result(self) -> Manifest:
        """Return the manifest.

        Raises:
            WorkerLost: There is none.
        """
        from distributed import KilledWorker
        from distributed.comm.core import CommClosedError

        try:
            return msgspec.json.decode(self._future.result(timeout=_CONNECT_S), type=Manifest)
        except (KilledWorker, CancelledError, CommClosedError, OSError, TimeoutError) as error:
            raise WorkerLost(f"A worker of the cluster was lost ({error}).") from error

    def forget(self) -> None:
        """Let the scheduler forget the task."""
        if self._client.status == "running":
            self._client.unsubscribe_topic(self._topic)
            self._client.cancel([self._future], force=True)
        self._future.release()


def run_on_worker(spec: bytes, store: bytes, topic: str) -> bytes:
    """Run a spec in a worker process, and return the manifest; both are JSON."""
    from distributed import Event, get_client, get_worker

    worker = get_worker()
    stop = Event(topic, client=get_client(timeout=_CONNECT_S))
    reported_s = 0.0

    def report(progress: Report) -> None:
        nonlocal reported_s
        if time.monotonic() - reported_s >= _POLL_S:
            reported_s = time.monotonic()
            worker.log_event(topic, (progress.frames_done, progress.fps))

    worker.log_event(topic, (0, None))
    sweep()
    blobs = msgspec.json.decode(store, type=Store).opened()
    order = msgspec.json.decode(spec, type=Spec)
    return msgspec.json.encode(run(order, blobs, is_stopped=stop.is_set, report=report))
