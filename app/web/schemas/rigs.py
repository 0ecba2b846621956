"""The library of rigs."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Self

from pydantic import BaseModel, Field

from app.storage.database.tables import LibraryRig
from app.storage.records.rigs import RigUser
from app.survey.given import Given, PackName


class LibraryRigIn(Given):
    """A rig and its name in the library."""

    name: PackName = Field(description="Name of the rig, which must be unique.")
    rig: dict[str, Any] = Field(description="The rig file: camera, mount and pipe.")


class RigUserOut(BaseModel):
    """An inspection whose header names a rig."""

    id: str
    name: str


class LibraryRigOut(BaseModel):
    """A rig of the library."""

    id: str
    name: str
    rig: dict[str, Any]
    changed_at: datetime
    changed_by: str
    used_by: list[RigUserOut]
    """Inspections whose header field `rig_id` is its name, newest first."""

    @classmethod
    def of(cls, row: LibraryRig, users: list[RigUser]) -> Self:
        """Convert the row."""
        return cls(
            id=row.id,
            name=row.name,
            rig=row.rig,
            changed_at=row.changed_at,
            changed_by=row.changed_by,
            used_by=[RigUserOut(id=user.id, name=user.name) for user in users],
        )


class LibraryOut(BaseModel):
    """The rigs by name."""

    rigs: list[LibraryRigOut]
