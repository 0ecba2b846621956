"""Films, photos, tiles and tracks as blobs: bytes under a key, wherever they lie.

A key is a relative path such as `inspections/<id>/video.mp4`. `blobs_at` returns the store that the
server was set to: the data folder, or a bucket of an S3-compatible object store. Callers do not
know which. What a method has written when it returns survives a power cut.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import logging
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Protocol, cast
from urllib.parse import parse_qsl, urlsplit

from app.errors import BlobNotFound, InvalidSettings, StoreUnavailable
from app.settings import SCRATCH_BYTES
from app.storage.files import (
    copy_durably,
    raise_if_full,
    replace_file,
    sync_file,
    sync_folder,
    write_durably,
)

if TYPE_CHECKING:
    from obstore import GetOptions, ObjectMeta
    from obstore.store import S3Config, S3Store

logger = logging.getLogger(__name__)

BLOCK = 2**20
"""Largest block that `blocks` reads at a time, bytes."""
_KEY = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*(?:/[A-Za-z0-9_-][A-Za-z0-9._-]*)*")
"""No segment is empty, `..`, or hidden: hidden names are files that are being written."""
_PROBE = "store-check"
_PART = 8 * 2**20
_MOST_PARTS = 9000
"""S3 takes 10,000 parts of one object."""
_PARTS_AT_ONCE = 3
_PAGE = 1000
"""Keys of one answer to a list request, and of one request for deletion."""
_RETRIES = 4
_RETRY_S = 20.0
_CONNECT_S = 4.0
_REQUEST_S = 60.0
"""Longest time of one request, which carries one part at most."""


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


def blobs_at(url: str | None, folder: Path, *, scratch_bytes: int = SCRATCH_BYTES) -> Blobs:
    """Return the store of a server or of a worker; nothing is requested.

    Args:
        url: `s3://bucket/prefix?endpoint=https://host:port&region=name`, all but the bucket
            optional; credentials come from the variables AWS_*. None stands for `folder`.
        folder: The data folder: it contains the blobs, or else the scratch copies.
        scratch_bytes: Most bytes of scratch copies.
    Raises:
        InvalidSettings: The URL is not understood, or obstore is not installed.
    """
    if url is None:
        return FolderBlobs(folder)
    return ObjectBlobs(url, folder / "scratch", scratch_bytes)


def blocks(blobs: Blobs, key: str, first: int, length: int) -> Iterator[bytes]:
    """Yield `length` bytes of a blob from the byte `first` on, in blocks of bounded size."""
    end = first + length
    while first < end:
        block = blobs.read_range(key, first, min(BLOCK, end - first))
        if not block:
            raise BlobNotFound(f"{key} ended at {first} of {end} bytes.")
        yield block
        first += len(block)


def checked_key(key: str) -> str:
    """Return a key; raise ValueError if it could lead out of the store."""
    if not _KEY.fullmatch(key):
        raise ValueError(f"{key!r} is no key of a blob.")
    return key


class Readable(Protocol):
    """Something that has bytes: a blob, or a path."""

    def read_bytes(self) -> bytes:
        """Return all bytes; raise FileNotFoundError if there is nothing."""

    def exists(self) -> bool:
        """Return whether there is something."""


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

    def local(self) -> AbstractContextManager[Path]:
        """Hold the blob as a file, only to be read; raise BlobNotFound if there is none."""
        return self.blobs.local(self.key)


class FolderBlobs:
    """Blobs as files below a folder."""

    def __init__(self, root: Path) -> None:
        self._root = root.resolve()

    @property
    def name(self) -> str:
        """The folder's path."""
        return f"the folder {self._root}"

    @property
    def media(self) -> tuple[str, ...]:
        """The folder of the inspections; no child may read the server's tokens."""
        return (str(self._root / "inspections"),)

    def _path(self, key: str) -> Path:
        return self._root / checked_key(key)

    def _new(self, key: str) -> Path:
        """Return the path of a blob whose folder exists durably."""
        path = self._path(key)
        missing = [folder for folder in path.parents if not folder.exists()]
        path.parent.mkdir(parents=True, exist_ok=True)
        for folder in reversed(missing):
            sync_folder(folder.parent)
        return path

    def put(self, key: str, content: bytes) -> None:
        """Write, sync and rename."""
        with _room():
            write_durably(self._new(key), content)

    def put_again(self, key: str, content: bytes) -> None:
        """Write and rename."""
        with _room():
            replace_file(self._new(key), content)

    def sync(self, keys: Iterable[str]) -> None:
        """Sync the files and their folders."""
        folders = set()
        for key in keys:
            path = self._path(key)
            if path.exists():
                sync_file(path)
                folders.add(path.parent)
        for folder in folders:
            sync_folder(folder)

    def put_file(self, key: str, path: Path) -> None:
        """Copy, sync and rename."""
        with _room():
            copy_durably(path, self._new(key))

    def adopt(self, key: str, path: Path) -> bool:
        """Give the file a second name, or copy it where a file system has no such names."""
        target = self._new(key)
        sync_file(path)
        if target == path.resolve():
            return False
        try:
            target.unlink(missing_ok=True)
            target.hardlink_to(path)
        except OSError as error:
            if error.errno not in _NO_LINKS:
                raise
            self.put_file(key, path)
        sync_folder(target.parent)
        return True

    def get(self, key: str) -> bytes:
        """Read the whole file."""
        with _found(key):
            return self._path(key).read_bytes()

    def read_range(self, key: str, first: int, length: int) -> bytes:
        """Read a part of the file."""
        with _found(key), self._path(key).open("rb") as file:
            file.seek(first)
            return file.read(length)

    def about(self, key: str) -> Blob:
        """Ask the file system."""
        with _found(key):
            return _blob(key, self._path(key).stat())

    def exists(self, key: str) -> bool:
        """Ask the file system."""
        return self._path(key).is_file()

    def listed(self, folder: str) -> Iterator[Blob]:
        """Walk through the folder."""
        yield from self._below(self._path(folder), f"{folder}/")

    def _below(self, folder: Path, prefix: str) -> Iterator[Blob]:
        try:
            # A name with a slash, as keys sort: "a.b" comes before "a/b".
            entries = sorted(
                os.scandir(folder), key=lambda entry: entry.name + "/" * entry.is_dir()
            )
        except FileNotFoundError:
            return
        for entry in entries:
            key = prefix + entry.name
            if entry.is_symlink() or not _KEY.fullmatch(key):
                continue
            if entry.is_dir():
                yield from self._below(Path(entry.path), f"{key}/")
            else:
                try:
                    yield _blob(key, entry.stat())
                except FileNotFoundError:
                    continue

    def delete(self, key: str) -> None:
        """Delete the file."""
        self._path(key).unlink(missing_ok=True)

    def delete_all(self, folder: str) -> None:
        """Delete the folder."""
        try:
            shutil.rmtree(self._path(folder))
        except FileNotFoundError:
            return

    @contextmanager
    def local(self, key: str) -> Iterator[Path]:
        """Yield the file itself."""
        path = self._path(key)
        if not path.is_file():
            raise _missing(key)
        yield path

    def check(self) -> None:
        """Write and delete a small file."""
        try:
            self.put(_PROBE, b"")
            self.delete(_PROBE)
        except OSError as error:
            raise StoreUnavailable(f"{self._root} cannot be written: {error}.") from error


