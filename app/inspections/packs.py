"""Code packs: the built-in one, and those that people import as CSV."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

from app.errors import PackNotFound
from app.storage.database.tables import CodePack
from app.storage.records.packs import PackStore
from app.survey.catalogue import built_in
from app.survey.catalogue.table import CodeTable, read_table

logger = logging.getLogger(__name__)

_TABLES_KEPT = 16
"""Parsed tables held in memory; each has at most 1 MiB of text."""


@dataclass(frozen=True)
class PackView:
    """A pack with the number of its codes."""

    row: CodePack
    codes: int


class Packs:
    """Imports, lists and deletes packs, and returns their codes."""

    def __init__(self, store: PackStore) -> None:
        self._store = store
        self._imported = lru_cache(_TABLES_KEPT)(self._read)

    def add(self, name: str, content: bytes, who: str) -> PackView:
        """Import a pack from a CSV file.

        Raises:
            InvalidPack: The text says what is wrong, line by line.
            PackNameTaken: Another pack has this name.
        """
        table = read_table(name, content)
        pack = CodePack(
            id=secrets.token_hex(16),
            name=name,
            table=content.decode("utf-8-sig"),
            created_at=datetime.now(UTC),
            created_by=who,
        )
        self._store.add(pack)
        logger.info("Code pack %s (%s) with %d codes by %s.", pack.id, name, len(table.rows), who)
        return PackView(pack, len(table.rows))

    def all(self) -> list[PackView]:
        """Return the imported packs, sorted by name."""
        return [PackView(pack, len(self.table(pack.id).rows)) for pack in self._store.all()]

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
        return built_in() if pack_id is None else self._imported(pack_id)

    def require(self, header: Mapping[str, Any]) -> None:
        """Raise PackNotFound if the header names a pack that does not exist."""
        self.table(header.get("code_pack") or None)

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

    def free_name(self, name: str) -> str:
        """Return this name of a pack, with a number if another pack has it."""
        taken = {pack.name for pack in self._store.all()}
        names = (name, *(f"{name[:90]} ({n})" for n in range(2, len(taken) + 3)))
        return next(each for each in names if each not in taken)

    def _read(self, pack_id: str) -> CodeTable:
        pack = self._store.get(pack_id)
        return read_table(pack.name, pack.table.encode())
