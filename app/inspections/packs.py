"""Code packs: the built-in one, and versions of those that people import."""

from __future__ import annotations

import logging
import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

from app.errors import PackNotFound
from app.storage.database.tables import CodePack
from app.storage.records.packs import PackStore, require_offered
from app.survey.catalogue import built_in
from app.survey.catalogue.read import read_table
from app.survey.catalogue.table import CodeTable

logger = logging.getLogger(__name__)

_VERSIONED = re.compile(r"(.+) v([1-9][0-9]{0,3})")
_TABLES_KEPT = 16
"""Parsed tables held in memory; each has at most 1 MiB of text."""


@dataclass(frozen=True)
class PackView:
    """A version of a pack with the number of its codes, of its ratings, and of the inspections
    that are coded with it.
    """

    row: CodePack
    codes: int
    ratings: int
    inspections: int = 0


class Packs:
    """Imports, lists and deletes packs, and returns their codes."""

    def __init__(self, store: PackStore) -> None:
        self._store = store
        self._imported = lru_cache(_TABLES_KEPT)(self._read)

    def add(self, title: str, table: str, project: str | None, who: str) -> PackView:
        """Add a table of codes: a new pack, or the next version of the one with this title.

        Raises:
            InvalidPack: The text says what is wrong, line by line.
            PackNameTaken: The pack of this title is of another project, or has this table.
        """
        codes = read_table(title, table.encode())
        pack = CodePack(
            id=secrets.token_hex(16),
            title=title,
            version=1,
            project=project,
            table=table,
            created_at=datetime.now(UTC),
            created_by=who,
        )
        self._store.add(pack)
        logger.info(
            "Code pack %s (%s) with %d codes by %s.", pack.id, pack.name, len(codes.rows), who
        )
        return PackView(pack, len(codes.rows), len(codes.ratings))

    def all(self) -> list[PackView]:
        """Return the versions of imported packs, sorted by title, the newest first."""
        users = self._store.users()
        return [self._view(pack, users.get(pack.id, 0)) for pack in self._store.all()]

    def _view(self, pack: CodePack, users: int) -> PackView:
        table = self.table(pack.id)
        return PackView(pack, len(table.rows), len(table.ratings), users)

    def delete(self, pack_id: str) -> None:
        """Delete an imported pack.

        Raises:
            PackNotFound: No pack has this id.
            PackInUse: An inspection uses the pack.
        """
        self._store.delete(pack_id)
        self._imported.cache_clear()

    def table(self, pack_id: str | None) -> CodeTable:
        """Return the codes of a pack; None is the built-in one.

        Raises:
            PackNotFound: No pack has this id.
        """
        if pack_id is None:
            return built_in()
        self._store.get(pack_id)  # a token limited to projects does not see those of others
        return self._imported(pack_id)

    def require(self, header: Mapping[str, Any]) -> None:
        """Raise PackNotFound if the header names a pack that is not there, or not for its
        project.
        """
        if pack_id := header.get("code_pack"):
            require_offered(self._store.get(pack_id), header)

    def table_of(self, header: Mapping[str, Any]) -> CodeTable:
        """Return the codes for an inspection with this header.

        A header from before packs existed may name anything, which means the built-in pack.
        """
        try:
            return self.table(header.get("code_pack") or None)
        except PackNotFound:
            return built_in()

    def csv_of(self, header: Mapping[str, Any]) -> str | None:
        """Return the table that an inspection with this header uses; None for the built-in one."""
        try:
            return self._store.get(str(header.get("code_pack"))).table
        except PackNotFound:
            return None

    def brought(self, name: str, project: str | None) -> dict[str, Any]:
        """Return name, title, version and project of a pack that comes from another server: in
        its place among the versions here, or under a free name if another pack has its name.
        """
        here = self._store.all()
        taken = {pack.name for pack in here}
        if name in taken:
            names = (f"{name[:90]} ({n})" for n in range(2, len(taken) + 3))
            name = next(each for each in names if each not in taken)
        found = _VERSIONED.fullmatch(name)
        title, version = (found[1], int(found[2])) if found else (name, 1)
        for pack in here:
            if pack.title == title:
                project = pack.project
        return {"name": name, "title": title, "version": version, "project": project}

    def _read(self, pack_id: str) -> CodeTable:
        pack = self._store.get(pack_id)
        return read_table(pack.name, pack.table.encode())
