"""Files of the data folder; acknowledged content has been synced, with its folder.

Films, photos, tiles and tracks are blobs under keys (`keys`, `blobs`), which lie in the folder
unless the server has an object store. What grows, and what one server needs to resume its work,
lies in the folder always: recordings, checkpoints, uploads, the database, keys and tokens.

chainage.db
token                                  the access token, mode 0600, unless CHAINAGE_TOKEN is set
tokens.json                            the named tokens, by their SHA-256; see tokens.py
signing-key.pem                        signs evidence bundles, mode 0600; made by the first one
lock                                   held while a server uses the folder
address.json                           where that server is reached; see address.py
sample/<version>/video.mp4  rig.json   the rendered sample; sample/inspection names its inspection
uploads/<32 hex>.bin  .json            bytes so far; the announced size and names
inspections/<32 hex>/video.<suffix>    the original, as it was uploaded
                     rig.json  track.csv
                     health.csv  joints.csv
                     counter.json  counter.csv   the burnt-in distance counter: what is known of
                                           it, and its readings
                     recording.mkv         while a camera is recorded; then it becomes the video
                     parts.csv             frames missing from that film, and where its parts begin
                     photos/<uuid>-<frame>.jpg
                     wall/<index>.jpg  tiles of the unrolled wall; synced by a checkpoint
                     checkpoint  journal   during tracking: state for resuming after a crash
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import logging
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from app.errors import NO_ROOM, DataFolderInUse, DiskFull
from app.storage.blobs import keys

logger = logging.getLogger(__name__)

_OF_OTHERS = stat.S_IRWXG | stat.S_IRWXO


class Places:
    """Paths of all files; creates nothing, so that a server may be using the folder."""

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self.database = self.root / "chainage.db"
        self.uploads = self.root / "uploads"
        self.inspections = self.root / "inspections"
        self.sample = self.root / "sample"
        self.lock = self.root / "lock"
        self.token = self.root / "token"

    @property
    def media(self) -> tuple[str, ...]:
        """Folders that contain uploads and growing films."""
        return str(self.uploads), str(self.inspections)

    def inspection(self, inspection_id: str) -> Path:
        """Return the folder of an inspection."""
        return self.inspections / inspection_id

    def checkpoint(self, inspection_id: str) -> Path:
        """Return the file of the last checkpoint of an inspection that is being tracked."""
        return self.inspection(inspection_id) / "checkpoint"

    def journal(self, inspection_id: str) -> Path:
        """Return the file of the results up to that checkpoint."""
        return self.inspection(inspection_id) / "journal"

    def recording(self, inspection_id: str) -> Path:
        """Return the file that a camera is recorded into."""
        return self.inspection(inspection_id) / keys.RECORDING

    def marks(self, inspection_id: str) -> Path:
        """Return the file of the frames missing from a recording and of where its parts begin."""
        return self.inspection(inspection_id) / "parts.csv"


class DataFolder(Places):
    """Creates and locks the data folder, and measures free space."""

    def __init__(self, root: Path, *, reserve_bytes: int, is_shared: bool = False) -> None:
        """Create and lock the folder.

        Args:
            root: The folder.
            reserve_bytes: Space that stays free.
            is_shared: Whether the database says which server is active; a frozen one keeps its
            lock of the folder.
        Raises:
            DataFolderInUse: Another server uses it, which does not share it.
        """
        super().__init__(root)
        self.reserve_bytes = reserve_bytes
        self.root.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._keep_to_owner()
        self.uploads.mkdir(exist_ok=True)
        self.inspections.mkdir(exist_ok=True)
        self._lock = self._take_lock(fcntl.LOCK_SH if is_shared else fcntl.LOCK_EX)

    def _keep_to_owner(self) -> None:
        """Take the rights of others away that an older version or a person has left."""
        # The database is with its logs and earlier copies.
        for path in (self.root, *self.root.glob(f"{self.database.name}*")):
            with suppress(FileNotFoundError):  # a log, which another program has just removed
                mode = stat.S_IMODE(path.stat().st_mode)
                try:
                    if mode & _OF_OTHERS:
                        path.chmod(mode & ~_OF_OTHERS)
                except PermissionError:  # it belongs to somebody else, as a mounted volume may
                    logger.warning("Others may use %s, which belongs to another user.", path)

    def close(self) -> None:
        """Release the folder for another server."""
        self._lock.close()

    def _take_lock(self, kind: int) -> BinaryIO:
        lock = self.lock.open("wb")
        try:
            fcntl.flock(lock, kind | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.close()
            raise DataFolderInUse(
                f"Another server is using the data folder {self.root}."
            ) from error
        return lock

    def free_bytes(self) -> int:
        """Return the free space without the reserve; negative when short."""
        return self.disk_free_bytes() - self.reserve_bytes

    def disk_free_bytes(self) -> int:
        """Return the free space including the reserve."""
        return shutil.disk_usage(self.root).free

    def disk_bytes(self) -> int:
        """Return the capacity of the disk."""
        return shutil.disk_usage(self.root).total

    def require_room(self, size: int) -> None:
        """Raise DiskFull unless `size` bytes fit."""
        if size > self.free_bytes():
            raise DiskFull(
                "There is not enough room on the server's disk. Free some space, then continue."
            )

    def kept_token(self) -> str:
        """Return the server's own token, made at the first start and readable by its owner only;
        on a full disk one that is forgotten.
        """
        if self.token.exists():
            return self.token.read_text("ascii").strip()
        token = secrets.token_urlsafe(32)
        try:
            write_durably(self.token, token.encode(), mode=0o600)
        except DiskFull:
            logger.warning("The disk is full: the access token is valid until the server ends.")
        return token


@contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """Yield where to write a file that then replaces `path`; several may do so at once."""
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        yield part
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def write_durably(path: Path, content: bytes, *, mode: int = 0o644) -> None:
    """Replace a file atomically: after a power cut it is either the old or the whole new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with (
        full_disk_reported(),
        _replacing(path) as part,
        open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as out,  # noqa: PTH123
    ):
        out.write(content)
        out.flush()
        os.fsync(out.fileno())
    sync_folder(path.parent)


