"""What `chainage archive add` sends: the films, rules, rigs and tables that the user named."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app.archive.folders import is_film
from app.archive.paths import text_of
from app.errors import InvalidTable, NoSuchFilm
from vo_core.csv_rows import decoded, records
from vo_core.errors import InvalidRig


@dataclass(frozen=True)
class Source:
    """Films that were named by a folder, a film or a list."""

    paths: Sequence[Path]
    list_csv: str | None = None
    """The list with whole paths, if it is a table."""
    rigs: Mapping[str, Any] = field(default_factory=dict)
    """Rig files that the list names."""
    missing: Sequence[str] = ()
    """Sentences about rig files that cannot be read."""

    @property
    def folders(self) -> list[Path]:
        """Folders in which the films are."""
        return [Path(os.path.commonpath([p if p.is_dir() else p.parent for p in self.paths]))]


def read_source(path: Path) -> Source:
    """Read what the user named.

    Raises:
        NoSuchFilm: There is nothing, or the list names no film.
        InvalidTable: The list cannot be read.
    """
    path = path.absolute()
    if path.is_dir() or (path.is_file() and is_film(path.name)):
        return Source([path])
    try:
        content = path.read_bytes()
    except OSError as error:
        raise NoSuchFilm(f"The list {path} cannot be read: {error.strerror}.") from error
    source = _table(path, content) if path.suffix.lower() == ".csv" else _lines(path, content)
    if not source.paths:
        raise NoSuchFilm(f"The list {path} names no film.")
    return source


def read_rules(path: Path) -> tuple[dict[str, Any], list[str]]:
    """Read a file of rules, in which a rig may be the path of a rig file.

    Returns:
        The rules, and sentences about rig files that cannot be read and are left out.
    Raises:
        InvalidTable: The file is not JSON.
    """
    rules = _json(path, InvalidTable)
    rigs, faults = {}, []
    stated = rules.get("rigs", {}) if isinstance(rules, dict) else None
    if not isinstance(stated, dict):
        raise InvalidTable(f"{path.name} is not an object with rigs and rules.")
    for name, rig in stated.items():
        if not isinstance(rig, str):
            rigs[name] = rig
            continue
        try:
            rigs[name] = _json(path.parent / rig, InvalidRig)
        except InvalidRig as error:
            faults.append(f"Rig {name}: {error}")
    return rules | {"rigs": rigs}, faults


def rules_of_rig(path: Path) -> dict[str, Any]:
    """Return rules that give every film the rig of a file.

    Raises:
        InvalidRig: The file cannot be read.
    """
    return {
        "rigs": {path.name: _json(path, InvalidRig)},
        "rules": [{"name": "all films", "pattern": "**", "rig": path.name}],
    }


def _json(path: Path, refusal: type[Exception]) -> Any:
    try:
        return json.loads(path.read_bytes())
    except OSError as error:
        raise refusal(f"{path} cannot be read: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise refusal(f"{path} is not a JSON file: {error}.") from error


def _lines(path: Path, content: bytes) -> Source:
    """Read one path a line, relative to the folder of the list; # begins a comment."""
    lines = [line.strip() for line in os.fsdecode(content).splitlines()]
    return Source([path.parent / line for line in lines if line and not line.startswith("#")])


def _table(path: Path, content: bytes) -> Source:
    """Read a table with the column path; rig names a rig of the rules, or a rig file."""
    rows = records(decoded(content, InvalidTable), InvalidTable)
    _, header = next(rows, (1, []))
    names = [name.strip().lower() for name in header]
    if "path" not in names:
        raise InvalidTable(f"{path.name} has no column path.")
    at = names.index("path")
    rig_at = names.index("rig") if "rig" in names else None
    films, rigs, missing, written = [], dict[str, Any](), list[str](), io.StringIO()
    table = csv.writer(written)
    table.writerow(names)
    for _, cells in rows:
        if len(cells) <= at or not cells[at].strip():
            continue
        film = path.parent / cells[at].strip()
        films.append(film)
        table.writerow([*cells[:at], text_of(os.path.realpath(film)), *cells[at + 1 :]])
        rig = cells[rig_at].strip() if rig_at is not None and len(cells) > rig_at else ""
        if rig.lower().endswith(".json") and rig not in rigs:
            try:
                rigs[rig] = _json(path.parent / rig, InvalidRig)
            except InvalidRig as error:
                missing.append(str(error))
                rigs[rig] = None
    found = {name: rig for name, rig in rigs.items() if rig is not None}
    return Source(films, written.getvalue(), found, missing)
