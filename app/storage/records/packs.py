"""Code packs in the database, beside the built-in one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.errors import PackInUse, PackNameTaken, PackNotFound
from app.storage.database.database import Database
from app.storage.database.tables import CodePack, Inspection

_NOT_FOUND = "There is no such code pack; it may have been deleted."


class PackStore:
    """Returns detached rows; a pack is never changed, only added and deleted."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[CodePack]:
        """Return all packs, sorted by name."""
        with self._database.read() as session:
            return list(session.scalars(select(CodePack).order_by(CodePack.name)))

    def get(self, pack_id: str) -> CodePack:
        """Return the pack with this id.

        Raises:
            PackNotFound: No pack has this id.
        """
        with self._database.read() as session:
            return existing(session, pack_id)

    def add(self, pack: CodePack) -> None:
        """Add a new pack; `pack` can then be used like a result of get().

        Raises:
            PackNameTaken: Another pack has this name.
        """

        def insert(session: Session) -> None:
            if session.scalar(select(CodePack.id).where(CodePack.name == pack.name)):
                raise PackNameTaken(
                    f"There is a code pack named {pack.name!r} already; choose another name."
                )
            session.add(pack)

        self._database.write(insert)

    def delete(self, pack_id: str) -> None:
        """Delete a pack.

        Raises:
            PackNotFound: No pack has this id.
            PackInUse: An inspection uses the pack.
        """

        def remove(session: Session) -> None:
            pack = existing(session, pack_id)
            users = session.scalar(
                select(func.count()).where(Inspection.header["code_pack"].as_string() == pack_id)
            )
            if users:
                number = "An inspection is" if users == 1 else f"{users} inspections are"
                raise PackInUse(
                    f"{number} coded with the pack {pack.name!r}, so it cannot be deleted."
                )
            session.delete(pack)

        self._database.write(remove)


def existing(session: Session, pack_id: str) -> CodePack:
    """Return the row of this id, within a session.

    Raises:
        PackNotFound: No pack has this id.
    """
    pack = session.get(CodePack, pack_id)
    if pack is None:
        raise PackNotFound(_NOT_FOUND)
    return pack


def require_pack_of(session: Session, header: Mapping[str, Any]) -> None:
    """Check, within the session that stores a header, that the pack it names exists.

    Raises:
        PackNotFound: The pack does not exist.
    """
    pack_id = header.get("code_pack")
    if pack_id:
        existing(session, pack_id)
