"""Tracks films on a cluster of Dask distributed (`pip install 'chainage[cluster]'`).

The scheduler only carries specs, manifests and progress; films and results go through the blob
store. Whoever can reach a scheduler can run code on its workers, so it is reached by TLS with
certificates of both sides, or on this machine only.
"""

from __future__ import annotations

import logging
import secrets
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from app.burnt_in.readings import ReadFilm
from app.errors import EngineUnavailable, WorkerLost
from app.jobs.messages import Progress
from app.storage.blobs.blobs import Blobs
from app.storage.blobs.stores import blobs_at
from app.tracking.films.engines import EngineState
from app.tracking.films.run_files import RunFiles
from app.tracking.films.runs import Run, Runs
from app.tracking.films.work import IsStopped, Manifest, OnReport, Report, Spec, run
from app.tracking.pictures.counter_reading import CounterOrder, OnProgress, read_counter

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
        """Films that are submitted, in this order."""
        self._counters = 0
        """Counters that are being read."""
        self._known = EngineState("dask", 0)
        self._known_s = -_STATE_S

    def slots(self) -> int:
        """Return the number of threads of all workers, which is looked up if it is not known."""
        with self._lock:
            if time.monotonic() - self._known_s >= _STATE_S:
                self._known = self._looked_up()
                self._known_s = time.monotonic()
            return min(max(self._known.workers - self._counters, 0), self.most_slots)

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

    def read_counter(
        self, order: CounterOrder, is_stopped: IsStopped, report: OnProgress
    ) -> ReadFilm:
        """Have a counter read by a worker, see `counter_reading.read_counter`.

        Raises:
            WorkerLost: Its worker was lost.
            EngineUnavailable: The scheduler is gone, or has no worker.
        """
        with self._lock:
            client = self._client()
            self._counters += 1
        try:
            task = _Task(client, read_counter_on_worker, order, self._store)
            read = self._followed(
                task, client, is_stopped, lambda news: report(Progress(*news)), may_wait=True
            )
        finally:
            with self._lock:
                self._counters -= 1
        return msgspec.json.decode(read, type=ReadFilm)

    def _run(
        self, spec: Spec, is_stopped: IsStopped, report: OnReport, *, may_wait: bool
    ) -> Manifest:
        with self._lock:
            client = self._client()
            task = _Task(client, run_on_worker, spec, self._store)
            self._tasks.append(task)
        try:
            manifest = self._followed(
                task, client, is_stopped, lambda news: report(Report(*news)), may_wait=may_wait
            )
        finally:
            with self._lock:
                self._tasks.remove(task)
        return msgspec.json.decode(manifest, type=Manifest)

    def _followed(
        self,
        task: _Task,
        client: Client,
        is_stopped: IsStopped,
        hear: Callable[[tuple[Any, ...]], None],
        *,
        may_wait: bool,
    ) -> bytes:
        stopped_s: float | None = None
        try:
            while not task.is_done(_POLL_S):
                if (news := task.news) is not None:
                    hear(news)
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
            task.forget()

    def _require_worker(self, task: _Task, *, may_wait: bool) -> None:
        """Raise EngineUnavailable if there is no worker, or none for a task that may not wait."""
        slots = self.slots()
        if not self._known.workers:
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
    """One call of a function on the cluster; its answer is JSON."""

    def __init__(
        self,
        client: Client,
        work: Callable[[bytes, bytes, str], bytes],
        order: Spec | CounterOrder,
        store: Store,
    ) -> None:
        from distributed import Event

        self._client = client
        self.news: tuple[Any, ...] | None = None
        """The newest progress; None until a worker has begun."""
        # A key of its own: the scheduler would answer a known one with the result it remembers.
        self._topic = f"chainage-{secrets.token_hex(16)}"
        self._stop = Event(self._topic, client=client)
        client.subscribe_topic(self._topic, self._hear)
        self._future: Future[Any] = client.submit(
            work,
            msgspec.json.encode(order),
            msgspec.json.encode(store),
            self._topic,
            key=self._topic,
            pure=False,
        )
        self._ended = threading.Event()
        self._future.add_done_callback(lambda _: self._ended.set())

    def _hear(self, event: tuple[float, Any]) -> None:
        self.news = event[1]

    def is_done(self, timeout_s: float) -> bool:
        """Wait a while for the end."""
        return self._ended.wait(timeout_s)

    def stop(self) -> None:
        """Ask the worker to end the run where it is."""
        self._stop.set()

    def result(self) -> bytes:
        """Return the answer.

        Raises:
            WorkerLost: There is none.
        """
        from distributed import KilledWorker
        from distributed.comm.core import CommClosedError

        try:
            return bytes(self._future.result(timeout=_CONNECT_S))
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
    is_stopped, tell = _line_to_server(topic)
    reported_s = 0.0

    def report(progress: Report) -> None:
        nonlocal reported_s
        if time.monotonic() - reported_s >= _POLL_S:
            reported_s = time.monotonic()
            tell((progress.frames_done, progress.fps))

    tell((0, None))
    blobs = msgspec.json.decode(store, type=Store).opened()
    order = msgspec.json.decode(spec, type=Spec)
    return msgspec.json.encode(run(order, blobs, is_stopped=is_stopped, report=report))


def read_counter_on_worker(order: bytes, store: bytes, topic: str) -> bytes:
    """Read a counter in a worker process, and return the readings; both are JSON."""
    is_stopped, tell = _line_to_server(topic)
    read = read_counter(
        msgspec.json.decode(order, type=CounterOrder),
        msgspec.json.decode(store, type=Store).opened(),
        is_stopped=is_stopped,
        report=lambda progress: tell((progress.done, progress.total)),
    )
    return msgspec.json.encode(read)


def _line_to_server(topic: str) -> tuple[IsStopped, Callable[[tuple[Any, ...]], None]]:
    """Return whether the server has asked to stop, and what tells it how far the work is."""
    from distributed import Event, get_client, get_worker

    worker = get_worker()
    stop = Event(topic, client=get_client(timeout=_CONNECT_S))
    return stop.is_set, lambda news: worker.log_event(topic, news)
