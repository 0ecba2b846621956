"""Resumable uploads after tus 1.0.0: the offset is the number of bytes on the disk.

These rules survived kill -9 during a PATCH: one request at a time uses an upload, bytes are synced
before they are acknowledged, and a broken connection keeps the received bytes.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import logging
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from app.errors import (
    ChecksumMismatch,
    InvalidUpload,
    OffsetConflict,
    TooManyUploads,
    UploadBusy,
    UploadIncomplete,
    UploadNotFound,
    UploadTooLarge,
)
from app.storage.database.limits import is_foreign
from app.storage.folder.files import DataFolder, full_disk_reported
from app.storage.folder.uploads import UploadInfo, UploadStore, sync, write_all

logger = logging.getLogger(__name__)

CHECKSUMS = ("sha1", "sha256")
MAX_CHECKED_PIECE = 16 * 2**20
"""Largest piece with a checksum: it is held in memory until it is verified."""
MOST_OF_A_TOKEN = 100
"""Most uploads of a token that have not become an inspection."""
_BLOCK = 2**20
_READ_S = 120.0
"""How long an inspection waits for a page that still looks at its film: to search it for the axis
takes seconds, on a busy machine many."""
_CLOCK_WAS_SET_S = 60.0
"""Jump of the clock that shows it was set, not just adjusted."""


@dataclass(frozen=True)
class Checksum:
    """Algorithm and expected digest of one PATCH."""

    algorithm: str
    digest: bytes


@dataclass(frozen=True)
class UploadState:
    """Progress of an upload."""

    info: UploadInfo
    offset: int
    expires_at: float
    """Seconds since 1970."""


class Uploads:
    """Creates uploads, appends to them, deletes them, and hands them over."""

    def __init__(self, folder: DataFolder, *, max_bytes: int, expiry_s: float) -> None:
        self._folder = folder
        self._store = UploadStore(folder.uploads)
        self.max_bytes = max_bytes
        self._expiry_s = expiry_s
        self._clock_zero_s = _clock_zero_s()
        self._creating = threading.Lock()
        self._ended = threading.Condition()
        """Guards the uses of uploads; notified when one ends."""
        self._busy: set[str] = set()
        self._readers: Counter[str] = Counter()

    def create(self, length: int, filename: str, metadata: str, owner: str) -> str:
        """Create an upload of `length` bytes, announced by the token `owner`; return its id.

        Raises:
            UploadTooLarge: The length exceeds the server's limit.
            TooManyUploads: The token has reached its limit.
            DiskFull: The disk has no room for it besides other announced uploads.
        """
        if length > self.max_bytes:
            raise UploadTooLarge(
                f"The file has {length} bytes; the server takes {self.max_bytes} at most."
            )
        with self._creating:  # two concurrent ones would not count each other
            announced = list(self._store.announced())
            if sum(info.owner == owner for info, _ in announced) >= MOST_OF_A_TOKEN:
                raise TooManyUploads(
                    f"This token has {MOST_OF_A_TOKEN} uploads that have not become an inspection; "
                    "discard some, or wait until they expire."
                )
            self._folder.require_room(length + sum(rest for _, rest in announced))
            return self._store.create(UploadInfo(length, filename, metadata, owner))

    def state(self, upload_id: str) -> UploadState:
        """Return announced and received lengths.

        Raises:
            UploadNotFound: The id is unknown, expired, deleted, or already an inspection.
        """
        info = self._info(upload_id)
        expires_at = self._store.touched_at(upload_id) + self._expiry_s
        return UploadState(info, self._store.offset(upload_id), expires_at)

    def _info(self, upload_id: str) -> UploadInfo:
        info = self._store.info(upload_id)
        if is_foreign(info.owner):
            raise UploadNotFound("There is no such upload of this token.")
        return info

    async def append(
        self,
        upload_id: str,
        offset: int,
        pieces: AsyncIterator[bytes],
        checksum: Checksum | None,
    ) -> UploadState:
        """Append the bytes of one PATCH at `offset`; they are on the disk when it returns.

        When `pieces` fails, because the client disconnected, received bytes are kept and synced.

        Raises:
            OffsetConflict: The disk holds another number of bytes.
            UploadBusy: Another request is using the upload.
            UploadTooLarge: More bytes came than were announced.
            ChecksumMismatch: The digest differs; nothing was appended.
            DiskFull: The bytes that fitted are kept.
        """
        with self._in_use(upload_id):
            state = await asyncio.to_thread(self.state, upload_id)
            if offset != state.offset:
                raise OffsetConflict(state.offset)
            room = state.info.length - offset
            if checksum is not None:
                pieces = _verified(pieces, checksum, room)
            file = self._store.open(upload_id)
            try:
                await self._append_all(file, _blocks(pieces), room)
            finally:
                await _in_thread(_sync_and_close, file)
            return await asyncio.to_thread(self.state, upload_id)

    async def _append_all(self, file: BinaryIO, blocks: AsyncIterator[bytes], room: int) -> None:
        async for block in blocks:
            if len(block) > room:
                raise UploadTooLarge("More bytes came than were announced for this upload.")
            await _in_thread(self._write, file, block)
            room -= len(block)

    def _write(self, file: BinaryIO, block: bytes) -> None:
        self._folder.require_room(len(block))
        with full_disk_reported():
            write_all(file, block)

    def delete(self, upload_id: str) -> None:
        """Delete an upload and its bytes."""
        with self._in_use(upload_id):
            self._info(upload_id)
            self._store.delete(upload_id)

    @contextmanager
    def held(self, upload_id: str) -> Iterator[tuple[Path, UploadInfo]]:
        """Hold a complete upload for reading; others may read it too.

        Raises:
            UploadIncomplete: Bytes are missing.
            UploadBusy: It is being changed or taken.
        """
        with self._read(upload_id):
            yield self._complete(upload_id)

    @contextmanager
    def take(self, upload_id: str) -> Iterator[tuple[Path, UploadInfo]]:
        """Hold a complete upload to make an inspection of it; the file may be moved away.

        When the block ends without an exception the upload is deleted, otherwise it stays.
        """
        with self._in_use(upload_id, _READ_S):
            yield self._complete(upload_id)
            self._store.delete(upload_id)

    def _complete(self, upload_id: str) -> tuple[Path, UploadInfo]:
        state = self.state(upload_id)
        if state.offset != state.info.length:
            raise UploadIncomplete(
                f"Only {state.offset} of {state.info.length} bytes of the video have arrived."
            )
        return self._store.path(upload_id), state.info

    def expire(self) -> None:
        """Delete abandoned uploads.

        Setting the clock makes active uploads look old, for example on a machine that learns the
        time from the network only later; then the time of every upload is reset.
        """
        before_s, self._clock_zero_s = self._clock_zero_s, _clock_zero_s()
        if abs(self._clock_zero_s - before_s) > _CLOCK_WAS_SET_S:
            self._store.touch_all()
        for upload_id in self._store.older_than(self._expiry_s):
            with suppress(UploadBusy), self._in_use(upload_id):
                logger.info("Upload %s expired.", upload_id)
                self._store.delete(upload_id)

    @contextmanager
    def _in_use(self, upload_id: str, patience_s: float = 0.0) -> Iterator[None]:
        """Use an upload alone; wait so long until nobody reads it."""
        with self._ended:
            self._require_unused(upload_id)
            self._busy.add(upload_id)
            is_alone = self._ended.wait_for(lambda: not self._readers[upload_id], patience_s)
        try:
            if not is_alone:
                raise _busy()
            yield
        finally:
            with self._ended:
                self._busy.remove(upload_id)

    @contextmanager
    def _read(self, upload_id: str) -> Iterator[None]:
        with self._ended:
            self._require_unused(upload_id)
            self._readers[upload_id] += 1
        try:
            yield
        finally:
            with self._ended:
                self._readers[upload_id] -= 1
                if not self._readers[upload_id]:
                    del self._readers[upload_id]
                self._ended.notify_all()

    def _require_unused(self, upload_id: str) -> None:
        if upload_id in self._busy:
            raise _busy()


def _busy() -> UploadBusy:
    return UploadBusy("Another request is using this upload; try again in a moment.")


async def _blocks(pieces: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
    """Gather received pieces into blocks of 1 MiB; yield the rest before raising a failure."""
    gathered = bytearray()
    try:
        async for piece in pieces:
            gathered += piece
            if len(gathered) >= _BLOCK:
                yield bytes(gathered)
                gathered.clear()
    except Exception:  # whatever ended the stream; it is raised again
        if gathered:
            yield bytes(gathered)
        raise
    if gathered:
        yield bytes(gathered)


async def _verified(
    pieces: AsyncIterator[bytes], checksum: Checksum, room: int
) -> AsyncIterator[bytes]:
    held = bytearray()
    async for piece in pieces:
        held += piece
        if len(held) > min(room, MAX_CHECKED_PIECE):
            raise UploadTooLarge(
                f"A piece with a checksum may have {MAX_CHECKED_PIECE} bytes at most, "
                "and not more than was announced."
            )
    digest = hashlib.new(checksum.algorithm, held, usedforsecurity=False).digest()
    if not hmac.compare_digest(digest, checksum.digest):
        raise ChecksumMismatch("The piece was damaged on its way; send it again.")
    yield bytes(held)


def checksum_from(algorithm: str, digest: bytes) -> Checksum:
    """Return a checksum of a known algorithm.

    Raises:
        InvalidUpload: The algorithm is unknown.
    """
    if algorithm not in CHECKSUMS:
        raise InvalidUpload(
            f"Upload-Checksum names {algorithm!r}; known are {', '.join(CHECKSUMS)}."
        )
    return Checksum(algorithm, digest)


async def _in_thread(call: Callable[..., None], *args: object) -> None:
    """Like `asyncio.to_thread`, but wait for the thread also when cancelled.

    Otherwise the file would be closed while the thread writes to it.
    """
    running = asyncio.ensure_future(asyncio.to_thread(call, *args))
    try:
        await asyncio.shield(running)
    except asyncio.CancelledError:
        await asyncio.wait([running])
        raise


def _clock_zero_s() -> float:
    """Return the wall-clock time of the monotonic zero; it changes when the clock is set."""
    return time.time() - time.monotonic()


def _sync_and_close(file: BinaryIO) -> None:
    with file:
        sync(file)
