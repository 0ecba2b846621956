"""Orders of reports of many inspections, made in a thread while a person waits for them.

`bulk_archive` makes the file. It is kept for an hour, without a name: it is lost when the server
ends.
"""

from __future__ import annotations

import logging
import os
import tempfile
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import IO, Literal

from app.errors import BulkExportNotFound, Busy
from app.reports.bulk_archive import Made, Sources, Stopped, Wanted, Watcher, write
from app.reports.report import failure
from app.reports.reports import Reports
from app.storage.database import limits
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


class Order(Watcher):
    """One order, as the one who waits for it sees it."""

    def __init__(self, wanted: Wanted, who: str, is_stopping: Callable[[], bool]) -> None:
        super().__init__()
        self.id = uuid.uuid4().hex
        self.wanted = wanted
        self.who = who
        self.limit = limits.current()
        """Of the one who waits for it: reports may show other inspections of an asset."""
        self.state: State = "waiting"
        self.is_cancelled = False
        self.file: IO[bytes] | None = None
        """The archive, without a name: it ends with the process."""
        self.made: Made | None = None
        """What the file is, once it is whole."""
        self.detail: str | None = None
        """Why it failed, in the language of the order."""
        self.ended_s: float | None = None
        """When it ended, of `time.monotonic`."""
        self._is_stopping = is_stopping

    @property
    def total(self) -> int:
        """Steps in all."""
        return self.wanted.steps

    @property
    def written(self) -> int:
        """Bytes that are written so far."""
        file = self.file
        try:
            return os.fstat(file.fileno()).st_size if file else 0
        except ValueError:  # it was closed meanwhile
            return 0

    @property
    def size(self) -> int | None:
        """Bytes of the archive, once it is whole."""
        return self.written if self.made else None

    @property
    def filename(self) -> str | None:
        """What the archive is called, once it is whole."""
        return self.made.filename if self.made else None

    def check(self) -> None:
        """Raise Stopped where nobody waits for the file any more."""
        if self.is_cancelled or self._is_stopping():
            raise Stopped

    def end(self, state: State) -> None:
        """Note that it has ended; only one that is done keeps its file."""
        self.state, self.present, self.ended_s = state, None, time.monotonic()
        if state != "done":
            self.made = None
            self.close()

    def close(self) -> None:
        """Delete the archive."""
        file, self.file = self.file, None
        if file is not None:
            with suppress(OSError):  # a full disk does not take what it still holds
                file.close()


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
        self._orders: dict[str, Order] = {}
        self._waiting: deque[Order] = deque()

    def order(self, wanted: Wanted, who: str) -> Order:
        """Put an order at the end of the queue; ended ones of the same person go first.

        Raises:
            Busy: Too many orders, of this person or of all, have not ended yet.
        """
        order = Order(wanted, who, lambda: self._stopping)
        with self._changed:
            self._make_room_for(who)
            self._orders[order.id] = order
            self._waiting.append(order)
        self.wake()
        return order

    def find(self, order_id: str) -> Order:
        """Return an order.

        Raises:
            BulkExportNotFound: No order has this id.
        """
        found = self._orders.get(order_id)
        if found is None or limits.is_foreign(found.who):
            raise BulkExportNotFound(
                "There is no such export: the server was started again, or newer exports have "
                "replaced it. Make it again."
            )
        return found

    def archive(self, order_id: str) -> tuple[Iterator[bytes], int, Made]:
        """Return the archive in pieces, its bytes, and what it is; several may read the same one
        at once.

        Raises:
            BulkExportNotFound: No order has this id, or its archive is not whole.
        """
        with self._changed:
            order = self.find(order_id)
            if order.file is None or order.made is None:
                raise BulkExportNotFound("This archive is not made yet.")
            # Its own handle stays valid when the order makes room for another.
            own = os.fdopen(os.dup(order.file.fileno()), "rb")
            return _blocks(own), order.written, order.made

    def cancel(self, order_id: str) -> None:
        """Stop an order and delete its archive.

        Raises:
            BulkExportNotFound: No order has this id.
        """
        with self._changed:
            order = self.find(order_id)
            order.is_cancelled = True
            if order in self._waiting:
                self._waiting.remove(order)
            if order.state != "running":  # else the thread does so
                order.end("cancelled")

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

    def _drop(self, orders: Iterable[Order]) -> None:
        for order in orders:
            order.close()
            del self._orders[order.id]

    def _drop_old(self) -> None:
        old_s = time.monotonic() - KEPT_S
        ended = [o for o in self._orders.values() if o.ended_s is not None and o.ended_s < old_s]
        self._drop(ended)

    def _step(self) -> float:
        with self._changed:
            self._drop_old()
            if not self._waiting:
                return _SWEEP_S
            order = self._waiting.popleft()
            order.state = "running"
        self._make(order)
        return 0.0

    def _make(self, order: Order) -> None:
        state: State = "failed"
        try:
            self._write(order)
            state = "done"
        except Stopped:
            state = "cancelled"
        except ChainageError as error:
            order.detail = order.wanted.words.phrase(failure(error))
        except Exception:
            logger.exception("A bulk export failed.")
            order.detail = order.wanted.words("failure.internal_error")
        with self._changed:
            order.end("cancelled" if order.is_cancelled else state)

    def _write(self, order: Order) -> None:
        with limits.limited(order.limit), full_disk_reported():
            # Not where temporary files usually go: that may be memory.
            order.file = tempfile.TemporaryFile(dir=self._sources.scratch)  # noqa: SIM115  (kept)
            made = write(order.wanted, self._sources, order.file, order)
            order.check()
            order.file.flush()
        order.made = made


def _blocks(file: IO[bytes]) -> Iterator[bytes]:
    at = 0
    with file:  # a position of its own, because duplicates of a file share one
        while block := os.pread(file.fileno(), _BLOCK, at):
            yield block
            at += len(block)
