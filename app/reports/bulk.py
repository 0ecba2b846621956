"""Orders of reports of many inspections, made in a thread while a person waits for them.

`bulk_archive` makes the file. It is kept for an hour, without a name: it is lost when the server
ends.
"""

from __future__ import annotations

import logging
import os
import tempfile
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import IO, Literal, cast

from app.errors import BulkExportNotFound, Busy
from app.reports.bulk_archive import Made, NotMade, Sources, Stopped, Wanted, write
from app.reports.report import Phrase, failure
from app.reports.reports import Reports
from app.storage.folder.files import DataFolder, full_disk_reported
from app.storage.records.inspections import InspectionStore
from app.tracking.worker import Worker
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

State = Literal["waiting", "running", "done", "failed", "cancelled"]
MOST_KEPT = 8
"""Orders that are kept; one that has ended makes room for a new one."""
MOST_OF_ONE = 2
"""Orders of one person that have not ended."""
KEPT_S = 3600.0
"""How long an order is kept after its end."""

_STOP_TIMEOUT_S = 30.0
_SWEEP_S = 60.0
_BLOCK = 2**20


@dataclass(frozen=True)
class Progress:
    """How far an order is."""

    id: str
    state: State
    done: int
    """Inspections that are in the archive or in the document; the total of these steps follows."""
    total: int
    present: str | None
    """Name of the inspection whose reports are being made."""
    not_made: tuple[NotMade, ...]
    size: int | None
    """Bytes of the archive, once it is whole."""
    filename: str | None
    """What the archive is called, once it is whole."""
    written: int
    """Bytes that are written so far."""
    detail: str | None
    """Why it failed, in the language of the order."""


@dataclass
class _Order:
    wanted: Wanted
    who: str
    progress: Progress
    file: IO[bytes] | None = None
    """The archive, without a name: it ends with the process."""
    made: Made | None = None
    """What the file is, once it is whole."""
    ended_s: float | None = None
    """When it ended, of `time.monotonic`."""
    is_cancelled: threading.Event = field(default_factory=threading.Event)


class BulkExports(Worker):
    """Makes one archive at a time, in the order in which they are wanted."""

    def __init__(
        self,
        inspections: InspectionStore,
        reports: Reports,
        clip_of: Callable[[str, str], bytes],
        folder: DataFolder,
    ) -> None:
        super().__init__("bulk-export", stop_timeout_s=_STOP_TIMEOUT_S)
        self._sources = Sources(inspections, reports, folder.root, folder.require_room, clip_of)
        self._orders: dict[str, _Order] = {}
        self._waiting: deque[_Order] = deque()

    def order(self, wanted: Wanted, who: str) -> Progress:
        """Put an order at the end of the queue; ended ones of the same person go first.

        Raises:
            Busy: Too many orders, of this person or of all, have not ended yet.
        """
        progress = Progress(
            uuid.uuid4().hex, "waiting", 0, wanted.steps, None, (), None, None, 0, None
        )
        with self._changed:
            self._make_room_for(who)
            order = self._orders[progress.id] = _Order(wanted, who, progress)
            self._waiting.append(order)
        self.wake()
        return progress

    def progress(self, order_id: str) -> Progress:
        """Return how far an order is.

        Raises:
            BulkExportNotFound: No order has this id.
        """
        with self._changed:
            order = self._order(order_id)
            written = os.fstat(order.file.fileno()).st_size if order.file else 0
            return replace(order.progress, written=written)

    def archive(self, order_id: str) -> tuple[Iterator[bytes], int, Made]:
        """Return the archive in pieces, its bytes, and what it is; several may read the same one
        at once.

        Raises:
            BulkExportNotFound: No order has this id, or its archive is not whole.
        """
        with self._changed:
            order = self._order(order_id)
            file, size, made = order.file, order.progress.size, order.made
            if file is None or size is None or made is None:
                raise BulkExportNotFound("This archive is not made yet.")
            # Its own handle stays valid when the order makes room for another.
            own = os.fdopen(os.dup(file.fileno()), "rb")
        return _blocks(own), size, made

    def cancel(self, order_id: str) -> None:
        """Stop an order and delete its archive.

        Raises:
            BulkExportNotFound: No order has this id.
        """
        with self._changed:
            order = self._order(order_id)
            order.is_cancelled.set()
            if order in self._waiting:
                self._waiting.remove(order)
            if order.progress.state != "running":  # else the thread does so
                _end(order, "cancelled")

    def _make_room_for(self, who: str) -> None:
        unfinished = [o for o in self._orders.values() if o.ended_s is None]
        if sum(order.who == who for order in unfinished) >= MOST_OF_ONE:
            raise Busy(f"{MOST_OF_ONE} bulk exports of yours are being made; wait for one to end.")
        if len(unfinished) >= MOST_KEPT:
            raise Busy(f"{MOST_KEPT} bulk exports are being made; try again later.")
        ended = [o for o in self._orders.values() if o.ended_s is not None]
        own = [order for order in ended if order.who == who]
        excess = max(0, len(self._orders) + 1 - MOST_KEPT)
        others = [order for order in ended if order.who != who][: max(0, excess - len(own))]
        self._drop(own + others)

    def _drop(self, orders: Sequence[_Order]) -> None:
        for order in orders:
            _close(order)
            del self._orders[order.progress.id]

    def _drop_old(self) -> None:
        old_s = time.monotonic() - KEPT_S
        ended = [o for o in self._orders.values() if o.ended_s is not None and o.ended_s < old_s]
        self._drop(ended)

    def _order(self, order_id: str) -> _Order:
        found = self._orders.get(order_id)
        if found is None:
            raise BulkExportNotFound(
                "There is no such export: the server was started again, or newer exports have "
                "replaced it. Make it again."
            )
        return found

    def _step(self) -> float:
        with self._changed:
            self._drop_old()
            if not self._waiting:
                return _SWEEP_S
            order = self._waiting.popleft()
        try:
            self._make(order)
        except ChainageError as error:
            self._fail(order, failure(error))
        except Exception:
            logger.exception("A bulk export failed.")
            self._fail(order, Phrase("failure.internal_error"))
        return 0.0

    def _fail(self, order: _Order, reason: Phrase) -> None:
        with self._changed:
            _end(order, "failed")
            order.progress = replace(order.progress, detail=order.wanted.words.phrase(reason))

    def _make(self, order: _Order) -> None:
        with self._changed:
            order.progress = replace(order.progress, state="running")
        with full_disk_reported():
            # Not where temporary files usually go: that may be memory.
            file = tempfile.TemporaryFile(dir=self._sources.scratch)  # noqa: SIM115  (kept open)
            order.file = file
            watched = _OrderWatcher(order, self._changed, lambda: self._stopping)
            try:
                order.made = write(
                    order.wanted, self._sources, cast(IO[bytes], _Guarded(file, watched)), watched
                )
                watched.check()
            except Stopped:
                with self._changed:
                    _end(order, "cancelled")
                return
            file.flush()
        with self._changed:
            if order.is_cancelled.is_set():
                _end(order, "cancelled")
                return
            size = os.fstat(file.fileno()).st_size
            order.progress = replace(
                order.progress, state="done", present=None, size=size, filename=order.made.filename
            )
            order.ended_s = time.monotonic()


