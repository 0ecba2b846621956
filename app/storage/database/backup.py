"""Archives a data folder while a server uses it, and restores it.

The archive is a ZIP without compression: pictures and videos hardly shrink, and uncompressed
members cannot expand when they are read. Its `manifest.json` lists the size and the SHA-256 of
every file. The database is copied first, in the state of one moment; then the files of its
inspections, which are only ever appended to, replaced whole or deleted. The server's own token and
uploads without an inspection are left out.

The database of an archive is always an SQLite file, so an archive of one kind of database restores
into the other.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import sqlite3
import stat
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import IO

import msgspec

from app.errors import UnusableBackup
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs, StoredBlob
from app.storage.blobs.folder import FolderBlobs
from app.storage.blobs.stores import blobs_at
from app.storage.database.database import FILE, stored_at
from app.storage.database.sqlite import revision_of
from app.storage.database.tables import ENDED
from app.storage.folder import signing_key
from app.storage.folder.files import DataFolder, raise_if_full, sync_folder
from app.survey.observations.attachments import VOICE_SUFFIXES

OnProgress = Callable[[int, int], None]
"""Called with the bytes done and the total."""

_FORMAT = 1
_MANIFEST = "manifest.json"
_DATABASE = FILE
_TOKENS = "tokens.json"
_GROWING = ("checkpoint", "journal", keys.RECORDING)
"""Files of an inspection that lie in the data folder whatever the store is."""
_ROOT_FILES = (_TOKENS, signing_key.FILE)
"""Files beside the database, copied if they exist."""
_NAME = re.compile(
    r"chainage\.db|tokens\.json|signing-key\.pem|detectors/[0-9a-f]{32}\.onnx"
    r"|inspections/[0-9a-f]{32}(?:/[A-Za-z0-9_-][A-Za-z0-9._-]*){1,2}"
)
"""All names that an archive may contain: no path leads out of the folder or to its lock."""
_BLOCK = 2**20
_MOST_MANIFEST_BYTES = 256 * 2**20
_TRIES = 5


class Entry(msgspec.Struct, frozen=True):
    """One file of an archive."""

    size: int
    sha256: str


class Manifest(msgspec.Struct, frozen=True):
    """The list of the files in an archive."""

    format: int
    version: str
    """Version of Chainage."""
    made_at: datetime
    files: dict[str, Entry]
    missing: list[str]
    """Files that the database names and that were missing before the backup."""


@dataclass(frozen=True)
class Summary:
    """Totals of a backup or restore."""

    inspections: int
    observations: int
    files: int
    size_bytes: int
    missing: tuple[str, ...]


_MALFORMED = (
    zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError,
    sqlite3.DatabaseError,
)  # fmt: skip
"""Errors of damaged, encrypted and foreign archives, which share no base class."""


class _Changed(Exception):
    """A file disappeared while it was copied: its inspection was deleted or is tracked again."""


def back_up(
    data: Path,
    target: Path,
    on_progress: OnProgress,
    database_url: str | None = None,
    store: str | None = None,
) -> Summary:
    """Write everything acknowledged so far into the archive `target`.

    Args:
        data: The data folder; a server may be using it.
        target: The archive; replaced whole, or unchanged after a failure.
        on_progress: Called with the progress.
        database_url: The database; None for the file in the data folder.
        store: The object store; None for the data folder.
    Raises:
        UnusableBackup: There is no database, or inspections keep being deleted.
        UnusableDatabase: The database is damaged or of a newer version.
        StoreUnavailable: The object store does not answer.
        DiskFull: There is no room for the archive.
    """
    stored = stored_at(database_url, data)
    if stored.revision() is None:  # it reports damage with the name of the database
        raise UnusableBackup(stored.missing)
    blobs = blobs_at(store, data)
    missing: list[str] = []
    with tempfile.TemporaryDirectory(prefix=".chainage-backup-", dir=target.parent) as folder:
        part = Path(folder) / "part"
        for _ in range(_TRIES):
            try:
                snapshot = Path(folder) / _DATABASE
                stored.copy_to(snapshot)
                revision_of(snapshot)
                found = _members(data, blobs, snapshot)
                gone = sorted(_named_by(snapshot) - found.keys())
                if gone != missing:  # deleted meanwhile; missing twice: lost before
                    missing = gone
                    continue
                manifest = _written(part, found, missing, on_progress)
            except _Changed:
                continue
            except OSError as error:
                raise_if_full(error)
                raise
            part.replace(target)
            sync_folder(target.parent)
            return _summary(snapshot, manifest)
    raise UnusableBackup("The inspections are changing all the time; try again when it is calmer.")


def restore(
    archive: Path,
    data: Path,
    on_progress: OnProgress,
    database_url: str | None = None,
    store: str | None = None,
) -> Summary:
    """Create a data folder from an archive; after a failure folder and store are unchanged.

    Args:
        archive: An archive written by `back_up`.
        data: A folder that is empty or does not exist.
        on_progress: Called with the progress.
        database_url: An empty database; None for a file in the data folder.
        store: An empty object store; None for the data folder.
    Raises:
        UnusableBackup: The archive is damaged or foreign, or the folder, the database or the
        store is not empty.
        UnusableDatabase: A newer version made the archive.
        StoreUnavailable: The object store does not answer.
        DiskFull: There is no room for the files.
    """
    if data.exists() and any(data.iterdir()):
        raise UnusableBackup(
            f"The folder {data} is not empty, and a server may be using it; name a new one."
        )
    stored = stored_at(database_url, data)
    stored.require_empty()
    with _held(data) as folder, _filled(store, data) as blobs, _opened(archive) as source:
        manifest = _manifest_of(source, archive)
        folder.require_room(sum(entry.size for entry in manifest.files.values()))
        part = folder.root / ".restoring"
        part.mkdir()
        _extract(source, manifest, part, on_progress)
        summary = _checked(part, manifest)
        _settle(part, manifest, folder.root, blobs)
        stored.take_over(part / _DATABASE)  # the last step: without it the rest is not used
        part.rmdir()
    return summary


@dataclass(frozen=True)
class _Member:
    """A file to copy, and its size when it was listed."""

    source: StoredBlob
    size: int

    @classmethod
    def of(cls, store: Blobs, key: str) -> _Member:
        """Look at a file."""
        return cls(StoredBlob(store, key), store.about(key).size)


def _members(data: Path, blobs: Blobs, snapshot: Path) -> dict[str, _Member]:
    """Return every file to copy, by its name in the archive."""
    folder = FolderBlobs(data)
    members = {_DATABASE: _Member.of(FolderBlobs(snapshot.parent), _DATABASE)}
    members |= {name: _Member.of(folder, name) for name in _ROOT_FILES if folder.exists(name)}
    with closing(sqlite3.connect(snapshot)) as connection:
        ids = [str(row[0]) for row in connection.execute("SELECT id FROM inspections ORDER BY id")]
    for blob in blobs.listed(keys.DETECTORS):
        members[blob.key] = _Member(StoredBlob(blobs, blob.key), blob.size)
    for inspection_id in ids:
        # In the order of names: the checkpoint precedes the journal, which may be longer than the
        # checkpoint says.
        for store in (folder, blobs):  # growing files, and blobs; possibly the same
            for blob in store.listed(keys.inspection(inspection_id)):
                if _NAME.fullmatch(blob.key):
                    member = _Member(StoredBlob(store, blob.key), blob.size)
                    members.setdefault(blob.key, member)
    return members


def _named_by(database: Path) -> set[str]:
    """Return the files that the database requires."""
    with closing(sqlite3.connect(database)) as connection:
        inspections = connection.execute(
            "SELECT id, video_file, status, frames_done, source_sha256 FROM inspections"
        ).fetchall()
        photos = connection.execute(
            "SELECT inspection_id, id, photo_frame FROM observations "
            "WHERE photo_frame IS NOT NULL AND photo_error IS NULL"
        ).fetchall()
        attachments = connection.execute(
            "SELECT inspection_id, id, frame, media_type FROM attachments WHERE sha256 IS NOT NULL"
        ).fetchall()
        tables = connection.execute("SELECT name FROM sqlite_master").fetchall()
        detectors = (
            connection.execute("SELECT id FROM detectors").fetchall()
            if ("detectors",) in tables  # of an older revision, there is none
            else []
        )
    names = {keys.photo(*row) for row in photos} | {keys.detector(*row) for row in detectors}
    names |= {
        keys.photo(inspection_id, id_, frame)
        if media_type is None
        else keys.voice(inspection_id, id_, VOICE_SUFFIXES[media_type])
        for inspection_id, id_, frame, media_type in attachments
    }
    for id_, video_file, status, frames_done, sha256 in inspections:
        if sha256 and video_file:  # without a digest it is a recording, possibly not begun
            names.add(keys.film(id_, video_file))
        if status in ENDED and frames_done:
            names.add(keys.track(id_))
    return names


def _written(
    part: Path, members: Mapping[str, _Member], missing: list[str], on_progress: OnProgress
) -> Manifest:
    """Write an archive of the members and sync it.

    Raises:
        _Changed: A member disappeared, also a tile or a checkpoint.
    """
    files: dict[str, Entry] = {}
    done = 0
    try:
        total = sum(member.size for member in members.values())
        with part.open("wb") as out:
            with zipfile.ZipFile(out, "w") as archive:
                for name, member in members.items():
                    files[name] = _stored(archive, name, member.source)
                    done += files[name].size
                    on_progress(done, max(done, total))
                manifest = Manifest(_FORMAT, version("chainage"), datetime.now(UTC), files, missing)
                archive.writestr(_MANIFEST, msgspec.json.encode(manifest))
            out.flush()
            os.fsync(out.fileno())
    except FileNotFoundError as error:
        raise _Changed from error
    return manifest


def _stored(archive: zipfile.ZipFile, name: str, stored: StoredBlob) -> Entry:
    """Copy a file at its current length; bytes appended meanwhile belong to the next backup."""
    info = zipfile.ZipInfo(name)
    info.external_attr = (stat.S_IFREG | 0o600) << 16
    with (
        stored.local() as path,
        path.open("rb") as source,
        archive.open(info, "w", force_zip64=True) as target,
    ):
        size = os.fstat(source.fileno()).st_size
        return Entry(size, _copied(source, target, size))


def _copied(source: IO[bytes], target: IO[bytes], size: int) -> str:
    """Copy `size` bytes and return their SHA-256.

    Raises:
        _Changed: The source has fewer bytes.
    """
    digest = hashlib.sha256()
    while size:
        block = source.read(min(size, _BLOCK))
        if not block:
            raise _Changed
        digest.update(block)
        target.write(block)
        size -= len(block)
    return digest.hexdigest()


@contextmanager
def _held(data: Path) -> Iterator[DataFolder]:
    """Hold the new folder against servers; when the block fails, remove everything in it."""
    is_new = not data.exists()
    folder = DataFolder(data, reserve_bytes=0)
    try:
        yield folder
    except BaseException:
        for path in folder.root.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        if is_new:
            folder.root.rmdir()
        raise
    finally:
        folder.close()


@contextmanager
def _filled(store: str | None, data: Path) -> Iterator[Blobs]:
    """Yield the new store, which must be empty; when the block fails, empty it again."""
    blobs = blobs_at(store, data)
    if any(blobs.listed(keys.INSPECTIONS)):
        raise UnusableBackup(f"There are inspections in {blobs.name} already; name an empty store.")
    try:
        yield blobs
    except BaseException:
        blobs.delete_all(keys.INSPECTIONS)
        blobs.delete_all(keys.DETECTORS)
        raise


@contextmanager
def _opened(archive: Path) -> Iterator[zipfile.ZipFile]:
    """Open the archive; every fault of it is one error."""
    try:
        with zipfile.ZipFile(archive) as opened:
            yield opened
    except _MALFORMED as error:
        raise UnusableBackup(f"{archive} is damaged or no backup of Chainage: {error}.") from error


def _manifest_of(source: zipfile.ZipFile, archive: Path) -> Manifest:
    """Read the manifest and check it against the archive.

    Raises:
        UnusableBackup: The archive differs from its manifest.
    """
    infos = {info.filename: info for info in source.infolist()}
    stated = infos.pop(_MANIFEST, None)
    if stated is None or stated.file_size > _MOST_MANIFEST_BYTES:
        raise UnusableBackup(f"{archive} is no backup of Chainage: it has no manifest.")
    _require_plain(stated, archive)
    try:
        manifest = msgspec.json.decode(source.read(stated), type=Manifest)
    except msgspec.MsgspecError as error:
        raise UnusableBackup(f"The manifest of {archive} cannot be read: {error}.") from error
    if manifest.format != _FORMAT:
        raise UnusableBackup(
            f"{archive} was made by Chainage {manifest.version} in a form that this version does "
            "not know."
        )
    if len(source.infolist()) != len(infos) + 1 or infos.keys() != manifest.files.keys():
        raise UnusableBackup(f"{archive} does not hold the files that its manifest names.")
    for name, info in infos.items():
        _require_plain(info, archive)
        if not _NAME.fullmatch(name) or info.file_size != manifest.files[name].size:
            raise UnusableBackup(f"{archive} holds {name!r}, which does not belong to a backup.")
    size = sum(info.file_size for info in infos.values())
    if _DATABASE not in infos or size > archive.stat().st_size:
        raise UnusableBackup(
            f"{archive} is damaged: its files overlap, or the database is missing."
        )
    return manifest


def _require_plain(info: zipfile.ZipInfo, archive: Path) -> None:
    """Require a file as `back_up` stores it: no link or device, not compressed or encrypted."""
    kind = stat.S_IFMT(info.external_attr >> 16)
    is_stored = info.compress_type == zipfile.ZIP_STORED and info.file_size == info.compress_size
    if kind not in (0, stat.S_IFREG) or not is_stored or info.flag_bits & 1:
        raise UnusableBackup(f"{archive} holds {info.filename!r} in a form that no backup has.")


def _extract(
    source: zipfile.ZipFile, manifest: Manifest, part: Path, on_progress: OnProgress
) -> None:
    total = sum(entry.size for entry in manifest.files.values())
    done = 0
    for name, entry in manifest.files.items():
        path = part / name
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with source.open(name) as packed, open(path, "xb", opener=_for_owner) as out:
                digest = _copied(packed, out, entry.size)
                out.flush()
                os.fsync(out.fileno())
        except _Changed:
            digest = ""
        except OSError as error:
            raise_if_full(error)
            raise
        if not secrets.compare_digest(digest, entry.sha256):
            raise UnusableBackup(f"The backup is damaged: {name} has changed since it was made.")
        done += entry.size
        on_progress(done, total)


def _for_owner(path: str, flags: int) -> int:
    """Open with the owner's permissions only: the file may be a key."""
    return os.open(path, flags, 0o600)


