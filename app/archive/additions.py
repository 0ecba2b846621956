"""Adds films to the archive: finds them, gives each what rules and tables say, stores the new."""

from __future__ import annotations

import secrets
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

from app.archive.assignment import Assigned, Assignment
from app.archive.folders import Found, found_in
from app.archive.rules import Rules
from app.archive.tables import Table
from app.storage.archive.films import ArchiveFilms

MOST_FILES = 100_000
"""Files that one request looks at."""
_MOST_OTHERS = 1000
"""Files other than films that are listed."""


@dataclass(frozen=True)
class Addition:
    """One file, and what the film gets."""

    found: Found
    assigned: Assigned | None
    """None if the file cannot be added."""
    is_known: bool

    @property
    def problem(self) -> str | None:
        """A sentence that says why the film is not tracked, or what is wrong with its header."""
        if self.is_known:
            return "The film is in the archive already."
        return self.found.problem if self.assigned is None else self.assigned.error_detail


@dataclass(frozen=True)
class Additions:
    """All files of a request."""

    films: Sequence[Addition]
    others: int
    """Files other than films that are not listed."""
    warnings: Sequence[str]

    @property
    def found(self) -> int:
        """Number of films."""
        return sum(each.assigned is not None for each in self.films)

    @property
    def known(self) -> int:
        """Number of films that are in the archive already."""
        return sum(each.is_known for each in self.films)

    @property
    def new(self) -> Sequence[Addition]:
        """The films that are not."""
        return [each for each in self.films if each.assigned and not each.is_known]


@dataclass(frozen=True)
class Request:
    """Films to add."""

    paths: Sequence[str]
    """Texts of absolute paths of folders or films."""
    rules: Rules
    tables: Sequence[Table] = field(default_factory=tuple)
    priority: int | None = None
    """Of all films; None leaves it to the rules."""


def additions(request: Request, allowed: Sequence[Path], archive: ArchiveFilms) -> Additions:
    """Find the films of a request and what each gets; nothing is stored.

    Raises:
        FolderNotAllowed, NoSuchFilm: A path cannot be used.
    """
    files = list(islice(found_in(request.paths, allowed), MOST_FILES + 1))
    warnings = []
    if len(files) > MOST_FILES:
        files.pop()
        warnings.append(
            f"Only the first {MOST_FILES} files were looked at; add the others folder by folder."
        )
    listed = assigned_to(
        files, Assignment(request.rules), archive, request.tables, request.priority
    )
    warnings += [sentence for table in request.tables for sentence in table.unused()]
    others = [each for each in listed if each.assigned is None]
    left_out = {id(each) for each in others[_MOST_OTHERS:]}
    return Additions([each for each in listed if id(each) not in left_out], len(left_out), warnings)


def assigned_to(
    files: Sequence[Found],
    assignment: Assignment,
    archive: ArchiveFilms,
    tables: Sequence[Table] = (),
    priority: int | None = None,
) -> list[Addition]:
    """Return what each file gets."""
    known = archive.known(file.path for file in files if file.problem is None)
    return [
        Addition(
            file,
            assignment.assigned_to(file.path, file.relative, tables, priority)
            if file.problem is None
            else None,
            file.path in known,
        )
        for file in files
    ]


def columns(new: Iterable[Addition], who: str) -> list[dict[str, Any]]:
    """Return the columns of new films; their ids are made here."""
    now = datetime.now(UTC)
    return [
        {
            "id": secrets.token_hex(16),
            "path": each.found.path,
            "relative": each.found.relative,
            "size": each.found.size,
            "modified_at": each.found.modified_at,
            "added_at": now,
            "added_by": who,
            **asdict(each.assigned),
        }
        for each in new
        if each.assigned is not None
    ]
