"""Blobs as objects of a bucket of an S3-compatible store."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, cast
from urllib.parse import parse_qsl, urlsplit

from app.errors import BlobNotFound, InvalidSettings, StoreUnavailable
from app.storage.blobs.blobs import PROBE, Blob, checked_key, is_key, no_such_blob
from app.storage.blobs.scratch import Scratch

if TYPE_CHECKING:
    from obstore import GetOptions, ObjectMeta
    from obstore.store import S3Config, S3Store

logger = logging.getLogger(__name__)

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
_IN_URL = {"endpoint", "region"}
"""What the query of a store's URL may name."""


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
        for page in self._pages(folder):
            yield from (_described(meta["path"], meta) for meta in page)

    def _pages(self, folder: str) -> Iterator[Sequence[ObjectMeta]]:
        pages = self._store.list(checked_key(folder), chunk_size=_PAGE)
        while True:
            with self._answers(folder):
                page = next(pages, None)
            if page is None:
                return
            yield page

    def delete(self, key: str) -> None:
        """Delete the object."""
        try:
            with self._answers(key):
                self._store.delete(checked_key(key))
        except BlobNotFound:
            return  # some stores report it

    def delete_all(self, folder: str) -> None:
        """Delete one page of objects after another."""
        for page in self._pages(folder):
            with self._answers(folder):
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
        self.put(PROBE, b"")

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
            raise no_such_blob(key) from error
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
    if is_wrong or (prefix and not is_key(prefix)):
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


def _described(key: str, meta: ObjectMeta) -> Blob:
    digest = hashlib.sha256((meta["e_tag"] or str(meta["last_modified"])).encode()).digest()
    return Blob(key, meta["size"], int.from_bytes(digest[:6]))
