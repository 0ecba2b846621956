"""Reports of many inspections as one ZIP archive, made in a thread while a person waits for it.

Each inspection has a folder with a file for each wanted format. `inspections.csv` lists all of
them, with what could not be made and why. An archive is kept for an hour, in a file without a name:
it is lost when the server ends.
"""

from __future__ import annotations

import csv
import io
import logging
import os
import tempfile
import threading
import time
import uuid
import zipfile
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from typing import IO, Literal

from app.errors import BulkExportNotFound, Busy, DiskFull, InspectionNotFound
from app.reports.content.naming import safe_file_name
from app.reports.content.words import Language
from app.reports.report import Extras, Units
from app.reports.reports import Export, Reports
from app.storage.files import DataFolder, full_disk_reported
from app.storage.inspections import InspectionStore
from app.storage.tables import Inspection
from app.survey.catalogue.header import asset_of, project_of
from app.tracking.worker import Worker
from vo_core.csv_rows import plain
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
_COMPRESSED = (".pdf", ".xlsx", ".zip")
_LIST = "inspections.csv"
_LIST_HEAD = (
    "folder", "inspection_id", "name", "project", "asset_id", "review", "files", "not_made",
)  # fmt: skip


@dataclass(frozen=True)
class Wanted:
    """What somebody orders."""

    inspections: tuple[str, ...]
    """Ids, in the order of the archive."""
    kinds: tuple[str, ...]
    """Formats, by their names in `app.reports.formats.FORMATS`."""
    language: Language
    units: Units
    burnt_in: bool
    clips: bool


@dataclass(frozen=True)
class NotMade:
    """A file that is missing in the archive."""

    inspection_id: str
    name: str
    """Of the inspection; empty if it was deleted."""
    kind: str
    """Its format, by the name in `FORMATS`; empty if the whole inspection is missing."""
    detail: str


@dataclass(frozen=True)
class Progress:
    """How far an order is."""

    id: str
    state: State
    done: int
    """Inspections that are in the archive; their total follows."""
    total: int
    present: str | None
    """Name of the inspection whose reports are being made."""
    not_made: tuple[NotMade, ...]
    size: int | None
    """Bytes of the archive, once it is whole."""
    detail: str | None
    """Why it failed."""