class ObjectBlobs:
    """Blobs as objects of a bucket, with scratch copies for programs that need a file."""

    def __init__(self, url: str, scratch: Path, scratch_bytes: int) -> None:
        """Take the URL, the folder of scratch copies, and the most bytes of these."""
        self._store, self.name = _opened(url)
        self._scratch = Scratch(scratch, scratch_bytes)

    name: str
    """The URL without its query."""

    @property
    def media(self) -> tuple[str, ...]:
        """The folder of the scratch copies."""
        return (str(self._scratch.folder),)

    def put(self, key: str, content: bytes) -> None:
        """Send the object; the store has it durably when it answers."""
        with self._answers(key):
            self._store.put(checked_key(key), content, use_multipart=False)

    def put_again(self, key: str, content: bytes) -> None:
        """Send the object."""
        self.put(key, content)

    def sync(self, keys: Iterable[str]) -> None:
        """Do nothing: whatever the store has acknowledged is durable."""

    def put_file(self, key: str, path: Path) -> None:
        """Send the file, in parts if it is large; the object appears whole."""
        part = max(_PART, -(-path.stat().st_size // _MOST_PARTS))
        with path.open("rb") as file, self._answers(key):
            self._store.put(checked_key(key), file, chunk_size=part, max_concurrency=_PARTS_AT_ONCE)

    def adopt(self, key: str, path: Path) -> bool:
        """Send the file, in parts if it is large."""
        self.put_file(key, path)
        return True

    def get(self, key: str) -> bytes:
        """Fetch the object, a large one in blocks, so that no request takes long."""
        with self._answers(key):
            found = self._store.get(checked_key(key))
            if found.meta["size"] <= _PART:
                return found.bytes().to_bytes()
        size = found.meta["size"]
        return b"".join(self.read_range(key, first, _PART) for first in range(0, size, _PART))

    def read_range(self, key: str, first: int, length: int) -> bytes:
        """Fetch a part of the object."""
        return self._part(key, {"range": (first, first + length)})

    def _part(self, key: str, options: GetOptions) -> bytes:
        with self._answers(key):
            return self._store.get(checked_key(key), options=options).bytes().to_bytes()

    def about(self, key: str) -> Blob:
        """Ask for the head of the object."""
        return _described(key, self._head(key))

    def _head(self, key: str) -> ObjectMeta:
        with self._answers(key):
            return self._store.head(checked_key(key))

    def exists(self, key: str) -> bool:
        """Ask for the head of the object."""
        try:
            self._head(key)
        except BlobNotFound:
            return False
        return True

    def listed(self, folder: str) -> Iterator[Blob]:
        """Ask for one page of keys after another."""
        pages = self._store.list(checked_key(folder), chunk_size=_PAGE)
        while True:
            with self._answers(folder):
                page = next(pages, None)
            if page is None:
                return
            yield from (_described(meta["path"], meta) for meta in page)

    def delete(self, key: str) -> None:
        """Delete the object."""
        try:
            with self._answers(key):
                self._store.delete(checked_key(key))
        except BlobNotFound:
            return  # some stores report it

    def delete_all(self, folder: str) -> None:
        """Delete one page of objects after another."""
        pages = self._store.list(checked_key(folder), chunk_size=_PAGE)
        while True:
            with self._answers(folder):
                page = next(pages, None)
                if page is None:
                    return
                self._store.delete([meta["path"] for meta in page])

    @contextmanager
    def local(self, key: str) -> Iterator[Path]:
        """Hold a scratch copy of the object as it is now."""
        meta = self._head(key)
        size, e_tag = meta["size"], meta["e_tag"]
        unchanged: GetOptions = {"if_match": e_tag} if e_tag else {}
        identity = hashlib.sha256(f"{self.name}\n{key}\n{size}\n{e_tag}".encode()).hexdigest()
        name = identity[:32] + Path(key).suffix

        def parts() -> Iterator[bytes]:
            for first in range(0, size, _PART):
                yield self._part(key, {**unchanged, "range": (first, first + _PART)})

        with self._scratch.held(name, size, parts) as path:
            yield path

    def check(self) -> None:
        """Send a small object."""
        self.put(_PROBE, b"")

    @contextmanager
    def _answers(self, key: str) -> Iterator[None]:
        """Turn failures of the store into sentences of ours; obstore's may hold a key's id."""
        from obstore.exceptions import (
            BaseError,
            PermissionDeniedError,
            UnauthenticatedError,
        )

        try:
            yield
        except FileNotFoundError as error:
            if "NoSuchBucket" in str(error):
                raise StoreUnavailable(f"The bucket of {self.name} does not exist.") from error
            raise _missing(key) from error
        except (PermissionDeniedError, UnauthenticatedError) as error:
            raise StoreUnavailable(
                f"The object store {self.name} refuses the credentials in AWS_ACCESS_KEY_ID and "
                "AWS_SECRET_ACCESS_KEY, or they do not allow this."
            ) from error
        except BaseError as error:
            if "NoSuchBucket" in str(error):
                raise StoreUnavailable(f"The bucket of {self.name} does not exist.") from error
            logger.debug("Object store: %s", error)
            raise StoreUnavailable(
                f"The object store {self.name} does not answer as it should; try again in a moment."
            ) from error


def _opened(url: str) -> tuple[S3Store, str]:
    """Return the bucket that a URL names, and the name of the store; nothing is requested."""
    parts = urlsplit(url)
    given = dict(parse_qsl(parts.query))
    name = f"{parts.scheme}://{parts.hostname or ''}{parts.path.rstrip('/')}"
    prefix = parts.path.strip("/")
    is_wrong = parts.scheme != "s3" or not parts.hostname or "@" in url or given.keys() - _IN_URL
    if is_wrong or (prefix and not _KEY.fullmatch(prefix)):
        raise InvalidSettings(
            "CHAINAGE_STORE must read s3://bucket/prefix?endpoint=https://host&region=name; "
            "credentials belong into AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY."
        )
    try:
        from obstore.store import S3Store
    except ImportError as error:
        raise InvalidSettings(
            "CHAINAGE_STORE needs the package obstore: pip install 'chainage[cluster]'."
        ) from error
    store = S3Store(
        parts.hostname,
        prefix=prefix or None,
        config=cast("S3Config", given),
        client_options={
            "allow_http": given.get("endpoint", "").startswith("http://"),
            "connect_timeout": timedelta(seconds=_CONNECT_S),
            "timeout": timedelta(seconds=_REQUEST_S),
        },
        retry_config={
            "max_retries": _RETRIES,
            "retry_timeout": timedelta(seconds=_RETRY_S),
            "backoff": {"max_backoff": timedelta(seconds=2)},
        },
    )
    return store, name


_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EXDEV, errno.EMLINK)
"""Errors of a file system without a second name for this file."""
_IN_URL = {"endpoint", "region"}


Content = Callable[[], Iterator[bytes]]
"""Yields the blocks of a new copy."""


class Scratch:
    """A folder of copies, which threads and processes share; those used longest ago go first.

    Whoever uses a copy holds a shared lock on it, which ends with the process. A copy is made under
    a hidden name with an exclusive lock, so that everybody else waits for it.
    """

    def __init__(self, folder: Path, most_bytes: int) -> None:
        self.folder = folder.resolve()
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._most_bytes = most_bytes

    @contextmanager
    def held(self, name: str, size: int, content: Content) -> Iterator[Path]:
        """Hold the copy of this name; if there is none, `content` yields its `size` bytes."""
        path = self.folder / name
        while (file := _locked(path, size)) is None:
            self._make(path, size, content)
        with file:
            yield path

    def _make(self, path: Path, size: int, content: Content) -> None:
        part = path.with_name(f".{path.name}.part")
        with part.open("ab") as out:
            try:
                fcntl.flock(out, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                fcntl.flock(out, fcntl.LOCK_SH)  # another one makes it; its users do not block this
                return
            if not _is_at(out, part):
                return  # another one has made it meanwhile, or has given up
            try:
                with _room():
                    if not path.exists():
                        self._make_room(size)
                        out.truncate(0)  # what a process left that was killed
                        for block in content():
                            out.write(block)
                        out.flush()
                        os.fsync(out.fileno())
                        part.replace(path)
            finally:
                if _is_at(out, part):
                    part.unlink()

    def _make_room(self, size: int) -> None:
        """Delete unused copies until `size` bytes fit, as far as there are any."""
        found = []
        for path in self.folder.iterdir():
            try:
                found.append((path.stat(), path))
            except FileNotFoundError:
                continue
        used = sum(stat.st_size for stat, _ in found)
        for stat, path in sorted(found, key=lambda pair: pair[0].st_mtime_ns):
            if used + size <= self._most_bytes:
                return
            if _deleted_unless_used(path):
                used -= stat.st_size


def _locked(path: Path, size: int) -> BinaryIO | None:
    """Open a copy and lock it against deletion; None if it is missing or not whole."""
    try:
        file = path.open("rb")
    except FileNotFoundError:
        return None
    fcntl.flock(file, fcntl.LOCK_SH)
    if _is_at(file, path):
        if os.fstat(file.fileno()).st_size == size:
            os.utime(file.fileno())
            return file
        path.unlink(missing_ok=True)  # damaged
    file.close()
    return None


def _deleted_unless_used(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()
    except BlockingIOError:
        return False
    except FileNotFoundError:
        pass
    return True


def _is_at(file: BinaryIO, path: Path) -> bool:
    """Return whether an open file still has this name."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except FileNotFoundError:
        return False


def _blob(key: str, stat: os.stat_result) -> Blob:
    # The modification time survives a restart; microseconds are exact in JavaScript.
    return Blob(key, stat.st_size, stat.st_mtime_ns // 1000)


def _described(key: str, meta: ObjectMeta) -> Blob:
    digest = hashlib.sha256((meta["e_tag"] or str(meta["last_modified"])).encode()).digest()
    return Blob(key, meta["size"], int.from_bytes(digest[:6]))


@contextmanager
def _room() -> Iterator[None]:
    """Turn the errors of a full disk into DiskFull."""
    try:
        yield
    except OSError as error:
        raise_if_full(error)
        raise


@contextmanager
def _found(key: str) -> Iterator[None]:
    try:
        yield
    except FileNotFoundError as error:
        raise _missing(key) from error


def _missing(key: str) -> BlobNotFound:
    return BlobNotFound(f"The server's store has no {key}.")
