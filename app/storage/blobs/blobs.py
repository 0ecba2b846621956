"""What a store of blobs offers: films, photos, tiles and tracks as bytes under a key.

A key is a relative path such as `inspections/<id>/video.mp4`. Callers do not know where the bytes
lie: in the data folder (`folder_blobs`), or in a bucket of an S3-compatible object store
(`object_blobs`); `blob_stores` opens one of them. What a method has written when it returns
survives a power cut.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from app.errors import BlobChanged, BlobNotFound

_BLOCK = 2**20
"""Largest block that `blocks` reads at a time, bytes."""
_KEY = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*(?:/[A-Za-z0-9_-][A-Za-z0-9._-]*)*")
"""No segment is empty, `..`, or hidden: hidden names are files that are being written."""
PROBE = "store-check"
"""Key of the blob that the stores write to check that they can."""


@dataclass(frozen=True)
class Blob:
    """What a store says of a blob."""

    key: str
    size: int
    """Bytes."""
    revision: int
    """Changes with the content; below 2^53, so that it is exact in JavaScript. In a folder it
    rises."""


class Blobs(Protocol):
    """A store of blobs; every method may raise StoreUnavailable, and those that write DiskFull."""

    @property
    def name(self) -> str:
        """What to call the store in a sentence; without credentials."""

    @property
    def media(self) -> tuple[str, ...]:
        """Existing folders in which the paths of `local` lie, for children that are confined."""

    def put(self, key: str, content: bytes) -> None:
        """Store a blob, replacing any of this key whole."""

    def put_again(self, key: str, content: bytes) -> None:
        """Store a blob that can be made again: it survives a power cut only after `sync`."""

    def sync(self, keys: Iterable[str]) -> None:
        """Make blobs of `put_again` durable; those that are missing by now are passed over."""

    def put_file(self, key: str, path: Path) -> None:
        """Store a copy of a file, in parts if it is large."""

    def adopt(self, key: str, path: Path) -> bool:
        """Store a file of the server's own, without another copy if the store is its disk.

        From now on nobody may change the file. Return whether `path` is to be deleted by who calls,
        when it is not needed any more; otherwise it is the blob itself.
        """

    def get(self, key: str) -> bytes:
        """Return a blob; raise BlobNotFound if there is none."""

    def read_range(self, key: str, first: int, length: int) -> bytes:
        """Return `length` bytes from the byte `first` on, which exists; fewer at the end."""

    def about(self, key: str) -> Blob:
        """Return size and revision of a blob; raise BlobNotFound if there is none."""

    def exists(self, key: str) -> bool:
        """Return whether there is such a blob."""

    def listed(self, folder: str) -> Iterator[Blob]:
        """Yield the blobs below a folder in the order of their keys, with bounded memory.

        In an object store this takes a request for every 1000: where keys are known, do not list.
        """

    def delete(self, key: str) -> None:
        """Delete a blob, if there is one."""

    def delete_all(self, folder: str) -> None:
        """Delete all blobs below a folder."""

    def local(self, key: str) -> AbstractContextManager[Path]:
        """Hold a blob as a file, only to be read; raise BlobNotFound if there is none.

        In a folder this is the blob itself. Of an object store it is a scratch copy, which stays
        for the next one who asks until others need its room.
        """

    def check(self) -> None:
        """Raise StoreUnavailable unless the store can be written now."""


def blocks(blobs: Blobs, key: str, first: int, length: int) -> Iterator[bytes]:
    """Yield `length` bytes of a blob from the byte `first` on, in blocks of bounded size."""
    end = first + length
    while first < end:
        block = blobs.read_range(key, first, min(_BLOCK, end - first))
        if not block:
            raise BlobNotFound(f"{key} ended at {first} of {end} bytes.")
        yield block
        first += len(block)


def is_key(text: str) -> bool:
    """Return whether a text may be the key of a blob."""
    return _KEY.fullmatch(text) is not None


def checked_key(key: str) -> str:
    """Return a key; raise ValueError if it could lead out of the store."""
    if not is_key(key):
        raise ValueError(f"{key!r} is no key of a blob.")
    return key


def no_such_blob(key: str) -> BlobNotFound:
    """Return the error of a key without a blob."""
    return BlobNotFound(f"The server's store has no {key}.")


class Readable(Protocol):
    """Something that has bytes: a blob, or a path."""

    def read_bytes(self) -> bytes:
        """Return all bytes; raise FileNotFoundError if there is nothing."""


@dataclass(frozen=True)
class Checked:
    """Something that is only read as it was stored."""

    stored: Readable
    sha256: str
    """Digest of the bytes when they were stored."""

    def read_bytes(self) -> bytes:
        """Return all bytes; raise FileNotFoundError if there are none, BlobChanged if others."""
        content = self.stored.read_bytes()
        if hashlib.sha256(content).hexdigest() != self.sha256:
            raise BlobChanged("The file has changed since it was stored: restore it from a backup.")
        return content


def as_stored(stored: Readable, sha256: str | None) -> Readable:
    """Return what can only be read unchanged, where its digest is known."""
    return Checked(stored, sha256) if sha256 else stored


@dataclass(frozen=True)
class StoredBlob:
    """One blob of a store, whether it exists or not."""

    blobs: Blobs
    key: str

    def exists(self) -> bool:
        """Return whether there is such a blob."""
        return self.blobs.exists(self.key)

    def about(self) -> Blob:
        """Return size and revision; raise BlobNotFound if there is none."""
        return self.blobs.about(self.key)

    def read_bytes(self) -> bytes:
        """Return the blob; raise BlobNotFound if there is none."""
        return self.blobs.get(self.key)

    def blocks(self, first: int, length: int) -> Iterator[bytes]:
        """Yield `length` bytes from the byte `first` on, in blocks of bounded size."""
        return blocks(self.blobs, self.key, first, length)

    def has(self, size: int, sha256: str, go_on: Callable[[], None] = lambda: None) -> bool:
        """Return whether the blob still has this size and digest.

        Args:
            size: In bytes.
            sha256: In hexadecimal digits.
            go_on: Called before each block of what may be a large film; ends it by an exception.
        Raises:
            BlobNotFound: There is no blob.
        """
        if self.about().size != size:
            return False
        digest = hashlib.sha256()
        for block in self.blocks(0, size):
            go_on()
            digest.update(block)
        return digest.hexdigest() == sha256

    def local(self) -> AbstractContextManager[Path]:
        """Hold the blob as a file, only to be read; raise BlobNotFound if there is none."""
        return self.blobs.local(self.key)
