"""Code packs in the database, beside the built-in one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.errors import PackInUse, PackNameTaken, PackNotFound
from app.storage.database import Database
from app.storage.tables import CodePack, Inspection

_NOT_FOUND = "There is no such code pack; it may have been deleted."


class PackStore:
    """Rows come back detached; a pack is never changed, only added and deleted."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[CodePack]:
        """In the order of their names."""
        with self._database.read() as session:
            return list(session.scalars(select(CodePack).order_by(CodePack.name)))

    def get(self, pack_id: str) -> CodePack:
        """One.

        Raises:
            PackNotFound: There is none of this id.
        """
        with self._database.read() as session:
            return existing(session, pack_id)

    def add(self, pack: CodePack) -> None:
        """A new one; `pack` may be used on as what get() returns.

        Raises:
            PackNameTaken: Another one has this name.
        """

        def insert(session: Session) -> None:
            if session.scalar(select(CodePack.id).where(CodePack.name == pack.name)):
                raise PackNameTaken(
                    f"There is a code pack named {pack.name!r} already; choose another name."
                )
            session.add(pack)

        self._database.write(insert)

    def delete(self, pack_id: str) -> None:
        """Remove it.

        Raises:
            PackNotFound: There is none of this id.
            PackInUse: An inspection is coded with it.
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
    """The row of this id, within a session.

    Raises:
        PackNotFound: There is none.
    """
    pack = session.get(CodePack, pack_id)
    if pack is None:
        raise PackNotFound(_NOT_FOUND)
    return pack


def require_pack_of(session: Session, header: Mapping[str, Any]) -> None:
    """Within the session that stores a header: the pack that it names must be there.

    Raises:
        PackNotFound: It is not.
    """
    pack_id = header.get("code_pack")
    if pack_id:
        existing(session, pack_id)