@dataclass
class _Order:
    wanted: Wanted
    who: str
    progress: Progress
    file: IO[bytes] | None = None
    """The archive, without a name: it ends with the process."""
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
        self._inspections = inspections
        self._reports = reports
        self._clip_of = clip_of
        self._folder = folder
        self._orders: dict[str, _Order] = {}
        self._waiting: deque[_Order] = deque()

    def order(self, wanted: Wanted, who: str) -> Progress:
        """Put an order at the end of the queue; ended ones of the same person go first.

        Raises:
            Busy: Too many orders, of this person or of all, have not ended yet.
        """
        progress = Progress(
            uuid.uuid4().hex, "waiting", 0, len(wanted.inspections), None, (), None, None
        )
        with self._changed:
            self._make_room_for(who)
            order = self._orders[progress.id] = _Order(wanted, who, progress)
            self._waiting.append(order)
            self._changed.notify_all()
        return progress

    def progress(self, order_id: str) -> Progress:
        """Return how far an order is.

        Raises:
            BulkExportNotFound: No order has this id.
        """
        with self._changed:
            return self._order(order_id).progress

    def archive(self, order_id: str) -> tuple[Iterator[bytes], int]:
        """Return the archive in pieces, and its bytes; several may read the same one at once.

        Raises:
            BulkExportNotFound: No order has this id, or its archive is not whole.
        """
        with self._changed:
            order = self._order(order_id)
            file, size = order.file, order.progress.size
            if file is None or size is None:
                raise BulkExportNotFound("This archive is not made yet.")
            # Its own handle stays valid when the order makes room for another.
            own = os.fdopen(os.dup(file.fileno()), "rb")
        return _blocks(own), size

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

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._stopping, _SWEEP_S)
                if self._stopping:
                    return
                self._drop_old()
                if not self._waiting:
                    continue
                order = self._waiting.popleft()
            try:
                self._make(order)
            except ChainageError as error:
                self._fail(order, str(error))
            except Exception:
                logger.exception("A bulk export failed.")
                self._fail(order, "The server could not make this archive; its log says why.")

    def _fail(self, order: _Order, detail: str) -> None:
        with self._changed:
            order.progress = replace(order.progress, detail=detail)
            _end(order, "failed")

    def _make(self, order: _Order) -> None:
        self._show(order, state="running")
        rows: list[tuple[str, ...]] = []
        with full_disk_reported():
            # Not where temporary files usually go: that may be memory.
            file = tempfile.TemporaryFile(dir=self._folder.root)  # noqa: SIM115  (kept open)
            order.file = file
            with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
                for number, inspection_id in enumerate(order.wanted.inspections, 1):
                    if self._must_stop(order):
                        break
                    rows.append(self._add(archive, order, number, inspection_id))
                    self._show(order, done=number)
                archive.writestr(_LIST, _listed(rows))
            file.flush()
        with self._changed:
            if order.is_cancelled.is_set() or self._stopping:
                _end(order, "cancelled")
            else:
                size = os.fstat(file.fileno()).st_size
                order.progress = replace(order.progress, state="done", present=None, size=size)
                order.ended_s = time.monotonic()

    def _add(
        self, archive: zipfile.ZipFile, order: _Order, number: int, inspection_id: str
    ) -> tuple[str, ...]:
        """Add the folder of an inspection; return its row of the list."""
        try:
            row = self._inspections.get(inspection_id)
        except InspectionNotFound as error:
            self._miss(order, NotMade(inspection_id, "", "", str(error)))
            return ("", inspection_id, "", "", "", "", "", str(error))
        self._show(order, present=row.name)
        folder = safe_file_name(f"{number:03d}-{asset_of(row.header) or row.name}")
        made, missing = [], []
        for kind in order.wanted.kinds:
            if self._must_stop(order):
                break
            self._folder.require_room(0)
            export = self._export(order.wanted, inspection_id, kind)
            if isinstance(export, str):
                missing.append(f"{kind}: {export}")
                self._miss(order, NotMade(inspection_id, row.name, kind, export))
                continue
            _write(archive, f"{folder}/{export.filename}", export)
            made.append(export.filename)
        return _row(folder, row, made, missing)

    def _export(self, wanted: Wanted, inspection_id: str, kind: str) -> Export | str:
        """Return the file, or why there is none: one of them must not cost all the others."""
        extras = Extras(
            burnt_in=wanted.burnt_in,
            clip_of=partial(self._clip_of, inspection_id) if wanted.clips else None,
        )
        try:
            return self._reports.export(
                inspection_id, kind, language=wanted.language, units=wanted.units, extras=extras
            )
        except DiskFull:
            raise
        except ChainageError as error:
            return str(error)
        except Exception:
            logger.exception("The %s of %s could not be made.", kind, inspection_id)
            return "The server could not make this file; its log says why."

    def _must_stop(self, order: _Order) -> bool:
        return order.is_cancelled.is_set() or self._stopping

    def _miss(self, order: _Order, missing: NotMade) -> None:
        self._show(order, not_made=(*order.progress.not_made, missing))

    def _show(self, order: _Order, **changes: object) -> None:
        with self._changed:
            order.progress = replace(order.progress, **changes)  # type: ignore[arg-type]


def _end(order: _Order, state: State) -> None:
    order.progress = replace(order.progress, state=state, present=None, size=None)
    order.ended_s = time.monotonic()
    _close(order)


def _close(order: _Order) -> None:
    if order.file is not None:
        order.file.close()
        order.file = None


def _write(archive: zipfile.ZipFile, name: str, export: Export) -> None:
    member = zipfile.ZipInfo(name, datetime.now(UTC).timetuple()[:6])
    is_compressed = name.endswith(_COMPRESSED)
    member.compress_type = zipfile.ZIP_STORED if is_compressed else zipfile.ZIP_DEFLATED
    with archive.open(member, "w", force_zip64=True) as out:
        for block in export.written.blocks():
            out.write(block)


def _row(
    folder: str, row: Inspection, made: Sequence[str], missing: Sequence[str]
) -> tuple[str, ...]:
    return (
        folder,
        row.id,
        row.name,
        project_of(row.header) or "",
        asset_of(row.header) or "",
        row.review_state,
        " ".join(made),
        "; ".join(missing),
    )


def _listed(rows: Sequence[Sequence[str]]) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerows([plain(cell) for cell in row] for row in (_LIST_HEAD, *rows))
    return out.getvalue().encode("utf-8-sig")


def _blocks(file: IO[bytes]) -> Iterator[bytes]:
    at = 0
    with file:  # a position of its own, because duplicates of a file share one
        while block := os.pread(file.fileno(), _BLOCK, at):
            yield block
            at += len(block)
