"""A Dask cluster of real processes with TLS, which a test may kill one by one."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from builders import PATIENCE_S
from distributed import Client
from distributed.security import Security
from ports import free_port

CERTIFICATES = Path(__file__).parent.parent / "docker" / "certificates.sh"
_FAST = {
    # A worker that is killed is missed at once, as its connection breaks; one that hangs is not
    # what is tested.
    "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "5s",
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "30s",
    "DASK_DISTRIBUTED__COMM__RETRY__COUNT": "0",
}


class Cluster:
    """A scheduler on a port of its own, and its workers."""

    def __init__(self, scratch: Path) -> None:
        self._scratch = scratch
        self.port = free_port()
        self.address = f"tls://127.0.0.1:{self.port}"
        scratch.mkdir(parents=True, exist_ok=True)
        shutil.copy(CERTIFICATES, scratch)
        subprocess.run(["bash", scratch / CERTIFICATES.name], check=True, capture_output=True)
        secrets = scratch / "secrets"
        self.ca, self.cert, self.key = (
            secrets / name for name in ("ca.crt", "node.crt", "node.key")
        )
        self.workers: list[subprocess.Popen[bytes]] = []
        self.start_scheduler()

    @property
    def settings(self) -> dict[str, object]:
        """Settings of a server that uses it."""
        return {
            "dask": self.address,
            "dask_ca": self.ca,
            "dask_cert": self.cert,
            "dask_key": self.key,
        }

    def start_scheduler(self) -> None:
        self.scheduler = self._started(
            "scheduler", "--host", "127.0.0.1", "--protocol", "tls", "--port", str(self.port)
        )

    def add_worker(self) -> subprocess.Popen[bytes]:
        worker = self._started(
            "worker", self.address, "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1",
            "--death-timeout", str(PATIENCE_S), "--local-directory", str(self._scratch),
        )  # fmt: skip
        self.workers.append(worker)
        return worker

    def wait_for_workers(self, count: int) -> None:
        security = Security(
            tls_ca_file=str(self.ca), tls_client_cert=str(self.cert), tls_client_key=str(self.key)
        )
        with Client(
            self.address, security=security, timeout=PATIENCE_S, set_as_default=False
        ) as client:
            client.wait_for_workers(count, timeout=PATIENCE_S)

    def stop(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.send_signal(signal.SIGKILL)
            process.wait()

    def _started(self, *command: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [
                *(sys.executable, "-m", "dask", *command, "--no-dashboard"),
                *("--tls-ca-file", self.ca, "--tls-cert", self.cert, "--tls-key", self.key),
            ],
            env=os.environ | _FAST,
            stderr=subprocess.DEVNULL,
        )


@contextmanager
def cluster(scratch: Path, workers: int) -> Iterator[Cluster]:
    """A running cluster."""
    made = Cluster(scratch)
    try:
        for _ in range(workers):
            made.add_worker()
        made.wait_for_workers(workers)
        yield made
    finally:
        made.stop()
