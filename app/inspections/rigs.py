"""The library of rigs: those of a crew's cameras, by name."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from app.storage.database.tables import LibraryRig
from app.storage.records.rigs import RigStore, RigUser
from vo_core import Rig


class Rigs:
    """Lists, keeps and deletes rigs."""

    def __init__(self, store: RigStore) -> None:
        self._store = store

    def all(self) -> list[tuple[LibraryRig, list[RigUser]]]:
        """Return the rigs by name, each with the inspections whose header names it."""
        return self._store.all()

    def put(self, rig_id: str, name: str, stated: Mapping[str, Any], who: str) -> None:
        """Keep a rig under a name, or change or rename the one with this id.

        Raises:
            InvalidRig: The text names field, value and the allowed values.
            RigNameTaken: Another rig has this name.
        """
        rig = Rig.parse(dict(stated)).model_dump(mode="json", exclude_unset=True)
        now = datetime.now(UTC)
        self._store.put(LibraryRig(id=rig_id, name=name, rig=rig, changed_at=now, changed_by=who))

    def delete(self, rig_id: str) -> None:
        """Take a rig off the library; inspections keep their own copies.

        Raises:
            RigNotFound: No rig has this id.
        """
        self._store.delete(rig_id)