class _OrderWatcher:
    """The order as the one who waits for it sees it; it stops the work."""

    def __init__(
        self, order: _Order, changed: threading.Condition, is_stopping: Callable[[], bool]
    ) -> None:
        self._order = order
        self._changed = changed
        self._is_stopping = is_stopping

    def begin(self, name: str) -> None:
        """Show the name of the inspection; stop where the order is cancelled."""
        self.check()
        self._show(present=name)

    def done(self) -> None:
        """Count the step."""
        self._show(done=self._order.progress.done + 1)

    def miss(self, missing: NotMade) -> None:
        """Add what could not be made."""
        self._show(not_made=(*self._order.progress.not_made, missing))

    def check(self) -> None:
        """Raise Stopped where nobody waits for the file any more."""
        if self._order.is_cancelled.is_set() or self._is_stopping():
            raise Stopped

    def _show(self, **changes: object) -> None:
        with self._changed:
            self._order.progress = replace(self._order.progress, **changes)  # type: ignore[arg-type]


class _Guarded:
    """The file of an order: a large film in it stops where the order is cancelled."""

    def __init__(self, file: IO[bytes], watched: _OrderWatcher) -> None:
        self._file = file
        self._watched = watched
        self.seek, self.tell, self.flush = file.seek, file.tell, file.flush

    def write(self, content: bytes) -> int:
        """Write the content, or raise Stopped."""
        self._watched.check()
        return self._file.write(content)


def _end(order: _Order, state: State) -> None:
    order.progress = replace(order.progress, state=state, present=None, size=None, filename=None)
    order.ended_s = time.monotonic()
    _close(order)


def _close(order: _Order) -> None:
    file, order.file = order.file, None
    if file is not None:
        with suppress(OSError):  # a full disk does not take what it still holds; nobody reads it
            file.close()


def _blocks(file: IO[bytes]) -> Iterator[bytes]:
    at = 0
    with file:  # a position of its own, because duplicates of a file share one
        while block := os.pread(file.fileno(), _BLOCK, at):
            yield block
            at += len(block)
