"""The library of rigs."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Self

from pydantic import BaseModel, Field

from app.storage.database.tables import LibraryRig
from app.storage.records.rigs import RigUser
from app.survey.given import Given, PackName
from app.web.schemas.out import Out


class LibraryRigIn(Given):
    """A rig and its name in the library."""

    name: PackName = Field(description="Name of the rig, which must be unique.")
    rig: dict[str, Any] = Field(description="The rig file: camera, mount and pipe.")


class RigUserOut(Out):
    """An inspection whose header names a rig."""

    id: str
    name: str


class LibraryRigOut(Out):
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
        return cls.read_from(row, used_by=users)


class LibraryOut(BaseModel):
    """The rigs by name."""

    rigs: list[LibraryRigOut]