def _checked(part: Path, manifest: Manifest) -> Summary:
    """Check the extracted files as a whole."""
    database = part / _DATABASE
    revision_of(database)
    with closing(sqlite3.connect(database)) as connection:
        answer = connection.execute("PRAGMA integrity_check").fetchone()[0]
    lost = _named_by(database) - manifest.files.keys() - set(manifest.missing)
    if answer != "ok" or lost:
        what = f"the database says {answer}" if answer != "ok" else f"{min(lost)} is missing"
        raise UnusableBackup(f"The backup is damaged: {what}.")
    return _summary(database, manifest)


def _settle(part: Path, manifest: Manifest, root: Path, blobs: Blobs) -> None:
    """Move the extracted files into place, except for the database."""
    folder = FolderBlobs(root)
    for name in manifest.files.keys() - {_DATABASE}:
        is_local = name in _ROOT_FILES or name.rpartition("/")[2] in _GROWING
        (folder if is_local else blobs).adopt(name, part / name)
        (part / name).unlink()
    for empty in sorted((path for path in part.rglob("*") if path.is_dir()), reverse=True):
        empty.rmdir()


def _summary(database: Path, manifest: Manifest) -> Summary:
    with closing(sqlite3.connect(database)) as connection:
        (inspections,) = connection.execute("SELECT count(*) FROM inspections").fetchone()
        (observations,) = connection.execute(
            "SELECT count(*) FROM observations WHERE deleted_at IS NULL"
        ).fetchone()
    size = sum(entry.size for entry in manifest.files.values())
    return Summary(inspections, observations, len(manifest.files), size, tuple(manifest.missing))
