"""Resumable uploads after tus 1.0.0: the offset is what is on the disk.

The rules are those that survived kill -9 in mid-PATCH: one request at a time uses an upload, bytes
are synced before they are acknowledged, and a broken connection keeps what came.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import logging
import threading
import time
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
    UploadTooLarge,
)
from app.storage.files import DataFolder, raise_if_full
from app.storage.uploads import UploadInfo, UploadStore, sync, write_all

logger = logging.getLogger(__name__)

CHECKSUMS = ("sha1", "sha256")
MAX_CHECKED_PIECE = 16 * 2**20
"""A piece with a checksum is held in memory until it is verified."""
MOST_OF_A_TOKEN = 100
"""Uploads that are announced or complete, and not yet an inspection."""
_BLOCK = 2**20
_CLOCK_WAS_SET_S = 60.0
"""What a clock that is only kept right does not jump by."""


@dataclass(frozen=True)
class Checksum:
    """Algorithm and expected digest of one PATCH."""

    algorithm: str
    digest: bytes


@dataclass(frozen=True)
class UploadState:
    """Where an upload stands."""

    info: UploadInfo
    offset: int
    expires_at: float
    """Seconds since 1970."""


class Uploads:
    """Create, look up, append, delete, take."""

    def __init__(self, folder: DataFolder, *, max_bytes: int, expiry_s: float) -> None:
        self._folder = folder
        self._store = UploadStore(folder.uploads)
        self.max_bytes = max_bytes
        self._expiry_s = expiry_s
        self._clock_zero_s = _clock_zero_s()
        self._lock, self._creating = threading.Lock(), threading.Lock()
        self._busy: set[str] = set()

    def create(self, length: int, filename: str, metadata: str, owner: str) -> str:
        """A new upload of `length` bytes, announced by the token `owner`.

        Raises:
            UploadTooLarge: Above the server's limit.
            TooManyUploads: The token has as many as it may have.
            DiskFull: More than the disk has room for, with what others have announced.
        """
        if length > self.max_bytes:
            raise UploadTooLarge(
                f"The file has {length} bytes; the server takes {self.max_bytes} at most."
            )
        with self._creating:  # two at once would both count without the other
            announced = list(self._store.announced())
            if sum(info.owner == owner for info, _ in announced) >= MOST_OF_A_TOKEN:
                raise TooManyUploads(
                    f"There are {MOST_OF_A_TOKEN} uploads of this token that became no inspection; "
                    "discard some, or wait until they expire."
                )
            self._folder.require_room(length + sum(rest for _, rest in announced))
            return self._store.create(UploadInfo(length, filename, metadata, owner))

    def state(self, upload_id: str) -> UploadState:
        """What was announced and what has arrived.

        Raises:
            UploadNotFound: Not made here, expired, deleted, or already an inspection.
        """
        info = self._store.info(upload_id)
        expires_at = self._store.touched_at(upload_id) + self._expiry_s
        return UploadState(info, self._store.offset(upload_id), expires_at)

    async def append(
        self,
        upload_id: str,
        offset: int,
        pieces: AsyncIterator[bytes],
        checksum: Checksum | None,
    ) -> UploadState:
        """Append the bytes of one PATCH at `offset`; they are on the disk when it returns.

        When `pieces` fails, because the client went away, what came is kept and synced.

        Raises:
            OffsetConflict: The disk holds another number of bytes.
            UploadBusy: Another request is using the upload.
            UploadTooLarge: More bytes than were announced.
            ChecksumMismatch: Nothing was appended.
            DiskFull: What fitted is kept.
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
        try:
            write_all(file, block)
        except OSError as error:
            raise_if_full(error)
            raise

    def delete(self, upload_id: str) -> None:
        """Forget an upload and its bytes."""
        with self._in_use(upload_id):
            self._store.info(upload_id)
            self._store.delete(upload_id)

    @contextmanager
    def take(self, upload_id: str) -> Iterator[tuple[Path, UploadInfo]]:
        """Hold a complete upload to make an inspection of it; the file may be moved away.

        When the block ends without an exception the upload is gone, otherwise it stays.

        Raises:
            UploadIncomplete: Bytes are missing.
        """
        with self._in_use(upload_id):
            state = self.state(upload_id)
            if state.offset != state.info.length:
                raise UploadIncomplete(
                    f"Only {state.offset} of {state.info.length} bytes of the video have arrived."
                )
            yield self._store.path(upload_id), state.info
            self._store.delete(upload_id)

    def expire(self) -> None:
        """Delete the uploads that nobody goes on with.

        A clock that was set makes what is just arriving look old, as on a machine that knows the
        time only once it finds a network: then all of them get their time anew.
        """
        before_s, self._clock_zero_s = self._clock_zero_s, _clock_zero_s()
        if abs(self._clock_zero_s - before_s) > _CLOCK_WAS_SET_S:
            self._store.touch_all()
        for upload_id in self._store.older_than(self._expiry_s):
            with suppress(UploadBusy), self._in_use(upload_id):
                logger.info("Upload %s expired.", upload_id)
                self._store.delete(upload_id)

    @contextmanager
    def _in_use(self, upload_id: str) -> Iterator[None]:
        with self._lock:
            if upload_id in self._busy:
                raise UploadBusy("Another request is using this upload; try again in a moment.")
            self._busy.add(upload_id)
        try:
            yield
        finally:
            with self._lock:
                self._busy.remove(upload_id)


async def _blocks(pieces: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
    """Gather the network's pieces into blocks of 1 MiB; what came before a failure comes first."""
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
    """Checked for a known algorithm.

    Raises:
        InvalidUpload: Another algorithm.
    """
    if algorithm not in CHECKSUMS:
        raise InvalidUpload(
            f"Upload-Checksum names {algorithm!r}; known are {', '.join(CHECKSUMS)}."
        )
    return Checksum(algorithm, digest)


async def _in_thread(call: Callable[..., None], *args: object) -> None:
    """`asyncio.to_thread`, but when cancelled it still waits for the thread to end.

    Otherwise the file would be closed while a thread writes to it.
    """
    running = asyncio.ensure_future(asyncio.to_thread(call, *args))
    try:
        await asyncio.shield(running)
    except asyncio.CancelledError:
        await asyncio.wait([running])
        raise


def _clock_zero_s() -> float:
    """Time 0 of the clock that nobody sets, by the one that can be set; it changes with it."""
    return time.time() - time.monotonic()


def _sync_and_close(file: BinaryIO) -> None:
    with file:
        sync(file)
