"""Health of the server: whether every part works, with reasons."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass

from app.errors import NotReady
from app.storage.storage import Storage
from app.tracking.films.queue import Tracking
from app.tracking.pictures.media import Media
from app.watched import Watched
from vo_core.errors import ChainageError

_CACHED_S = 2.0


@dataclass(frozen=True)
class Check:
    """The result for one part."""

    name: str
    ok: bool
    detail: str


class Health:
    """Checks the parts; the answer is cached for 2 s, as anyone may ask."""

    def __init__(
        self,
        storage: Storage,
        media: Media,
        tracking: Tracking,
        threads: Sequence[Watched],
    ) -> None:
        """Store the parts; without one of `threads` the server would not do all that it should."""
        self._database = storage.database
        self._folder = storage.folder
        self._blobs = storage.blobs
        self._media = media
        self._tracking = tracking
        self._threads = threads
        self._stopping = False
        self._lock = threading.Lock()
        self._checked_at = 0.0
        self._checks: list[Check] = []

    def ready(self) -> list[Check]:
        """Run all checks.

        Raises:
            NotReady: A check failed; the text says which and why.
        """
        if self._stopping:
            raise NotReady("server: It is shutting down.")
        # Concurrent callers do not each block a thread on a hanging database.
        if not self._lock.acquire(timeout=_CACHED_S):
            raise NotReady("server: The last check has not ended yet.")
        try:
            if time.monotonic() - self._checked_at > _CACHED_S:
                self._checks = [
                    self._writes(),
                    self._room(),
                    self._stores(),
                    self._workers(),
                    self._engine(),
                    self._version(),
                ]
                self._checked_at = time.monotonic()
            checks = self._checks
        finally:
            self._lock.release()
        failed = [f"{check.name}: {check.detail}" for check in checks if not check.ok]
        if failed:
            raise NotReady(" ".join(failed))
        return checks

    def stop(self) -> None:
        """Report not ready from now on; open requests are still answered."""
        self._stopping = True

    def _writes(self) -> Check:
        try:
            self._database.beat()
        except (ChainageError, OSError) as error:
            return Check("database", False, str(error))
        except Exception as error:  # the driver's errors share no base class with ours
            return Check("database", False, f"It accepts no writes ({type(error).__name__}).")
        return Check("database", True, "It accepts writes.")

    def _room(self) -> Check:
        free = self._folder.free_bytes()
        detail = f"{free / 2**30:.1f} GiB can still be used."
        return Check("disk", free > 0, detail if free > 0 else "The disk is nearly full.")

    def _stores(self) -> Check:
        try:
            self._blobs.check()
        except ChainageError as error:
            return Check("store", False, str(error))
        return Check("store", True, f"Films go to {self._blobs.name}, which accepts writes.")

    def _workers(self) -> Check:
        troubles = [trouble for thread in self._threads if (trouble := thread.trouble())]
        if troubles:
            return Check("workers", False, " ".join(troubles))
        media = "runs" if self._media.is_alive() else "starts when it is needed"
        return Check("workers", True, f"All threads work; the media process {media}.")

    def _engine(self) -> Check:
        """Describe what tracks the films; without it the server still shows and stores all else."""
        engine = self._tracking.engine_state()
        waiting = self._tracking.waiting()
        if engine.problem is None:
            return Check("tracking", True, f"{engine.workers} films at once; {waiting} wait.")
        return Check("tracking", True, f"{engine.problem} {waiting} films wait.")

    def _version(self) -> Check:
        stored = self._database.dialect
        name = stored.kind.lower()
        try:
            return Check(name, True, f"Version {stored.version()}. {stored.remark()}".rstrip())
        except ChainageError as error:
            return Check(name, False, str(error))
