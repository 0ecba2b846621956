"""Films in the folders of this machine: found in a fixed order, never outside the allowed folders.

A link is followed only if its target lies in an allowed folder too; then the film is its target.
Folders that are links, hidden names and special files are passed over.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from app.archive.paths import path_of, text_of
from app.errors import FolderNotAllowed, NoSuchFilm

SUFFIXES = frozenset(
    (".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".mpg", ".mpeg", ".vob")
    + (".ts", ".mts", ".m2ts", ".m2t")
)
"""Suffixes of films, in lower case."""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True)
class Found:
    """A file that may be a film."""

    path: str
    """Text of the resolved path."""
    relative: str
    """Text of the path within the added folder, with slashes."""
    size: int
    modified_at: datetime
    problem: str | None
    """A sentence that says why it cannot be added."""


@dataclass(frozen=True)
class Folder:
    """A folder to choose from."""

    name: str
    path: str
    """Text of the resolved path."""


@dataclass(frozen=True)
class Listing:
    """What is in one folder, or which folders there are to begin with."""

    path: str | None
    """None for the beginning."""
    above: str | None
    """The folder that it is in; None where that is the beginning."""
    folders: list[Folder]
    films: int
    """Films directly in it."""


def folders_in(text: str | None, allowed: Sequence[Path]) -> Listing:
    """Return the folders in a folder by their names, the allowed ones for None.

    Raises:
        FolderNotAllowed: The folder is outside them.
        NoSuchFilm: There is no such folder, or it cannot be read.
    """
    roots = [_resolved(folder) for folder in allowed]
    if text is None:
        offered = [Folder(text_of(root), text_of(root)) for root in roots]
        return Listing(None, None, offered, 0)
    folder = _allowed(path_of(text), roots)
    try:
        with os.scandir(folder) as entries:
            shown = sorted((e for e in entries if e.name[0] != "."), key=lambda e: e.name)
    except OSError as error:
        raise NoSuchFilm(f"The folder {text_of(folder)} cannot be read.") from error
    is_folder = [_is_folder(entry) and not entry.is_symlink() for entry in shown]
    return Listing(
        text_of(folder),
        None if folder in roots else text_of(folder.parent),
        [
            Folder(text_of(entry.name), text_of(Path(entry)))
            for entry, is_one in zip(shown, is_folder, strict=True)
            if is_one
        ],
        sum(is_film(e.name) for e, is_one in zip(shown, is_folder, strict=True) if not is_one),
    )


def found_in(paths: Iterable[str], allowed: Sequence[Path]) -> Iterator[Found]:
    """Yield the files of folders, and the named files, each once.

    Args:
        paths: Texts of absolute paths. A named file is relative to the common folder of all named
            files.
        allowed: Folders in which they must be.
    Raises:
        FolderNotAllowed: A path is outside them.
        NoSuchFilm: There is nothing at a path.
    """
    roots = [_resolved(folder) for folder in allowed]
    targets = [_allowed(path_of(text), roots) for text in paths]
    files = [path for path in targets if not path.is_dir()]
    common = Path(os.path.commonpath([path.parent for path in files])) if files else None
    seen = set[str]()
    for target in targets:
        is_folder = target.is_dir()
        root = target if is_folder else common or target.parent
        for path in files_below(target) if is_folder else [target]:
            found = looked_at(path, root, roots)
            if found.path not in seen:
                seen.add(found.path)
                yield found


def looked_at(path: Path, root: Path, roots: Sequence[Path]) -> Found:
    """Describe a file below `root`; a link is described by its target, if that is in `roots`."""
    relative = text_of(path.relative_to(root).as_posix())
    try:
        real = path.resolve(strict=True)
        if not _is_in(real, roots):
            problem = "The link leads out of the folders for films."
            return Found(text_of(path), relative, 0, _EPOCH, problem)
        status = real.lstat()
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        reason = getattr(error, "strerror", None) or "it is a link to itself"
        problem = f"The file cannot be read: {reason}."
        return Found(text_of(path), relative, 0, _EPOCH, problem)
    return Found(
        text_of(real), relative, status.st_size, modified_at(status), _problem(path, status)
    )


def modified_at(status: os.stat_result) -> datetime:
    """Return the time of the last change, to the microsecond, as databases keep it."""
    return _EPOCH + timedelta(microseconds=status.st_mtime_ns // 1000)


def is_film(name: str) -> bool:
    """Return whether a file name has the suffix of a film."""
    return os.path.splitext(name)[1].lower() in SUFFIXES  # noqa: PTH122  (names, not paths)


def _problem(path: Path, status: os.stat_result) -> str | None:
    if stat.S_ISDIR(status.st_mode):
        return "The folder cannot be read."
    if not stat.S_ISREG(status.st_mode) or not is_film(path.name):
        return "The file is not a film by its suffix."
    if status.st_size == 0:
        return "The file is empty (0 bytes)."
    return None


def files_below(folder: Path) -> Iterator[Path]:
    """Yield the files below a folder in a fixed order, and the folders that cannot be read; hidden
    names are passed over.
    """
    waiting = [folder]
    while waiting:  # `os.walk` calls itself for each level, of which there may be thousands
        parent = waiting.pop()
        try:
            with os.scandir(parent) as entries:
                shown = sorted((e for e in entries if e.name[0] != "."), key=lambda e: e.name)
        except OSError:
            yield parent
            continue
        is_folder = [_is_folder(entry) for entry in shown]
        yield from (Path(e) for e, is_one in zip(shown, is_folder, strict=True) if not is_one)
        waiting += [
            Path(entry)
            for entry, is_one in zip(reversed(shown), reversed(is_folder), strict=True)
            if is_one and not entry.is_symlink()
        ]


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:  # links in a circle
        return False


def _allowed(path: Path, roots: Sequence[Path]) -> Path:
    real = _resolved(path)
    if not _is_in(real, roots):
        named = " or ".join(text_of(root) for root in roots) or "no folder"
        raise FolderNotAllowed(
            f"The path {text_of(path)} is not in a folder for films; CHAINAGE_ARCHIVE_FOLDERS "
            f"allows {named}."
        )
    if not real.exists():
        raise NoSuchFilm(f"There is nothing at {text_of(path)}.")
    return real


def _resolved(path: Path) -> Path:
    try:
        return path.resolve()
    except (OSError, RuntimeError) as error:
        raise NoSuchFilm(f"The path {text_of(path)} cannot be read.") from error


def _is_in(path: Path, roots: Sequence[Path]) -> bool:
    return any(path.is_relative_to(root) for root in roots)
