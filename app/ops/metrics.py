"""Metrics for monitoring systems, in the text format of Prometheus.

Every label has few values: routes keep their parameter names, and no inspection, token or address
is a label.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    Info,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from app.storage.database.tables import ENDED, STATES
from app.storage.records.alerts import AlertStore
from app.storage.records.inspections import InspectionStore
from app.storage.storage import Storage
from app.tracking.films.runs import Runs
from app.tracking.live import Event, Update
from app.tracking.pictures.media import Media
from app.tracking.recorder import Recorder
from app.viewer.scenes import Scenes

_SECONDS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0)


class Metrics:
    """Counts events, and reads the services when the metrics are requested."""

    def __init__(self, database: str) -> None:
        """Store the kind and version of the database."""
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        Info("chainage_build", "Versions.", registry=self._registry).info(
            {"version": version("chainage"), "database": database}
        )
        self._requests = Counter(
            "chainage_http_requests",
            "Answered requests; status 499 if the client disconnected before the answer.",
            ("method", "route", "status"),
            registry=self._registry,
        )
        self._request_seconds = Histogram(
            "chainage_http_request_duration_seconds",
            "Time from the request to the end of its answer.",
            ("method", "route"),
            buckets=_SECONDS,
            registry=self._registry,
        )
        self._write_seconds = Histogram(
            "chainage_database_write_duration_seconds",
            "Time of a transaction, with the sync of the disk.",
            buckets=_SECONDS,
            registry=self._registry,
        )
        self._websockets = Gauge(
            "chainage_websocket_clients",
            "Open web sockets.",
            ("kind",),
            registry=self._registry,
        )
        for kind in ("live", "viewer"):
            self._websockets.labels(kind)
        self._frames = Counter(
            "chainage_tracked_frames", "Frames that were tracked.", registry=self._registry
        )
        self._dropped = Counter(
            "chainage_live_frames_dropped",
            "Frames that cameras sent too fast to be tracked; they are recorded.",
            registry=self._registry,
        )
        self._lock = threading.Lock()
        self._frames_before: dict[str, int] = {}
        """Frames done so far, by running inspection."""
        self._dropped_before: dict[str, int] = {}
        """Frames dropped so far, by running live inspection."""

    def observe(self, services: WatchedServices) -> None:
        """Read these services at every request."""
        self._registry.register(services)

    def text(self) -> bytes:
        """Return all metrics as of now."""
        return generate_latest(self._registry)

    def count_request(self, method: str, route: str, status: int, duration_s: float) -> None:
        """Count a request that has ended."""
        self._requests.labels(method, route, str(status)).inc()
        self._request_seconds.labels(method, route).observe(duration_s)

    def websocket_clients(self, kind: str) -> Gauge:
        """Return the gauge of open web sockets of a kind, "live" or "viewer"."""
        return self._websockets.labels(kind)

    def count_write(self, duration_s: float) -> None:
        """Count a transaction of the database."""
        self._write_seconds.observe(duration_s)

    def on_event(self, event: Event) -> None:
        """Count an event."""
        if not isinstance(event, Update):
            return
        self._count_frames(event)
        if event.camera is not None:
            with self._lock:
                before = self._dropped_before.get(event.inspection_id, 0)
                self._dropped.inc(max(event.camera.dropped - before, 0))
                self._dropped_before[event.inspection_id] = event.camera.dropped
        if event.state in ENDED:
            with self._lock:
                self._dropped_before.pop(event.inspection_id, None)

    def _count_frames(self, event: Update) -> None:
        """Count the tracked frames: of a worker of a cluster only their number is known."""
        done = event.progress.frames_done
        with self._lock:
            before = self._frames_before.get(event.inspection_id, done)
            self._frames.inc(len(event.estimates) or max(done - before, 0))
            self._frames_before[event.inspection_id] = done
            if event.state != "running":
                del self._frames_before[event.inspection_id]


class WatchedServices(Collector):
    """Collects values from the services on request."""

    def __init__(
        self, storage: Storage, runs: Runs, media: Media, recorder: Recorder, scenes: Scenes
    ) -> None:
        self._inspections = InspectionStore(storage.database)
        self._folder = storage.folder
        self._runs = runs
        self._media = media
        self._recorder = recorder
        self._scenes = scenes
        self._alerts = AlertStore(storage.database)

    def describe(self) -> Iterator[Metric]:
        """Describe nothing in advance; else the registry would query services that are starting."""
        return iter(())

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics of each service."""
        counts = self._inspections.counts()
        by_status = GaugeMetricFamily(
            "chainage_inspections", "Inspections by status.", labels=["status"]
        )
        for status in STATES:
            by_status.add_metric([status], counts.get(status, 0))
        yield by_status
        yield _gauge("queue_length", "Videos that wait to be tracked.", counts.get("queued", 0))
        runs = self._runs.all()
        yield _gauge(
            "tracked_frames_per_second",
            "Frames tracked per second in all runs together.",
            sum(run.fps or 0.0 for run in runs),
        )
        cameras = sum(run.camera is not None for run in runs)
        yield _gauge("live_recordings", "Cameras that are recorded.", cameras)
        yield _gauge("viewer_servers", "3D views that are open.", self._scenes.count())
        yield _gauge("child_processes", "Processes that the server has started.", _children())
        yield _gauge(
            "disk_free_bytes",
            "Free space on the disk of the data folder, including the reserve.",
            self._folder.disk_free_bytes(),
        )
        restarts = CounterMetricFamily(
            "chainage_child_restarts",
            "Processes that had died or hung and were replaced.",
            labels=["kind"],
        )
        restarts.add_metric(["media"], self._media.restarts)
        restarts.add_metric(["camera"], self._recorder.restarts)
        yield restarts
        alerts = GaugeMetricFamily(
            "chainage_webhook_alerts",
            "Notifications of severe observations, by state.",
            labels=["state"],
        )
        for state, number in self._alerts.counts().items():
            alerts.add_metric([state], number)
        yield alerts


def _gauge(name: str, text: str, value: float) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"chainage_{name}", text, value=value)


def _children() -> int:
    """Count child processes: each is listed under the thread that started it until that thread
    ends.
    """
    found: set[str] = set()
    for task in Path(f"/proc/{os.getpid()}/task").glob("*"):
        with suppress(OSError):  # a thread that has just ended
            found.update((task / "children").read_text("ascii").split())
    return len(found)