def append_durably(path: Path, at: int, content: bytes | bytearray) -> int:
    """Write `content` after the first `at` bytes of a file, truncate the rest, return its new
    length.
    """
    is_new = not path.exists()
    with full_disk_reported(), path.open("wb" if is_new else "rb+") as file:
        file.truncate(at)
        file.seek(at)
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    if is_new:
        sync_folder(path.parent)
    return at + len(content)


def replace_file(path: Path, content: bytes) -> None:
    """Replace a file that can be made again: after a power cut it may be missing."""
    with _replacing(path) as part:
        part.write_bytes(content)


def copy_durably(source: Path, target: Path) -> None:
    """Copy a file into the data folder; the target is complete or missing."""
    with _replacing(target) as part:
        shutil.copyfile(source, part)
        sync_file(part)
    sync_folder(target.parent)


def sync_file(path: Path) -> None:
    """Sync a file that was written before."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Make renames and new names in `folder` durable."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def raise_if_full(error: OSError) -> None:
    """Turn "no space left" and "quota exceeded" into DiskFull; let the rest pass."""
    if error.errno in NO_ROOM:
        raise DiskFull from error


@contextmanager
def full_disk_reported() -> Iterator[None]:
    """Turn the errors of a full disk in the block into DiskFull."""
    try:
        yield
    except OSError as error:
        raise_if_full(error)
        raise


def delete_tree(folder: Path) -> None:
    """Delete a folder with all its files, also with one that is written meanwhile, until none is
    left.

    Raises:
        OSError: It cannot be deleted.
    """
    for is_last in (False, False, True):
        try:
            shutil.rmtree(folder)
        except FileNotFoundError:
            return
        except OSError as error:
            if is_last or error.errno != errno.ENOTEMPTY:
                raise
